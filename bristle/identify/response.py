"""The response of a building, as measured: one motion per level, and what its inertia says.

Every level's displacement, velocity and acceleration are joined by a Kalman smoother with white
jerk. Where dry friction lets the acceleration jump, the jerk is given that jump: else the velocity
would be smoothed across it, and a yield force would be held against the wrong side of v = 0.

A level whose displacement was not measured integrates its velocity, and drifts. What is slow is
therefore taken from the nearest level that has a displacement, and the storeys between by their
equilibrium: far below the first mode they hardly deflect.

Equilibrium is taken sample by sample from the accelerations as measured, for they and the forces
jump together; their noise is white and known.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.signal import butter, sosfiltfilt

from ..data.labels import Labels
from ..data.measurement import Measurement
from ..errors import RecordError
from ..physics.building import Building, frequencies
from .drive import smooth_steps
from .kalman import Samples, kalman_smooth, room
from .prepare import SHORTEST
from .smooth import random_motion

Array = NDArray[np.float64]

JUMP = 6.0
"""A change of acceleration that is so many times what is usual from sample to sample is a jump."""

SLOW = 0.3
"""Share of the first natural frequency below which a displacement that was not measured is taken
from equilibrium: storeys hardly deflect there, so that it needs their stiffness only roughly."""


@dataclass(frozen=True)
class Response:
    """A run of a building, its motion smoothed.

    `x`, `v`, `a` (levels, n): displacement, velocity [m, m/s] relative to the table, smoothed, and
    absolute acceleration [m/s2] as measured (or, for a level without an accelerometer, smoothed:
    `accelerometer` (levels,) says which). `ground` (n,) [m/s2]; `force` (n,) [N] of the damper,
    None where it was not measured; `V` (n,) [V]. `noise_a` (levels,), `noise_force`, `noise_ground`
    standard deviations; `std` (levels, 3) what the smoother leaves uncertain of x, v and relative
    acceleration; `draws` (levels, d, n, 3) draws of that error; `V_left` the noise left on V;
    `drive` the channel that V holds, in its own unit, "" where none was measured; `labels` what is
    known of the whole run.
    """

    name: str
    dt: float
    x: Array
    v: Array
    a: Array
    ground: Array
    force: Array | None
    V: Array
    noise_a: Array
    noise_force: float
    noise_ground: float
    accelerometer: NDArray[np.bool_]
    std: Array
    draws: Array
    V_left: float
    drive: str = ""
    labels: Labels = field(default_factory=dict)

    @property
    def driven(self) -> bool:
        """Whether the damper's command was measured."""
        return bool(self.drive)


def check_channels(measurement: Measurement, building: Building) -> None:
    """Raise a RecordError that names every channel that is missing.

    A building's response needs the ground acceleration and, of each level, the displacement or
    velocity: what an accelerometer shows drifts away when it is integrated twice.
    """
    levels = building.levels()
    missing = [] if measurement.has("ground_acceleration") else ["ground_acceleration"]
    for level in levels:
        able = (f"{level}_displacement", f"{level}_velocity")
        if not any(measurement.has(channel) for channel in able):
            alone = measurement.has(f"{level}_acceleration_absolute")
            why = " (its acceleration alone drifts when it is integrated)" if alone else ""
            missing.append(" or ".join(able) + why)
    if missing:
        raise RecordError(
            f"{measurement.name}: missing {', and '.join(missing)}. A run of {building.name!r} "
            f"needs ground_acceleration and the displacement or velocity of {', '.join(levels)}."
        )
    known = {f"{level}_" for level in levels}
    beyond = sorted(
        channel
        for channel in measurement.channels
        if channel.startswith(("base_", "floor"))
        and not any(channel.startswith(level) for level in known)
    )
    if beyond:
        raise RecordError(
            f"{measurement.name}: {', '.join(beyond)} measured, but {building.name!r} has the "
            f"levels {', '.join(levels)}. Give the building.toml of the structure that was tested."
        )
    if len(measurement.time) < SHORTEST:
        raise RecordError(
            f"{measurement.name}: {len(measurement.time)} samples; a fit needs {SHORTEST} or more."
        )


def respond(measurement: Measurement, building: Building, draws: int = 12) -> Response:
    """Return a measurement as a response; see `responses` for several of one rig."""
    return responses([measurement], building, draws)[0]


