"""Bands with what a verdict's limits leave open: as wide as the effect makes them, and by whom.

Hidden springs are those of an exact linear step, which no engine of the package has computed.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from prediction.test_in_closed_loop import DRAG, damper, viscous
from shaken import building, shake
from studies import house_study

from bristle.cli import main
from bristle.errors import RunError, StudyError
from bristle.model.model import Model
from bristle.prediction import monte_carlo
from bristle.prediction.closed_loop import closed_loop
from bristle.prediction.closed_loop_result import ClosedLoop, Predicted
from bristle.prediction.monte_carlo import Figures
from bristle.study import Study
from bristle.view.blocks import Table

STIFF = 60.0  # N/m, of a spring that may be beside the damper: 4 % of the isolation's
KEY = ("floor1_acceleration_absolute", "rms")


def limit(effect: str, parameter: str, value: float, **also: Any) -> dict[str, Any]:
    return {
        "effect": effect, "parameter": parameter, "unit": "1", "side": "below", "limit95": value,
        "share": 0.01, "named_from": None, "named_share": None, "coarse": False, "others": {},
        "moved": {}, **also,
    }  # fmt: skip


def verdict(*limits: dict[str, Any], kind: str = "none", effects: tuple[str, ...] = ()) -> Any:
    findings = [{"site": "damper", "limits": list(limits)}]
    return {"schema": 2, "kind": kind, "effects": list(effects), "findings": findings}


SPRING = limit("gas_spring", "k", STIFF)
SMALL = limit("quadratic_damping", "c_2", 1e-6)
HIDDEN = {"effect": "coil_lag", "why": "the command is constant"}


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    study = house_study(tmp_path_factory.mktemp("limits"), viscous, None)
    study.add_step("identify bingham", "to see", damper(study.model(), DRAG, spread=1e-3))
    return study.folder


@pytest.fixture(scope="module")
def found(rig: Path) -> ClosedLoop:
    Study(rig).write_verdict(verdict(SPRING, SMALL, HIDDEN))
    return closed_loop(Study(rig), draws=6, with_limits=True)


def row(found: ClosedLoop, response: str = KEY[0], kind: str = KEY[1]) -> Predicted:
    return next(one for one in found.rows if (one.response, one.kind) == (response, kind))


def test_the_band_reaches_to_the_response_with_the_effect_at_its_limit(
    rig: Path, found: ClosedLoop
) -> None:
    own = building(1, True, 6)
    with_spring, without = (
        np.std(shake(own, 22, viscous, lambda x, v, k=k: [k * x[0], 0.0], samples=2500)[KEY[0]])
        for k in (STIFF, 0.0)
    )
    plain, one = row(closed_loop(Study(rig), draws=6)), row(found)
    assert plain.band is not None
    assert one.band is not None
    side = 0 if with_spring < without else 1  # a spring has one sign, so that one end moves
    moved, kept = abs(one.band[side] - plain.band[side]), one.band[1 - side] - plain.band[1 - side]
    assert kept == pytest.approx(0.0, abs=1e-12)
    assert abs(with_spring - without) / without > 0.01
    half = 0.5 * (plain.band[1] - plain.band[0])
    reach = np.hypot(with_spring - without, half) - half
    assert moved == pytest.approx(reach, rel=0.1)


def test_the_parts_say_what_the_band_is_of(found: ClosedLoop) -> None:
    one = row(found)
    assert next(iter(one.parts)) == "gas_spring"
    assert sum(one.parts.values()) == pytest.approx(1.0)
    assert one.parts["quadratic_damping"] < 1e-3
    assert one.as_dict()["parts"] == one.parts
    said = found.sentences()
    assert "of the band's variance is gas spring, which the runs do not exclude." in said[-2]
    assert said[-1].endswith("--see gas_spring")
    header, rows, *_ = next(found.view().every(Table))
    assert "widened by" in header
    assert all(len(cells) == len(header) for cells in rows)
    assert any("the runs cannot show coil_lag: no band has them" in note for note in found.notes)


def test_without_limits_nothing_of_it_is_said(rig: Path) -> None:
    found = closed_loop(Study(rig), draws=6)
    assert row(found).parts == {}
    assert "widened by" not in next(found.view().every(Table)).header
    assert not any("gas_spring" in text for text in found.sentences())


def test_a_band_without_open_effects_says_so() -> None:
    band, parts = (1.0, 1.2), {"the parameters": 0.95, "gas_spring": 0.05}
    one = Predicted("run", "drift1", "peak", None, 1.1, band, parts=parts)
    said = ClosedLoop((one,), 20).sentences()
    assert said[1] == (
        "The least certain peak is that of drift1 in run: 1100 mm, 95 % band 1000 to 1200 mm; "
        "95 % of the band's variance is the parameters."
    )
    assert said[2] == "No effect that the runs do not exclude widens the bands by much."


def test_changes_to_either_side_widen_either_side() -> None:
    drawn = {KEY: np.array([0.99, 1.01, 1.0, 0.98, 1.02])}
    left = {"asymmetry": {KEY: np.array([-0.1, -0.05, 0.05, 0.1])}, "none": {KEY: np.zeros(4)}}
    plain, wide = (Figures({KEY: 1.0}, drawn, 0.0, 0, left=one) for one in ({}, left))
    before, after = plain.band(KEY), wide.band(KEY)
    assert before is not None
    assert after is not None
    assert before[0] - after[0] == pytest.approx(after[1] - before[1])
    assert wide.parts(KEY)["asymmetry"] > 0.5
    assert "none" not in wide.parts(KEY)
    assert Figures({KEY: 1.0}, {KEY: np.ones(2)}, 0.0, 0, left=left).parts(KEY) == {}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (verdict(kind="effect", effects=("gas_spring",)), "names gas_spring, and its limits hold"),
        (verdict(), "the verdict has no limits"),
        (verdict({k: v for k, v in SPRING.items() if k != "moved"}), "an older version"),
        (
            {**verdict(SPRING), "laws": [{}], "law": "lugre", "command": "linear"},
            "the verdict's law is lugre, and the model's bingham",
        ),
    ],
)
def test_limits_of_another_model_are_refused(
    rig: Path, found: ClosedLoop, content: Any, words: str
) -> None:
    study = Study(rig)
    study.write_verdict(content)
    with pytest.raises(StudyError, match=words):
        closed_loop(study, with_limits=True)


def test_what_cannot_be_is_refused(
    rig: Path, found: ClosedLoop, capsys: pytest.CaptureFixture[str]
) -> None:
    (rig / "verdict.json").unlink(missing_ok=True)
    asked = ["predict", str(rig), "--with-limits"]
    assert main(asked) == 2
    assert "there is no verdict, whose limits" in capsys.readouterr().err
    Study(rig).write_verdict(verdict(SMALL))
    assert main([*asked, "--draws", "2"]) == 2
    assert "--draws 5 is the least" in capsys.readouterr().err
    assert main([*asked, "--draws", "5", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["rows"][0]["parts"]["the parameters"] > 0.99


def test_effects_of_every_site_have_their_part(rig: Path) -> None:
    bumper = limit("end_stop", "k", 500.0, others={"clearance": 0.002, "shape": 1.0})
    soft = limit("storey_softening", "d_half", 0.02, side="above", others={"shape": 2.0})
    late = limit("delay", "time", 1e-3, moved={"c_0": -0.2})  # it moves the model alone
    mass = limit("fluid_inertia", "m_f", 0.02)
    sites = {"damper": [mass, late], "layer": [bumper], "storey1": [soft]}
    findings = [{"site": site, "limits": limits} for site, limits in sites.items()]
    Study(rig).write_verdict({**verdict(), "findings": findings})
    found = closed_loop(Study(rig), draws=6, with_limits=True)
    assert found.notes == ()
    assert set(row(found).parts) >= {"fluid_inertia", "delay", "end_stop", "storey_softening"}


def test_an_effect_with_which_nothing_can_be_simulated_is_in_no_band(
    rig: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Study(rig).write_verdict(verdict(SPRING, SMALL))
    simulated = monte_carlo._figures

    def figures(model: Model, *rest: Any) -> Any:
        if "quadratic_damping" in model.effects:
            raise RunError("it does not come to rest.")
        return simulated(model, *rest)

    monkeypatch.setattr(monte_carlo, "_figures", figures)
    found = closed_loop(Study(rig), draws=6, with_limits=True)
    assert found.notes[-1] == (
        "with quadratic_damping the building cannot be simulated at each of its sizes (it does not "
        "come to rest): no band has it"
    )
    assert set(row(found).parts) == {"gas_spring", "the parameters"}


def test_an_effect_that_stops_one_of_its_draws_is_left_out_whole(
    rig: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Study(rig).write_verdict(verdict(SPRING, SMALL))
    simulated = monte_carlo._figures

    def figures(model: Model, *rest: Any) -> Any:
        found = simulated(model, *rest)
        return ["it stops", *found[1:]] if "gas_spring" in model.effects else found

    monkeypatch.setattr(monte_carlo, "_figures", figures)
    found = closed_loop(Study(rig), draws=6, with_limits=True)
    assert "gas_spring" not in row(found).parts
    assert any("with gas_spring" in note and "(it stops)" in note for note in found.notes)


def test_a_limit_that_is_the_samplings_resolution_widens_no_band(
    rig: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Study(rig).write_verdict(verdict({**SPRING, "coarse": True}, SMALL))
    found = closed_loop(Study(rig), draws=6, with_limits=True)
    assert "gas_spring" not in row(found).parts
    assert any("the limit of gas_spring is only" in note for note in found.notes)
    assert not any("--see" in text for text in found.sentences())
