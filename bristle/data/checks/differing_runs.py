"""Runs whose force or motion was recorded with another gain, zero or sign than in the others.

What a damper's force depends on is the same in all runs: the velocity, the command, the motion
since it last turned. A force that is linear in a set of such shapes is fitted to all runs together,
each with a gain and a zero of its own. A run that differs is one whose gain or zero lies far off
those of the others, more than they scatter and than its own parts do, and whose force has the right
shape otherwise. Displacement and velocity are held against each other in every run.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from ...core.arrays import Array
from ...core.finding import Finding
from ...core.text import plain, quantity
from ..corrections import LEFT_OUT, Correction
from ..measurement import Measurement
from ..relation import derivative_relation
from .motion import velocity_of_run

# The force of a damper as a sum of shapes that all its runs share, with a gain and a zero of each.
#
# Shapes are what the force is linear in: a yield force that turns with the velocity, bristles that
# deflect with the motion, each with powers of the command, a viscous force, a spring and a mass.
# They tell no parameter; they tell whether runs are of one rig, and recorded alike.

_SAMPLES = 1500  # of a run, at most
_WIDTHS = (0.05, 0.3)  # of a yield force's turn, in standard deviations of the velocity
_LENGTHS = np.array([0.03, 0.12, 0.5])  # over which a force builds up, in those of the displacement
_STRETCHES = 6  # of a run: the scatter over them gives its standard errors
_MASS = 0.02  # s; so that an acceleration is about as large as the other shapes
_TURNS = 25  # of gains and shapes


@dataclass(frozen=True, eq=False)
class RunForces:
    """Gain, zero [N] and misfit of each run (n,), and the standard errors of gain and zero."""

    gain: Array
    zero: Array
    misfit: Array
    gain_error: Array
    zero_error: Array


@dataclass(frozen=True, eq=False)
class ForcePart:
    """Shapes (n, s) and force (n,) [N] of a run, with their mean products."""

    shapes: Array
    force: Array
    squares: Array
    product: Array
    mean: Array


def force_parts(runs: Sequence[Measurement], velocities: Sequence[Array]) -> list[ForcePart]:
    """Return the shapes and the force of each run.

    Parameters
    ----------
    runs : with a force
    velocities : (n,) m/s of each run
    """
    every = [max(1, len(run.time) // _SAMPLES) for run in runs]
    forces = [run["force"][::k] for run, k in zip(runs, every, strict=True)]
    return [
        ForcePart(A, f, A.T @ A / len(A), A.T @ f / len(A), A.mean(axis=0))
        for A, f in zip(_shapes(runs, velocities, every), forces, strict=True)
    ]


def fitted_forces(parts: Sequence[ForcePart], sound: Sequence[int]) -> RunForces:
    """Return gain and zero of each run's force against shapes that are fitted to sound runs.

    The median gain of these is 1. Shapes and gains are fitted in turn, by least squares.

    Parameters
    ----------
    parts : of all runs
    sound : which of them the shapes are fitted to
    """
    largest = max(float(np.var(part.force)) for part in parts)
    weights = [1.0 / max(float(np.var(part.force)), 1e-3 * largest) for part in parts]
    gain, zero = np.ones(len(parts)), np.zeros(len(parts))
    theta = np.zeros(parts[0].shapes.shape[1])
    for _ in range(_TURNS):
        left = np.sum([weights[k] * gain[k] ** 2 * parts[k].squares for k in sound], axis=0)
        right = np.sum(
            [
                weights[k] * gain[k] * (parts[k].product - zero[k] * parts[k].mean)
                for k in sound
            ],
            axis=0,
        )  # fmt: skip
        small = 1e-8 * np.trace(left) / len(left) * np.eye(len(left))
        theta = np.linalg.solve(left + small, right)
        for k, part in enumerate(parts):
            mean, power = float(part.mean @ theta), float(theta @ part.squares @ theta)
            level = float(part.force.mean())
            gain[k] = (float(theta @ part.product) - mean * level) / max(power - mean**2, 1e-300)
            zero[k] = level - gain[k] * mean
        size = float(np.median(gain[list(sound)])) or 1.0
        gain, theta = gain / size, theta * size
    predicted = [part.shapes @ theta for part in parts]
    misfit = [
        float(np.std(part.force - g * p) / np.std(part.force))
        for part, g, p in zip(parts, gain, predicted, strict=True)
    ]
    errors = np.array(
        [_standard_errors(p, part.force) for p, part in zip(predicted, parts, strict=True)]
    )
    relative = errors[:, 0] / np.maximum(np.abs(gain), 1e-9)
    return RunForces(gain, zero, np.array(misfit), relative, errors[:, 1])


def _standard_errors(predicted: Array, force: Array) -> tuple[float, float]:
    """Return the standard errors of gain and zero [N], from stretches of a run that move."""
    moving = 0.05 * float(np.std(predicted))
    parts = [
        np.polyfit(p, f, 1)
        for p, f in zip(
            np.array_split(predicted, _STRETCHES), np.array_split(force, _STRETCHES), strict=True
        )
        if float(np.std(p)) > moving
    ]
    if len(parts) < 3:
        return float("inf"), float("inf")
    gain, zero = np.std(parts, axis=0) / np.sqrt(len(parts))
    return float(gain), float(zero)


def _shapes(
    runs: Sequence[Measurement], velocities: Sequence[Array], every: Sequence[int]
) -> list[Array]:
    """Return the shapes (n, s) of each run that a damper's force is linear in, one size in all."""
    motions = [_displacement(run, v) for run, v in zip(runs, velocities, strict=True)]
    speed = float(np.std(np.concatenate(velocities)))
    stroke = float(np.median([np.std(x) for x in motions])) or 1.0
    top = max((float(np.max(np.abs(run[run.drive]))) for run in runs if run.drive), default=0.0)
    out = []
    for run, v, x, k in zip(runs, velocities, motions, every, strict=True):
        rate, motion = v[::k] / speed, x[::k] / stroke
        u = run[run.drive][::k] / top if run.drive and top else np.zeros(len(rate))
        turning = [np.tanh(rate / width) for width in _WIDTHS]
        powers = (np.ones(len(u)), u, u * u)
        columns = [one * power for one in (*turning, *_slips(motion).T) for power in powers]
        push = np.gradient(rate) / (k * run.step) * _MASS
        columns += [rate, rate * u, rate * np.abs(rate), motion, push]
        out.append(np.column_stack(columns))
    used = np.any(np.concatenate(out) != 0.0, axis=0)
    return [one[:, used] for one in out]


