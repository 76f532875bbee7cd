"""Runs whose force or motion was recorded with another gain, zero or sign than in the others.

What a damper's force depends on is the same in all runs: the velocity, the command, the motion
since it last turned. A force that is linear in a set of such shapes is fitted to all runs together,
each with a gain and a zero of its own. A run that differs is one whose gain or zero lies far off
those of the others, more than they scatter and than its own parts do, and whose force has the right
shape otherwise. Displacement and velocity are held against each other in every run.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import log

import numpy as np

from ...core.arrays import Array
from ...core.finding import Finding
from ...core.text import plain, quantity
from ..corrections import LEFT_OUT, Correction
from ..force_shapes import RunForces, fitted_forces, force_parts
from ..measurement import Measurement
from ..relation import derivative_relation
from .motion import velocity_of_run

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
