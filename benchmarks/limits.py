"""How often the limits that a verdict tells hold the size of an effect that is there.

    python -m benchmarks limits --clean 6 --named 12

makes what is missing of these figures, and prints them; without a number it prints what is there.

clean      bench cases of the blind benchmark's generator that hide nothing, to whose force each
           effect is added in turn, at 0.3 to 3 times its limit, as the library computes it

named      the same cases, four effects in each, added at the size that is said to be named 9 times
           of 10; the whole search for effects then names it, or not

A case holds where the limit that is told then allows the size that is there.
"""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np

from bristle.diagnosis.effect_limits import limit_of
from bristle.diagnosis.effect_size import Sized, SizeSearch
from bristle.diagnosis.prepared import Prepared
from bristle.diagnosis.site import diagnose_damper
from bristle.diagnosis.trials import joinable, judge
from bristle.identification.fit import refine
from bristle.identification.problem import Problem, Run
from bristle.model.model import Model

from ._answers import Answer, asked
from ._blind import cases
from ._blind.plan import make_plan
from ._blind.subject import halves, prepared
from ._rows import Row

SEED = 43
SIZES = (0.3, 3.0)
"""Least and largest size that is added, over the limit of the clean runs."""

EACH = 2
"""Sizes of each effect in a case."""

GROUPS = 4
"""Into how many cases the effects are divided that are to be named."""


def rows(done: dict[str, Answer]) -> list[Row]:
    """Return the rows of what has answers: all effects, and each."""
    return [
        *_counted(done, "clean", "limits at 95 %: sizes within", (0.92, 0.98)),
        *_counted(done, "named", "named at the size said for 9 of 10", (0.85, 0.95)),
    ]


def _counted(done: dict[str, Answer], kind: str, name: str, goal: tuple[float, float]) -> list[Row]:
    """Return the rows of one kind: all effects, and each."""
    held: dict[str, list[bool]] = {}
    for key, answer in done.items():
        for effect, found in answer.items() if json.loads(key)[0] == kind else ():
            held.setdefault(effect, []).extend(found)
    every = [one for found in held.values() for one in found]
    if not every:
        return []
    return [_row(name, every, goal), *(_row(f"  {one}", held[one]) for one in sorted(held))]


def _row(name: str, held: list[bool], goal: tuple[float, float] | None = None) -> Row:
    share = float(np.mean(held))
    measured = f"{share:.0%} of {len(held)}"
    if goal is None:
        return Row(name, measured)
    ratio = max(goal[0] / max(share, 1e-3), share / goal[1])
    return Row(name, measured, f"{goal[0]:.0%} to {goal[1]:.0%}", ratio)


def _answered(kind: str, number: int) -> Answer:
    """Return by effect whether what is told of a case holds."""
    return _within(number) if kind == "clean" else _named(number)


def _opened(number: int) -> Prepared:
    """Return a clean case as a diagnosis opens it."""
    task = [one for one in make_plan(SEED, 6 * number + 12, "none") if one.noise == 0.01][number]
    case = cases.load(task)
    return prepared(*halves(case), task.law)


def _clean(opened: Prepared) -> SizeSearch:
    deciding = sum(len(run.force) - run.skip for run in opened.held_out.runs)
    model = opened.before.model
    expected = opened.problem.expectation(model)
    return SizeSearch(opened.problem, model, expected, deciding, judging=opened.held_out)


def _within(number: int) -> Answer:
    """Return by effect whether the limits of a case hold the sizes that were added."""
    opened = _opened(number)
    rng, model = np.random.default_rng([SEED, number]), opened.before.model
    clean = _clean(opened)
    return {
        name: [_holds(name, clean, float(rng.uniform(*np.log(SIZES)))) for _ in range(EACH)]
        for name in joinable(model)
        if not limit_of(Sized(name, clean)).why
    }


def _named(number: int) -> Answer:
    """Return by effect whether a verdict names it at the size that it is said to be named from."""
    opened = _opened(number // GROUPS)
    model, clean = opened.before.model, _clean(opened)
    found = {}
    for name in joinable(model)[number % GROUPS :: GROUPS]:
        sized = Sized(name, clean)
        size = limit_of(sized).named
        if size is None:
            continue
        train, held_out = (
            problem.of(_added(problem, sized, size))
            for problem in (opened.problem, opened.held_out)
        )
        before = judge(refine(model, train, 6), train, held_out)
        again = replace(opened, problem=train, held_out=held_out, before=before)
        found[name] = [name in diagnose_damper(again)[0].effects]
    return found


def _added(problem: Problem, sized: Sized, value: float) -> list[Run]:
    """Return runs to whose force an effect is added."""
    with_it, without = sized.with_value(value), sized.without()
    return [
        replace(
            run, force=run.force + problem.predict(with_it, run) - problem.predict(without, run)
        )
        for run in problem.runs
    ]


def _known(problem: Problem, model: Model, deciding: int) -> SizeSearch:
    return SizeSearch(problem, model, problem.expectation(model), deciding)


def _holds(name: str, clean: SizeSearch, size: float) -> bool:
    """Return whether the limit allows an effect that was added, of a size [log of its limit]."""
    sized, problem = Sized(name, clean), clean.problem
    limit = limit_of(sized).largest
    assert limit is not None
    value = limit * float(np.exp(-size if sized.falls else size))
    added = problem.of(_added(problem, sized, value))
    found = limit_of(Sized(name, _known(added, refine(clean.model, added, 6), clean.held_out)))
    if found.largest is None:
        return True  # told as what these runs cannot show
    return value >= found.largest if sized.falls else value <= found.largest


run, main = asked("limits", __doc__, ("clean", "named"), _answered, rows)
