"""The package's models beside a floor, on the published sets that measured a force.

What takes long is kept as answers (`_answers`), so that the table is drawn again at once.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from bristle.data.measurement import Measurement
from bristle.identification.prepare import prepare

from . import _measured
from ._answers import Answer, Answers
from ._floor import LEARNERS, WITHOUT, have_learner, least_squares, without_physics
from ._free import bare_laws, corrected_runs, opened_once, steps
from ._measured import BENCHES, Row, Runs
from ._rows import Row as Figure

SPLITS = {"last third": _measured.last_third, "middle level": _measured.by_level}
"""Other ways of holding runs out: the worst of all counts."""


def _other(make: Callable[[Path], Runs], split: Callable[[Runs], Runs]) -> Callable[[Path], Runs]:
    return lambda folder: split(make(folder))


SETS: dict[str, tuple[str, Callable[[Path], Runs]]] = {
    **BENCHES,
    **{
        f"{folder}/{name}": (f"{title}, {name} held out", _other(make, split))
        for folder, (title, make) in BENCHES.items()
        for name, split in SPLITS.items()
        if name != "middle level" or folder in ("mr_damper_utfpr", "shock_absorber_dyno")
    },
}  # fmt: skip
"""The same, and the other ways of holding runs out as FOLDER/WAY; one run has no levels."""

Error = tuple[float, str]
"""An error, and what it belongs to."""

NOT_RUN: Error = (float("nan"), "not run yet")

STEPS, LAW = "steps", "law"
"""The jobs of law, effects and curves, and of a bare law; others are named as the learners are."""

VERSION = 2
"""Raised where `_floor` or `_free` finds other numbers: answers of before are then none."""

GOAL = 1.1
"""Ratio of the package's error to the floor that every set should reach."""


@dataclass(frozen=True)
class Beside:
    """The errors on the held-out runs of a set, over the force's RMS; texts say with which model.

    `given` the least of the laws that were given, `free` law and effects, `learned` with curves,
    `closed` with a closure besides; `law` the best bare law with a closure; `floors` those without
    physics and that of a law fitted by least squares, as training runs choose them; `best_law` that
    of the law which is best on the held-out runs.
    """

    data: str
    given: Error
    free: Error
    learned: Error
    closed: Error
    law: Error
    floors: tuple[Error, ...]
    best_law: Error

    @property
    def floor(self) -> Error:
        """The least floor."""
        return min(self.floors)

    @property
    def ratio(self) -> float:
        """The error of the model that the steps end with, over the floor."""
        return self.closed[0] / self.floor[0]

    @property
    def without(self) -> float:
        """The same of the model without a closure."""
        return self.learned[0] / self.floor[0]


Found = dict[str, dict[str, Answer]]
"""Answers by folder and job."""


def answers(data: Path, only: str = "") -> Found:
    """Return what was found by folder and job; what is missing is made where the data are there.

    Parameters
    ----------
    data : folder of the sets
    only : sets whose folder's name holds it
    """
    there = [name for name in SETS if (data / name.partition("/")[0]).is_dir()]
    folders = [name for name in there if only.partition("/")[0] in name]

    def answer(folder: str, job: str, _version: int) -> Answer:
        return found(job, *SETS[folder][1](data / folder.partition("/")[0]))

    made = Answers("reach").complete(jobs(folders), answer)
    return _by_folder(made, folders)


def jobs(folders: Sequence[str]) -> Iterator[tuple[str, str, int]]:
    """Yield the jobs of sets; the learners where they are installed."""
    for folder in folders:
        yield folder, STEPS, VERSION
        yield folder, LAW, VERSION
        for learner in LEARNERS if have_learner() else ():
            yield folder, learner.name, VERSION


def kept() -> Found:
    """Return what this code has found before, by folder and job."""
    return _by_folder(Answers("reach").kept(), list(SETS))


def _by_folder(made: dict[str, Answer], folders: Sequence[str]) -> Found:
    out: Found = {folder: {} for folder in folders}
    for key, one in made.items():
        folder, job, version = json.loads(key)
        if folder in out and version == VERSION:
            out[folder][job] = one
    return out