def responses(
    measurements: list[Measurement],
    building: Building,
    draws: int = 12,
    seed: int = 0,
    looser: float = 1.0,
) -> list[Response]:
    """Return the measurements of one rig as responses.

    The smoother's jerk is each run's own, times `looser`: likeliest is not without bias, and a
    looser smoother trades a little noise for much of that. The draws of its error are made once per
    level.

    Parameters
    ----------
    measurements : runs of one rig, with one sampling step
    building : whose levels were measured
    draws, seed : how many draws of the smoother's error, and their seed
    looser : factor of the jerk's intensity [1]

    Raises
    ------
    RecordError
        If a channel is missing, or the building has other levels than were measured.
    """
    for measurement in measurements:
        check_channels(measurement, building)
    smoothed = [[_level(m, name, looser) for name in building.levels()] for m in measurements]
    corner = SLOW * frequencies(building)[0]
    longest = max(len(m.time) for m in measurements)
    made: dict[tuple[int, tuple[bool, ...]], Array] = {}
    for i in range(building.size):
        for have in dict.fromkeys(_instruments(run[i]) for run in smoothed):
            alike = [run[i] for run in smoothed if _instruments(run[i]) == have]
            made[i, have] = _draws(longest, alike, measurements[0].step, draws, seed + i)
    out = []
    for m, levels in zip(measurements, smoothed, strict=True):
        errors = [made[i, _instruments(one)] for i, one in enumerate(levels)]
        a, noise_a = _accelerations(m, building, levels)
        levels, errors = _anchored(levels, errors, _deflected(building, a), m.step, corner)
        out.append(_response(m, levels, errors, (a, noise_a)))
    return out


def _instruments(level: dict[str, Any]) -> tuple[bool, ...]:
    """Return which of displacement, velocity and acceleration of a level were measured."""
    return tuple(bool(one) for one in level["have"])


def _accelerations(
    m: Measurement, building: Building, levels: list[dict[str, Any]]
) -> tuple[Array, Array]:
    """Return the absolute acceleration (levels, n) [m/s2] and its noise (levels,).

    Smoothed where a level has no accelerometer.
    """
    ground = m["ground_acceleration"]
    noise_ground = m.noise.get("ground_acceleration", 0.0)
    a, noise = [], []
    for name, level in zip(building.levels(), levels, strict=True):
        channel = f"{name}_acceleration_absolute"
        own = m.has(channel)
        a.append(m[channel] if own else level["state"][:, 2] + ground)
        noise.append(
            m.noise.get(channel, 0.0) if own else float(np.hypot(level["std"][2], noise_ground))
        )
    return np.array(a), np.array(noise)


def _deflected(building: Building, a: Array) -> Array:
    """Return how far springs alone deflect under accelerations (levels, n) [m/s2], (levels, n) m.

    Differences of levels count: what is below the first one has the damper beside it.
    """
    below = np.cumsum((np.array(building.M) @ a)[::-1], axis=0)[::-1]
    return np.asarray(np.cumsum(-below / np.array(building.stiffnesses)[:, None], axis=0))


def _response(
    m: Measurement, levels: list[dict[str, Any]], errors: list[Array], absolute: tuple[Array, Array]
) -> Response:
    """Return a measurement as a response; `absolute` are accelerations and their noise."""
    n = len(m.time)
    a, noise_a = absolute
    own = [level["have"][2] for level in levels]
    drive = m.drive
    V, left = np.zeros(n), 0.0
    if drive:
        V, left = smooth_steps(m[drive], m.noise.get(drive, 0.0), m.step)
    return Response(
        m.name, m.step,
        np.array([level["state"][:, 0] for level in levels]),
        np.array([level["state"][:, 1] for level in levels]),
        a, m["ground_acceleration"], m["force"] if m.has("force") else None, V, noise_a,
        m.noise.get("force", 0.0), m.noise.get("ground_acceleration", 0.0), np.array(own),
        np.array([level["std"] for level in levels]),
        np.array([error[:, :n] for error in errors]), left, drive, m.labels,
    )  # fmt: skip


