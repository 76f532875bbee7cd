"""Equilibrium above each storey, and the forces that it gives.

The force of a damper that no load cell shows is in those above every storey that it acts across.
Where it acts across several, those above neighbouring ones are subtracted, which leaves the
equilibrium of the level between them; the one above the highest is left out.

Their cross products with instruments are summed over blocks of time, whose scatter gives the
covariance of what is solved for.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh
from scipy.signal import cont2discrete, lfilter, ss2tf

from ..core.arrays import Array, Flags
from ..errors import RecordError
from ..physics.building import GROUND, Building, Device
from .building_motion import Response

# The response that a building shows to a measured excitation, mode by mode.


def stiffness_matrix(building: Building, stiffness: Array) -> Array:
    """Return K (n, n) with other stiffnesses [N/m] below the levels."""
    K = np.array(building.K)
    for i, change in enumerate(stiffness - np.array(building.stiffnesses)):
        K[i, i] += change
        if i:
            K[i - 1, i - 1] += change
            K[i - 1, i] -= change
            K[i, i - 1] -= change
    return K


def loads_on(run: Response, unknown: Device | None = None) -> Array:
    """Return the forces (n, samples) [N] of devices on the levels, as far as they are known.

    Parameters
    ----------
    run : with the forces that were measured
    unknown : a damper whose force was not measured in every run, and counts in none
    """
    n = len(run.x)
    loads = np.zeros((n, run.x.shape[1]))
    for load in run.loads if unknown is None else run.others:
        loads += np.outer(load.device.incidence(n), load.force)
    return loads


def simulated(
    run: Response, building: Building, stiffness: Array, zeta: Array, unknown: Device | None
) -> tuple[Array, Array]:
    """Return the displacements and velocities (n, samples) [m, m/s] that a building shows to a run.

    Parameters
    ----------
    run : the response whose ground motion, force and first state are taken
    building : its masses and matrices, of n levels
    stiffness : (n,) N/m below each level, in place of the building's
    zeta : (n,) damping ratios of the modes
    unknown : the damper whose force was not measured: the measured motion across it then drives
        the rest, its upper end and all above by that much; None where there is none
    """
    M, K = np.array(building.M), stiffness_matrix(building, stiffness)
    n = building.size
    load = -np.outer(M.sum(axis=1), run.ground) - loads_on(run, unknown)
    if unknown is None:
        free, ratios = np.eye(n), zeta
        driven_x, driven_v = np.zeros_like(run.x), np.zeros_like(run.v)
        start_x, start_v = run.x[:, 0], run.v[:, 0]
    else:
        # q = free y + above s: what the damper does to y is its force times b free = 0.
        kept = np.arange(n) != unknown.upper
        above = (np.arange(n) >= unknown.upper).astype(float)
        free, ratios = np.eye(n)[:, kept], zeta[1:]
        x, v, a = run.x[unknown.upper], run.v[unknown.upper], run.a[unknown.upper]
        if unknown.lower == GROUND:
            a = a - run.ground
        else:
            free[unknown.upper, unknown.lower] = 1.0
            x, v = x - run.x[unknown.lower], v - run.v[unknown.lower]
            a = a - run.a[unknown.lower]
        driven_x, driven_v = np.outer(above, x), np.outer(above, v)
        load -= np.outer(M @ above, a) + np.outer(K @ above, x)
        start_x, start_v = (run.x - driven_x)[kept, 0], (run.v - driven_v)[kept, 0]
    M, K, load = free.T @ M @ free, free.T @ K @ free, free.T @ load
    values, shapes = eigh(K, M)
    omega = np.sqrt(np.maximum(values, 1e-12))
    forces, x, v = shapes.T @ load, [], []
    for r in range(len(omega)):
        begin = (float(shapes[:, r] @ M @ start_x), float(shapes[:, r] @ M @ start_v))
        # An instrument of a mode must die out, whatever its ratio looks like in between.
        own = _oscillator(float(omega[r]), max(float(ratios[r]), 1e-3), forces[r], run.dt, begin)
        x.append(own[0])
        v.append(own[1])
    shown = free @ shapes
    return shown @ np.array(x) + driven_x, shown @ np.array(v) + driven_v


def _oscillator(
    omega: float, zeta: float, force: Array, dt: float, begin: tuple[float, float]
) -> tuple[Array, Array]:
    """Return position and velocity (n,) of p'' + 2 zeta omega p' + omega^2 p = force.

    Exact for a force that is linear between samples.
    """
    A = np.array([[0.0, 1.0], [-(omega**2), -2.0 * zeta * omega]])
    state = cont2discrete((A, np.array([[0.0], [1.0]]), np.eye(2), np.zeros((2, 1))), dt, "foh")
    numerator, denominator = ss2tf(*state[:4])
    damped = omega * np.sqrt(max(1.0 - zeta**2, 1e-12))
    decay = zeta * omega
    time = np.arange(len(force)) * dt
    fade, phase = np.exp(-decay * time), damped * time
    side = (begin[1] + decay * begin[0]) / damped
    x = fade * (begin[0] * np.cos(phase) + side * np.sin(phase))
    v = -decay * x + damped * fade * (side * np.cos(phase) - begin[0] * np.sin(phase))
    return (
        x + lfilter(numerator[0], denominator, force),
        v + lfilter(numerator[1], denominator, force),
    )


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


class Equations(NamedTuple):
    """Which equations of equilibrium have no unknown force.

    `levels` (m,): the level that each is named by; `weights` (m, n): how the equilibria of the
    levels are summed in each; `springs` (m, n): how often the spring below each level is in it;
    `told` the springs that are in any.
    """

    levels: tuple[int, ...]
    weights: Array
    springs: Array
    told: tuple[int, ...]


def equations_of(n: int, unknown: Device | None = None) -> Equations:
    """Return the equations of a building of n levels that are free of a damper's force.

    Parameters
    ----------
    n : how many levels
    unknown : the damper whose force was not measured, None where there is none
    """
    levels, weights = [], []
    for i in range(n):
        if unknown is None or not unknown.crosses(i):
            levels.append(i)
            weights.append([float(j >= i) for j in range(n)])
        elif i < unknown.upper:
            levels.append(i)
            weights.append([float(j == i) for j in range(n)])
    W = np.array(weights).reshape(len(levels), n)
    springs = np.diff(W, axis=1, prepend=0.0)
    told = np.flatnonzero(np.any(springs != 0.0, axis=0))
    return Equations(tuple(levels), W, springs, tuple(told.tolist()))


class EquilibriumSystem:
    """The equations t_i = sum_j s_ij k_j d_j + sum_r zeta_r g_ir + offset_i, row by row.

    Unknowns are ordered: the stiffnesses that are told, ratios, offsets.

    Parameters
    ----------
    building : its masses and matrices, of n levels
    runs : its responses
    stiffness : (n,) N/m below each level, as it stands
    unknown : the damper whose force was not measured, None where there is none
    """

    def __init__(
        self, building: Building, runs: list[Response], stiffness: Array, unknown: Device | None
    ) -> None:
        n = building.size
        self.n, self.unknown, self.equations = n, unknown, equations_of(n, unknown)
        W, springs = self.equations.weights, self.equations.springs
        self.told, self.rows = list(self.equations.told), len(W)
        self.M = np.array(building.M)
        modes = modes_of(building, stiffness)
        weighted = self.M @ modes.shapes
        # Damping force in equation i of mode r: above[i, r] times the mode's velocity.
        self.above = W @ (2.0 * modes.omega * weighted)
        self.modal = weighted.T
        total = W @ self.M
        drifts = W @ np.array(building.K) @ np.tril(np.ones((n, n)))  # forces by drift
        self.other = drifts - springs * np.array(building.stiffnesses)
        self.other[np.abs(self.other) < 1e-9 * np.abs(drifts).max()] = 0.0
        self.total = total
        noise = np.median([run.noise_a for run in runs], axis=0)
        x = np.median([run.std[:, 0] for run in runs], axis=0)
        drift = np.sqrt(x**2 + np.append(0.0, x[:-1]) ** 2)
        white = (total**2) @ noise**2
        for k, load in enumerate(runs[0].loads if unknown is None else runs[0].others):
            cells = [(run.loads if unknown is None else run.others)[k].noise for run in runs]
            share = W @ np.array(load.device.incidence(n))
            white += (share * float(np.median(cells))) ** 2
        self.white = np.sqrt(white)
        self.noise = np.sqrt(white + springs**2 @ (stiffness * drift) ** 2)

    def target(self) -> Array:
        """Return the signals' shares (m, 4 n + 1) in what the springs of each row must carry."""
        n = self.n
        rows = np.zeros((self.rows, 4 * n + 1))
        rows[:, :n] = -self.other
        rows[:, 2 * n : 3 * n] = -self.total
        rows[:, 3 * n : 4 * n] = -self.equations.weights
        return rows

    def regressors(self, i: int) -> Array:
        """Return the signals' shares (p, 4 n + 1) in the regressors of row i."""
        n, k = self.n, len(self.told)
        rows = np.zeros((k + n + self.rows, 4 * n + 1))
        rows[np.arange(k), self.told] = self.equations.springs[i, self.told]
        rows[k : k + n, n : 2 * n] = self.above[i][:, None] * self.modal
        rows[k + n + i, 4 * n] = 1.0
        return rows

    def instruments(self, i: int) -> Array:
        """Return the instruments' shares (p, 2 n + 1) for row i."""
        n = self.n
        rows = self.regressors(i)
        return np.hstack([rows[:, : 2 * n], rows[:, 4 * n :]])

    def solve(self, sums: Array, given: Array, free: Flags) -> tuple[Array, Array]:
        """Return the unknowns (p,) and their covariance, from blocks taken as independent.

        The damping ratios that are not `free` (n,) stay as `given`, with a variance of zero.
        """
        m = len(self.told)
        p = m + self.n + self.rows
        per_block_A = np.zeros((len(sums), p, p))
        per_block_b = np.zeros((len(sums), p))
        target = self.target()
        for i in range(self.rows):
            W, R = self.instruments(i) / self.noise[i] ** 2, self.regressors(i)
            per_block_A += W @ sums @ R.T
            per_block_b += W @ sums @ target[i]
        theta, covariance = np.zeros(p), np.zeros((p, p))
        theta[m : m + self.n] = np.where(free, 0.0, given)
        kept = np.concatenate([np.ones(m, bool), free, np.ones(self.rows, bool)])
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
        """Return stiffnesses (those that are not told as given) and damping ratios."""
        m, found = len(self.told), stiffness.copy()
        found[self.told] = theta[:m]
        return found, theta[m : m + self.n]


