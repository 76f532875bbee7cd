"""What the data check finds: in a sentence with numbers, and what to do about it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any, Literal

from ..corrections import Correction

Level = Literal["error", "warning", "note"]
_OF_ONE_RUN = ("run gain", "run sign", "run zero")
"""Kinds that say how one run differs from the others."""
_ORDER = {"error": 0, "warning": 1, "note": 2}


@dataclass(frozen=True)
class Finding:
    """One finding.

    `kind` names it for programs ("clipping"), `run` and `channel` are "" where it is about all;
    `text` says it with numbers, `do` what to do, "" where there is nothing; `value` is the number
    by which findings of one kind are ordered, worst last. `corrections` set it right where that can
    be done.
    """

    kind: str
    level: Level
    text: str
    do: str = ""
    run: str = ""
    channel: str = ""
    value: float = 0.0
    corrections: tuple[Correction, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return the finding as JSON has it."""
        return {**asdict(self), "corrections": [one._asdict() for one in self.corrections]}


def grouped(findings: Iterable[Finding]) -> list[tuple[Finding, list[str]]]:
    """Return the worst finding of each kind and channel, with the runs that share it."""
    groups: dict[tuple[str, ...], list[Finding]] = defaultdict(list)
    for finding in findings:
        run = finding.run if finding.kind in _OF_ONE_RUN else ""
        groups[finding.kind, finding.channel, run].append(finding)
    out = [
        (min(group, key=_worst_first), [one.run for one in group if one.run])
        for group in groups.values()
    ]
    return sorted(out, key=lambda pair: _ORDER[pair[0].level])


def _worst_first(finding: Finding) -> tuple[int, float]:
    return _ORDER[finding.level], -finding.value


def sentence(finding: Finding, runs: list[str]) -> str:
    """Return one finding as text: where, what, and in how many other runs."""
    where = f"{finding.run}: " if finding.run else ""
    others = len(set(runs)) - 1
    also = f" (the same in {others} other run{'s' * (others > 1)})" if others > 0 else ""
    return f"{where}{finding.text}{also}"