def _level(m: Measurement, name: str, looser: float) -> dict[str, Any]:
    """Return the smoothed motion of one level: state (n, 3), std (3,), jerk, noise, have."""
    n, dt = len(m.time), m.step
    y, r, have = np.zeros((n, 3)), np.zeros(3), np.zeros(3, dtype=np.bool_)
    for i, what in enumerate(("displacement", "velocity")):
        channel = f"{name}_{what}"
        if m.has(channel):
            y[:, i], have[i] = m[channel], True
            r[i] = m.noise.get(channel, 0.0) ** 2
    channel = f"{name}_acceleration_absolute"
    if m.has(channel):
        y[:, 2], have[2] = m[channel] - m["ground_acceleration"], True
        r[2] = m.noise.get(channel, 0.0) ** 2 + m.noise.get("ground_acceleration", 0.0) ** 2
    # A channel without any noise still is no better than its last digits.
    r = np.maximum(r, (1e-7 * np.std(y, axis=0)) ** 2 + 1e-30)
    added = jumps(y[:, 2], dt) if have[2] else np.zeros(n)
    jerk = looser * _likeliest(y, r, have, dt, added)
    out = room(n)
    kalman_smooth(_samples(y, r, have, dt), jerk + added, out)
    std = np.sqrt(np.maximum(out.cov, 0.0))
    return {"state": out.state, "std": std, "jerk": jerk, "r": r, "have": have}


def _samples(y: Array, r: Array, have: NDArray[np.bool_], dt: float) -> Samples:
    """Return a level's channels (n, 3) of variances r (3,), with a wide guess of the beginning.

    Where a channel is missing, the fastest change of the one below it says how large it is.
    """
    n, largest = len(y), np.max(np.abs(y), axis=0)
    fastest = float(np.max(np.abs(np.diff(y[:, 0])), initial=0.0)) / dt
    wide = max(largest[0], largest[1] * dt, largest[2] * dt * dt) + 1e-12
    speed, rise = wide / dt / np.sqrt(n), wide / dt**2 / np.sqrt(n)
    if have[0] and not have[1]:
        speed = 2.0 * fastest + 1e-12
    if not have[2]:
        rise = 2.0 * (largest[1] if have[1] else fastest) / dt + 1e-12
    cov = np.zeros(6)
    for c, (at, size) in enumerate(((0, wide), (3, speed), (5, rise))):
        cov[at] = 4.0 * r[c] if have[c] else size**2
    return Samples(y, r, have, dt, np.where(have, y[0], 0.0), cov)


def _anchored(
    levels: list[dict[str, Any]], errors: list[Array], deflected: Array, dt: float, corner: float
) -> tuple[list[dict[str, Any]], list[Array]]:
    """Return levels and draws of their errors, with slow displacements from those measured.

    Parameters
    ----------
    levels, errors : per level what `_level` and `_draws` return
    deflected : (levels, n) how far the springs deflect [m]; see `_deflected`
    dt, corner : sampling step [s]; frequency below which a displacement is not the level's own [Hz]
    """
    able = [i for i, level in enumerate(levels) if level["have"][0]]
    levels, errors = list(levels), list(errors)
    if not able or len(able) == len(levels):
        return levels, errors
    low = butter(2, min(2.0 * corner * dt, 0.5), output="sos")

    def joined(own: Array, other: Array) -> Array:
        """Return (..., n) the fast part of one displacement and the slow one of another."""
        return np.asarray(own + sosfiltfilt(low, other - own, axis=-1))

    for i, level in enumerate(levels):
        if level["have"][0]:
            continue
        near = min(able, key=lambda k: abs(k - i))
        state, std, error = level["state"].copy(), level["std"].copy(), errors[i].copy()
        there = levels[near]["state"][:, 0] + deflected[i] - deflected[near]
        state[:, 0] = joined(state[:, 0], there)
        if len(error):
            error[:, :, 0] = joined(error[:, :, 0], errors[near][:, :, 0])
        # White noise of a velocity, integrated: its power above a corner f is r dt/(2 pi^2 f).
        drift = np.sqrt(level["r"][1] * dt / (2.0 * np.pi**2 * corner))
        std[0] = np.hypot(min(std[0], drift), levels[near]["std"][0])
        levels[i], errors[i] = {**level, "state": state, "std": std}, error
    return levels, errors


