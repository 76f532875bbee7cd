"""How well data determine a model's parameters: covariance, and what they do not identify."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .model import parameter
from .residuals import BLOCK, drawn_noise
from .scaled import Scaled
from .search import HUBER_AT_ONE, loss, mean_loss

Array = NDArray[np.float64]

_WEAK = 1e-6  # a singular value of the scaled Jacobian below this share of the largest is none
_MISFIT = 1.15  # z above which a residual is more than noise


def covariance_of(scaled: Scaled, theta: Array) -> tuple[Array, tuple[str, ...]]:
    """Return the covariance (p, p) [SI], and the names that the data do not identify.

    Covariance A^-1 B A^-1 of an M-estimator (Huber 1981, Robust Statistics, ch. 7): A = J'J over
    the samples within the quadratic part of the loss, B the covariance of J' psi under the drawn
    noise, white for the force's own. Where the residual is more than noise, B is taken from the
    residual itself, in blocks, so that a wrong model's intervals widen with its error.

    Parameters
    ----------
    scaled : the parameters and the residuals
    theta : (p,) where the search ended
    """
    r = scaled.residuals(theta)
    J = scaled.jacobian(theta, r)
    norms = np.linalg.norm(J, axis=0)
    safe = np.where(norms > 0.0, norms, 1.0)
    J = J / safe
    inner = np.abs(r) <= 2.0
    A = J[inner].T @ J[inner]
    values, vectors = np.linalg.eigh(A)
    weak = values <= _WEAK**2 * values[-1]
    inverse = (vectors * np.where(weak, 0.0, 1.0 / np.where(weak, 1.0, values))) @ vectors.T
    own, drawn = drawn_noise(scaled.problem, scaled.expected)
    B = (J * (own**2)[:, None]).T @ J
    if len(drawn) > 1:
        scores = np.array([J.T @ np.clip(e, -2.0, 2.0) for e in drawn])
        scores -= scores.mean(axis=0)
        B = B + scores.T @ scores / (len(drawn) - 1)
    if scaled.problem.excess or mean_loss(loss(r)) > _MISFIT**2 * HUBER_AT_ONE:
        B = _scores_of_blocks(J, r)
    covariance = inverse @ B @ inverse
    size = scaled.scale / safe
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0)) * size
    return covariance * np.outer(size, size), _lost(
        scaled, theta * scaled.scale, std, norms, vectors[:, weak]
    )


def _scores_of_blocks(J: Array, r: Array) -> Array:
    """Return the covariance (p, p) of J' psi, from blocks of samples taken as independent."""
    scores = J * np.clip(r, -2.0, 2.0)[:, None]
    edges = np.arange(0, len(r), min(BLOCK, max(1, len(r) // 20)))
    sums = np.add.reduceat(scores, edges, axis=0)
    sums -= sums.mean(axis=0)
    B: Array = sums.T @ sums
    return B


def _lost(
    scaled: Scaled, value: Array, std: Array, norms: Array, directions: Array
) -> tuple[str, ...]:
    """Name what does not move the force, is mixed up with others, or is wider than its size."""
    lost = []
    for i, name in enumerate(scaled.names):
        size = scaled.problem.size(parameter(scaled.model.law, name).unit)
        mixed = directions.size and float(np.max(np.abs(directions[i]))) > 0.3
        if norms[i] == 0.0 or mixed or std[i] > max(abs(value[i]), size):
            lost.append(name)
    return tuple(lost)