def _slips(motion: Array) -> Array:
    """Return the deflections (n, l) of Dahl's bristles, between -1 and 1, that follow a motion."""
    steps = np.diff(motion, prepend=motion[0])
    kept = np.exp(-np.abs(steps)[:, None] / _LENGTHS)
    pulled = np.sign(steps)[:, None] * (1.0 - kept)
    out: Array = np.empty(kept.shape)
    now: Array = np.zeros(len(_LENGTHS))
    for k in range(len(out)):
        now = now * kept[k] + pulled[k]
        out[k] = now
    return out


def _displacement(run: Measurement, velocity: Array) -> Array:
    """Return the displacement (n,) [m] about its mean; without one the integral of the velocity."""
    if run.has("displacement"):
        return run["displacement"] - np.mean(run["displacement"])
    return np.cumsum(velocity - np.mean(velocity)) * run.step


# Which run differs: by its gain, its zero or its sign.

MIN_RUNS = 4
"""Runs from which on one can differ from the others."""

GAIN = 0.12
"""Least share by which a run's gain must be off: oil that is some degrees warmer does less."""

ZERO = 0.05
"""Least share of the force's RMS by which a run's zero must be off."""

SCATTER = 15.0
"""By how many times the scatter of the others a run must be off. Effects that no shape has scatter,
too: by 12 at the most on runs of the independent generator."""

PARTS = 8.0
"""By how many standard errors, told from parts of the run, it must be off."""

MISFIT = 0.25
"""Share of a run's force that the shapes may leave, with its own gain and zero."""

_SURE = 0.005  # scatter that is taken at the least, as a share
_CELLS = 4  # of speed and of command, in which others must have moved as well
_COVERED = 0.8  # share of a run's samples in cells of other runs
_LIKE = 0.35  # share of a gain's logarithm within which a channel's noise was scaled by it
_MOTION_GAIN = 0.03  # least share by which the gain between two channels of motion must be off


_CORRECT = f"Give the run a correction, or {LEFT_OUT}."


def check_differing_runs(runs: Sequence[Measurement]) -> Iterator[Finding]:
    """Yield a finding for each run whose gain, zero or sign differs from those of the others.

    Parameters
    ----------
    runs : of one rig; those without force or motion are left out
    """
    motion = list(_motion(runs))
    yield from motion
    off = {finding.run for finding in motion}
    able = [run for run in runs if run.name not in off and _has_force(run)]
    if len(able) >= MIN_RUNS:
        yield from _forces(able)


# -- motion