def jumps(a: Array, dt: float) -> Array:
    """Return the jerk [m2/s5] that accounts for the jumps of an acceleration (n,) [m/s2]."""
    change = np.abs(np.diff(a, prepend=a[0]))
    usual = float(np.median(change)) / 0.6745
    return np.where(change > JUMP * usual, change**2 / dt, 0.0)


def _likeliest(
    y: Array, r: Array, have: NDArray[np.bool_], dt: float, added: Array, most: int = 4000
) -> float:
    """Return the intensity of the white jerk that makes the strongest stretch likeliest."""
    n = len(y)
    if n > most:
        power = np.convolve(np.abs(y[:, int(np.argmax(have))]), np.ones(most), mode="valid")
        begin = int(np.argmax(power))
        y, added = y[begin : begin + most], added[begin : begin + most]
    samples = _samples(y, r, have, dt)
    highest = int(np.flatnonzero(have)[-1])
    third = np.diff(y[:, highest], n=3 - highest) / dt ** (3 - highest)
    top = np.log10(np.var(third) * dt + 1e-30)

    def cost(exponent: float) -> float:
        return kalman_smooth(samples, 10.0**exponent + added)

    grid = np.arange(top - 12.0, top + 2.1, 1.5)
    best = grid[int(np.argmin([cost(exponent) for exponent in grid]))]
    found = minimize_scalar(
        cost, bounds=(best - 1.5, best + 1.5), method="bounded", options={"xatol": 0.1}
    )
    return float(10.0**found.x)


def _draws(n: int, runs: list[dict[str, Any]], dt: float, draws: int, seed: int) -> Array:
    """Return draws (d, n, 3) of the smoother's error at the median jerk and noise of the runs.

    The runs have the same instruments.
    """
    generator = np.random.default_rng(seed)
    jerk = float(np.median([run["jerk"] for run in runs]))
    r = np.median([run["r"] for run in runs], axis=0)
    have = runs[0]["have"]
    lead = min(200, n)
    total = n + 2 * lead
    out = np.zeros((draws, n, 3))
    smoothed = room(total)
    for d in range(draws):
        path = random_motion(generator, total, dt, jerk)
        y = path + generator.standard_normal((total, 3)) * np.sqrt(r)
        kalman_smooth(_samples(y, r, have, dt), np.full(total, jerk), smoothed)
        out[d] = (path - smoothed.state)[lead : lead + n]
    return out


def shear(response: Response, building: Building, level: int) -> tuple[Array, float]:
    """Return what must be carried below a level, and its noise per sample.

    The inertia, damping and (for matrices that are no chain) elastic forces of this level and all
    above it, as M, C and K of the building have them, without the linear spring below the level
    itself: -sum_j>=level (M a + C v + K x)_j + k x_rel, in N, positive against +x.

    Returns
    -------
    force (n,) N; noise: standard deviation of its white part [N], from the accelerometers
    """
    M, C, K = (np.array(matrix) for matrix in (building.M, building.C, building.K))
    rows_m, rows_c, rows_k = (matrix[level:].sum(axis=0) for matrix in (M, C, K))
    # Sums over a chain leave rounding where the springs above cancel.
    rows_k[np.abs(rows_k) < 1e-12 * np.abs(K).max()] = 0.0
    below = response.x[level] - (response.x[level - 1] if level else 0.0)
    total = -(rows_m @ response.a + rows_c @ response.v + rows_k @ response.x)
    noise = float(np.sqrt(np.sum((rows_m * response.noise_a) ** 2)))
    return total + building.stiffnesses[level] * below, noise


def base_equilibrium(response: Response, building: Building) -> tuple[Array, float]:
    """Return the force on the first level by its own equilibrium alone, and its noise.

    As `shear` at level 0, from one accelerometer instead of all, but from the storey above it as
    the building has it.
    """
    M, C, K = (np.array(matrix)[0] for matrix in (building.M, building.C, building.K))
    total = -(M @ response.a + C @ response.v + K @ response.x)
    white = np.sum((M * response.noise_a) ** 2)
    smooth = np.sum((K * response.std[:, 0]) ** 2) + np.sum((C * response.std[:, 1]) ** 2)
    own = building.stiffnesses[0] * response.x[0]
    return total + own, float(np.sqrt(white + smooth))
