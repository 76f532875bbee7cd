"""Corrections of the parts of runs as corrections of the runs: study.toml has one table for each.

A gap in a file cuts its run into parts, and each part is checked by itself: what was wrong with the
whole run is found in every one of them, and must be set right once.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..data.corrections import LEFT_OUT, Correction
from .reading import names_of_runs, place_of_run
from .settings import Settings

LEFT = 0.25
"""Share of a part's fault that the correction of the run may leave there, or add to it."""


@dataclass(frozen=True)
class RunCorrections:
    """What is set right in a run, from what was found in its parts.

    `name` of the run, `place` its file and piece in study.toml; `notes` sentences on parts that do
    not show what is corrected; `apart` sentences on what is not corrected, for no single value is
    right for all parts.
    """

    name: str
    place: tuple[str, int]
    corrections: tuple[Correction, ...]
    notes: tuple[str, ...] = ()
    apart: tuple[str, ...] = ()


def joined_corrections(
    folder: Path,
    settings: Settings,
    found: Mapping[str, Sequence[Correction]],
    samples: Mapping[str, int] | None = None,
) -> list[RunCorrections]:
    """Return the corrections of runs from those of their parts.

    Of a channel and a fault there is one, the mean over the parts by their samples; lines have
    several frequencies.

    Parameters
    ----------
    folder : of the study
    settings : the content of its study.toml
    found : corrections by the name of a run or of a part of it
    samples : how many samples each run or part has, by name; None takes all parts alike

    Raises
    ------
    StudyError
        If no run has such a name.
    """
    sizes = dict.fromkeys(found, 1) if samples is None else samples
    names = names_of_runs(settings)
    parts: dict[tuple[str, int], list[str]] = {}
    for name in {**found, **sizes}:
        parts.setdefault(place_of_run(folder, settings, name), []).append(name)
    return [
        _of_run(names[place], place, {part: found.get(part, ()) for part in own}, sizes)
        for place, own in parts.items()
        if any(found.get(part) for part in own)
    ]


def _of_run(
    name: str,
    place: tuple[str, int],
    found: Mapping[str, Sequence[Correction]],
    sizes: Mapping[str, int],
) -> RunCorrections:
    """Return the corrections of a run from those of its parts."""
    every = [(part, one) for part, listed in found.items() for one in listed]
    kinds = dict.fromkeys(one[:2] for _, one in every)
    out: list[Correction] = []
    notes, apart = [], []
    for channel, fault in kinds:
        own = [(part, one) for part, one in every if one[:2] == (channel, fault)]
        if fault == "line":
            out += _lines(own, sizes)
            continue
        values = np.array([one.value for _, one in own])
        weights = [sizes.get(part, 1) for part, _ in own]
        mean = float(np.average(values, weights=weights))
        without = 1.0 if fault == "gain" else 0.0
        if np.any(np.abs(values - mean) > LEFT * np.abs(values - without)):
            apart.append(_apart_text(name, own))
            continue
        out.append(Correction(channel, fault, mean))
        silent = [part for part in found if part not in dict(own)]
        if silent:
            notes.append(f"{', '.join(silent)}: the check does not find this fault there.")
    return RunCorrections(name, place, tuple(out), tuple(notes), tuple(apart))


def _lines(own: Sequence[tuple[str, Correction]], sizes: Mapping[str, int]) -> list[Correction]:
    """Return the lines of a run: of those that are alike that of the longest part."""
    out: list[Correction] = []
    for _, one in sorted(own, key=lambda pair: -sizes.get(pair[0], 1)):
        if not any(map(one.is_like, out)):
            out.append(one)
    return out


def _apart_text(name: str, own: Sequence[tuple[str, Correction]]) -> str:
    told = ", ".join(f"by {part} {one.text}" for part, one in own)
    return (
        f"{name} is not corrected: {told}. No single value is right for all parts. Make a file of "
        f"each part, or {LEFT_OUT}."
    )
