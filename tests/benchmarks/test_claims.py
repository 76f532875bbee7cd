"""The ledger on made-up tables: with one that fits the text all hold, and each can be turned."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import pandas as pd
import pytest

from benchmarks.paper.comparison.claims import (
    NOT,
    REPRODUCED,
    UNDECIDABLE,
    Numbers,
    ledger,
)
from benchmarks.paper.comparison.experiment import (
    BINGHAM,
    CLIPPED,
    EL_CENTRO,
    FOUR,
    HINF,
    LPV,
    LPV_0,
    LPV_400,
    NEWHALL,
    NONE,
    SYLMAR,
    ZERO,
)
from benchmarks.paper.comparison.identification import STIFFNESS

LAWS = (NONE, ZERO, FOUR, CLIPPED, HINF, LPV, BINGHAM, LPV_0, LPV_400)
CASES = [(EL_CENTRO, 0.2), (EL_CENTRO, 0.6), (SYLMAR, 0.3), (SYLMAR, 0.7)]
WEAK = (0.2, 0.3)
Y, RMS_Y = "peak floor 2 acceleration [m/s2]", "rms floor 2 acceleration [m/s2]"
X, RMS_X = "peak base drift [mm]", "rms base drift [mm]"
F, RMS_F = "peak damper force [N]", "rms damper force [N]"
RMS_V = "rms voltage [V]"


def made_up() -> dict[str, Any]:
    """Return what `Numbers` takes, made so that every statement of the text holds."""
    rows = [row(motion, g, law) for motion, g in CASES for law in LAWS]
    table = pd.DataFrame(rows)
    least = {"0.2 g": 2.0, "0.4 g": 4.0, "0.6 g": 4.0, "0.8 g": 8.0}
    optimum = pd.DataFrame(
        [
            {
                "intensity": g,
                "voltage [V]": float(V),
                Y: 5.0 + (best - V) * 1.5 if best > V else 5.0 + V - best,
            }
            for g, best in least.items()
            for V in range(9)
        ]
    )
    heights = {0.0: 0.3, 8.0: 0.05}
    peaks = pd.DataFrame(
        [
            {"law": "LuGre", "voltage [V]": V, "height [m/s2]": h, "crest [m/s2]": 0.1}
            for V, h in heights.items()
            for _ in range(3)
        ]
    )
    errors = {"Bingham": 0.95, "Bingham, standard": 1.0, "LuGre": 0.425, "LuGre, standard": 0.5}
    fits = pd.DataFrame(
        [
            {"specimen": specimen, "law": law, "error [N]": error, "share": error / 2.0}
            for specimen in STIFFNESS
            for law, error in errors.items()
        ]
    )
    facts = {
        "sample_period": 0.002, "stroke": 0.02, "k_b": 1057.0, "frequencies": [2.1, 5.48, 9.0],
        "first_mode": 13.19, "damping_ratio": 0.01, "force_at_8V": 9.85, "weight_corner": 12.0,
        "speeds": [0.01, 0.02, 0.1, 0.2],
        "steady": {0.0: [1.0, 2.0, 1.4, 1.3], 8.0: [8.0, 9.85, 8.1, 7.9]},
        "paper_windows": {EL_CENTRO: 35.0, SYLMAR: 20.0},
    }  # fmt: skip
    return {"table": table, "optimum": optimum, "peaks": peaks, "fits": fits, "facts": facts,
            "strong": (SYLMAR, 0.7)}  # fmt: skip


def row(motion: str, g: float, law: str) -> dict[str, Any]:
    """Return the numbers of a law as the text has them: clipped 10, the others in proportion."""
    weak = g in WEAK
    low = {LPV: 0.30 if weak else 0.25, HINF: 0.07 if weak else 0.22}
    y = 10.0 * (1.0 - low.get(law, 0.0)) if law != NONE else 40.0 * g
    y = {BINGHAM: 11.0, LPV_0: 9.5, LPV_400: 7.0}.get(law, y)
    return {
        "motion": motion, "intensity [g]": g, "law": law, Y: y, RMS_Y: y / 5.0,
        X: {FOUR: 9.0, LPV: 10.5}.get(law, 11.0),
        RMS_X: {LPV: 0.95}.get(law, 1.0),
        F: {NONE: 0.0, FOUR: 6.0}.get(law, 8.0),
        RMS_F: {NONE: 0.0, FOUR: 3.0}.get(law, 2.0),
        RMS_V: {CLIPPED: 1.4}.get(law, 1.5),
        "between": {LPV: 0.6}.get(law, 0.0),
        "peak command": {LPV_0: 12.0}.get(law, 8.0),
    }  # fmt: skip


def verdict(number: int, given: dict[str, Any]) -> Any:
    return next(v for s, v in ledger(Numbers(**given)) if s.number == number)


def put(
    column: str, value: float, law: str, motion: str = "", g: float = 0.0
) -> Callable[..., Any]:
    """Return a change of the table: a law's number, everywhere or in one place."""

    def change(given: dict[str, Any]) -> None:
        table = given["table"]
        at = table["law"] == law
        if motion:
            at &= table["motion"] == motion
        if g:
            at &= table["intensity [g]"] == g
        assert at.any()
        table.loc[at, column] = value

    return change


def fact(name: str, value: Any) -> Callable[..., Any]:
    def change(given: dict[str, Any]) -> None:
        given["facts"][name] = value

    return change


def error(law: str, value: float, specimen: str = "") -> Callable[..., Any]:
    def change(given: dict[str, Any]) -> None:
        fits = given["fits"]
        at = (fits["law"] == law) & fits["specimen"].str.contains(specimen)
        fits.loc[at, ["error [N]", "share"]] = [value, value / 2.0]

    return change