def _motion(runs: Sequence[Measurement]) -> Iterator[Finding]:
    """Yield runs whose displacement and velocity go together otherwise than in the others."""
    pairs = [run for run in runs if run.has("displacement", "velocity")]
    found = [derivative_relation(run["displacement"], run["velocity"], run.step) for run in pairs]
    known = [
        (run, one)
        for run, one in zip(pairs, found, strict=True)
        if one is not None and abs(one.correlation) > 0.9
    ]
    if len(known) < MIN_RUNS:
        return
    usual = float(np.median([one.gain for _, one in known]))
    logs = np.array([log(abs(one.gain / usual)) for _, one in known])
    scatter = _scatter(logs)
    zeros = np.array([_velocity_zero(run) for run, _ in known])
    rms = float(np.median([np.std(run["velocity"]) for run, _ in known]))
    apart = (zeros - np.median(zeros)) / rms
    for (run, one), size, zero in zip(known, logs, apart, strict=True):
        ratio = one.gain / usual
        error = one.gain_std / abs(one.gain)
        if ratio < 0.0:
            yield _turned(run)
        elif abs(size) > max(_MOTION_GAIN, PARTS * scatter, PARTS * error):
            yield _of_motion(run, ratio, runs)
        if abs(zero) > max(ZERO, SCATTER * _scatter(apart)):
            text = (
                f"velocity shows {plain(float(zero) * rms)} m/s more than in the other runs: its "
                "mean is not the way that the displacement went."
            )
            yield _of_zero(run, "velocity", text, float(zero), rms)


def _velocity_zero(run: Measurement) -> float:
    """Return the mean of a velocity less the way that the displacement went, by the time [m/s]."""
    x = run["displacement"]
    return float(np.mean(run["velocity"]) - (x[-1] - x[0]) / run.duration)


def _turned(run: Measurement) -> Finding:
    """Return the finding that displacement and velocity of a run have opposite signs."""
    resists = run.has("force") and float(np.mean(run["force"] * run["velocity"])) > 0.0
    return _of_sign(run, "displacement" if resists else "velocity")


def _of_sign(run: Measurement, channel: str) -> Finding:
    return Finding(
        "run sign", "error", f"{channel} has the opposite sign of that in the other runs.",
        _CORRECT, run.name, channel, 1.0, (Correction(channel, "sign", -1.0),),
    )  # fmt: skip


def _of_motion(run: Measurement, ratio: float, runs: Sequence[Measurement]) -> Finding:
    """Return the finding that the gain between displacement and velocity differs in a run."""
    text = (
        f"velocity is {plain(ratio, 4)} times what the displacement says, by the gain of the other "
        "runs"
    )
    channel = _channel_by_noise(run, ratio, runs)
    if not channel:
        return Finding(
            "run gain", "warning", f"{text}: one of the two has another gain in this run.",
            f"Look up the ranges of both instruments, or {LEFT_OUT}.", run.name, "velocity",
            abs(log(ratio)),
        )  # fmt: skip
    value = ratio if channel == "velocity" else 1.0 / ratio
    return Finding(
        "run gain", "warning",
        f"{text}; by its noise, {channel} shows {plain(value, 4)} times what it should.",
        _CORRECT, run.name, channel, abs(log(ratio)),
        (Correction(channel, "gain", value),),
    )  # fmt: skip


def _channel_by_noise(run: Measurement, ratio: float, runs: Sequence[Measurement]) -> str:
    """Return whether displacement or velocity was scaled, "" where the noise does not tell.

    A record that was scaled has its noise scaled as well.
    """
    apart, scatter = {}, 0.0
    for channel in ("displacement", "velocity"):
        noise = [one.noise.get(channel, 0.0) for one in runs if one.has(channel)]
        own = run.noise.get(channel, 0.0)
        if min([own, *noise]) <= 0.0:
            return ""
        logs = np.log(noise)
        apart[channel] = log(own) - float(np.median(logs))
        scatter = max(scatter, _scatter(logs))
    size = log(ratio)
    left = {
        "velocity": np.hypot(apart["velocity"] - size, apart["displacement"]),
        "displacement": np.hypot(apart["velocity"], apart["displacement"] + size),
    }
    best, other = sorted(left, key=lambda one: float(left[one]))
    sure = left[best] < _LIKE * abs(size) < abs(size) < left[other]
    return best if sure and scatter < _LIKE * abs(size) else ""


# -- force


def _has_force(run: Measurement) -> bool:
    velocity = velocity_of_run(run) if run.has("force") else None
    return velocity is not None and float(min(np.ptp(velocity), np.ptp(run["force"]))) > 0.0


