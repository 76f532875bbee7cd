"""The response of a building, as measured: one motion per level, and what its inertia says.

Every level's motion is smoothed by itself.

A level whose displacement was not measured integrates its velocity, and drifts. What is slow is
therefore taken from the nearest level that has a displacement, and the storeys between by their
equilibrium: far below the first mode they hardly deflect.

Equilibrium is taken sample by sample from the accelerations as measured, for they and the forces
jump together; their noise is white and known.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from ..data.extra import Extra
from ..data.labels import Labels
from ..data.measurement import Measurement
from ..errors import RecordError
from ..physics.building import Building, frequencies, with_one_damper
from .drive import smooth_steps
from .level import corrected, level_draws, smoothed_level
from .prepare import SHORTEST

Array = NDArray[np.float64]

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
    known of the whole run; `extra` its channels besides those that bristle knows.
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
    extra: Mapping[str, Extra] = field(default_factory=dict)

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
    level; those of a floor without an accelerometer from each run's own motion.

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
    with_one_damper(building)
    for measurement in measurements:
        check_channels(measurement, building)
    smoothed = [
        [smoothed_level(m, name, looser) for name in building.levels()] for m in measurements
    ]
    corner = SLOW * frequencies(building)[0]
    longest = max(len(m.time) for m in measurements)
    made: dict[tuple[int, tuple[bool, ...]], Array] = {}
    for i in range(building.size):
        for have in dict.fromkeys(_instruments(run[i]) for run in smoothed):
            alike = [run[i] for run in smoothed if _instruments(run[i]) == have]
            if not _is_smooth(i, have):
                made[i, have] = level_draws(longest, alike, measurements[0].step, draws, seed + i)
    out = []
    for m, levels in zip(measurements, smoothed, strict=True):
        errors = []
        for i, one in enumerate(levels):
            if _is_smooth(i, _instruments(one)):
                levels[i], error = corrected(one, m.step, draws, seed + i)
                errors.append(error)
            else:
                errors.append(made[i, _instruments(one)])
        a, noise_a = _accelerations(m, building, levels)
        levels, errors = _anchored(levels, errors, _deflected(building, a), m.step, corner)
        out.append(_response(m, levels, errors, (a, noise_a)))
    return out


def _instruments(level: dict[str, Any]) -> tuple[bool, ...]:
    """Return which of displacement, velocity and acceleration of a level were measured."""
    return tuple(bool(one) for one in level["have"])


def _is_smooth(level: int, have: tuple[bool, ...]) -> bool:
    """Return whether a level's acceleration is smoothed, and does not jump.

    Dry friction and end stops act on the first level; those above have a storey between.
    """
    return level > 0 and not have[2]


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
        np.array([error[:, :n] for error in errors]), left, drive, m.labels, m.extra,
    )  # fmt: skip


def _anchored(
    levels: list[dict[str, Any]], errors: list[Array], deflected: Array, dt: float, corner: float
) -> tuple[list[dict[str, Any]], list[Array]]:
    """Return levels and draws of their errors, with slow displacements from those measured.

    Parameters
    ----------
    levels, errors : per level what `smoothed_level` and `level_draws` return
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
