"""What is known of whole runs, held against the motion that was measured."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ..measurement import Measurement
from ..tone import label_doubt, tone_of
from .finding import Finding


def check_labels(runs: Sequence[Measurement]) -> Iterator[Finding]:
    """Yield the runs on a bench whose frequency or amplitude is another one than their label's."""
    for run in runs:
        tone = tone_of(run) if {"frequency", "amplitude"} & {*run.labels} else None
        text = "" if tone is None else label_doubt(run.labels, tone)
        if text:
            yield Finding(
                "label", "warning",
                f"{text}: what was told of the run by its name or a table is doubtful, the level "
                "of a command as well.",
                "Correct labels and levels in its [[runs]] of study.toml.", run.name,
            )  # fmt: skip
