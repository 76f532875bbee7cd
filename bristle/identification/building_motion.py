"""The response of a building, as measured: one motion per level, and what its inertia says.

Every level's motion is smoothed by itself.

Equilibrium is taken sample by sample from the accelerations as measured, for they and the forces
jump together; their noise is white and known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.ndimage import convolve1d
from scipy.optimize import minimize_scalar
from scipy.signal import butter, sosfiltfilt

from ..core.arrays import Array, Flags
from ..data.channels import Labels, device_channel, no_device
from ..data.decimate import Finer
from ..data.extra_channels import Extra
from ..data.measurement import Measurement
from ..errors import RecordError
from ..physics.building import GROUND, Building, Device, frequencies, with_damper
from .kalman import Samples, kalman_smooth, room
from .prepare import refuse_short, untold
from .smoothing import EDGE, MovingPart, random_motion, smooth_steps

# Slow displacements of levels that have none of their own.
#
# A level whose displacement was not measured integrates its velocity, and drifts. What is slow is
# therefore taken from the nearest level that has a displacement, and the storeys between by their
# equilibrium: far below the first mode they hardly deflect.


SLOW = 0.3
"""Share of the first natural frequency below which a displacement that was not measured is taken
from equilibrium: storeys hardly deflect there, so that it needs their stiffness only roughly."""


class LevelMotion(NamedTuple):
    """The smoothed motion of one level, in SI.

    `state` (n, 3) displacement, velocity, acceleration and `std` (3,) their errors; `jerk` the
    intensity of the motion and `added` (n,) that of its jumps; `r` (3,) the variances of the
    channels and `have` (3,) which there are; `forced` (n, 3) what was taken off before and put
    back.
    """

    state: Array
    std: Array
    jerk: float
    added: Array
    r: Array
    have: Flags
    forced: Array


class Load(NamedTuple):
    """A device beside the one that is identified: its `force` (n,) [N] as measured, its `noise`."""

    device: Device
    force: Array
    noise: float


def deflected(building: Building, a: Array, loads: Sequence[Load]) -> Array:
    """Return how far springs alone deflect under accelerations and known forces, (levels, n) m.

    Differences of levels count: what is below the first one may have a damper beside it.

    Parameters
    ----------
    building : its masses and springs
    a : (levels, n) absolute accelerations [m/s2]
    loads : what devices carry, as far as it is known
    """
    below = np.cumsum((np.array(building.M) @ a)[::-1], axis=0)[::-1]
    for load in loads:
        for i in range(1, building.size):
            below[i] += load.force * load.device.crosses(i)
    return np.asarray(np.cumsum(-below / np.array(building.stiffnesses)[:, None], axis=0))


def anchored(
    levels: list[LevelMotion],
    errors: list[Array],
    springs: Array,
    dt: float,
    corner: float,
    apart: set[int],
    names: Sequence[str],
) -> tuple[list[LevelMotion], list[Array]]:
    """Return levels and draws of their errors, with slow displacements from those measured.

    Parameters
    ----------
    levels, errors : per level what `smoothed_level` and `level_draws` return
    springs : (levels, n) how far the springs deflect [m]; see `deflected`
    dt, corner : sampling step [s]; frequency below which a displacement is not the level's own [Hz]
    apart : levels whose storey below has a device of unknown force beside its spring
    names : of each level's displacement, with the run, for messages

    Raises
    ------
    RecordError
        If a displacement was not measured that only levels beyond such a storey could give.
    """
    able = [i for i, level in enumerate(levels) if level.have[0]]
    levels, errors = list(levels), list(errors)
    if not able or len(able) == len(levels):
        return levels, errors
    low = butter(2, min(2.0 * corner * dt, 0.5), output="sos")

    def joined(own: Array, other: Array) -> Array:
        """Return (..., n) the fast part of one displacement and the slow one of another."""
        return np.asarray(own + sosfiltfilt(low, other - own, axis=-1))

    for i, level in enumerate(levels):
        if level.have[0]:
            continue
        beside = [k for k in able if not apart & set(range(min(i, k) + 1, max(i, k) + 1))]
        if not beside:
            raise RecordError(
                f"{names[i]} was not measured, and no other level gives it: the force of a damper "
                "between was not measured. Measure that displacement, or the force."
            )
        near = min(beside, key=lambda k: abs(k - i))
        state, std, error = level.state.copy(), level.std.copy(), errors[i].copy()
        there = levels[near].state[:, 0] + springs[i] - springs[near]
        state[:, 0] = joined(state[:, 0], there)
        if len(error):
            error[:, :, 0] = joined(error[:, :, 0], errors[near][:, :, 0])
        # White noise of a velocity, integrated: its power above a corner f is r dt/(2 pi^2 f).
        drift = np.sqrt(level.r[1] * dt / (2.0 * np.pi**2 * corner))
        std[0] = np.hypot(min(std[0], drift), levels[near].std[0])
        levels[i], errors[i] = level._replace(state=state, std=std), error
    return levels, errors


# The motion of one level of a building: smoothed, and how far the result may be off.
#
# Displacement, velocity and acceleration are joined by a Kalman smoother with white jerk. Where dry
# friction lets the acceleration jump, the jerk is given that jump: else the velocity would be
# smoothed across it, and a yield force would be held against the wrong side of v = 0.

JUMP = 6.0
"""A change of acceleration that is so many times what is usual from sample to sample is a jump."""


PULSE = 1001
"""Samples over which a smoother's answer to a pulse has faded."""


