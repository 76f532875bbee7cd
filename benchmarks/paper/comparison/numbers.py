"""The numbers that decide the paper's statements, and how they are listed and compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from .experiment import (
    EL_CENTRO,
)

if TYPE_CHECKING:
    import pandas as pd

REPRODUCED, NOT, UNDECIDABLE = "reproduced", "not reproduced", "undecidable"

PEAK_Y, RMS_Y = "peak floor 2 acceleration [m/s2]", "rms floor 2 acceleration [m/s2]"
PEAK_X, RMS_X = "peak base drift [mm]", "rms base drift [mm]"
PEAK_F, RMS_F = "peak damper force [N]", "rms damper force [N]"
RMS_V = "rms voltage [V]"

OPTIMA = {"0.2 g": 2.0, "0.4 g": 4.0, "0.6 g": 4.0, "0.8 g": 8.0}
"""The best constant voltages [V] that the text gives."""
AS_GOOD = 0.02
"""Share of a peak within which two voltages count as equally good."""
POINTS = 5.0
"""Percentage points by which a percentage may miss the text's and still be called the same."""
ALIKE = 0.15
"""Share within which two values count as being in the same range."""

Key = tuple[str, float]


@dataclass(frozen=True)
class Numbers:
    """What the statements are decided by.

    `table`: a row per motion, intensity and law (`experiment.measured`); `optimum`: "intensity",
    "voltage [V]" and the peak acceleration of floor 2; `peaks`: "law", "voltage [V]", "height
    [m/s2]", "crest [m/s2]" of the stiction peaks; `fits`: errors of identification; `facts`:
    numbers of model and designs (see `facts.facts`); `strong`: the motion and intensity [g] of the
    strong Northridge case.
    """

    table: pd.DataFrame
    optimum: pd.DataFrame
    peaks: pd.DataFrame
    fits: pd.DataFrame
    facts: dict[str, Any]
    strong: Key

    def __post_init__(self) -> None:
        index = self.table.set_index(["motion", "intensity [g]", "law"])
        object.__setattr__(self, "_index", index)

    def cases(self) -> list[Key]:
        """Return motion and intensity [g] of every case."""
        pairs = self.table[["motion", "intensity [g]"]].drop_duplicates()
        return [(str(motion), float(intensity)) for motion, intensity in pairs.to_numpy()]

    def value(self, case: Key, law: str, quantity: str) -> float:
        """Return one number of the table."""
        index: Any = self.__dict__["_index"]
        return float(index.loc[(*case, law), quantity])

    def lower(self, case: Key, law: str, other: str, quantity: str) -> float:
        """Return by how many percent a law's number lies below another's.

        Parameters
        ----------
        case : motion and intensity [g]
        law, other : names of the two laws
        quantity : column of the table, such as `PEAK_Y`
        """
        return 100.0 * (1.0 - self.value(case, law, quantity) / self.value(case, other, quantity))

    def weak(self) -> list[Key]:
        """Return the weakest case of each motion."""
        return [min(group) for group in grouped(self.cases()).values()]

    def strongest(self) -> list[Key]:
        """Return the strongest case of each motion."""
        return [max(group) for group in grouped(self.cases()).values()]


@dataclass(frozen=True)
class Verdict:
    """The verdict on a statement: the number behind it, how it was decided, and why so."""

    verdict: str
    measured: str
    why: str = ""


def verdict_word(holds: bool) -> str:
    """Return the verdict's word for a statement that holds, or does not."""
    return REPRODUCED if holds else NOT


def near(value: float, wanted: float, share: float) -> bool:
    """Return whether a value lies within a share [1] of the one that is wanted."""
    return abs(value - wanted) <= share * abs(wanted)


def named(case: Key) -> str:
    """Return a case in words: its motion and its intensity [g]."""
    return f"{case[0]} {case[1]:g} g"


def listed(n: Numbers, value: Callable[[Key], float], form: str = "{:.0f}") -> str:
    """Return a number of every case, by motion, the weakest first."""
    return "; ".join(
        f"{motion} {', '.join(form.format(value(case)) for case in sorted(group))}"
        for motion, group in grouped(n.cases()).items()
    )


def grouped(cases: list[Key]) -> dict[str, list[Key]]:
    """Return cases by motion."""
    groups: dict[str, list[Key]] = {}
    for case in cases:
        groups.setdefault(case[0], []).append(case)
    return groups


def cases_text(cases: list[Key]) -> str:
    """Return cases in words, by motion, the weakest first."""
    return "; ".join(
        f"{motion} {', '.join(f'{intensity:g}' for _, intensity in sorted(group))} g"
        for motion, group in grouped(cases).items()
    )


def by_record(n: Numbers, holds: Callable[[Key], bool], measured: str, why: str = "") -> Verdict:
    """Decide an order over all cases; the text leaves the Northridge station open.

    It is not reproduced where it fails on El Centro, and undecidable where it holds on that and
    fails on a Northridge record, for another station may have been meant.

    Parameters
    ----------
    n : the numbers of all cases
    holds : whether the order holds in a case, a motion and its intensity [g]
    measured : the numbers behind it, in a sentence
    why : what to know of it, in sentences
    """
    failed = [case for case in n.cases() if not holds(case)]
    count = f"holds in {len(n.cases()) - len(failed)} of {len(n.cases())} cases"
    text = f"{count}. {measured}"
    if not failed:
        return Verdict(REPRODUCED, text, why)
    where = f"Fails at {cases_text(failed)}."
    if any(case[0] == EL_CENTRO for case in failed):
        return Verdict(NOT, text, f"{where} {why}".strip())
    open_ = "The text does not name the Northridge station, and the order depends on the record."
    return Verdict(UNDECIDABLE, text, f"{where} {open_} {why}".strip())
