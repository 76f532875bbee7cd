"""The response of a building, as measured: one motion per level, and what its inertia says.

Every level's motion is smoothed by itself.

Equilibrium is taken sample by sample from the accelerations as measured, for they and the forces
jump together; their noise is white and known.
"""

# Longer than 300 lines: a docstring says of every field and argument which shape and unit it has.

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..data.channels import device_channel, no_device
from ..data.extra import Extra
from ..data.finer import Finer
from ..data.labels import Labels
from ..data.measurement import Measurement
from ..errors import RecordError
from ..physics.building import Building, frequencies, with_damper
from ..physics.device import GROUND, Device
from .anchored import SLOW, Load, anchored, deflected
from .device_motion import DeviceMotion, measured_across
from .drive import smooth_steps
from .level import corrected, level_draws, smoothed_level
from .prepare import refuse_short, untold

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

FIRST_LEVEL = Device("", GROUND, 0)
"""Where the damper of a building without devices of its own sits."""


class KnownSamples(NamedTuple):
    """Which samples of a run were measured.

    `motion`, `acceleration` (levels, n) of each level's displacement or velocity, and of its
    accelerometer and the ground's; `force` (n,) of the damper; `others` (n,) of all other devices.
    """

    motion: Flags
    acceleration: Flags
    force: Flags
    others: Flags

    def equilibrium(self, level: int = 0) -> Flags:
        """Return where the equilibrium of a level and all above it is known (n,)."""
        there = np.vstack([self.acceleration[level:], self.motion, self.others[None, :]])
        return np.asarray(there.all(axis=0), dtype=np.bool_)


@dataclass(frozen=True)
class Response:
    """A run of a building, its motion smoothed.

    `x`, `v`, `a` (levels, n): displacement, velocity [m, m/s] relative to the table, smoothed, and
    absolute acceleration [m/s2] as measured (or, for a level without an accelerometer, smoothed:
    `accelerometer` (levels,) says which). `ground` (n,) [m/s2]; `force` (n,) [N] of the damper at
    its place `device`, None where it was not measured; `others` what other devices carry; `across`
    the motion of a damper between two levels, where it is smoothed by itself; `V` (n,) [V].
    `noise_a` (levels,), `noise_force`, `noise_ground` standard deviations; `std` (levels, 3) what
    the smoother leaves uncertain of x, v and relative acceleration; `draws` (levels, d, n, 3) draws
    of that error; `V_left` the noise left on V; `drive` the channel that V holds, in its own unit,
    "" where none was measured; `labels` what is known of the whole run; `extra` its channels
    besides those that bristle knows. `known` says where all that was measured, and not filled in;
    `known_but` by reason where it would be, but for that one; `finer` is that of `Run`; `untold`
    names the channels whose noise cannot be told from their signal.
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
    device: Device = FIRST_LEVEL
    others: tuple[Load, ...] = ()
    across: DeviceMotion | None = None
    known: KnownSamples | None = None
    finer: Finer | None = None
    known_but: Mapping[str, KnownSamples] = field(default_factory=dict)
    untold: tuple[str, ...] = ()

    @property
    def damped(self) -> bool:
        """Whether there is a damper: one with a place, or one whose force or command is known."""
        return bool(self.device.name) or self.driven or self.force is not None

    @property
    def loads(self) -> list[Load]:
        """All devices whose force is known."""
        if self.force is None:
            return list(self.others)
        return [Load(self.device, self.force, self.noise_force), *self.others]

    def hides(self, level: int) -> bool:
        """Return whether a damper of unknown force acts across the storey below a level."""
        return self.damped and self.force is None and self.device.crosses(level)

    @property
    def driven(self) -> bool:
        """Whether the damper's command was measured."""
        return bool(self.drive)


def check_channels(measurement: Measurement, building: Building) -> None:
    """Raise a RecordError that names every channel that is missing.

    A building's response needs the ground acceleration and, of each level, the displacement or
    velocity: what an accelerometer shows drifts away when it is integrated twice. Of devices beside
    the one that is identified the force is needed.
    """
    levels = building.levels()
    names = [device.name for device in building.devices]
    for channel in measurement.channels:
        if wrong := no_device(channel, names):
            raise RecordError(f"{measurement.name}: {wrong}.")
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
        and not device_channel(channel)
        and not any(channel.startswith(level) for level in known)
    )
    if beyond:
        raise RecordError(
            f"{measurement.name}: {', '.join(beyond)} measured, but {building.name!r} has the "
            f"levels {', '.join(levels)}. Give the building.toml of the structure that was tested."
        )
    _refuse_unmeasured(measurement, building)
    refuse_short(measurement)


