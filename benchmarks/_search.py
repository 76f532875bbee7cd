"""Evolution of a design: CMA-ES, from Hansen (2016), The CMA Evolution Strategy: A Tutorial."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bristle.core.arrays import Array


def minimise(
    function: Callable[[Array], float], start: Array, spread: float, rounds: int, seed: int
) -> tuple[Array, float]:
    """Return the best point found and its value; ten points are tried per round.

    Parameters
    ----------
    start : (n,) array
        In units in which all coordinates matter alike.
    spread : float
        Standard deviation of the first round.
    """
    random = np.random.default_rng(seed)
    n, size = len(start), 10
    half = size // 2
    weights = np.log(half + 0.5) - np.log(np.arange(1, half + 1))
    weights /= weights.sum()
    effective = 1.0 / (weights**2).sum()
    c_path = (4.0 + effective / n) / (n + 4.0 + 2.0 * effective / n)
    c_step = (effective + 2.0) / (n + effective + 5.0)
    c_one = 2.0 / ((n + 1.3) ** 2 + effective)
    c_rank = min(
        1.0 - c_one, 2.0 * (effective - 2.0 + 1.0 / effective) / ((n + 2.0) ** 2 + effective)
    )
    damp = 1.0 + 2.0 * max(0.0, ((effective - 1.0) / (n + 1.0)) ** 0.5 - 1.0) + c_step
    expected = n**0.5 * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n))
    mean, path, step_path, C = start.astype(float), np.zeros(n), np.zeros(n), np.eye(n)
    best, least = mean, np.inf
    for k in range(rounds):
        lengths, axes = np.linalg.eigh(C)
        lengths = np.sqrt(np.maximum(lengths, 1e-20))
        moves = (random.standard_normal((size, n)) * lengths) @ axes.T
        values = np.array([function(mean + spread * move) for move in moves])
        order = np.argsort(values)
        if values[order[0]] < least:
            best, least = mean + spread * moves[order[0]], float(values[order[0]])
        chosen = moves[order[:half]]
        move = weights @ chosen
        mean = mean + spread * move
        step_path = (1.0 - c_step) * step_path
        step_path += (c_step * (2.0 - c_step) * effective) ** 0.5 * (
            axes @ ((axes.T @ move) / lengths)
        )
        length = float(np.linalg.norm(step_path))
        short = (
            length / (1.0 - (1.0 - c_step) ** (2 * k + 2)) ** 0.5
            < (1.4 + 2.0 / (n + 1.0)) * expected
        )
        path = (1.0 - c_path) * path + short * (c_path * (2.0 - c_path) * effective) ** 0.5 * move
        C = (1.0 - c_one - c_rank) * C + c_one * np.outer(path, path)
        C += c_rank * (chosen.T * weights) @ chosen
        spread *= float(np.exp(c_step / damp * (length / expected - 1.0)))
    return best, least
