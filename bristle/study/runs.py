"""Which measurements of a study a model is fitted to, and which ones are held out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..data.measurement import Measurement
from ..errors import StudyError
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
    """Return the pieces that a model can be held against, and which ones are left out, and why.

    Missing values cut a file into pieces, and one may be short or hold a rest only: that is no
    reason to refuse the file. A file in one piece, or with no piece that is of use, stays whole,
    to be refused by what needs more of it.
    """
    kept, left = [], []
    for piece in pieces:
        of_file = [one for one in pieces if one.source == piece.source]
        reason = _idle(piece)
        if not reason or len(of_file) == 1 or all(_idle(one) for one in of_file):
            kept.append(piece)
        else:
            left.append(f"{piece.name} is left out: {reason}.")
    return kept, tuple(left)


def _idle(piece: Measurement) -> str:
    """Return why nothing can be learnt from a piece of a run, "" where something can."""
    if len(piece.time) < SHORTEST:
        return f"it has {len(piece.time)} samples, and a fit needs {SHORTEST}"
    for channel in ("force", "displacement", "velocity"):
        if piece.has(channel) and float(np.ptp(piece[channel])) == 0.0:
            return f"its {channel} does not change"
    return ""


def split_in_time(pieces: list[Measurement]) -> Runs:
    """Return the first 70 % of a single run's samples for training, and the rest held out."""
    total = sum(len(piece.time) for piece in pieces)
    wanted, train, holdout = round(SPLIT * total), [], []
    for piece in pieces:
        size = len(piece.time)
        if wanted >= size:
            train.append(piece)
        elif wanted <= 0:
            holdout.append(piece)
        else:
            train.append(piece.part(0, wanted, f"{piece.name}, first {SPLIT:.0%}"))
            holdout.append(piece.part(wanted, size, f"{piece.name}, last {1.0 - SPLIT:.0%}"))
        wanted -= size
    note = (
        "There is one run. It is split in time, the last 30 % held out: weaker than a "
        "separate run, because its motion, voltage and temperature are like those in training."
    )
    return Runs(train, holdout, (note,))


def refuse_twins(train: list[Measurement], holdout: list[Measurement]) -> None:
    """Refuse runs that are held out and for training, too; StudyError names both."""
    _refuse_same(train, holdout, "held out", "which is for training")


def refuse_seen(seen: list[Measurement], test: list[Measurement]) -> None:
    """Refuse test runs that are for training or held out, too; StudyError names both."""
    _refuse_same(seen, test, "a test run", "which is not")


def _refuse_same(
    others: list[Measurement], judging: list[Measurement], what: str, beside: str
) -> None:
    first = {one.digest(): one.name for one in others}
    for one in judging:
        if one.digest() in first:
            raise StudyError(
                f"{one.name} is {what} and is the same measurement as {first[one.digest()]}, "
                f"{beside}: it tests nothing. Use another run, or remove one."
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
