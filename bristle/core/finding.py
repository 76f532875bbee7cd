"""What a check finds, in files, in data and in channels: a sentence, and what to do about it."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import nan
from typing import Any, Literal

from ..errors import UnitError
from ..units import parse
from .text import plural

Level = Literal["error", "warning", "note", "pass"]
_OF_ONE_RUN = ("run gain", "run sign", "run zero")
"""Kinds that say how one run differs from the others."""
_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.]*\d)")
"""A number of a sentence, and no part of a name."""
_POWER = re.compile(" \u00d7 10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+")
_WORD = re.compile(r"(?: to -?[\d.]+)? ([^\s,;:()]*[^\s,;:().])")
"""What stands behind a number, or behind the range that begins with it."""
_ORDER = {"error": 0, "warning": 1, "note": 2}


@dataclass(frozen=True)
class Finding:
    """What a check finds, in a sentence with numbers; `kind` is for programs ("clipping").

    `do` says what to do about it, "" where there is nothing. `line` 0 stands for the whole file, or
    for an override. `run` and `channel` are "" where it is about all; `runs` are those that it was
    seen in, () for all, and `either` is the channel that may be to blame instead. `value` is the
    number by which findings of one kind are ordered, worst last, or the size of a fault, `std` its
    uncertainty. `fixes` set it right where that can be done. The level "pass" is that of a rule of
    a conformance report that holds.
    """

    kind: str
    level: Level
    text: str
    do: str = ""
    run: str = ""
    channel: str = ""
    value: float = 0.0
    fixes: tuple[Any, ...] = ()
    std: float = nan
    line: int = 0
    either: str = ""
    runs: tuple[str, ...] = ()

    def as_dict(self, *names: str) -> dict[str, Any]:
        """Return some of its fields by name."""
        return {name: getattr(self, name) for name in names}


def worded(file: object, finding: Finding) -> str:
    """Return a finding as one line that begins with its place, `FILE:LINE: text`."""
    place = f"{file}:{finding.line}" if finding.line else str(file)
    return finding.text if finding.text.startswith(f"{place}: ") else f"{place}: {finding.text}"


def grouped(findings: Iterable[Finding]) -> list[tuple[Finding, list[Finding]]]:
    """Return the worst finding of each kind and channel, with those of all runs that share it."""
    groups: dict[tuple[str, ...], list[Finding]] = defaultdict(list)
    for finding in findings:
        run = finding.run if finding.kind in _OF_ONE_RUN else ""
        # Notes of a reader are of one kind whatever they say, and a noise may be a lower limit in
        # one run and too high in another: what lies 1000 times apart is not "similar".
        said = _NUMBER.sub("", finding.text) if finding.kind in ("reading", "noise") else ""
        groups[finding.kind, finding.channel, run, said].append(finding)
    out = [(min(group, key=_worst_first), group) for group in groups.values()]
    return sorted(out, key=lambda pair: _ORDER[pair[0].level])


def _worst_first(finding: Finding) -> tuple[int, float]:
    return _ORDER[finding.level], -finding.value


def sentence(finding: Finding, group: Sequence[Finding]) -> str:
    """Return one finding as text: where, what, and in how many other runs.

    Parameters
    ----------
    finding : the worst one
    group : those of all runs that share it, see `grouped`
    """
    where = f"{finding.run}: " if finding.run else ""
    others = len({one.run for one in group if one.run}) - 1
    if others < 1:
        return f"{where}{finding.text}"
    what = "the same" if len({one.text for one in group}) == 1 else "similar"
    also = _range_text(group) or f"{what} in {plural(others, 'other run')}"
    return f"{where}{finding.text} ({also})"


def _range_text(group: Sequence[Finding]) -> str:
    """Return between which values the first number lies that differs, "" where none can be told."""
    if len({_NUMBER.sub("", one.text) for one in group}) > 1:
        return ""
    columns = zip(*(list(_NUMBER.finditer(one.text)) for one in group), strict=True)
    for column in columns:
        texts = [match.group() for match in column]
        error = column[0].string[: column[0].start()].endswith("± ")  # of the number before it
        if len(set(texts)) > 1 and not error:
            unit = _unit(column[0])
            low, high = min(texts, key=float), max(texts, key=float)
            runs = len({one.run for one in group})
            return f"{low} to {high}{unit} in {runs} runs"
    return ""


def _unit(number: re.Match[str]) -> str:
    """Return the unit behind a number of a sentence, a blank before it, "" where none is there."""
    power = _POWER.match(number.string, number.end())
    before, begin = (power.group(), power.end()) if power else ("", number.end())
    word = _WORD.match(number.string, begin)
    text = word.group(1) if word else ""
    if text == "in":  # the preposition: readers convert inches
        return before
    try:
        parse(text)
    except UnitError:
        return f"{before} {text}" if text in ("ppm", "times") else before
    return f"{before} {text}" if text else before
