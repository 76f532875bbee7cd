"""Whether the rivals of a class can be told apart at all on the data at hand, tested apart.

The test knows what no method knows, the noise-free answer of the specimen. Each rival is fitted
to the noise-free training runs; what it leaves of the noise-free held-out runs is a fixed curve.
With r_t left by the true effect and r_b by the rival, both over the noise s of a sample, the
log-likelihood of the data prefers the true effect by D = sum(r_b^2 - r_t^2)/(2 s^2) on average,
with the standard deviation of sum (r_b - r_t) n / s^2, n the noise. The best test there is
(Neyman & Pearson 1933, Phil. Trans. R. Soc. A 231, 289-337) then resolves the two by
D over that deviation. Below `score.RESOLVED` they are inseparable on these data.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from bristle.core.arrays import Array
from bristle.diagnosis.trials import short_search
from bristle.identification.fit import fit_from_starts, refine
from bristle.identification.prepare import prepare
from bristle.identification.problem import Problem, Run
from bristle.identification.start_grid import SearchContext, ranked_guesses
from bristle.model.model import Model

from . import cases, subject
from .cases import Recorded


def resolution(
    true: list[Array], rival: list[Array], noise: list[Array], draws: list[Array], own: list[float]
) -> float:
    """Return by how many standard deviations data prefer the true effect to a rival.

    Parameters
    ----------
    true, rival : per run (n,) N, what each leaves of the noise-free force
    noise : per run (n,) N, the standard deviation expected of a sample
    draws : per run (d, n) N, draws of the part of the noise that comes from the measured motion
    own : per run N, the standard deviation of the force channel, white
    """
    gain, white = 0.0, 0.0
    carried = np.zeros(min(len(d) for d in draws))
    for t, b, s, d, f in zip(true, rival, noise, draws, own, strict=True):
        weight = (b - t) / s**2
        gain += float(np.sum((b**2 - t**2) / s**2)) / 2.0
        white += float(np.sum(weight**2)) * f**2
        carried += d[: len(carried)] @ weight
    spread = np.sqrt(white + float(np.mean(carried**2)))
    return gain / float(spread) if spread > 0.0 else 0.0


def follow_up(case: Recorded, answer: dict[str, Any], experiment: Any) -> dict[str, Any]:
    """Return what only the generator can add to a class: can it be told apart, what did a run do.

    `resolved` rival -> standard deviations; `separated` the verdict after the proposed experiment.
    """
    found = case.truth["effects"]
    if (
        answer["kind"] != "ambiguous"
        or len(found) != 1
        or found[0]["effect"] not in answer["effects"]
    ):
        return {}
    made = cases.make(case.task)
    more: dict[str, Any] = {"resolved": resolve(case, made, answer["effects"])}
    if experiment is not None:
        more["separated"] = subject.perform(case, made, experiment)
    return more


def resolve(case: Recorded, made: Any, rivals: list[str]) -> dict[str, float]:
    """Return for each rival of the hidden effect how well these data resolve the two."""
    true = str(case.truth["effects"][0]["effect"])
    noisy = Problem([prepare(m) for m in subject.measurements(case.part("holdout"), case.channels)])
    train, held = (
        Problem([as_run(run, case.channels, noisy.runs[0].noise) for run in made.clean(role)])
        for role in ("train", "holdout")
    )
    base = fit_from_starts(train, Model(case.task.law), starts=2).model
    fits = {name: best_of(name, base, train) for name in (true, *rivals)}
    expected = noisy.expectation(fits[true])
    left = {name: _left(one, held) for name, one in fits.items()}
    skip = [run.skip for run in held.runs]
    noise = [e[1][k:] for e, k in zip(expected, skip, strict=True)]
    draws = [e[2][:, k:] for e, k in zip(expected, skip, strict=True)]
    own = [run.noise for run in noisy.runs]
    return {
        name: resolution(left[true], left[name], noise, draws, own)
        for name in rivals
        if name != true
    }


def best_of(name: str, base: Model, train: Problem) -> Model:
    """Return a model with one more effect, searched as a diagnosis does and refined."""
    context = SearchContext(base, train)
    guesses = short_search(name, context, ranked_guesses(name, context))
    return refine(guesses.model, train, sweeps=24)


def _left(model: Model, problem: Problem) -> list[Array]:
    return [run.force[run.skip :] - problem.predict(model, run)[run.skip :] for run in problem.runs]


def as_run(run: dict[str, Any], channels: tuple[str, ...], noise: float) -> Run:
    """Return a noise-free run as it is, its weights those of noisy data: nothing is smoothed."""
    time = run["time"]
    step = float(time[1] - time[0])
    return Run(
        run["name"], step, run["displacement"], run["velocity"],
        np.gradient(run["velocity"], step), run["voltage"], run["force"], noise,
        np.zeros((0, len(time), 4)),
    )  # fmt: skip
