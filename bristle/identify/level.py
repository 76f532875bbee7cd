"""The motion of one level of a building: smoothed, and how far the result may be off.

Displacement, velocity and acceleration are joined by a Kalman smoother with white jerk. Where dry
friction lets the acceleration jump, the jerk is given that jump: else the velocity would be
smoothed across it, and a yield force would be held against the wrong side of v = 0.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from ..data.measurement import Measurement
from .kalman import Samples, kalman_smooth, room
from .smooth import EDGE, Motion, posterior_draws, random_motion

Array = NDArray[np.float64]

JUMP = 6.0
"""A change of acceleration that is so many times what is usual from sample to sample is a jump."""


def smoothed_level(m: Measurement, name: str, looser: float) -> dict[str, Any]:
    """Return the smoothed motion of one level: state (n, 3), std (3,), jerk, noise, have.

    What was not measured of one channel the others tell, and the motion about it.
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
    added = jumps(y[:, 2], dt) if have[2] else np.zeros(n)
    jerk = looser * _likeliest(y, seen, r, have, dt, added)
    out = room(n)
    kalman_smooth(_samples(y, r, have, dt, seen), jerk + added, out)
    std = np.sqrt(np.maximum(out.cov, 0.0))
    return {"state": out.state, "std": std, "jerk": jerk, "r": r, "have": have}


def _samples(
    y: Array, r: Array, have: NDArray[np.bool_], dt: float, seen: NDArray[np.bool_] | None = None
) -> Samples:
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
    y: Array, seen: NDArray[np.bool_], r: Array, have: NDArray[np.bool_], dt: float, added: Array,
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


def level_draws(n: int, level: dict[str, Any], dt: float, draws: int, seed: int) -> Array:
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
    jerk, r, have = level["jerk"], level["r"], level["have"]
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


def corrected(
    level: dict[str, Any], dt: float, draws: int, seed: int
) -> tuple[dict[str, Any], Array]:
    """Return a floor that has no accelerometer without its known error, and draws of the rest.

    A floor's motion is smoother than white jerk: the smoother lets noise pass where nothing moves,
    and takes some motion for noise. Most of the acceleration's error is known therefore from the
    motion found (three quarters of it on the buildings of the tests), and taken off.

    Parameters
    ----------
    level : the smoothed motion of one level: `state` (n, 3), `r` (3,) and `have` (3,) of its
        channels, `jerk` and `std`
    dt : step [s]
    draws : how many draws, 0 for none
    seed : of the draws
    """
    state, r, have, jerk = level["state"], level["r"], level["have"], level["jerk"]
    if not draws:
        return level, np.zeros((0, len(state), 3))
    x, v, a = state.T.copy()
    motion = Motion(x, v, a, level["std"], jerk, np.ones(2))
    noise = (float(np.sqrt(r[0])), float(np.sqrt(r[1])))
    seen = (bool(have[0]), bool(have[1]))
    error = posterior_draws(len(state), dt, noise, jerk, seen, draws, seed, motion)
    known = error.mean(axis=0)
    error -= known
    edge = min(EDGE, len(state) // 4)
    std = np.sqrt(np.mean(error[:, edge : len(state) - edge] ** 2, axis=(0, 1)))
    return {**level, "state": state + known, "std": std}, error
