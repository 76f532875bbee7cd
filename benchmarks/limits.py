"""How often the limits that a verdict tells hold the size of an effect that is there.

    python -m benchmarks limits --clean 6

makes what is missing of these figures, and prints them; without a number it prints what is there.

clean      bench cases of the blind benchmark's generator that hide nothing, to whose force each
           effect is added in turn, at 0.3 to 3 times its limit, as the library computes it

A case holds where the limit that is told then allows the size that is there.
"""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np

from bristle.diagnose.candidates import joinable
from bristle.diagnose.effect_limits import limit_of
from bristle.diagnose.effect_size import Known, Sized
from bristle.diagnose.opening import Insufficient, opening
from bristle.identify.model import Model, Problem
from bristle.identify.search_context import refine

from ._answers import Answer, Answers, ask
from ._blind import cases
from ._blind.plan import make_plan
from ._blind.subject import measurements
from ._rows import Row

SEED = 43
SIZES = (0.3, 3.0)
"""Least and largest size that is added, over the limit of the clean runs."""

EACH = 2
"""Sizes of each effect in a case."""


def run() -> list[Row]:
    """Return the rows of what has been made so far."""
    return rows(Answers("limits").kept())


def main(given: list[str]) -> int:
    """Make what is missing of the figures, print them."""
    return ask("limits", __doc__, ("clean",), _answered, rows, given)


def rows(done: dict[str, Answer]) -> list[Row]:
    """Return the rows of what has answers: all effects, and each."""
    held: dict[str, list[bool]] = {}
    for answer in done.values():
        for effect, found in answer.items():
            held.setdefault(effect, []).extend(found)
    every = [one for found in held.values() for one in found]
    if not every:
        return []
    out = [_row("limits at 95 %: sizes within", every, "92 to 98 %")]
    return out + [_row(f"limits at 95 %: {name}", held[name], "") for name in sorted(held)]


def _row(name: str, held: list[bool], goal: str) -> Row:
    share = float(np.mean(held))
    ratio = max(0.92 / max(share, 1e-3), share / 0.98) if goal else None
    return Row(name, f"{share:.0%} of {len(held)}", goal, ratio)


def _answered(_kind: str, number: int) -> Answer:
    """Return by effect whether the limits of a case hold the sizes that were added."""
    task = [one for one in make_plan(SEED, 6 * number + 12, "none") if one.noise == 0.01][number]
    case = cases.load(task)
    opened = opening(
        *(measurements(case.part(role), case.channels) for role in ("train", "holdout")),
        Model(task.law),
    )
    if isinstance(opened, Insufficient):
        raise RuntimeError(json.dumps(opened.reasons))
    deciding = sum(len(run.force) - run.skip for run in opened.held_out.runs)
    rng, model = np.random.default_rng([SEED, number]), opened.before.model
    clean = _known(opened.problem, model, deciding)
    return {
        name: [_holds(name, clean, float(rng.uniform(*np.log(SIZES)))) for _ in range(EACH)]
        for name in joinable(model)
        if not limit_of(Sized(name, clean)).why
    }


def _known(problem: Problem, model: Model, deciding: int) -> Known:
    return Known(problem, model, problem.expectation(model), deciding)


def _holds(name: str, clean: Known, size: float) -> bool:
    """Return whether the limit allows an effect that was added, of a size [log of its limit]."""
    sized, problem = Sized(name, clean), clean.problem
    limit = limit_of(sized).largest
    assert limit is not None
    value = limit * float(np.exp(-size if sized.falls else size))
    with_it, without = sized.with_value(value), sized.without()
    runs = [
        replace(
            run, force=run.force + problem.predict(with_it, run) - problem.predict(without, run)
        )
        for run in problem.runs
    ]
    added = problem.of(runs)
    found = limit_of(Sized(name, _known(added, refine(clean.model, added, 6), clean.held_out)))
    if found.largest is None:
        return True  # told as what these runs cannot show
    return value >= found.largest if sized.falls else value <= found.largest
