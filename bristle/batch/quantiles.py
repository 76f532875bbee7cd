"""What an ensemble says: quantiles of each output, and failures by their reason."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .plan import Outcome, Plan

if TYPE_CHECKING:
    import pandas as pd

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

    Quantiles are linear between order statistics; without a run they are NaN.
    """
    import pandas as pd

    done = frame[frame["status"] == "done"]
    rows = []
    for output in plan.outputs:
        values = done[output.name].to_numpy()
        found = np.quantile(values, LEVELS) if len(values) else np.full(len(LEVELS), np.nan)
        rows.append([output.unit, *map(float, found), len(values), len(frame) - len(values)])
    titles = ["unit", *(f"{100 * level:g} %" for level in LEVELS), "done", "failed"]
    index = pd.Index([output.name for output in plan.outputs], name="output")
    return pd.DataFrame(rows, index=index, columns=titles)


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
