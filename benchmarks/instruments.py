"""How verdicts stand instruments that are missing, off zero, or beside masses that are not known.

    python -m benchmarks instruments --left-out 12 --zero 24 --masses 100

makes what is missing of these three figures, with the generator of the blind benchmark, and prints
them; without a number it prints what is there. A diagnosis takes some ten seconds, so the table of
all benchmarks shows what the last run found.

left out   buildings, each without one accelerometer or one displacement: a case without a crash
           whose verdict names the hidden effect, or "none" where none is hidden
zero       bench cases with one hidden effect and a load cell off by 15 % of the force: the effect
           alone named and the zero told (a gas spring's preload is a zero, so that it is left out)
masses     buildings that hide nothing, masses in the file off by 3 % (standard deviation):
           the verdict "none" and no sensor fault
"""

from __future__ import annotations

import argparse
import json
import traceback
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from bristle.diagnosis import diagnose_rig
from bristle.model.model import Model
from bristle.physics.building import Building
from bristle.physics.effect import EFFECTS
from tests.independent.rigs import LAWS

from ._answers import Answer, Answers
from ._blind import building, cases, score, work
from ._blind.plan import BUILDINGS, Task, make_plan, make_structure_plan
from ._blind.subject import measurements, packed
from ._rows import Row

SEED = 11
ZERO = 0.15
"""Zero of the load cell as a share of the force's RMS."""
DOUBT = 0.03
"""Standard deviation of the masses in a building's file, as a share."""
GONE = tuple(
    f"{level}_{what}"
    for what in ("acceleration_absolute", "displacement")
    for level in ("base", "floor1", "floor2")
)
GOALS = {"left out": 0.9, "zero": 0.9, "masses": 1.0}


def run() -> list[Row]:
    """Return the rows of what has been made so far."""
    return rows(Answers("instruments").kept())


def main(given: list[str]) -> int:
    """Make what is missing of the figures, print them."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks instruments", description=__doc__)
    for name in GOALS:
        parser.add_argument(f"--{name.replace(' ', '-')}", type=int, default=0, metavar="CASES")
    chosen = parser.parse_args(given)
    jobs = ((figure, *job) for figure, job in _jobs(chosen))
    done = Answers("instruments").complete(jobs, _answered)
    for row in rows(done):
        print(f"{row.name}: {row.measured} (goal {row.goal})")
    return 0


def rows(done: dict[str, Answer]) -> list[Row]:
    """Return one row per figure that has answers: how many are right, and how many crashed."""
    out = []
    for figure, goal in GOALS.items():
        own = [answer for key, answer in done.items() if json.loads(key)[0] == figure]
        if own:
            right = score.Count(sum(one["right"] for one in own), len(own))
            crashed = sum("error" in one for one in own)
            text = f"{right.good} of {right.of} right, {crashed} crashed"
            out.append(
                Row(f"instruments: {figure}", text, f">= {goal:.0%}", goal / max(right.share, 1e-3))
            )
    return out


def _jobs(chosen: argparse.Namespace) -> Iterator[tuple[str, tuple[Any, ...]]]:
    yield from (("left out", (k, gone)) for k in range(chosen.left_out) for gone in GONE)
    yield from (("zero", (k,)) for k in range(chosen.zero))
    yield from (("masses", (k,)) for k in range(chosen.masses))


def _answered(figure: str, *job: Any) -> Answer:
    """Return whether a case is answered rightly and what was said; an error is wrong."""
    asked: dict[str, Callable[..., Answer]] = {
        "left out": _left_out, "zero": _zero, "masses": _masses,
    }  # fmt: skip
    try:
        return asked[figure](*job)
    except Exception:  # whatever it is, it is the method's failure on this case
        return {"right": False, "said": [], "error": traceback.format_exc()}


def _left_out(number: int, gone: str) -> Answer:
    task = make_structure_plan(SEED, number + 1)[number]
    case = cases.load(task)
    said = _of_building(case, building.file_of(case), gone)
    line = {"task": vars(task), "truth": work.slim(case.truth), "answer": said}
    hidden = bool(case.truth["effects"])
    right = score.names_effect_or_class(line) if hidden else not score.false_alarm(line)
    return {"right": right, "said": [said["kind"], *said["effects"]]}


def _zero(number: int) -> Answer:
    plan = (task for task in make_plan(SEED, 40 * (number + 1), "effect"))
    able = [t for t in plan if t.noise == 0.01 and not EFFECTS[t.effect].offset]
    task = able[number]
    case = cases.load(task)
    force = np.concatenate([run["force"] for run in case.runs])
    zero = ZERO * float(np.sqrt(np.mean(force**2))) * (-1.0) ** number
    for one in case.runs:
        one["force"] = one["force"] + zero
    train, held_out = (
        measurements(case.part(role), case.channels) for role in ("train", "holdout")
    )
    said = packed(diagnose_rig(train, held_out, Model(task.law)).as_dict())
    told = [s["value"] for s in said["sensors"] if (s["channel"], s["fault"]) == ("force", "bias")]
    near = any(abs(value - zero) < 0.1 * abs(zero) for value in told)
    line = {"task": vars(task), "truth": work.slim(case.truth), "answer": said}
    right = near and said["kind"] == "effect" and score.names_it_alone(line)
    return {"right": right, "said": [task.effect, said["kind"], *said["effects"], *told]}


def _masses(number: int) -> Answer:
    beds = [(rig, law) for rig in BUILDINGS for law in LAWS]
    rig, law = beds[number % len(beds)]
    late = bool(number // len(beds) % 2)
    task = Task("structure", "none", "", 0.0, 0.01, rig, law, 7000 + number, reconstructed=late)
    case = cases.load(task)
    off = DOUBT * np.random.default_rng(number).standard_normal(
        len(case.truth["building"]["masses"])
    )
    told = case.truth["building"]
    told["masses"] = (np.array(told["masses"]) * (1.0 + np.clip(off, -0.09, 0.09))).tolist()
    said = _of_building(
        replace(case, truth=case.truth | {"building": told}), building.file_of(case)
    )
    right = said["kind"] == "none" and not said["sensors"]
    return {"right": right, "said": [said["kind"], *said["effects"]]}


def _of_building(case: cases.Recorded, file: Building, gone: str = "") -> dict[str, Any]:
    channels = tuple(channel for channel in case.channels if channel != gone)
    train, held_out = (measurements(case.part(role), channels) for role in ("train", "holdout"))
    return packed(diagnose_rig(train, held_out, Model(case.task.law), file).as_dict())
