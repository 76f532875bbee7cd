"""Trials of the generator's cases, made once and kept outside the repository.

What a decision needs of a trial is small: z, the plain error, and the losses of held-out samples,
of which the means over blocks suffice, for a paired gain is resampled in blocks. Pairs are tried
where any of the rules that are looked at asks for them.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._blind import building, cases, plan, subject
from benchmarks._blind.plan import Task
from bristle.core.arrays import Array
from bristle.core.files import cache_folder
from bristle.diagnosis.decision import decide
from bristle.diagnosis.rig_runs import BenchRuns
from bristle.diagnosis.rule import BENCH, DecisionRule
from bristle.diagnosis.sensor_faults import instruments_of
from bristle.diagnosis.site import Trials, diagnose_line, is_organised, prepare_line
from bristle.diagnosis.trials import Trial, parts_of
from bristle.identification.building_sites import structure_problems
from bristle.identification.rig import DAMPER
from bristle.model.model import Model

from .varied import variants

WEAKER = (1.0, 0.2, 0.07)
"""Factors on the strengths of the proof's plan, in turn: 40, 15 and 5 % of the force become 8, 3
and 1 %, or 2.8, 1 and 0.35 %."""


class NotStoredError(Exception):
    """A rule asks for trials that were not made."""


@dataclass
class Stored:
    """The trials of one case, or of one site of a building, ready to be decided anew.

    `opened` is "" or the verdict of data that carry none; `instruments` the sensor effects that the
    channels show of each other; `pattern` the strongest pattern of the
    residual: its share of the power, and its probability by chance. `grown` and `reduced` hold the
    trials of pairs by the effects that they begin from.
    """

    task: Task
    site: str
    code: str
    opened: str = ""
    instruments: tuple[str, ...] = ()
    before: Trial | None = None
    single: list[Trial] = field(default_factory=list)
    pattern: tuple[float, float] = (0.0, 1.0)
    grown: dict[str, list[Trial]] = field(default_factory=dict)
    reduced: dict[str, list[Trial]] = field(default_factory=dict)

    def grow(self, first: Trial) -> list[Trial]:
        """Return the stored trials of pairs with this effect."""
        return _looked_up(self.grown, first)

    def reduce(self, pair: Trial) -> list[Trial]:
        """Return the stored trials of a pair's members."""
        return _looked_up(self.reduced, pair)


def _looked_up(kept: dict[str, list[Trial]], trial: Trial) -> list[Trial]:
    key = "+".join(trial.effects)
    if key not in kept:
        raise NotStoredError(key)
    return kept[key]


def organised(stored: Stored, rule: DecisionRule) -> bool:
    """Return whether a rule calls the residual of a stored case organised."""
    return is_organised(*stored.pattern, rule)


# --- plan ---------------------------------------------------------------------------------------


def make_plan(seed: int, bench: int, structure: int) -> list[Task]:
    """Return the tasks of a calibration: seeds from `plan.RESERVED` on, which no proof may use."""
    own = plan.RESERVED + seed
    tasks = plan.make_plan(own, bench) if bench else []
    sites = [t for t in plan.make_structure_plan(own, 8 * structure) if _is_of_a_site(t)]
    return [
        replace(task, seed=plan.RESERVED + task.seed, strength=_strength(task, turn))
        for part in (tasks, sites[:structure])
        for turn, task in enumerate(part)
    ]


def _strength(task: Task, turn: int) -> float:
    """Return a task's strength; two of three effects are so weak that they come near the noise.

    What is far above the noise meets no border of the rule, whatever its values.
    """
    return task.strength * WEAKER[turn % len(WEAKER)]


def _is_of_a_site(task: Task) -> bool:
    """Return whether a building hides nothing or an effect of its own, its damper's force known."""
    return not task.reconstructed and task.effect in (*plan.SITES, "none")


# --- making -------------------------------------------------------------------------------------


def made(task: Task) -> list[Stored]:
    """Return the trials of a case, one per site on a building; pairs for every rule looked at."""
    case, code = cases.load(task), subject.digest()
    train, holdout = subject.halves(case)
    if task.kind == "structure":
        problems = structure_problems(train, holdout, building.file_of(case), task.law)
        lines = {s: prepare_line(s, *pair) for s, pair in problems.items() if s != "damper"}
        found = {site: diagnose_line(site, one) for site, one in lines.items()}
        return [
            Stored(task, site, code, before=one.before, single=list(one.trials))
            for site, one in found.items()
        ]
    runs = BenchRuns(train, holdout, Model(task.law))
    if runs.lacking is not None:
        return [Stored(task, "", code, "insufficient")]
    trials = Trials(opened := runs.prepare(DAMPER))
    first = trials.patterns[0] if trials.patterns else None
    stored = Stored(
        task, "", code, "", instruments_of(opened.faults), trials.before, trials.single,
        (first.share, first.p) if first else (0.0, 1.0),
    )  # fmt: skip
    _grow(stored, trials)
    return [stored]


