"""What known effects gain where none of them, nor a pair, explains what is missing."""

from __future__ import annotations

from typing import Any

from .candidates import Trial
from .decision import missing
from .finding import Finding
from .rule import BENCH, DecisionRule


def gains_of(found: Finding, rule: DecisionRule = BENCH) -> list[dict[str, Any]]:
    """Return the effects that lower a site's held-out error by enough, and beyond chance.

    Single ones, the best first; last the pair that gains most, if it gains more than the best one.
    """
    before = found.before
    if found.kind != "unknown" or before is None:
        return []
    able = [trial for trial in found.trials if missing(before, trial, rule)]
    rows = [_row(trial, before, found.site) for trial in able[: rule.most_alternatives]]
    pair = found.together
    if able and pair is not None and missing(able[0], pair, rule):
        rows.append(_row(pair, before, found.site))
    return rows


def _row(trial: Trial, before: Trial, site: str) -> dict[str, Any]:
    return {
        "effects": [name for name in trial.effects if name not in before.effects],
        "site": site, "z_holdout": round(trial.z, 4), "gain": round(1.0 - trial.z / before.z, 4),
    }  # fmt: skip