def _forces(runs: Sequence[Measurement]) -> Iterator[Finding]:
    """Yield runs whose force has another gain, zero or sign, each by the shapes of the others."""
    parts = force_parts(runs, [_velocity(run) for run in runs])
    found = fitted_forces(parts, list(range(len(runs))))
    rms = float(np.sqrt(np.mean([np.mean(run["force"] ** 2) for run in runs])))
    gains, zeros = _apart(found, rms)
    off = (np.abs(gains) > 0.5 * GAIN) | (found.gain < 0.0) | (np.abs(zeros) > 0.5 * ZERO)
    sound = np.flatnonzero(~off).tolist()
    if len(sound) < MIN_RUNS - 1 or len(sound) == len(runs):
        return
    found = fitted_forces(parts, sound)
    gains, zeros = _apart(found, rms, sound)
    most = min(MISFIT, 2.0 * float(np.median(found.misfit)) + 0.02)
    for k in np.flatnonzero(off).tolist():
        run, gain, zero = runs[k], float(found.gain[k]), float(zeros[k])
        if found.misfit[k] > most or not _is_covered(run, [runs[i] for i in sound]):
            continue
        least = max(GAIN, SCATTER * _scatter(gains[sound]), PARTS * float(found.gain_error[k]))
        if gain < 0.0 or abs(gains[k]) > least:
            yield _of_gain(run, gain)
            continue
        least = max(
            ZERO, SCATTER * _scatter(zeros[sound]), PARTS * float(found.zero_error[k]) / rms
        )
        if abs(zero) > least:
            text = (
                f"force shows {quantity(zero * rms, 'N', 3, rms)} more than in the other runs, "
                "whatever the motion and the command: the load cell was not set to zero, or a "
                "preload acted."
            )
            yield _of_zero(run, "force", text, zero, rms)


def _apart(found: RunForces, rms: float, sound: Sequence[int] | None = None) -> tuple[Array, Array]:
    """Return how far log gain and zero, by `rms`, of each run (n,) are from the usual ones."""
    own = list(range(len(found.gain))) if sound is None else sound
    logs, zeros = np.log(np.maximum(np.abs(found.gain), 1e-9)), found.zero / rms
    return logs - np.median(logs[own]), zeros - np.median(zeros[own])


def _of_gain(run: Measurement, gain: float) -> Finding:
    if gain < 0.0 and 0.8 < -gain < 1.25:
        return _of_sign(run, "force")
    turned = (Correction("force", "sign", -1.0),) if gain < 0.0 else ()
    corrections = (*turned, Correction("force", "gain", abs(gain)))
    return Finding(
        "run gain", "warning",
        f"force is {plain(gain, 3)} times what the other runs say at the same motion and command: "
        "another range of the load cell, another temperature, or another damper.",
        f"Give the run a correction if the load cell's range was another, else {LEFT_OUT}.",
        run.name, "force", abs(log(abs(gain))), corrections,
    )  # fmt: skip


def _of_zero(run: Measurement, channel: str, text: str, share: float, rms: float) -> Finding:
    """Return the finding of a channel's zero, off by a share of its RMS in all runs."""
    fix = Correction(channel, "bias", share * rms)
    return Finding("run zero", "warning", text, _CORRECT, run.name, channel, abs(share), (fix,))


def _scatter(values: Array) -> float:
    """Return the standard deviation of values (n,) by their median, the farthest one left out."""
    apart = np.sort(np.abs(values - np.median(values)))
    return max(1.4826 * float(np.median(apart[:-1])), _SURE)


def _is_covered(run: Measurement, others: Sequence[Measurement]) -> bool:
    """Return whether `is_covered` holds for a measured run; without a command it is zero."""
    return is_covered([
        (_velocity(one), one[one.drive] if one.drive else np.zeros(len(one.time)))
        for one in (run, *others)
    ])  # fmt: skip


def is_covered(moves: Sequence[tuple[Array, Array]], others: int = 2) -> bool:
    """Return whether other runs moved as fast, at the same command, as the first one.

    Beyond what others did no shape tells how large the force should be.

    Parameters
    ----------
    moves : velocity (n,) [m/s] and command (n,) of each run, that of the run in question first
    others : how many others must have done so, at the least
    """
    top = max(float(np.max(np.abs(level))) for _, level in moves)
    speed = max(float(np.quantile(np.abs(velocity), 0.99)) for velocity, _ in moves)
    shares = [_cells(np.abs(v) / speed, np.abs(level) / (top or 1.0)) for v, level in moves]
    seen = np.sum([share > 0.01 for share in shares[1:]], axis=0)
    return bool(np.sum(shares[0][seen >= others]) >= _COVERED)


def _velocity(run: Measurement) -> Array:
    found = velocity_of_run(run)
    assert found is not None  # `_has_force` asked
    return found


def _cells(speed: Array, level: Array) -> Array:
    """Return the share of a run's samples in each cell of speed and of command, both over most."""
    fast, high = (np.clip(part * _CELLS, 0, _CELLS - 1).astype(np.int64) for part in (speed, level))
    return np.bincount(fast * _CELLS + high, minlength=_CELLS**2) / len(speed)
