"""The equations of equilibrium above each storey, linear in stiffnesses and damping ratios.

Their cross products with instruments are summed over blocks of time, whose scatter gives the
covariance of what is solved for.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from ..errors import RecordError
from ..physics.building import Building
from .response import Response
from .simulated import simulated, stiffness_matrix

Array = NDArray[np.float64]

BLOCK = 0.5
"""Length [s] of the blocks whose sums are taken as independent, longer than a smoother's memory."""

BLOCKS = 20
"""Blocks that a run has at least: they are as long as the slowest period, where it is longer, for
what a linear building leaves of a rig that is not linear is correlated over that."""

SKIP = 25  # first samples, where the smoother still settles


class Modes(NamedTuple):
    """Angular frequencies [rad/s] and mass-normalised shapes (columns)."""

    omega: Array
    shapes: Array


def ratios_of(building: Building) -> Array:
    """Return the modal damping ratios that a building's C amounts to."""
    modes = modes_of(building, np.array(building.stiffnesses))
    diagonal = np.einsum("ir,ij,jr->r", modes.shapes, np.array(building.C), modes.shapes)
    return np.asarray(diagonal / (2.0 * modes.omega))


def modes_of(building: Building, stiffness: Array) -> Modes:
    """Return the modes of a building with other stiffnesses (n,) [N/m]."""
    values, shapes = eigh(stiffness_matrix(building, stiffness), np.array(building.M))
    return Modes(np.sqrt(np.maximum(values, 1e-12)), shapes)


class EquilibriumSystem:
    """The equations t_i = k_i d_i + sum_r zeta_r g_ir + offset_i above each level from `first` on.

    Unknowns are ordered: stiffnesses, ratios, offsets.
    """

    def __init__(
        self, building: Building, runs: list[Response], stiffness: Array, first: int
    ) -> None:
        n = building.size
        self.n, self.first, self.rows = n, first, n - first
        self.M = np.array(building.M)
        modes = modes_of(building, stiffness)
        weighted = self.M @ modes.shapes
        # Damping force above level i of mode r: above[i, r] times the mode's velocity.
        self.above = np.cumsum((2.0 * modes.omega * weighted)[::-1], axis=0)[::-1]
        self.modal = weighted.T
        total = np.cumsum(self.M[::-1], axis=0)[::-1]
        chain = np.cumsum(np.array(building.K)[::-1], axis=0)[::-1]
        drifts = chain @ np.tril(np.ones((n, n)))  # forces above each level by drift
        self.other = drifts - np.diag(building.stiffnesses)
        self.other[np.abs(self.other) < 1e-9 * np.abs(drifts).max()] = 0.0
        self.total = total
        noise = np.median([run.noise_a for run in runs], axis=0)
        cell = float(np.median([run.noise_force for run in runs]))
        x = np.median([run.std[:, 0] for run in runs], axis=0)
        drift = np.sqrt(x**2 + np.append(0.0, x[:-1]) ** 2)
        white = (total**2) @ noise**2
        if runs[0].force is not None and first == 0:
            white[0] += cell**2
        self.white = np.sqrt(white)
        self.noise = np.sqrt(white + (stiffness * drift) ** 2)

    def target(self) -> Array:
        """Return the signals' shares (n, 3 n + 2) in what each level's springs must carry."""
        n = self.n
        rows = np.zeros((n, 3 * n + 2))
        rows[:, :n] = -self.other
        rows[:, 2 * n : 3 * n] = -self.total
        rows[0, 3 * n] = -1.0
        return rows

    def regressors(self, i: int) -> Array:
        """Return the signals' shares (p, 3 n + 2) in the regressors of level i."""
        n, m = self.n, self.rows
        rows = np.zeros((2 * m + n, 3 * n + 2))
        rows[i - self.first, i] = 1.0
        rows[m : m + n, n : 2 * n] = self.above[i][:, None] * self.modal
        rows[m + n + i - self.first, 3 * n + 1] = 1.0
        return rows

    def instruments(self, i: int) -> Array:
        """Return the instruments' shares (p, 2 n + 1) for level i."""
        n = self.n
        rows = self.regressors(i)
        return np.hstack([rows[:, : 2 * n], rows[:, 3 * n + 1 :]])

    def solve(self, sums: Array, given: Array, free: NDArray[np.bool_]) -> tuple[Array, Array]:
        """Return the unknowns (p,) and their covariance, from blocks taken as independent.

        The damping ratios that are not `free` (n,) stay as `given`, with a variance of zero.
        """
        p = 2 * self.rows + self.n
        per_block_A = np.zeros((len(sums), p, p))
        per_block_b = np.zeros((len(sums), p))
        target = self.target()
        for i in range(self.first, self.n):
            W, R = self.instruments(i) / self.noise[i] ** 2, self.regressors(i)
            per_block_A += W @ sums @ R.T
            per_block_b += W @ sums @ target[i]
        m = self.rows
        theta, covariance = np.zeros(p), np.zeros((p, p))
        theta[m : m + self.n] = np.where(free, 0.0, given)
        kept = np.concatenate([np.ones(m, bool), free, np.ones(m, bool)])
        per_block_b = (per_block_b - per_block_A @ theta)[:, kept]
        per_block_A = per_block_A[:, kept][:, :, kept]
        A, b = per_block_A.sum(axis=0), per_block_b.sum(axis=0)
        scale = 1.0 / np.sqrt(np.maximum(np.abs(np.diag(A)), 1e-300))
        inverse = scale[:, None] * np.linalg.pinv(A * scale[:, None] * scale, rcond=1e-12) * scale
        found = inverse @ b
        scores = per_block_b - per_block_A @ found
        blocks = len(scores)
        meat = scores.T @ scores * blocks / max(blocks - 1, 1)
        theta[kept] = found
        covariance[np.ix_(kept, kept)] = inverse @ meat @ inverse.T
        return theta, covariance

    def split(self, theta: Array, stiffness: Array) -> tuple[Array, Array]:
        """Return stiffnesses (those below `first` as given) and damping ratios."""
        m = self.rows
        return np.concatenate([stiffness[: self.first], theta[:m]]), theta[m : m + self.n]