def smoothed_level(
    m: Measurement, name: str, looser: float, forced: Array | float = 0.0, least: float = 0.0
) -> LevelMotion:
    """Return the smoothed motion of one level by name, in SI.

    What was not measured of one channel the others tell, and the motion about it. Without an
    accelerometer the part of the acceleration that measured forces and the ground make, `forced`
    (n,) [m/s2], is as fast as they are: no smoother shall take that for noise. It is taken off
    before, by its double integral, and put back.

    Parameters
    ----------
    m : the run
    name : of the level
    looser : factor of the jerk's likeliest intensity [1]
    forced : (n,) m/s2, what ground and measured forces make, or 0
    least : m2/s5, of the jerk
    """
    n, dt = len(m.time), m.step
    y, r, have = np.zeros((n, 3)), np.zeros(3), np.zeros(3, dtype=np.bool_)
    seen = np.ones((n, 3), dtype=np.bool_)
    for i, what in enumerate(("displacement", "velocity")):
        channel = f"{name}_{what}"
        if m.has(channel):
            y[:, i], have[i], seen[:, i] = m[channel], True, m.valid(channel)
            r[i] = m.noise.get(channel, 0.0) ** 2
    channel, ground = f"{name}_acceleration_absolute", "ground_acceleration"
    if m.has(channel):
        y[:, 2], have[2], seen[:, 2] = m[channel] - m[ground], True, m.valid(channel, ground)
        r[2] = m.noise.get(channel, 0.0) ** 2 + m.noise.get(ground, 0.0) ** 2
    # A channel without any noise still is no better than its last digits.
    r = np.maximum(r, (1e-7 * np.std(y, axis=0)) ** 2 + 1e-30)
    path = np.zeros((n, 3))
    if not have[2]:
        path[:, 2] = forced - np.mean(forced)
        path[:, 1] = cumulative_trapezoid(path[:, 2], dx=dt, initial=0.0)
        path[:, 0] = cumulative_trapezoid(path[:, 1], dx=dt, initial=0.0)
        y -= path * have
    added = jumps(y[:, 2], dt) if have[2] else np.zeros(n)
    jerk = max(looser * _likeliest(y, seen, r, have, dt, added), least)
    out = room(n)
    kalman_smooth(_samples(y, r, have, dt, seen), jerk + added, out)
    std = np.sqrt(np.maximum(out.cov, 0.0))
    state = out.state + path
    return LevelMotion(state, std, jerk, added, r, have, path)