def _grow(stored: Stored, trials: Trials) -> None:
    """Make the trials of all pairs that a rule looked at asks for, each once."""

    def grow(first: Trial) -> list[Trial]:
        key = "+".join(first.effects)
        if key not in stored.grown:
            stored.grown[key] = trials.grow(first)
        return stored.grown[key]

    def reduce(pair: Trial) -> list[Trial]:
        key = "+".join(pair.effects)
        if key not in stored.reduced:
            stored.reduced[key] = trials.reduce(pair)
        return stored.reduced[key]

    for _, _, rule in variants(BENCH):
        decide(trials.before, trials.single, grow, organised(stored, rule), reduce, rule)


# --- files --------------------------------------------------------------------------------------


def folder() -> Path:
    """Return where the trials of this generator's cases are kept."""
    return cache_folder() / "calibrate" / f"trials-{cases.generator_digest()}"


def keep(task: Task, found: list[Stored]) -> Path:
    """Write the trials of a case."""
    arrays: dict[str, Array] = {}
    about = [_about(one, arrays) for one in found]
    path = folder() / f"{task.key}.npz"
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_suffix(f".{os.getpid()}.tmp")
    with unfinished.open("wb") as file:
        np.savez_compressed(file, task=json.dumps(asdict(task)), about=json.dumps(about), **arrays)  # type: ignore[arg-type]
    unfinished.replace(path)
    return path


def _about(one: Stored, arrays: dict[str, Array]) -> dict[str, Any]:
    def number(trial: Trial) -> dict[str, Any]:
        name = f"losses_{len(arrays)}"
        arrays[name] = np.array([part.mean() for part in parts_of(trial.losses)])
        return {
            "effects": trial.effects, "train": trial.train, "z": trial.z, "rms": trial.rms,
            "refined": trial.refined, "losses": name, "samples": len(trial.losses),
        }  # fmt: skip

    return {
        "site": one.site, "code": one.code, "opened": one.opened, "instruments": one.instruments,
        "pattern": one.pattern,
        "before": number(one.before) if one.before is not None else None,
        "single": [number(t) for t in one.single],
        "grown": {key: [number(t) for t in found] for key, found in one.grown.items()},
        "reduced": {key: [number(t) for t in found] for key, found in one.reduced.items()},
    }  # fmt: skip


def read(path: Path) -> list[Stored]:
    """Return the trials of a file."""
    with np.load(path) as file:
        task = Task.of(json.loads(str(file["task"])))

        def trial(told: dict[str, Any]) -> Trial:
            means = file[told["losses"]]
            sizes = [len(part) for part in parts_of(np.zeros(told["samples"]))]
            losses = np.repeat(means, sizes)  # a block keeps its mean: no more is asked of it
            model = Model(task.law, tuple(told["effects"]))
            return Trial(
                model, told["train"], told["z"], told["rms"], losses, np.sqrt(2.0 * losses),
                told["refined"],
            )  # fmt: skip

        return [
            Stored(
                task, one["site"], one["code"], one["opened"], tuple(one["instruments"]),
                trial(one["before"]) if one["before"] is not None else None,
                [trial(t) for t in one["single"]], tuple(one["pattern"]),
                {key: [trial(t) for t in found] for key, found in one["grown"].items()},
                {key: [trial(t) for t in found] for key, found in one["reduced"].items()},
            )
            for one in json.loads(str(file["about"]))
        ]  # fmt: skip


def _make_and_keep(task: Task) -> tuple[str, str]:
    """Return a task's key, and why it gave no trials, "" if it did."""
    try:
        keep(task, made(task))
    except ValueError as error:  # the specimen's equations were not solved: no case
        return task.key, str(error)
    return task.key, ""


def make_missing(tasks: list[Task], workers: int, afresh: bool = False) -> Iterator[str]:
    """Make the trials that are not stored yet; yield a sentence for each case.

    `afresh` makes those again that other code has made.
    """
    code = subject.digest()
    left = [
        task
        for task in tasks
        if not (path := folder() / f"{task.key}.npz").is_file()
        or (afresh and any(one.code != code for one in read(path)))
    ]
    with ProcessPoolExecutor(max(1, workers)) as pool:
        futures = [pool.submit(_make_and_keep, task) for task in left]
        try:
            for count, done in enumerate(as_completed(futures), 1):
                key, why = done.result()
                yield f"{count}/{len(left)} {key}{': no case, ' + why if why else ''}"
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def stored_of(tasks: list[Task]) -> list[Stored]:
    """Return what is stored of these tasks."""
    paths = [folder() / f"{task.key}.npz" for task in tasks]
    return [one for path in paths if path.is_file() for one in read(path)]