def cross_products(
    runs: list[Response], building: Building, stiffness: Array, zeta: Array, first: int, plain: bool
) -> Array:
    """Return cross products (blocks, 2 n + 1, 3 n + 2) of instruments with signals, all runs.

    Parameters
    ----------
    runs : responses of the building, of n levels
    building : its masses and matrices
    stiffness : (n,) N/m below each level, as it stands
    zeta : (n,) damping ratios of the modes, as they stand
    first : 1 where the force on the first level is unknown, else 0; see `simulated`
    plain : whether the measured motion is its own instrument, and not the simulated one

    Raises
    ------
    RecordError
        If a run has too few samples for two blocks.
    """
    parts = []
    for run in runs:
        n = building.size
        drift = np.diff(run.x, axis=0, prepend=np.zeros((1, run.x.shape[1])))
        force = run.force if run.force is not None else np.zeros_like(run.ground)
        one = np.ones((1, len(force)))
        signals = np.vstack([drift, run.v, run.a, force[None, :], one])
        if plain:
            shown = np.vstack([drift, run.v, one])
        else:
            x, v = simulated(run, building, stiffness, zeta, first)
            shown = np.vstack([np.diff(x, axis=0, prepend=np.zeros((1, x.shape[1]))), v, one])
        slowest = round(2.0 * np.pi / modes_of(building, stiffness).omega[0] / run.dt)
        size = max(10, round(BLOCK / run.dt))
        size = max(size, min(slowest, (signals.shape[1] - SKIP) // BLOCKS))
        whole = (signals.shape[1] - SKIP) // size
        if whole < 2:
            raise RecordError(
                f"{run.name}: {signals.shape[1]} samples; intervals need {2 * size + SKIP} or more."
            )
        end = SKIP + whole * size
        s = signals[:, SKIP:end].reshape(3 * n + 2, whole, size).transpose(1, 0, 2)
        w = shown[:, SKIP:end].reshape(2 * n + 1, whole, size).transpose(1, 0, 2)
        parts.append(w @ s.transpose(0, 2, 1))
    return np.concatenate(parts)