def _samples(y: Array, r: Array, have: Flags, dt: float, seen: Flags | None = None) -> Samples:
    """Return a level's channels (n, 3) of variances r (3,), with a wide guess of the beginning.

    `seen` (n, 3) says which values were measured, None that all were.
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
    told = y if seen is None or seen.all() else np.where(seen, y, np.nan)
    return Samples(told, r, have, dt, np.where(have, y[0], 0.0), cov)


def jumps(a: Array, dt: float) -> Array:
    """Return the jerk [m2/s5] that accounts for the jumps of an acceleration (n,) [m/s2]."""
    change = np.abs(np.diff(a, prepend=a[0]))
    usual = float(np.median(change)) / 0.6745
    return np.where(change > JUMP * usual, change**2 / dt, 0.0)


def _likeliest(
    y: Array, seen: Flags, r: Array, have: Flags, dt: float, added: Array,
    most: int = 4000,
) -> float:  # fmt: skip
    """Return the intensity of the white jerk that makes the strongest stretch likeliest."""
    n = len(y)
    if n > most:
        power = np.convolve(np.abs(y[:, int(np.argmax(have))]), np.ones(most), mode="valid")
        begin = int(np.argmax(power))
        y, added = y[begin : begin + most], added[begin : begin + most]
        seen = seen[begin : begin + most]
    samples = _samples(y, r, have, dt, seen)
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


def level_draws(n: int, level: LevelMotion, dt: float, draws: int, seed: int) -> Array:
    """Return draws (d, n, 3) of the smoother's error at the jerk and the noise of a run.

    Parameters
    ----------
    n : how many samples a draw has
    level : the level's motion in the run, see `corrected`
    dt : step [s]
    draws : how many draws, d
    seed : of the draws
    """
    generator = np.random.default_rng(seed)
    jerk, r, have = level.jerk, level.r, level.have
    lead = min(200, n)
    total = n + 2 * lead
    each = jerk + np.pad(level.added, lead)
    out = np.zeros((draws, n, 3))
    smoothed = room(total)
    for d in range(draws):
        path = random_motion(generator, total, dt, jerk, each / jerk)
        y = path + generator.standard_normal((total, 3)) * np.sqrt(r)
        kalman_smooth(_samples(y, r, have, dt), each, smoothed)
        out[d] = (path - smoothed.state)[lead : lead + n]
    return out


def corrected(
    level: LevelMotion, dt: float, draws: int, seed: int, sudden: bool = False
) -> tuple[LevelMotion, Array]:
    """Return a level that has no accelerometer with what moves of its acceleration, and its error.

    Draws of the error are those of the whole way: the motion that was found counts as true, the
    channels' noise is laid on it, and it is smoothed and sought again (a parametric bootstrap:
    Efron & Tibshirani 1993, An Introduction to the Bootstrap, ch. 6). What is off in all of them
    alike is of a size that is known, and of no sign: half of the draws have it turned.

    An acceleration that jumps has all frequencies, so that none is sought in noise. What smoothing
    takes off a jump is no error where models are shown behind the same smoother, see `shown_pulse`.

    Parameters
    ----------
    level : the smoothed motion of one level: `state` (n, 3), `r` (3,) and `have` (3,) of its
        channels, `jerk` and `std`
    dt : step [s]
    draws : how many draws, 0 for none
    seed : of the draws
    sudden : whether forces on the level make its acceleration jump
    """
    state, r, have = level.state - level.forced, level.r, level.have
    n = len(state)
    if not draws:
        return level, np.zeros((0, n, 3))
    jerk, out = np.full(n, level.jerk), room(n)

    def smoothed(y: Array) -> Array:
        kalman_smooth(_samples(y, r, have, dt), jerk, out)
        return out.state.copy()

    generator = np.random.default_rng(seed)
    noise = np.sqrt(r) * generator.standard_normal((draws, n, 3))
    passed = np.array([smoothed(one) for one in noise])
    if sudden:
        error = state - smoothed(state) - passed  # smoothing is linear
        # When between two samples a measured force changed nobody knows.
        forced = level.forced[:, 2]
        late = np.diff(forced, append=forced[-1]) * generator.uniform(-0.5, 0.5, (draws, n))
        error[:, :, 2] = convolve1d(late, shown_pulse(level, dt), mode="nearest") - passed[:, :, 2]
    else:
        moving = MovingPart(passed[:, :, 2], dt)
        state = state - moving.still(state[:, 2], (2, 1, 0))
        seen = smoothed(state) + passed
        seen = np.array([one - moving.still(one[:, 2], (2, 1, 0)) for one in seen])
        error = state - seen
    error[1::2] -= 2.0 * error.mean(axis=0)
    edge = min(EDGE, n // 4)
    std = np.sqrt(np.mean(error[:, edge : n - edge] ** 2, axis=(0, 1)))
    return level._replace(state=state + level.forced, std=std), error


def shown_pulse(level: LevelMotion, dt: float) -> Array:
    """Return what a level's smoother shows of a pulse of its acceleration (2 k + 1,), its sum 1.

    Parameters
    ----------
    level : the smoothed motion of one level, see `corrected`
    dt : step [s]
    """
    n = min(PULSE, len(level.state))
    after = (np.arange(n) - n // 2) * dt
    pulse = np.column_stack([np.maximum(after, 0.0), np.heaviside(after, 0.5), np.zeros(n)])
    out = room(n)
    samples = _samples(pulse * level.have, level.r, level.have, dt)
    kalman_smooth(samples, np.full(n, level.jerk), out)
    shown = out.state[:, 2]
    k = int(np.max(np.abs(np.flatnonzero(np.abs(shown) > 1e-3 * shown.max()) - n // 2)))
    shown = shown[n // 2 - k : n // 2 + k + 1]
    return np.asarray(shown / shown.sum())


# The motion of the device that is identified: of its upper level relative to the lower one.
#
# Between the ground and a level it is that level's motion. Between two levels it is a small
# difference, and what the levels' sensors share cancels in it: the noise of the ground's
# acceleration is in the relative acceleration of every level. So channels are subtracted first and
# their difference is smoothed, by its own jerk and the noise of the two sensors. Where the two
# levels do not have the same sensors the smoothed motions are subtracted, and their errors add up
# as if they were independent: a little too wide.

_NAME = "relative"

LOOSER = 8.0
"""Factor on the likeliest jerk of a difference. Where a law's friction builds up fast the likeliest
one takes a thousandth off the displacement, which the spring of a storey turns into a force: on the
runs of tests/identification/test_building_devices.py z of training runs is 1.08 to 1.25 with it,
and 1.01 to 1.11 with this factor."""


@dataclass(frozen=True)
class DeviceMotion:
    """Displacement, velocity and acceleration across a device, smoothed.

    `x`, `v` (n,) [m, m/s]; `std` (3,) what the smoother leaves uncertain of x, v and a;
    `draws` (d, n, 3) draws of that error.
    """

    x: Array
    v: Array
    std: Array
    draws: Array


def measured_across(
    runs: Sequence[Measurement], building: Building, device: Device, draws: int, seed: int,
    looser: float,
) -> list[DeviceMotion | None]:  # fmt: skip
    """Return the motion across a device between two levels, from the difference of channels.

    Parameters
    ----------
    runs : of one rig
    building : whose levels were measured
    device : that connects two of them, or the ground and one
    draws, seed : how many draws of the smoother's error, and their seed
    looser : factor of the jerk's intensity [1]

    Returns
    -------
    list
        None for a run whose two levels have other sensors, or no displacement; for all runs where
        the device is on the ground, and the level's own motion is its motion.
    """
    if device.lower == GROUND:
        return [None] * len(runs)
    jerk = looser * LOOSER
    pair = [building.levels()[i] for i in device.levels]
    smoothed = [
        None if (seen := _difference(run, *pair)) is None else smoothed_level(seen, _NAME, jerk)
        for run in runs
    ]
    return [
        None
        if one is None
        else DeviceMotion(
            one.state[:, 0], one.state[:, 1], one.std,
            level_draws(len(run.time), one, run.step, draws, seed),
        )
        for one, run in zip(smoothed, runs, strict=True)
    ]  # fmt: skip


def _difference(run: Measurement, lower: str, upper: str) -> Measurement | None:
    """Return the difference of two levels' channels as those of a level on a still ground."""
    kinds = ("displacement", "velocity", "acceleration_absolute")
    there = [tuple(run.has(f"{level}_{kind}") for kind in kinds) for level in (lower, upper)]
    if there[0] != there[1] or not there[0][0]:
        return None
    channels, noise = {"ground_acceleration": np.zeros(len(run.time))}, {}
    for kind in (kind for kind, has in zip(kinds, there[0], strict=True) if has):
        low, high = f"{lower}_{kind}", f"{upper}_{kind}"
        channels[f"{_NAME}_{kind}"] = run[high] - run[low]
        both = run.noise.get(high, 0.0), run.noise.get(low, 0.0)
        noise[f"{_NAME}_{kind}"] = float(np.hypot(*both))
    return replace(run, channels=channels, noise=noise)


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
    names the channels whose noise cannot be told from their signal. `pulse` (2 k + 1,) is what is
    shown of a pulse of the first level's acceleration where that is smoothed, None elsewhere: so
    equilibrium shows what acts on that level and was not measured.
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
    accelerometer: Flags
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
    pulse: Array | None = None

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

    @property
    def white_a(self) -> Array:
        """Noise (levels,) of `a` that no draw has: that of accelerometers."""
        told = self.accelerometer | (self.draws.shape[1] == 0)
        return np.where(told, self.noise_a, 0.0)

    def smoothed_inertia(self, masses: Array) -> Array:
        """Return draws (d, n) of the error [N] of inertia from accelerations that are smoothed.

        Parameters
        ----------
        masses : (levels,) kg, that the accelerations are multiplied by
        """
        smoothed = np.where(self.accelerometer, 0.0, masses)
        return np.asarray(np.einsum("i,idn->dn", smoothed, self.draws[..., 2]))

    @cached_property
    def white(self) -> list[tuple[Array | None, Array]]:
        """By level draws (d, n) of its accelerometer's noise, None without one, and (d, 1) of V's.

        In standard deviations; the same at each use.
        """
        count, n = self.draws.shape[1:3]
        out: list[tuple[Array | None, Array]] = []
        for level, own in enumerate(self.accelerometer):
            generator = np.random.default_rng(level + 100)
            a = generator.standard_normal((count, n)) if own else None
            out.append((a, generator.standard_normal((count, 1))))
        return out

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
    own too, for a weak run has other noise than a strong one; those of a level without an
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
    smoothed = [_smoothed(m, building, device, looser) for m in measurements]
    across = measured_across(measurements, building, device, draws, seed + building.size, looser)
    ends = {0}.union(*(one.levels for one in building.devices))  # where accelerations may jump
    first = ends <= {GROUND, 0}  # forces that jump act on the first level alone
    out = []
    for m, levels, own in zip(measurements, smoothed, across, strict=True):
        errors = []
        for i, one in enumerate(levels):
            if not one.have[2] and (first or i not in ends):
                levels[i], error = corrected(one, m.step, draws, seed + i, i == 0)
                errors.append(error)
            else:
                errors.append(level_draws(len(m.time), one, m.step, draws, seed + i))
        found = _response(m, levels, errors, _accelerations(m, building, levels))
        reasons = m.left_out(*m.channels)
        found = replace(
            found, device=device, others=_loads(m, building, device), across=own,
            known=_known(m, building, device) if reasons else None,
            known_but={why: _known(m, building, device, why) for why in reasons},
            pulse=shown_pulse(levels[0], m.step) if first and not levels[0].have[2] else None,
        )  # fmt: skip
        out.append(_anchored(found, m, building, levels, errors))
    return out


