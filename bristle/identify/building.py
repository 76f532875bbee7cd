"""A building's stiffnesses and damping ratios from its response, its masses known.

Equilibrium above each storey is linear in them. Least squares would be biased: the drift that a
storey's shear is held against is the small difference of two noisy displacements. So the equations
are weighted with instruments, the response that the building found so far shows to the measured
excitation, which know nothing of the noise on drifts and accelerations (refined instrumental
variables: Young 1976, Automatica 12(3), 291-294; Soderstrom & Stoica 1983, Instrumental Variable
Methods for System Identification).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from ..data.measurement import Measurement
from ..errors import RecordError
from ..physics.building import Building
from .response import Response, responses
from .search import z_scale
from .simulated import simulated, stiffness_matrix

Array = NDArray[np.float64]

ROUNDS = 4
"""Rounds of instruments after the first, plain one."""

LOOSER = 64.0
"""Factor on the smoother's jerk: its corner at twice the frequency, for it would take a ten
thousandth off the drifts at the highest mode, as much as their standard deviation."""

BLOCK = 0.5
"""Length [s] of the blocks whose sums are taken as independent, longer than a smoother's memory."""

BLOCKS = 20
"""Blocks that a run has at least: they are as long as the slowest period, where it is longer, for
what a linear building leaves of a rig that is not linear is correlated over that."""

MISFIT = 1.5
"""z above which what equilibrium leaves is not noise, and the answer says so."""

LOST = 0.5
"""Relative standard deviation above which a parameter is not told by the data."""

_SKIP = 25  # first samples, where the smoother still settles


@dataclass(frozen=True)
class StructureFit:
    """A building as identified.

    `stiffnesses` (n,) N/m below each level, `damping_ratios` (n,) [1] of each mode, `frequencies`
    (n,) Hz, each with its standard deviation in `std_...`, infinite where the data cannot tell.
    `z` (n,) by level: RMS of what equilibrium leaves over the noise expected, `share` (n,) the same
    over the shear there; not a number where the damper's force is unknown.
    `building` carries the values; those in `unidentified` keep what was given.
    """

    building: Building
    stiffnesses: Array
    std_stiffnesses: Array
    damping_ratios: Array
    std_damping_ratios: Array
    frequencies: Array
    std_frequencies: Array
    z: Array
    share: Array
    unidentified: tuple[str, ...]
    notes: tuple[str, ...] = ()


class Equilibrium(NamedTuple):
    """What equilibrium leaves by level (n,): robustly in units of the noise, RMS over the shear."""

    z: Array
    share: Array


class Modes(NamedTuple):
    """Angular frequencies [rad/s] and mass-normalised shapes (columns)."""

    omega: Array
    shapes: Array


def identify_structure(
    measurements: list[Measurement], building: Building, *, damper: bool | None = None
) -> StructureFit:
    """Return a building's stiffnesses and damping ratios from its response.

    Parameters
    ----------
    measurements : one or more runs with the ground acceleration and every level's motion
    building : masses and start values; of matrices that are no chain only the storeys' springs move
    damper : whether a damper acts on the first level; None: if a force, voltage or current was
        measured. If its force was not, nothing can be said of what is below the first level.

    Raises
    ------
    RecordError
        If a channel is missing, the building has other levels than were measured, or a stiffness
        comes out negative.
    """
    runs = responses(measurements, building, draws=0, looser=LOOSER)
    first = _first(runs, damper)
    if first == building.size:
        raise RecordError(
            f"{measurements[0].name}: force was not measured, and {building.name!r} has no storey "
            "above the damper. Measure the damper's force."
        )
    free = np.ones(building.size, dtype=np.bool_)
    while True:
        ended = _rounds(runs, building, first, free)
        lost = _untold(ended, free)
        if not ended.positive and not lost.any() and ended.round > 0:
            lost[np.flatnonzero(free)[-1:]] = True  # the highest mode's ratio tells least
        if not lost.any():
            break
        free &= ~lost
    if not ended.positive:
        i = int(np.argmin(ended.stiffness))
        raise RecordError(
            f"{measurements[0].name}: the stiffness below {building.levels()[i]} comes out as "
            f"{ended.stiffness[i]:.4g} N/m. Check signs and units of its displacement and "
            "acceleration, and the masses of the building."
        )
    return _finish(runs, building, ended, first, free)


