"""The linear law of a layer or storey fitted to its runs, in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from ..physics.inputs import Inputs
from ..physics.laws import LAWS, Law
from .fit import Fit
from .model import Model, Run
from .structure import StructureProblem, StructureRun

Array = NDArray[np.float64]

DAMPING = "c"
"""The parameter of the linear laws that adds to the building's own damping."""


def fit_line(problem: StructureProblem, law: str) -> Fit:
    """Return the linear law fitted to a problem, by weighted linear least squares in three passes.

    The weights are those of Huber's loss at the expected noise. What the building and the line
    damp together stays above zero; where the data push below, `c` is at its bound, without a
    standard deviation. The bound goes along in the model's `limits`.
    """
    names = list(LAWS[law].parameters)
    limits = {DAMPING: (-problem.damped, float("inf"))} if np.isfinite(problem.damped) else {}
    model = Model(law, (), dict.fromkeys(names, 0.0), limits=limits)
    bounds = np.array([model.bounds(name) for name in names]).T
    columns = [line_columns(run, LAWS[law]) for run in problem.runs]
    A = np.concatenate(columns)
    force = np.concatenate([run.force for run in problem.runs])
    noise = [max(run.noise, 1e-300) for run in problem.runs]
    sigma = np.repeat(noise, [len(run.force) for run in problem.runs])
    weight = np.ones(len(force))
    scale = np.maximum(np.sqrt(np.mean(A**2, axis=0)), 1e-300)
    theta = np.zeros(len(names))
    for _ in range(4):
        w = np.sqrt(weight) / sigma
        theta = _within(A / scale * w[:, None], force * w, bounds * scale)
        z = np.abs(force - A @ (theta / scale)) / sigma
        spread = max(1.0, float(np.median(z)) / 0.6745)
        weight = np.minimum(1.0, 2.0 * spread / np.maximum(z, 1e-300))
    theta = theta / scale
    model = replace(model, values=dict(zip(names, theta.tolist(), strict=True)))
    z = (force - A @ theta) / sigma
    cost = float(np.mean(np.where(np.abs(z) <= 2.0, 0.5 * z * z, 2.0 * np.abs(z) - 2.0)))
    free = [name for name in names if not (name == DAMPING and at_bound(model))]
    covariance = _line_covariance(
        problem, model, [part[:, [names.index(n) for n in free]] for part in columns]
    )
    std = dict(zip(free, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    return Fit(model, std, cost, covariance=covariance)


def _within(A: Array, b: Array, bounds: Array) -> Array:
    """Return the least squares solution (p,) of A theta = b within bounds (2, p)."""
    theta = np.linalg.lstsq(A, b, rcond=1e-10)[0]
    if np.all((bounds[0] <= theta) & (theta <= bounds[1])):
        return np.asarray(theta)
    Q, R = np.linalg.qr(A)
    return np.asarray(lsq_linear(R, Q.T @ b, (bounds[0], bounds[1]), method="bvls").x)


def at_bound(model: Model, name: str = DAMPING) -> bool:
    """Return whether a line's parameter is at its lower bound."""
    low, _ = model.bounds(name)
    return bool(np.isfinite(low) and model.value(name) <= low + 1e-9 * abs(low))


def _line_covariance(problem: StructureProblem, model: Model, columns: list[Array]) -> Array:
    """Return the covariance (p, p) of the parameters whose columns (n, p) are given.

    By the sandwich formula with the drawn, correlated noise.
    """
    count = columns[0].shape[1]
    bread, meat = np.zeros((count, count)), np.zeros((count, count))
    scores: list[Array] = []
    expected = problem.expectation(model)
    for run, part, (_, sigma, spread) in zip(problem.runs, columns, expected, strict=True):
        J = part / sigma[:, None]
        bread += J.T @ J
        meat += (J * (run.noise / sigma)[:, None] ** 2).T @ J
        own = (spread / sigma) @ J
        scores = [a + b for a, b in zip(scores, own, strict=True)] if scores else list(own)
    found = np.array(scores)
    inverse = np.linalg.pinv(bread)
    covariance: Array = inverse @ (meat + found.T @ found / max(len(found), 1)) @ inverse
    return covariance


def line_columns(run: Run, law: type[Law]) -> Array:
    """Return the force (n, p) of each parameter of a linear law at 1, the others at zero."""
    whole, keep = (run.whole, run.keep) if isinstance(run, StructureRun) else (run, slice(None))
    assert whole is not None
    q = Inputs(*whole.smoothed, 0.0, 0.0, False)
    zero, none = np.zeros_like(q.x), dict.fromkeys(law.parameters, 0.0)
    own = [law.hooks()["force"](q, (), law.at({**none, name: 1.0})) for name in law.parameters]
    return np.column_stack([whole.seen(zero + force)[keep] for force in own])