def _smoothed(
    m: Measurement, building: Building, device: Device, looser: float
) -> list[LevelMotion]:
    """Return the smoothed motion of all levels of a run, see `smoothed_level`.

    A displacement alone may be likeliest under far less jerk than its level has: one without an
    accelerometer has at least the jerk of the smoothest level that has one.
    """
    forced = dict(zip(building.levels(), _forced(m, building, device), strict=True))
    shown = {one for one in forced if m.has(f"{one}_acceleration_absolute")}
    found = {one: smoothed_level(m, one, looser, forced[one]) for one in forced if one in shown}
    least = min((level.jerk for level in found.values()), default=0.0)
    for one in forced:
        if one not in shown:
            found[one] = smoothed_level(m, one, looser, forced[one], least)
    return [found[one] for one in forced]


def _forced(m: Measurement, building: Building, device: Device) -> Array:
    """Return the relative acceleration (levels, n) [m/s2] that ground and measured forces make."""
    loads = list(_loads(m, building, device))
    if m.has("force"):
        loads.append(Load(device, m["force"], 0.0))
    out = np.tile(-m["ground_acceleration"], (building.size, 1))
    for load in loads:
        shares = load.device.incidence(building.size) / np.diag(building.M)
        out -= np.outer(shares, load.force)
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
    levels: list[LevelMotion], errors: list[Array],
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
    x, v, std, drawn = _stacked(levels, errors, found.a.shape[1])
    return replace(found, x=x, v=v, std=std, draws=drawn)


