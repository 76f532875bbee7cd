"""Why a sample says nothing of a force, and is left out of the error: these reasons, no other.

They are of the data alone: every model is judged on the same samples.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..core.arrays import Flags

MISSING = "missing"
SATURATED = "saturated"
MASKED = "masked"
SETTLING = "settling at the start"
LOADED = "at rest under load at the start"

WAYS_OUT = {
    MISSING: "record without gaps, or leave the run out",
    MASKED: "take mask out of study.toml",
    SATURATED: "measure with a wider range, or leave the run out",
    SETTLING: "use longer runs",
    LOADED: "use longer runs",
}
"""What a user can do about each, in the order in which a sample with several is counted."""

NO_VALUE = (MISSING, MASKED)
"""Reasons for which nothing was measured: what stands there is interpolated."""


def any_of(flags: Mapping[str, Flags]) -> Flags | None:
    """Return where there is any reason (n,); None where there is none at all."""
    every = list(flags.values())
    return np.asarray(np.any(every, axis=0), dtype=np.bool_) if every else None


def occurring(flags: Mapping[str, Flags]) -> dict[str, Flags]:
    """Return the reasons that hold for at least one sample."""
    return {reason: where for reason, where in flags.items() if where.any()}


def merged(flags: Mapping[str, Flags], key: str, where: Flags) -> dict[str, Flags]:
    """Return flags by reason or channel, one of which holds at further samples (n,) as well."""
    return {**flags, key: flags[key] | where if key in flags else where}