def found(job: str, train: list[Measurement], held: list[Measurement]) -> Answer:
    """Return the answer to a job: held-out runs are opened by its last call alone."""
    if job == LAW:
        laws = bare_laws(train)
        every = {
            one.words: least_squares(one.model, *corrected_runs(one, train, held)) for one in laws
        }
        closed = opened_once(replace(laws[0], closed=True), train, held)
        words = laws[0].words
        return {"share": every[words], "with": words, "every": every, "closed": closed}
    if job == STEPS:
        pairs = zip(("free", "learned", "closed"), steps(train), strict=True)
        return {
            name: {"share": opened_once(one, train, held), "with": one.words, "z": one.z}
            for name, one in pairs
        }
    learner = next(one for one in LEARNERS if one.name == job)
    runs = [[prepare(run) for run in part] for part in (train, held)]
    reached = without_physics(learner, runs[0], runs[1])
    return {"share": reached.share, "with": reached.chosen, "folds": reached.folds}


def beside(found: Found, rows: Sequence[Row]) -> list[Beside]:
    """Return the sets of which a floor is known, with the models of the package.

    Parameters
    ----------
    found : answers by folder and job
    rows : those of the laws given
    """
    out = []
    for folder, done in found.items():
        title, made = SETS[folder][0], done.get(STEPS, {})
        given = [(row.after, f"{row.law} + {row.after_with}") for row in rows if row.data == title]
        floors = [
            (one["share"], f"{one['with']} by least squares" if job == LAW else job)
            for job, one in done.items()
            if job != STEPS
        ]
        if not floors:
            continue
        free, learned, closed = (
            (made[name]["share"], made[name]["with"]) if made else NOT_RUN
            for name in ("free", "learned", "closed")
        )
        law = done.get(LAW, {})
        every = [(share, words) for words, share in law.get("every", {}).items()]
        bare = (law["closed"], f"{law['with']} + a closure") if law else NOT_RUN
        best, least = (min(errors, default=NOT_RUN) for errors in (given, every))
        out.append(Beside(title, best, free, learned, closed, bare, tuple(floors), least))
    return out


def markdown(found: Sequence[Beside]) -> list[str]:
    """Return the lines of the table and of what belongs to it."""
    lines = [
        "### Beside reference models",
        "",
        "| set | law given | law free | learned | closure | law + closure | floor (which) | "
        "ratio | without closure |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for one in found:
        error, which = one.floor
        parts = (one.given, one.free, one.learned, one.closed, one.law)
        ours = " | ".join(_percent(part) for part in parts)
        ratios = " | ".join("-" if r != r else f"{r:.2f}" for r in (one.ratio, one.without))
        lines.append(f"| {one.data} | {ours} | {error:.1%} ({which}) | {ratios} |")
    lines.append("")
    for one in found:
        floors = "; ".join(f"{which} {error:.1%}" for error, which in one.floors)
        lines.append(
            f"- **{one.data}**: law given: {one.given[1]}; law free: {one.free[1]}; learned: "
            f"{one.learned[1]}. Floors: {floors}; best law on the held-out runs: "
            f"{one.best_law[1]} {_percent(one.best_law)}."
        )
    if not have_learner():
        lines.append(f"- Gradient boosting and neural network were {WITHOUT}.")
    return lines


def _percent(error: Error) -> str:
    return error[1] if error == NOT_RUN else f"{error[0]:.1%}"


def figures(found: Sequence[Beside]) -> list[Figure]:
    """Return a row per set: the ratio to the floor."""
    return [
        Figure(
            f"error on held-out runs over the floor: {one.data}",
            f"{one.ratio:.2f} ({one.closed[0]:.1%} / {one.floor[0]:.1%})",
            f"<= {GOAL}", one.ratio / GOAL, f"floor: {one.floor[1]}; without a closure "
            f"{one.without:.2f}",
        )
        for one in found
        if one.ratio == one.ratio
    ]  # fmt: skip
