"""What an ensemble says: quantiles of each output, and failures by their reason."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from statistics import NormalDist
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..data.open_effects import POINT, reach, simulated_whole
from .plan import Outcome, Plan
from .table import EFFECT

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]

VARIES = "all that varies"
"""What the ensemble draws, beside effects that are left open."""
LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)
_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?([eE][-+]?\d+)?")


@dataclass(frozen=True)
class Failure:
    """Failed runs of one kind: how many, the first one's number, and its reason in full."""

    count: int
    run: int
    reason: str


def quantiles(plan: Plan, frame: pd.DataFrame) -> pd.DataFrame:
    """Return one row per output: unit, quantiles of the runs that are done, their number.

    Quantiles are linear between order statistics; without a run they are NaN. Effects that are
    left open take those below the median down and those above it up.
    """
    import pandas as pd

    done = frame[frame["status"] == "done"]
    rows = []
    for output in plan.outputs:
        values = done[output.name].to_numpy()
        found = np.quantile(values, LEVELS) if len(values) else np.full(len(LEVELS), np.nan)
        if plan.left and len(values):
            found = _widened(found, [*_reaches(plan, done, output.name).values()])
        rows.append([output.unit, *map(float, found), len(values), len(frame) - len(values)])
    titles = ["unit", *(f"{100 * level:g} %" for level in LEVELS), "done", "failed"]
    index = pd.Index([output.name for output in plan.outputs], name="output")
    return pd.DataFrame(rows, index=index, columns=titles)


def parts(plan: Plan, frame: pd.DataFrame) -> dict[str, dict[str, float]]:
    """Return by output which share of the variance is from what, the largest first.

    "all that varies" is what the ensemble draws; the others are effects that are left open.
    """
    done = frame[frame["status"] == "done"]
    found = {}
    for output in plan.outputs if plan.left and len(done) > 1 else ():
        ends = _reaches(plan, done, output.name)
        power = {name: 0.5 * (low**2 + high**2) / POINT**2 for name, (low, high) in ends.items()}
        power[VARIES] = float(np.var(done[output.name].to_numpy(), ddof=1))
        whole = sum(power.values())
        order = sorted((name for name in power if power[name] > 0.0), key=lambda n: -power[n])
        found[output.name] = {name: power[name] / whole for name in order}
    return found


def notes(plan: Plan, frame: pd.DataFrame) -> list[str]:
    """Return what is said of effects that the quantiles do not have."""
    if plan.identified is None:
        return []
    lost = _simulated(plan, frame[frame["status"] == "done"])[1] if plan.left else {}
    return [
        *(f"with {name} not every run could be made ({why}): the quantiles are without it"
          for name, why in lost.items()),
        *plan.identified.notes,
    ]  # fmt: skip


def _simulated(plan: Plan, done: pd.DataFrame) -> tuple[dict[str, list[int]], dict[str, str]]:
    """Return the runs of each effect, and of others why they could not all be made with it."""
    tried: dict[str, list[int | str]] = {}
    made = done[plan.columns[-1]].notna()
    for run, name, why in zip(done.index, done[EFFECT[0]], done["reason"], strict=True):
        tried.setdefault(str(name), []).append(int(run) if made[run] else str(why))
    return simulated_whole(tried)


def _reaches(plan: Plan, done: pd.DataFrame, output: str) -> dict[str, tuple[float, float]]:
    """Return by effect how far it takes an output down, and up, at 95 %."""
    changes = done[f"{output} with it"] - done[output]
    whole, _ = _simulated(plan, done)
    return {name: reach(changes[runs].to_numpy()) for name, runs in whole.items()}


def _widened(found: Array, reaches: list[tuple[float, float]]) -> Array:
    """Return quantiles at `LEVELS` with the reach of effects below and above the median."""
    below, above = (np.sqrt(sum(ends[side] ** 2 for ends in reaches)) / POINT for side in (0, 1))
    away = np.array([NormalDist().inv_cdf(level) for level in LEVELS])
    middle = found[LEVELS.index(0.5)]
    more = np.abs(away) * np.where(away < 0.0, below, above)
    return np.asarray(middle + np.sign(away) * np.hypot(found - middle, more))


def failures(outcomes: Iterable[Outcome]) -> list[Failure]:
    """Return the failures, most frequent first; reasons that differ in numbers alone are one."""
    found: dict[str, list[Outcome]] = {}
    for outcome in sorted(outcomes, key=lambda one: one.run):
        if outcome.reason:
            found.setdefault(_NUMBER.sub("#", outcome.reason), []).append(outcome)
    return sorted(
        (Failure(len(same), same[0].run, same[0].reason) for same in found.values()),
        key=lambda failure: (-failure.count, failure.run),
    )