def curve(intensity: str, voltage: float, value: float) -> Callable[..., Any]:
    def change(given: dict[str, Any]) -> None:
        table = given["optimum"]
        at = (table["intensity"] == intensity) & (table["voltage [V]"] == voltage)
        table.loc[at, Y] = value

    return change


def height(voltage: float, value: float) -> Callable[..., Any]:
    def change(given: dict[str, Any]) -> None:
        given["peaks"].loc[given["peaks"]["voltage [V]"] == voltage, "height [m/s2]"] = value

    return change


def without_northridge(given: dict[str, Any]) -> None:
    given["table"] = given["table"][given["table"]["motion"] == EL_CENTRO]
    given["facts"]["paper_windows"] = {EL_CENTRO: 35.0}
    given["strong"] = (EL_CENTRO, 0.6)


def steady(V: float, curve: list[float]) -> Callable[..., Any]:
    def change(given: dict[str, Any]) -> None:
        given["facts"]["steady"][V] = curve

    return change


TURNS = [
    (1, fact("k_b", 1100.0), NOT),
    (1, fact("force_at_8V", 8.0), NOT),
    (1, fact("frequencies", [2.1, 5.6, 9.0]), NOT),
    (2, steady(0.0, [1.0, 1.5, 1.8, 2.0]), NOT),
    (3, steady(8.0, [8.0, 20.0, 8.1, 7.9]), NOT),
    (4, height(0.0, 0.05), NOT),
    (4, height(8.0, 0.2), NOT),
    (5, error("LuGre", 2.0), NOT),
    (5, error("LuGre", 2.0, "2000"), NOT),
    (6, error("LuGre", 0.05), NOT),
    (6, error("LuGre", 0.05, "2000"), UNDECIDABLE),
    (6, error("Bingham", 0.5), NOT),
    (7, curve("0.2 g", 6.0, 1.0), NOT),
    (8, curve("0.4 g", 4.0, 50.0), NOT),
    (8, curve("0.2 g", 0.0, 0.1), NOT),
    (9, put("between", 0.1, CLIPPED), NOT),
    (9, put("between", 0.0, LPV, SYLMAR, 0.7), NOT),
    (10, put(Y, 1.0, BINGHAM, SYLMAR), UNDECIDABLE),  # 6 of 8 comparisons
    (11, fact("weight_corner", 15.0), NOT),
    (11, fact("first_mode", 20.0), NOT),
    (12, put(Y, 9.6, LPV, SYLMAR, 0.7), NOT),
    (12, put("peak command", 13.0, LPV_400, SYLMAR, 0.7), NOT),
    (12, without_northridge, UNDECIDABLE),
    (13, put(Y, 9.5, LPV), NOT),
    (14, put(Y, 10.5, HINF), NOT),
    (15, put(Y, 99.0, LPV, EL_CENTRO, 0.2), NOT),
    (15, put(Y, 99.0, LPV, SYLMAR, 0.3), UNDECIDABLE),
    (16, put(X, 12.0, FOUR, EL_CENTRO, 0.6), NOT),
    (16, put(X, 12.0, FOUR, SYLMAR), UNDECIDABLE),
    (17, put(X, 20.0, LPV, SYLMAR, 0.3), NOT),
    (17, put(RMS_X, 1.1, LPV, EL_CENTRO, 0.2), NOT),
    (17, put(RMS_X, 0.7, LPV), NOT),
    (18, put(F, 9.0, FOUR, EL_CENTRO, 0.2), NOT),
    (18, put(RMS_F, 1.0, FOUR, SYLMAR, 0.7), UNDECIDABLE),
    (19, put(RMS_V, 3.0, CLIPPED), NOT),
    (19, put(RMS_V, 3.0, LPV), NOT),
    (20, fact("paper_windows", {EL_CENTRO: 31.18, SYLMAR: 20.0}), NOT),
    (20, without_northridge, UNDECIDABLE),
    (21, fact("damping_ratio", 0.05), NOT),
    (21, put(F, 0.5, NONE), NOT),
    (21, put(Y, 9.0, NONE, EL_CENTRO, 0.2), NOT),
]  # fmt: skip


@pytest.mark.parametrize("number", range(1, 22))
def test_a_table_that_fits_the_text_gives_reproduced(number: int) -> None:
    found = verdict(number, made_up())
    assert found.verdict == REPRODUCED, found.measured


@pytest.mark.parametrize(("number", "change", "expected"), TURNS)
def test_each_verdict_can_be_turned(number: int, change: Any, expected: str) -> None:
    given = copy.deepcopy(made_up())
    change(given)
    found = verdict(number, given)
    assert found.verdict == expected, found.measured


def test_every_statement_is_turned() -> None:
    assert {number for number, _, _ in TURNS} == set(range(1, 22))


def test_both_inverses_turned_over_is_not_reproduced() -> None:
    given = made_up()
    put(Y, 1.0, BINGHAM)(given)
    put(RMS_Y, 0.1, BINGHAM)(given)
    assert verdict(10, given).verdict == NOT


def test_failures_are_named_with_their_places() -> None:
    given = made_up()
    put(Y, 99.0, LPV, SYLMAR, 0.3)(given)
    assert f"Fails at {SYLMAR} 0.3 g." in verdict(15, given).why


def test_newhall_counts_like_any_record() -> None:
    given = made_up()
    more = given["table"][given["table"]["motion"] == SYLMAR].assign(motion=NEWHALL)
    given["table"] = pd.concat([given["table"], more], ignore_index=True)
    given["facts"]["paper_windows"][NEWHALL] = 20.0
    assert all(v.verdict == REPRODUCED for _, v in ledger(Numbers(**given)))
    assert "6 of 6" in verdict(15, given).measured
