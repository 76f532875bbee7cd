"""The effect of the library that comes nearest to what a closure carries."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..comparison.names import effect_name
from ..core.arrays import Array
from ..core.progress import tell
from ..core.text import percent, quantity
from ..diagnosis.prepared import Prepared
from ..diagnosis.trials import Trial, guesses_of, joinable, judge, short_search
from ..identification.problem import Problem
from ..identification.search import in_threads
from ..identification.start_grid import SearchContext, refine
from ..model.model import Model
from ..physics.drive import DRIVES, unit_for
from ..physics.effect import EFFECTS

LOOKED = 3
"""Effects that are searched, of those whose first steps come nearest."""

SWEEPS = 12
"""Jacobians of the refit of the nearest one to the runs themselves."""

NEAR = 0.3
"""Share of what a closure carries from which on an effect is named as near to it."""


@dataclass(frozen=True)
class Nearest:
    """The effect that comes nearest to what a network carries, and how it does in its place.

    `explains` its share of the network's squared force that the model alone cannot take over;
    `trial` the model with it, fitted to the runs.
    """

    effect: str
    explains: float
    trial: Trial

    def sentence(self, drive: str) -> str:
        """Return what is said of it; `drive` is the command's channel."""
        share, name = f"{100.0 * self.explains:.0f} %", effect_name(self.effect)
        if self.explains < NEAR:
            return (
                f"No effect of the library is near: the nearest, {name}, explains {share} of what "
                "the network carries."
            )
        effect, values = EFFECTS[self.effect], self.trial.model
        sizes = ", ".join(
            f"{own} = {quantity(values.value(f'{self.effect}.{own}'), unit)}"
            for own, one in effect.parameters.items()
            if own not in effect.assumed
            for unit in (unit_for(one.unit, DRIVES[drive]),)
        )
        error = self.trial.error
        left = f" leaves {percent(error.headline[1])} of the force" if error is not None else ""
        return (
            f"Nearest in the library: {name}, which explains {share} of what the network carries. "
            f"In its place, fitted to the runs, it{left or ' was tried'} ({sizes})."
        )


def nearest_effect(
    prepared: Prepared, base: Model, train: Problem, carried: Sequence[Array]
) -> Nearest | None:
    """Return the effect of the library that comes nearest to what a network carries.

    Every effect that can join is fitted, with the model, to the model's force with the network's.

    Parameters
    ----------
    prepared : the runs that judge
    base : the model that the network is beside
    train : runs of the training
    carried : per run of them the network's force (n,) [N]
    """
    forces = [train.predict(base, run) for run in train.runs]
    runs = [
        replace(run, force=force + own)
        for run, force, own in zip(train.runs, forces, carried, strict=True)
    ]
    told = train.of(runs)
    told.free_zero = False
    tell("comparing the closure with the effects of the library")
    context, alone = SearchContext(base, told), _left(told, refine(base, told, SWEEPS))
    names = joinable(base, prepared.shown, told)
    if not names or alone <= 0.0:
        return None
    guesses = guesses_of(names, context)
    able = sorted(names, key=lambda name: guesses[name][0].cost)[:LOOKED]
    ends = in_threads(lambda name: short_search(name, context, guesses[name], True).model, able)
    left = [_left(told, end) for end in ends]
    k = int(np.argmin(left))
    trial = judge(refine(ends[k], train, SWEEPS), train, prepared.held_out)
    return Nearest(able[k], max(0.0, 1.0 - left[k] / alone), trial)


def _left(problem: Problem, model: Model) -> float:
    """Return the sum of the squared errors of a model over the samples that count [N2]."""
    errors = [(run.force - problem.predict(model, run))[run.skip :] for run in problem.runs]
    return float(
        sum(np.sum(one[run.judged] ** 2) for one, run in zip(errors, problem.runs, strict=True))
    )
