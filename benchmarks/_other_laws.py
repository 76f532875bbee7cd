"""Bench data of the laws that the blind benchmark's generator lacks, with or without an effect.

The forces are those of the library itself, integrated ten times finer than they are sampled: so
they test the choice of law and effects, not whether a law has the right form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bristle.data.measurement import Measurement
from bristle.diagnosis.trials import joinable
from bristle.identification.prepare import prepare
from bristle.identification.problem import Problem
from bristle.identification.start_grid import Search, initial_guesses
from bristle.model.model import Model
from bristle.physics.effect import effects_of

from .laws import recorded, truth_of

LAWS = ("bouc_wen", "tanh", "dahl", "modified_bouc_wen")

RUNS = ("train_1", "train_2", "train_3", "train_4", "holdout_1", "holdout_2")

LEAST, MOST = 0.1, 0.6
"""Share of the force that an effect must change, beyond what the law absorbs."""

SEED = 4100


@dataclass(frozen=True)
class Hidden:
    """What made the runs of a case: law, effects, the share of the force that these change."""

    law: str
    effects: tuple[str, ...]
    strength: float
    train: Sequence[Measurement]
    held_out: Sequence[Measurement]


def other_law(number: int, with_effect: bool) -> Hidden:
    """Return a case: laws take turns, effects are drawn.

    Parameters
    ----------
    number : of the case
    with_effect : whether an effect of the library is hidden
    """
    law = LAWS[number % len(LAWS)]
    rng = np.random.default_rng([SEED, number, int(with_effect)])
    values, effects, strength = truth_of(law, rng), tuple[str, ...](), 0.0
    if with_effect:
        effect, values, strength = _strong(Model(law, (), values), rng)
        effects = (effect,)
    runs = [recorded(law, values, rng, name, effects) for name in RUNS]
    return Hidden(law, effects, strength, runs[:4], runs[4:])


def _strong(model: Model, rng: np.random.Generator) -> tuple[str, dict[str, float], float]:
    """Return an effect that changes a law's force enough, the values with it, and by how much."""
    runs = [prepare(recorded(model.law, dict(model.values), rng, name)) for name in RUNS[:2]]
    problem = Problem(runs)
    expected = problem.expectation(model)
    search = Search(problem, model, expected, model.free())
    base = search.residuals(search.start)
    own = search.sensitivities()
    basis = np.linalg.qr(own / np.maximum(np.linalg.norm(own, axis=0), 1e-300))[0]
    sigma = np.concatenate([s[r.skip :] for r, (_, s, _) in zip(runs, expected, strict=True)])
    size = float(np.linalg.norm(np.concatenate([r.force[r.skip :] for r in runs]) / sigma))
    instruments = {one.name for one in effects_of("sensor")}
    able = [name for name in joinable(model) if name not in instruments]
    for name in rng.permutation(able).tolist():
        for guess in rng.permutation(np.array(initial_guesses(name, model, problem), dtype=object)):
            with_it = Search(problem, guess, expected, [])
            change = with_it.residuals(with_it.start) - base
            share = float(np.linalg.norm(change - basis @ (basis.T @ change))) / size
            if LEAST <= share <= MOST:
                return name, dict(guess.values), share
    raise ValueError(f"no effect changes the force of {model.law} by {LEAST:.0%} to {MOST:.0%}")
