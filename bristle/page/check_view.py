"""View 1, Data: what the data check finds, and where in the runs a channel is cut off."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.finding import grouped, sentence
from ..data.cut_off import LONG
from ..data.noise import stretches
from ..study.data_check import check_data
from ..study.study import Study
from .data_view import Array, spans


def answer(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the data check of a study finds.

    Parameters
    ----------
    folder : of the study
    arguments : none are taken

    Raises
    ------
    StudyError, RecordError
        As `check_data`.
    """
    found = check_data(Study(folder))
    clipped = {(one.run, one.channel) for one in found.findings if one.kind == "clipping"}
    return {
        "ok": found.ok,
        "findings": [
            {
                "kind": finding.kind, "level": finding.level, "channel": finding.channel,
                "run": finding.run, "text": sentence(finding, runs), "do": finding.do,
                "can_correct": bool(finding.fixes),
            }
            for finding, runs in grouped(found.findings)
        ],
        "clipped": [
            {
                "run": run.name, "channel": channel,
                "spans": spans(run.time, at_extreme(run[channel])),
            }
            for run in found.runs
            for channel in run.channels if (run.name, channel) in clipped
        ],
    }  # fmt: skip


def at_extreme(values: Array) -> NDArray[np.bool_]:
    """Return the samples (n,) in stretches of equal ones at an extreme, of a clipped channel."""
    flags = np.zeros(len(values), dtype=np.bool_)
    for extreme in (values.max(), values.min()):
        for a, b in stretches(values == extreme):
            flags[a:b] |= b - a >= LONG
    return flags
