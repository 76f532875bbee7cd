"""Which faults of a verdict study.toml can set right, and the corrections that do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..data.corrections import TIMING, Correction

OF_ALL = ("clock", "slew", "range")
"""Faults that all runs share: of a logger, or of the amplifier of a command."""
OF_ONE = TIMING
"""Faults that are set right where a single run has them; late in all runs is an effect."""


def is_correctable(fault: Mapping[str, Any]) -> bool:
    """Return whether a correction in study.toml sets a fault of verdict.json right."""
    return fault["fault"] in (OF_ONE if fault.get("run") else OF_ALL)


def corrections_of(
    verdict: Mapping[str, Any] | None, runs: Sequence[str]
) -> dict[str, list[Correction]]:
    """Return the corrections that a verdict's faults ask for, by the name of the run.

    Parameters
    ----------
    verdict : the content of verdict.json; None where there is none
    runs : names of all runs, for what all of them share
    """
    out: dict[str, list[Correction]] = {}
    for fault in (verdict or {}).get("sensors") or []:
        if not is_correctable(fault):
            continue
        one = Correction(str(fault["channel"]), str(fault["fault"]), float(fault["value"]))
        for run in [str(fault["run"])] if fault.get("run") else runs:
            out.setdefault(run, []).append(one)
    return out
