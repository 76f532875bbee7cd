"""What these data could not show: the smallest visible share, and effects that leave no trace."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..compare.scale import rms
from ..identify.fit import Model, Problem
from ..identify.model import absorbed
from ..identify.search_context import Expected, Search
from ..identify.start_grid import initial_guesses
from ..physics.effect import effects_of
from .candidates import joinable
from .rule import BENCH, DecisionRule

Array = NDArray[np.float64]

BELOW = 0.9
"""A z below this is no chance: the noise expected was too large, as of a base that has friction and
no accelerometer, where room is left for jumps."""


def detectable(
    problem: Problem, expected: Expected, rule: DecisionRule = BENCH, z: float = 1.0
) -> float:
    """Return the smallest share of the force RMS that a missing effect must leave to be seen.

    It is what raises z by `rule.gain` over the noise expected of a true model.

    Parameters
    ----------
    problem : the runs
    expected : what a true model would show on each run; see `Problem.expectation`
    rule : the numbers that decide
    z : error over noise of the model; where it is below `BELOW`, the expected noise is too large
        and hides more
    """
    pairs = zip(problem.runs, expected, strict=True)
    force = np.concatenate([run.force[run.skip :][run.judged] for run in problem.runs])
    weight = np.concatenate([1.0 / one[1][run.skip :][run.judged] for run, one in pairs])
    # Noise as the residual sees it: a residual of share s has the excess s^2 mean(F^2/sigma^2).
    ratio = float(np.sqrt(np.mean(force**2) * np.mean(weight**2)))
    noise = z if z < BELOW else 1.0
    left = float(np.sqrt((1.0 + rule.gain) ** 2 - noise**2))
    return left / ratio if ratio > 0.0 else float("inf")


def untestable(
    model: Model,
    problem: Problem,
    expected: Expected,
    visible: float,
    rule: DecisionRule = BENCH,
    able: Sequence[str] | None = None,
) -> list[str]:
    """Return the effects that these runs do not excite, or that refitting the model absorbs.

    Those that a part of the law absorbs entirely, on whatever runs, are among them.

    Each effect is added at default size and scaled to `rule.typical`; what the sensitivities to the
    model's own parameters cannot absorb must reach `visible`.

    Parameters
    ----------
    model : the fitted model that effects join
    problem : the runs
    expected : what a true model would show on each run; see `Problem.expectation`
    visible : the detectable share of the force RMS; see `detectable`
    rule : the numbers that decide
    able : names of the effects that can join; None for those of a damper on a bench
    """
    free = model.free()
    search = Search(problem, model, expected, free)
    base = search.residuals(search.start)
    own = search.sensitivities() if free else np.zeros((len(base), 0))
    basis = np.linalg.qr(own / np.maximum(np.linalg.norm(own, axis=0), 1e-300))[0]
    sigma = np.concatenate(
        [s[run.skip :] for run, (_, s, _) in zip(problem.runs, expected, strict=True)]
    )
    force = np.concatenate([run.force[run.skip :] for run in problem.runs])
    size = rms(force / sigma)
    out = []
    for name in joinable(model) if able is None else able:
        change = _change(name, model, problem, expected, base)
        raw = rms(change) / size
        left = rms(change - basis @ (basis.T @ change)) / size
        if raw < rule.silent or rule.typical * left / raw < visible:
            out.append(name)
    taken_up = [e.name for e in effects_of("damper", model.law) if absorbed(e, model.law)]
    return sorted({*out, *(name for name in taken_up if name not in model.effects)})


def _change(name: str, model: Model, problem: Problem, expected: Expected, base: Array) -> Array:
    """Return by how much an effect changes the normalised residuals (n,), at most of its starts."""
    found = []
    for start in initial_guesses(name, model, problem):
        with_it = Search(problem, start, expected, [])
        found.append(with_it.residuals(with_it.start) - base)
    return max(found, key=rms)