class _Ended(NamedTuple):
    """Where the rounds ended: `positive` False where a stiffness came out negative in `round`.

    `std_zeta` (n,) is zero for ratios that were held.
    """

    stiffness: Array
    zeta: Array
    covariance: Array
    std_zeta: Array
    system: _System
    positive: bool
    round: int


def _rounds(
    runs: list[Response], building: Building, first: int, free: NDArray[np.bool_]
) -> _Ended:
    """Return the stiffnesses and the ratios of the modes in `free`; the others stay as given."""
    stiffness, given = np.array(building.stiffnesses), _ratios(building)
    zeta = given
    for round_ in range(1 + ROUNDS):
        sums = _sums(runs, building, stiffness, zeta, first, plain=round_ == 0)
        system = _System(building, runs, stiffness, first)
        theta, covariance = system.solve(sums, given, free)
        stiffness, zeta = system.split(theta, stiffness)
        positive = bool(np.all(stiffness > 0.0))
        if not positive:
            break
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))[system.rows : system.rows + system.n]
    return _Ended(stiffness, zeta, covariance, std, system, positive, round_)


def _untold(ended: _Ended, free: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which of the free ratios the data do not tell, (n,).

    Free, they would take whatever the others leave, and the instruments would follow them.
    """
    size = np.maximum(np.abs(ended.zeta), 1e-3)
    return free & ((ended.std_zeta > LOST * size) | (np.abs(ended.zeta) >= 1.0))


def _ratios(building: Building) -> Array:
    """Return the modal damping ratios that a building's C amounts to."""
    modes = _modes(building, np.array(building.stiffnesses))
    diagonal = np.einsum("ir,ij,jr->r", modes.shapes, np.array(building.C), modes.shapes)
    return np.asarray(diagonal / (2.0 * modes.omega))


def _modes(building: Building, stiffness: Array) -> Modes:
    values, shapes = eigh(stiffness_matrix(building, stiffness), np.array(building.M))
    return Modes(np.sqrt(np.maximum(values, 1e-12)), shapes)


class _System:
    """The equations t_i = k_i d_i + sum_r zeta_r g_ir + offset_i above each level from `first` on.

    Unknowns are ordered: stiffnesses, ratios, offsets.
    """

    def __init__(
        self, building: Building, runs: list[Response], stiffness: Array, first: int
    ) -> None:
        n = building.size
        self.n, self.first, self.rows = n, first, n - first
        self.M = np.array(building.M)
        modes = _modes(building, stiffness)
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


def _sums(
    runs: list[Response], building: Building, stiffness: Array, zeta: Array, first: int, plain: bool
) -> Array:
    """Return cross products (blocks, 2 n + 1, 3 n + 2) of instruments with signals, all runs."""
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
        slowest = round(2.0 * np.pi / _modes(building, stiffness).omega[0] / run.dt)
        size = max(10, round(BLOCK / run.dt))
        size = max(size, min(slowest, (signals.shape[1] - _SKIP) // BLOCKS))
        whole = (signals.shape[1] - _SKIP) // size
        if whole < 2:
            raise RecordError(
                f"{run.name}: {signals.shape[1]} samples; intervals need {2 * size + _SKIP} or "
                "more."
            )
        end = _SKIP + whole * size
        s = signals[:, _SKIP:end].reshape(3 * n + 2, whole, size).transpose(1, 0, 2)
        w = shown[:, _SKIP:end].reshape(2 * n + 1, whole, size).transpose(1, 0, 2)
        parts.append(w @ s.transpose(0, 2, 1))
    return np.concatenate(parts)


def _finish(
    runs: list[Response], building: Building, ended: _Ended, first: int, free: NDArray[np.bool_]
) -> StructureFit:
    """Return the fit with what is not identified put back and named."""
    stiffness, zeta, system = ended.stiffness.copy(), ended.zeta.copy(), ended.system
    n, m, covariance = building.size, ended.system.rows, ended.covariance
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    std_k = np.concatenate([np.full(first, np.inf), std[:m]])
    told = free & (np.arange(n) >= first)
    std_zeta = np.where(told, ended.std_zeta, np.inf)
    given = np.array(building.stiffnesses)
    levels, lost, notes = building.levels(), [], []
    for i in range(n):
        if std_k[i] > LOST * stiffness[i]:
            lost.append(f"stiffness below {levels[i]}")
            stiffness[i], std_k[i] = given[i], np.inf
    before = _ratios(building)
    for r in range(n):
        if not told[r]:
            lost.append(f"damping ratio of mode {r + 1}")
            zeta[r] = before[r]
        elif zeta[r] < 0.0:
            notes.append(
                f"mode {r + 1} comes out with a damping ratio of {zeta[r]:.4f}; the building is "
                "given 0"
            )
    if first:
        notes.append(
            f"the damper's force was not measured: what is below {levels[0]} keeps its given values"
        )
    modes = _modes(building, stiffness)
    # d(omega^2)/dk_i = (shape_i - shape_{i-1})^2 (Nelson 1976, AIAA J. 14(9)).
    part = np.diff(modes.shapes, axis=0, prepend=np.zeros((1, n))) ** 2
    known = np.isfinite(std_k)
    cov = np.zeros((n, n))
    cov[first:, first:] = covariance[:m, :m]
    cov *= np.outer(known, known)
    slope = part.T / (2.0 * modes.omega[:, None])
    std_omega = np.sqrt(np.maximum(np.einsum("ri,ij,rj->r", slope, cov, slope), 0.0))
    weighted = np.array(building.M) @ modes.shapes
    C = (weighted * (2.0 * np.maximum(zeta, 0.0) * modes.omega)) @ weighted.T
    freeze = [tuple(tuple(float(v) for v in row) for row in matrix) for matrix in (C,)]
    K = tuple(tuple(float(v) for v in row) for row in stiffness_matrix(building, stiffness))
    found = building._replace(C=freeze[0], K=K, stiffnesses=tuple(float(k) for k in stiffness))
    z, share = _left(runs, found, system)
    worst = int(np.nanargmax(z))
    if z[worst] > MISFIT:
        notes.append(
            f"equilibrium at {levels[worst]} leaves {z[worst]:.3g} times the noise: the building "
            "is not linear there, or its masses are not as given, or the displacements are not "
            "what the accelerations say. The values are those of the linear building that comes "
            "nearest, and the intervals hold for it alone"
        )
    return StructureFit(
        found, stiffness, std_k, zeta, std_zeta, modes.omega / (2.0 * np.pi),
        std_omega / (2.0 * np.pi), z, share, tuple(lost), tuple(notes),
    )  # fmt: skip


def equilibrium(
    measurements: list[Measurement], building: Building, *, damper: bool | None = None
) -> Equilibrium:
    """Return what equilibrium leaves of runs, such as those that a building was not fitted to.

    Raises
    ------
    RecordError
        If a channel is missing, or the building has other levels than were measured.
    """
    runs = responses(measurements, building, draws=0, looser=LOOSER)
    first = _first(runs, damper)
    return _left(runs, building, _System(building, runs, np.array(building.stiffnesses), first))


def _first(runs: list[Response], damper: bool | None) -> int:
    """Return the first level whose equilibrium is known: 1 under an unknown damper's force."""
    if damper is None:
        damper = any(run.driven or run.force is not None for run in runs)
    return 1 if damper and not all(run.force is not None for run in runs) else 0


def _left(runs: list[Response], found: Building, system: _System) -> Equilibrium:
    """Return what equilibrium leaves by level, offsets apart."""
    C, K, M = (np.array(matrix) for matrix in (found.C, found.K, found.M))
    rest: list[list[Array]] = [[] for _ in range(found.size)]
    whole: list[list[Array]] = [[] for _ in range(found.size)]
    for run in runs:
        inertia = M @ run.a
        if run.force is not None:
            inertia[0] += run.force
        above, carried = (
            np.cumsum(level[::-1], axis=0)[::-1][:, _SKIP:]
            for level in (inertia + C @ run.v + K @ run.x, inertia)
        )
        for i in range(system.first, found.size):
            rest[i].append(above[i] - np.median(above[i]))
            whole[i].append(carried[i] - np.median(carried[i]))
    z, share = np.full(found.size, np.nan), np.full(found.size, np.nan)
    for i in range(system.first, found.size):
        left = np.concatenate(rest[i])
        z[i] = z_scale(left / system.noise[i])
        share[i] = np.sqrt(np.mean(left**2) / np.mean(np.concatenate(whole[i]) ** 2))
    return Equilibrium(z, share)