def judged(run: Response, unknown: Device | None) -> Flags:
    """Return where all was measured that the equations of a run take (n,).

    Parameters
    ----------
    run : response of the building
    unknown : the damper whose force is in no equation, None where there is none
    """
    if run.known is None:
        return np.ones(run.x.shape[1], dtype=np.bool_)
    there = run.known.equilibrium()
    return there & run.known.force if unknown is None and run.force is not None else there


def cross_products(
    runs: list[Response], building: Building, stiffness: Array, zeta: Array,
    unknown: Device | None, plain: bool,
) -> Array:  # fmt: skip
    """Return cross products (blocks, 2 n + 1, 4 n + 1) of instruments with signals, all runs.

    Parameters
    ----------
    runs : responses of the building, of n levels
    building : its masses and matrices
    stiffness : (n,) N/m below each level, as it stands
    zeta : (n,) damping ratios of the modes, as they stand
    unknown : the damper whose force was not measured, None where there is none; see `simulated`
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
        one = np.ones((1, run.x.shape[1]))
        signals = np.vstack([drift, run.v, run.a, loads_on(run, unknown), one])
        if plain:
            shown = np.vstack([drift, run.v, one])
        else:
            x, v = simulated(run, building, stiffness, zeta, unknown)
            shown = np.vstack([np.diff(x, axis=0, prepend=np.zeros((1, x.shape[1]))), v, one])
        shown = shown * judged(run, unknown)  # what was not measured is in no sum
        slowest = round(2.0 * np.pi / modes_of(building, stiffness).omega[0] / run.dt)
        size = max(10, round(BLOCK / run.dt))
        size = max(size, min(slowest, (signals.shape[1] - SKIP) // BLOCKS))
        whole = (signals.shape[1] - SKIP) // size
        if whole < 2:
            raise RecordError(
                f"{run.name}: {signals.shape[1]} samples; intervals need {2 * size + SKIP} or more."
            )
        end = SKIP + whole * size
        s = signals[:, SKIP:end].reshape(4 * n + 1, whole, size).transpose(1, 0, 2)
        w = shown[:, SKIP:end].reshape(2 * n + 1, whole, size).transpose(1, 0, 2)
        parts.append(w @ s.transpose(0, 2, 1))
    return np.concatenate(parts)


# The force of a building's damper that no load cell shows, from equilibrium.
#
# Its error is that of the accelerometers, which is white, and that of the smoothed motion times
# springs and damping, which is correlated in time: that part is drawn with the error of the motion,
# so that it counts in intervals as it is.


class Reconstructed(NamedTuple):
    """A damper's force by equilibrium.

    `force` (n,) [N]; `noise` its standard deviation [N]; `white` that of the part that is white, of
    accelerometers and load cells; `error` (d, n) [N] draws of the other part, the motion's.
    """

    force: Array
    noise: float
    white: float
    error: Array


def reconstructed(
    response: Response, building: Building, linear_storeys: bool = True
) -> Reconstructed:
    """Return the damper's force by equilibrium.

    Of the equilibrium of all masses above a storey that the damper acts across, and the two ends'
    own, the one with the least noise is taken: that of the accelerometers, and what the smoother
    leaves uncertain of the motion, times the building's masses, springs and damping.

    Parameters
    ----------
    response : the run, its motion smoothed
    building : whose equilibrium gives the force
    linear_storeys : whether storeys are linear, as a level's own equilibrium needs
    """
    device, n = response.device, building.size
    able = [np.arange(n) >= i for i in range(device.lower + 1, device.upper + 1)]
    weights = [one.astype(np.float64) for one in able]
    if linear_storeys:
        ends = ((device.upper, 1.0), (device.lower, -1.0))
        weights += [sign * np.eye(n)[level] for level, sign in ends if level != GROUND]
    found = [_weighted(response, building, one) for one in weights]
    return min(found, key=lambda one: one.noise)


def _weighted(response: Response, building: Building, weights: Array) -> Reconstructed:
    """Return the damper's force by a sum of the levels' equilibria in which it counts once.

    Parameters
    ----------
    response, building : as in `reconstructed`
    weights : (n,) how often each level's equilibrium counts
    """
    M, C, K = (weights @ np.array(part) for part in (building.M, building.C, building.K))
    K[np.abs(K) < 1e-12 * np.abs(np.array(building.K)).max()] = 0.0  # rounding of springs above
    x, error = response.x, response.draws
    lower, upper = response.device.levels
    if response.across is not None and np.flatnonzero(K).tolist() == [lower, upper]:
        # The spring beside the damper takes its displacement, which is known better.
        x, error = x.copy(), error.copy()
        x[upper] = x[lower] + response.across.x
        error[upper, :, :, 0] = error[lower, :, :, 0] + response.across.draws[:, :, 0]
    force = -(M @ response.a + C @ response.v + K @ x)
    white = float(np.sum((M * response.white_a) ** 2))
    for other in response.others:
        share = float(weights @ np.array(other.device.incidence(building.size)))
        force, white = force - share * other.force, white + (share * other.noise) ** 2
    smooth = float(np.sum((K * response.std[:, 0]) ** 2) + np.sum((C * response.std[:, 1]) ** 2))
    inertia = response.smoothed_inertia(M)
    smooth += float(np.mean(inertia**2)) if len(inertia) else 0.0
    drawn = np.einsum("i,idn->dn", K, error[..., 0]) + np.einsum("i,idn->dn", C, error[..., 1])
    drawn += inertia
    if len(drawn) > 1:  # in the mean nothing is known of it
        drawn = (drawn - drawn.mean(axis=0)) * np.sqrt(len(drawn) / (len(drawn) - 1))
    return Reconstructed(force, float(np.sqrt(white + smooth)), float(np.sqrt(white)), drawn)