def _refuse_unmeasured(measurement: Measurement, building: Building) -> None:
    """Refuse devices beside the one that is identified whose force was not measured."""
    missing = [
        device
        for device in building.devices
        if device.name != building.studied and not measurement.has(f"{device.name}_force")
    ]
    if not missing:
        return
    levels = building.levels()
    where = ", ".join(f"{device.name}_force ({device.place(levels)})" for device in missing)
    raise RecordError(
        f"{measurement.name}: missing {where}. The device that is identified is "
        f"{building.studied!r}; the forces of all others must be measured, for equilibrium needs "
        "them. Measure them, or for runs in which a device does not act, take it out of the "
        "building's file."
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
    looser smoother trades a little noise for much of that. The draws of its error are each run's
    own too, for a weak run has other noise than a strong one; those of a floor without an
    accelerometer are made from its motion.

    Parameters
    ----------
    measurements : runs of one rig
    building : whose levels were measured
    draws, seed : how many draws of the smoother's error, and their seed
    looser : factor of the jerk's intensity [1]

    Raises
    ------
    RecordError
        If a channel is missing, or the building has other levels than were measured.
    """
    building = with_damper(building)
    device = building.device(building.studied)
    for measurement in measurements:
        check_channels(measurement, building)
    smoothed = [
        [smoothed_level(m, name, looser) for name in building.levels()] for m in measurements
    ]
    across = measured_across(measurements, building, device, draws, seed + building.size, looser)
    out = []
    for m, levels, own in zip(measurements, smoothed, across, strict=True):
        errors = []
        for i, one in enumerate(levels):
            if _is_smooth(i, _instruments(one), building):
                levels[i], error = corrected(one, m.step, draws, seed + i)
                errors.append(error)
            else:
                errors.append(level_draws(len(m.time), one, m.step, draws, seed + i))
        found = _response(m, levels, errors, _accelerations(m, building, levels))
        reasons = m.left_out(*m.channels)
        found = replace(
            found, device=device, others=_loads(m, building, device), across=own,
            known=_known(m, building, device) if reasons else None,
            known_but={why: _known(m, building, device, why) for why in reasons},
        )  # fmt: skip
        out.append(_anchored(found, m, building, levels, errors))
    return out


def _known(m: Measurement, building: Building, device: Device, but_for: str = "") -> KnownSamples:
    """Return which samples say something; with `but_for` that reason alone hides any."""
    motion, acceleration = [], []
    for name in building.levels():
        either = [f"{name}_displacement", f"{name}_velocity"]
        motion.append(
            np.any([m.valid(one, but_for=but_for) for one in either if m.has(one)], axis=0)
        )
        shown = ["ground_acceleration", f"{name}_acceleration_absolute"]
        acceleration.append(m.valid(*shown, but_for=but_for))
    others = [f"{one.name}_force" for one in building.devices if one is not device]
    return KnownSamples(
        np.array(motion), np.array(acceleration), m.valid("force", but_for=but_for),
        m.valid(*others, but_for=but_for),
    )  # fmt: skip


def _loads(m: Measurement, building: Building, device: Device) -> tuple[Load, ...]:
    """Return the measured forces of the devices beside the one that is identified."""
    return tuple(
        Load(one, m[f"{one.name}_force"], m.noise.get(f"{one.name}_force", 0.0))
        for one in building.devices
        if one is not device
    )


def _anchored(
    found: Response, m: Measurement, building: Building,
    levels: list[dict[str, Any]], errors: list[Array],
) -> Response:  # fmt: skip
    """Return a response whose slow motion is held by the forces, where a level hides its own.

    Parameters
    ----------
    found : of one run
    m, building : the run, and whose levels were measured
    levels, errors : smoothed motion and draws of its error, by level
    """
    levels, errors = anchored(
        levels, errors, deflected(building, found.a, found.loads), m.step,
        SLOW * frequencies(building)[0],
        {i for i in range(1, building.size) if found.hides(i)},
        [f"{m.name}: {level}_displacement" for level in building.levels()],
    )  # fmt: skip
    return _with_motion(found, levels, errors)


def _instruments(level: dict[str, Any]) -> tuple[bool, ...]:
    """Return which of displacement, velocity and acceleration of a level were measured."""
    return tuple(bool(one) for one in level["have"])


def _is_smooth(level: int, have: tuple[bool, ...], building: Building) -> bool:
    """Return whether a level's acceleration is smoothed, and does not jump.

    Dry friction and end stops act on the first level and at the ends of devices; others have a
    storey between.
    """
    ends = {0}.union(*(device.levels for device in building.devices))
    return level not in ends and not have[2]


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


def _with_motion(response: Response, levels: list[dict[str, Any]], errors: list[Array]) -> Response:
    """Return a response with the motion of its levels."""
    n = response.a.shape[1]
    return replace(
        response,
        x=np.array([level["state"][:, 0] for level in levels]),
        v=np.array([level["state"][:, 1] for level in levels]),
        std=np.array([level["std"] for level in levels]),
        draws=np.array([error[:, :n] for error in errors]),
    )


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
        finer=m.finer, untold=untold(m, m.channels),
    )  # fmt: skip


def shear(response: Response, building: Building, level: int) -> tuple[Array, float]:
    """Return what must be carried below a level, and its noise per sample.

    The inertia, damping and (for matrices that are no chain) elastic forces of this level and all
    above it, as M, C and K of the building have them, without the linear spring below the level
    itself: -sum_j>=level (M a + C v + K x)_j + k x_rel, in N, positive against +x. What devices
    beside the one that is identified carry there is taken off.

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
    for other in response.others:
        if other.device.crosses(level):
            total, noise = total - other.force, float(np.hypot(noise, other.noise))
    return total + building.stiffnesses[level] * below, noise
