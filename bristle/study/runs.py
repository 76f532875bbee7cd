"""Which measurements of a study a model is fitted to, and which ones are held out."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..data.left_out import MISSING, WAYS_OUT
from ..data.measurement import Measurement, stem_of
from ..data.sampling import LOST
from ..errors import StudyError
from ..findings import command
from ..identify.prepare import SHORTEST

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
            holdout.append(piece.part(left, size, f"{piece.name}, last {1.0 - share:.0%}"))
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
