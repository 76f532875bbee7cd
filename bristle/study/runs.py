"""Which measurements of a study a model is fitted to, and which ones are held out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.progress import Count
from ..core.text import command, listed
from ..data.corrections import LEFT_OUT, Correction
from ..data.left_out import MISSING, WAYS_OUT
from ..data.measurement import Known, Measurement, is_part, measurements_of, names_of_files, stem_of
from ..data.pieces import pieces_of
from ..data.read import read_table
from ..data.sampling import LOST
from ..data.table import Table
from ..errors import StudyError
from ..identification.prepare import SHORTEST
from ..identification.run_start import MOVING
from .study_file import Place, RunFile, Settings

SPLIT = 0.7
"""Share of a single run that is for training; the rest is held out."""


@dataclass(frozen=True)
class Runs:
    """The measurements of a study: those that a model is fitted to, and those held out.

    `notes` says what weakens the split, in sentences.
    """

    train: list[Measurement]
    holdout: list[Measurement]
    notes: tuple[str, ...] = ()

    @property
    def all(self) -> list[Measurement]:
        """Both, in order."""
        return [*self.train, *self.holdout]


def usable(pieces: list[Measurement]) -> tuple[list[Measurement], tuple[str, ...]]:
    """Return the pieces that a model can be held against, and what is left out, and why.

    Missing values cut a file into pieces, and one may be short or hold a rest only: that is no
    reason to refuse the file. A file in one piece, or with no piece that is of use, stays whole,
    to be refused by what needs more of it.
    """
    kept, left = [], []
    way_out = WAYS_OUT[MISSING].capitalize()
    for piece in pieces:
        of_file = [one for one in pieces if one.source == piece.source]
        reason = _idle(piece)
        if not reason or len(of_file) == 1 or all(_idle(one) for one in of_file):
            kept.append(piece)
        else:
            left.append(f"{piece.name} is left out: {reason}.")
    lost = {
        f"{stem_of(piece.source)}: {note}. {way_out}."
        for piece in pieces for note in piece.notes if LOST in note
    }  # fmt: skip
    return kept, (*sorted(lost), *left)


def _idle(piece: Measurement) -> str:
    """Return why nothing can be learnt from a piece of a run, "" where something can."""
    if len(piece.time) < SHORTEST:
        return f"it has {len(piece.time)} samples, and a fit needs {SHORTEST}"
    for channel in ("force", "displacement", "velocity"):
        if piece.has(channel) and float(np.ptp(piece[channel])) == 0.0:
            return f"its {channel} does not change"
    return ""


def split_in_time(pieces: list[Measurement]) -> Runs:
    """Return the first 70 % of a single run's samples for training, and the rest held out.

    The cut moves to the next place where no part is too short for a fit: it may be a gap between
    two pieces.
    """
    sizes = [len(piece.time) for piece in pieces]
    cut = _cut(sizes, round(SPLIT * sum(sizes)))
    left, train, holdout = cut, [], []
    for piece, size in zip(pieces, sizes, strict=True):
        if left >= size:
            train.append(piece)
        elif left <= 0:
            holdout.append(piece)
        else:
            share = left / size
            train.append(piece.part(0, left, f"{piece.name}, first {share:.0%}"))
            # What is not judged of a run in motion is the end of the first part: none is lost.
            begin, name = max(left - MOVING, 0), f"{piece.name}, last {1.0 - share:.0%}"
            holdout.append(piece.part(begin, size, name))
        left -= size
    rest = 100.0 * (1.0 - cut / sum(sizes))
    note = (
        f"There is one run. It is split in time, the last {rest:.0f} % held out: weaker than a "
        "separate run, because motion, command and temperature are like those in training."
    )
    return Runs(train, holdout, (note,))


def _cut(sizes: list[int], wanted: int) -> int:
    """Return the number of samples for training: next to `wanted`, no part below `SHORTEST`.

    Where pieces are too short for that, it is `wanted`: what needs more of them refuses them.
    """
    allowed, begin = [], 0
    for size in sizes:
        end = begin + size
        if begin:
            allowed.append(begin)
        if size >= 2 * SHORTEST:
            allowed.append(min(max(wanted, begin + SHORTEST), end - SHORTEST))
        begin = end
    return min(allowed, key=lambda cut: abs(cut - wanted), default=wanted)


def refuse_twins(
    train: list[Measurement], holdout: list[Measurement], study: Path | None = None
) -> None:
    """Refuse runs that are held out and for training, too; StudyError names both.

    Parameters
    ----------
    train, holdout : the runs
    study : the folder whose runs they are, for the command that leaves one out; None without one
    """
    _refuse_same(train, holdout, "held out", "which is for training", study)


def refuse_seen(seen: list[Measurement], test: list[Measurement]) -> None:
    """Refuse test runs that are for training or held out, too; StudyError names both."""
    _refuse_same(seen, test, "a test run", "which is not")


def _refuse_same(
    others: list[Measurement], judging: list[Measurement], what: str, beside: str,
    study: Path | None = None,
) -> None:  # fmt: skip
    first = {one.digest(): one.name for one in others}
    for one in judging:
        if one.digest() in first:
            exclude = "remove one"
            if study is not None:
                order = command("study", "roles", study, "--exclude", first[one.digest()])
                exclude = f"leave one out: {order}"
            raise StudyError(
                f"{one.name} is {what} and is the same measurement as {first[one.digest()]}, "
                f"{beside}: it tests nothing. Use another run, or {exclude}"
            )


def twins_within(runs: list[Measurement]) -> list[str]:
    """Return the sentences that tell which runs are one and the same."""
    first: dict[str, str] = {}
    notes = []
    for one in runs:
        digest = one.digest()
        if digest in first:
            notes.append(f"{one.name} is the same measurement as {first[digest]}: it counts twice.")
        first.setdefault(digest, one.name)
    return notes


# The runs of a study as measurements, each with what study.toml knows of it.


def read_runs(folder: Path, settings: Settings, role: str | None = None) -> list[Measurement]:
    """Return the measurements of a study's runs; a file of several runs is read once.

    Parameters
    ----------
    folder : the study's
    settings : the content of its study.toml
    role : the role of the runs; None for all

    Raises
    ------
    RecordError
        If a file cannot be read.
    StudyError
        If a run is none of those in its file.
    """
    tables: dict[str, Sequence[Table]] = {}
    found: list[Measurement] = []
    names = names_of_runs(settings)
    chosen = [run for run in settings.runs if role in (None, run.role)]
    count = Count("reading file", len({run.file for run in chosen}))
    for run in chosen:
        if run.file not in tables:
            count.begins(run.file)
            table = read_table(folder / run.file, settings.split)
            tables[run.file] = pieces_of(table, settings.split, settings.channels)
        name = names[run.place]
        found += _measured(folder, settings, run, name, tables[run.file])
    return found


def names_of_runs(settings: Settings) -> dict[Place, str]:
    """Return what the measurement of each run is called, by its place; no two are alike.

    Runs that are left out count: the others keep their names when one is left out or comes back.
    """
    every = (*settings.runs, *settings.excluded)
    ends = [f" run {run.piece}" if run.piece else "" for run in every]
    names = names_of_files([run.file for run in every], ends)
    return {run.place: name for run, name in zip(every, names, strict=True)}


def place_of_run(folder: Path, settings: Settings, name: str) -> Place:
    """Return the place of the run with a name, or of that with a part of this name.

    Raises
    ------
    StudyError
        If no run has such a name.
    """
    known = names_of_runs(settings)
    places = {known[run.place]: run.place for run in settings.runs}
    own = [one for one in places if is_part(name, one)]
    if not own:
        raise StudyError(
            f'{folder / "study.toml"}: no run is called "{name}"; there are {listed(places)}.'
        )
    return places[max(own, key=len)]


def _measured(
    folder: Path, settings: Settings, run: RunFile, name: str, tables: Sequence[Table]
) -> list[Measurement]:
    """Return the measurements of a run, by its name, among those of its file."""
    if run.piece > len(tables):
        raise StudyError(
            f"{folder / 'study.toml'}: {run.file} holds {len(tables)} runs, and "
            f"piece = {run.piece} is none of them."
        )
    known = Known(
        name, run.levels, run.labels, settings.rate, settings.mask, run.corrections, settings.extra,
    )  # fmt: skip
    return measurements_of(tables[max(run.piece, 1) - 1], settings.channels, known=known)


# Corrections of the parts of runs as corrections of the runs: study.toml has one table for each.
#
# A gap in a file cuts its run into parts, and each part is checked by itself: what was wrong with
# the whole run is found in every one of them, and must be set right once.

LEFT = 0.25
"""Share of a part's fault that the correction of the run may leave there, or add to it."""


@dataclass(frozen=True)
class RunCorrections:
    """What is set right in a run, from what was found in its parts.

    `name` of the run, and its `place`; `notes` sentences on parts that do
    not show what is corrected; `apart` sentences on what is not corrected, for no single value is
    right for all parts.
    """

    name: str
    place: Place
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
    parts: dict[Place, list[str]] = {}
    for name in {**found, **sizes}:
        parts.setdefault(place_of_run(folder, settings, name), []).append(name)
    return [
        _of_run(names[place], place, {part: found.get(part, ()) for part in own}, sizes)
        for place, own in parts.items()
        if any(found.get(part) for part in own)
    ]


def _of_run(
    name: str,
    place: Place,
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