def _accelerations(
    m: Measurement, building: Building, levels: list[LevelMotion]
) -> tuple[Array, Array]:
    """Return the absolute acceleration (levels, n) [m/s2] and its noise (levels,).

    Smoothed where a level has no accelerometer.
    """
    ground = m["ground_acceleration"]
    a, noise = [], []
    for name, level in zip(building.levels(), levels, strict=True):
        channel = f"{name}_acceleration_absolute"
        own = m.has(channel)
        a.append(m[channel] if own else level.state[:, 2] + ground)
        noise.append(m.noise.get(channel, 0.0) if own else float(level.std[2]))
    return np.array(a), np.array(noise)


def _stacked(levels: list[LevelMotion], errors: list[Array], n: int) -> tuple[Array, ...]:
    """Return x, v (levels, n), std (levels, 3) and draws (levels, d, n, 3) of the levels."""
    x, v = (np.array([level.state[:, k] for level in levels]) for k in (0, 1))
    std = np.array([level.std for level in levels])
    return x, v, std, np.array([error[:, :n] for error in errors])


def _response(
    m: Measurement, levels: list[LevelMotion], errors: list[Array], absolute: tuple[Array, Array]
) -> Response:
    """Return a measurement as a response; `absolute` are accelerations and their noise."""
    n = len(m.time)
    a, noise_a = absolute
    own = [level.have[2] for level in levels]
    x, v, std, draws = _stacked(levels, errors, n)
    drive = m.drive
    V, left = np.zeros(n), 0.0
    if drive:
        V, left = smooth_steps(m[drive], m.noise.get(drive, 0.0), m.step)
    return Response(
        m.name, m.step, x, v, a, m["ground_acceleration"],
        m["force"] if m.has("force") else None, V, noise_a, m.noise.get("force", 0.0),
        m.noise.get("ground_acceleration", 0.0), np.array(own), std, draws, left, drive, m.labels,
        m.extra, finer=m.finer, untold=untold(m, m.channels),
    )  # fmt: skip


def shear(response: Response, building: Building, level: int) -> tuple[Array, float, Array]:
    """Return what must be carried below a level, its noise, and draws of an error besides.

    The inertia, damping and (for matrices that are no chain) elastic forces of this level and all
    above it, as M, C and K of the building have them, without the linear spring below the level
    itself: -sum_j>=level (M a + C v + K x)_j + k x_rel, in N, positive against +x. What devices
    beside the one that is identified carry there is taken off.

    Returns
    -------
    force (n,) N; noise: standard deviation of its white part [N], from the accelerometers; (d, n)
    draws of the error of what is smoothed for want of one [N]
    """
    M, C, K = (np.array(matrix) for matrix in (building.M, building.C, building.K))
    rows_m, rows_c, rows_k = (matrix[level:].sum(axis=0) for matrix in (M, C, K))
    # Sums over a chain leave rounding where the springs above cancel.
    rows_k[np.abs(rows_k) < 1e-12 * np.abs(K).max()] = 0.0
    below = response.x[level] - (response.x[level - 1] if level else 0.0)
    total = -(rows_m @ response.a + rows_c @ response.v + rows_k @ response.x)
    noise = float(np.sqrt(np.sum((rows_m * response.white_a) ** 2)))
    for other in response.others:
        if other.device.crosses(level):
            total, noise = total - other.force, float(np.hypot(noise, other.noise))
    force = total + building.stiffnesses[level] * below
    return force, noise, response.smoothed_inertia(rows_m)
