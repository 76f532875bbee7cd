"""The Kalman smoother of a motion under white jerk: of a damper's and of a building's levels.

The covariances of the filter settle after some samples and then stay: from there on gains are kept,
which is what makes smoothing cheap enough to draw errors by it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from ..core.arrays import Array, Flags

_SETTLED = 1e-12
"""Relative change of a covariance in a sample below which it stays."""

# What the filter keeps of a sample, and where: the predicted covariance (6), the gains of three
# channels (3 each), the prediction (3), the shares of the innovations (3), their variances (3).
_GAIN, _MEAN, _SHARE, _SIZE, _COLUMNS = 6, 15, 18, 21, 24


class Samples(NamedTuple):
    """A measured motion, as the smoother takes it.

    `y` (n, 3) displacement, velocity, acceleration [m, m/s, m/s2]: what is not finite was not
    measured; `r` (3,) their variances; `have` (3,) whether a channel is there at all; `dt` the
    step [s]; `mean` (3,) and `cov` (6,) the state before the first sample and its covariance, by
    rows of the upper triangle.
    """

    y: Array
    r: Array
    have: Flags
    dt: float
    mean: Array
    cov: Array


class Smoothed(NamedTuple):
    """What smoothing fills.

    `state` (n, 3) the motion [m, m/s, m/s2]; `cov` (3,) its variances in the middle; `loss` (3,)
    mean squares of the normalised innovations.
    """

    state: Array
    cov: Array
    loss: Array


def room(n: int) -> Smoothed:
    """Return room for n smoothed samples."""
    return Smoothed(np.zeros((n, 3)), np.zeros(3), np.zeros(3))


def kalman_smooth(samples: Samples, jerk: Array, out: Smoothed | None = None) -> float:
    """Kalman filter for [x, v, a] with white jerk, and the smoother; return -log L.

    Smoothing is by the recursion of Bryson & Frazier (1963).

    Parameters
    ----------
    samples : what was measured
    jerk : (n,) intensity of the jerk on the way to each sample [m2/s5]
    out : filled with the smoothed motion; None: the likelihood alone is wanted
    """
    backward = out is not None
    n = len(samples.y) if backward else 1
    filled = out if out is not None else room(1)
    work = np.zeros((6, 9))
    total: float = _compiled()(samples, jerk, backward, filled, np.zeros((n, _COLUMNS)), work)
    return total


@cache
def _compiled() -> Callable[..., float]:
    from ..core.jit import compiled

    function: Callable[..., float] = compiled(_filter)
    return function


def _filter(samples: Any, jerk: Any, backward: bool, out: Any, kept: Any, work: Any) -> float:
    """Do the work of `kalman_smooth`; elements one by one, for slices take seconds to compile.

    `kept` has a row per sample, `work` six rows of room.
    """
    y, r, have, loss = samples.y, samples.r, samples.have, out.loss
    n = len(y)
    h = samples.dt
    h2 = 0.5 * h * h
    p, g, s, logs = work[0], work[1], work[2], work[3]
    for i in range(6):
        p[i] = samples.cov[i]
    x, v, a = samples.mean[0], samples.mean[1], samples.mean[2]
    for c in range(3):
        s[c], loss[c] = 1.0, 0.0
    total = growth = 0.0
    bounded = have[0] or have[1]  # of an acceleration alone, no covariance settles
    settled = False
    for k in range(n):
        whole = True
        for c in range(3):
            whole = whole and (not have[c] or np.isfinite(y[k, c]))
        if k > 0:
            settled = settled and whole and jerk[k] == jerk[k - 1]
            x, v, a = x + h * v + h2 * a, v + h * a, a
            growth = growth if settled else -p[0]
            if not settled:
                _predict(p, h, jerk[k])
        if backward:
            kept[k, _MEAN], kept[k, _MEAN + 1], kept[k, _MEAN + 2] = x, v, a
            if not settled:
                for i in range(6):
                    kept[k, i] = p[i]
        change = 0.0
        for c in range(3):
            if not have[c] or not np.isfinite(y[k, c]):
                continue
            if not settled:
                change = max(change, _measure(p, c, r[c], g, s, logs))
            e = y[k, c] - (x if c == 0 else v if c == 1 else a)
            share = e / s[c]
            total += logs[c] + 0.5 * e * share
            loss[c] += e * share / n
            x += g[3 * c] * e
            v += g[3 * c + 1] * e
            a += g[3 * c + 2] * e
            if backward:
                kept[k, _SHARE + c], kept[k, _SIZE + c] = share, s[c]
                for i in range(3 * c, 3 * c + 3):
                    kept[k, _GAIN + i] = g[i]
        if settled:
            # What no channel tells drifts: the displacement's variance grows on, and it alone.
            drift = 0.0 if have[0] else growth
            p[0] += drift
            if backward:
                for i in range(6):
                    kept[k, i] = kept[k - 1, i]
                kept[k, 0] += drift
        else:
            growth += p[0]
        settled = settled or (bounded and whole and k > 10 and change < _SETTLED)
    if backward:
        _smooth_back(samples, kept, out, work)
    return total


def _predict(p: Any, h: float, jerk: float) -> None:
    """Move a covariance (6,) on by a step h [s] under white jerk."""
    h2 = 0.5 * h * h
    a00, a01, a02, a11, a12, a22 = p[0], p[1], p[2], p[3], p[4], p[5]
    b01, b02, b12 = a01 + h * a11 + h2 * a12, a02 + h * a12 + h2 * a22, a12 + h * a22
    b00 = a00 + h * a01 + h2 * a02
    b11 = a11 + h * a12
    p[0] = b00 + h * b01 + h2 * b02 + jerk * h**5 / 20.0
    p[1] = b01 + h * b02 + jerk * h**4 / 8.0
    p[2] = b02 + jerk * h**3 / 6.0
    p[3] = b11 + h * b12 + jerk * h**3 / 3.0
    p[4] = b12 + jerk * h**2 / 2.0
    p[5] = a22 + jerk * h


def _measure(p: Any, c: int, r: float, g: Any, s: Any, logs: Any) -> float:
    """Take up channel c of variance r; return by how much gain and innovation's variance changed.

    `p` (6,) is updated; `g` (9,) gains, `s` (3,) variances of innovations and `logs` (3,) half
    their logarithms are filled for the channel.
    """
    i0, i1, i2 = p[2], p[4], p[5]
    if c == 0:
        i0, i1, i2 = p[0], p[1], p[2]
    elif c == 1:
        i0, i1, i2 = p[1], p[3], p[4]
    size = (i0 if c == 0 else i1 if c == 1 else i2) + r
    g0, g1, g2 = i0 / size, i1 / size, i2 / size
    change: float = max(abs(size - s[c]) / size, abs(g2 - g[3 * c + 2]) / (abs(g2) + 1e-300))
    s[c], logs[c] = size, 0.5 * np.log(size)
    g[3 * c], g[3 * c + 1], g[3 * c + 2] = g0, g1, g2
    p[0] -= g0 * i0
    p[1] -= g0 * i1
    p[2] -= g0 * i2
    p[3] -= g1 * i1
    p[4] -= g1 * i2
    p[5] -= g2 * i2
    # The channel's own row without a difference, for its variance may be tiny beside the state's.
    left = r / size
    if c == 0:
        p[0], p[1], p[2] = i0 * left, i1 * left, i2 * left
    elif c == 1:
        p[1], p[3], p[4] = i0 * left, i1 * left, i2 * left
    else:
        p[2], p[4], p[5] = i0 * left, i1 * left, i2 * left
    return change


def _square(
    a: float, b: float, c: float, L: Any,
) -> float:  # fmt: skip
    """Return w' L w for w = [a, b, c]."""
    return (  # type: ignore[no-any-return]
        a * (L[0, 0] * a + L[0, 1] * b + L[0, 2] * c)
        + b * (L[1, 0] * a + L[1, 1] * b + L[1, 2] * c)
        + c * (L[2, 0] * a + L[2, 1] * b + L[2, 2] * c)
    )


def _smooth_back(samples: Any, kept: Any, out: Any, work: Any) -> None:
    """Fill the state and its variances from what the filter kept."""
    y, have, state, cov = samples.y, samples.have, out.state, out.cov
    n = len(y)
    h = samples.dt
    h2 = 0.5 * h * h
    m, across, L = work[0], work[1], work[2:5]
    for i in range(5):
        for j in range(9):
            work[i, j] = 0.0
    for k in range(n - 1, -1, -1):
        wanted = k >= n // 2
        for c in (2, 1, 0):
            if not have[c] or not np.isfinite(y[k, c]):
                continue
            at = _GAIN + 3 * c
            g0, g1, g2 = kept[k, at], kept[k, at + 1], kept[k, at + 2]
            m[c] -= g0 * m[0] + g1 * m[1] + g2 * m[2] + kept[k, _SHARE + c]
            if wanted:  # L = (I - g H)' L (I - g H) + H' H / s
                for i in range(3):
                    across[i] = g0 * L[0, i] + g1 * L[1, i] + g2 * L[2, i]
                for i in range(3):
                    L[c, i] -= across[i]
                for i in range(3):
                    across[i] = L[i, 0] * g0 + L[i, 1] * g1 + L[i, 2] * g2
                for i in range(3):
                    L[i, c] -= across[i]
                L[c, c] += 1.0 / kept[k, _SIZE + c]
        p00, p01, p02, p11, p12, p22 = (
            kept[k, 0], kept[k, 1], kept[k, 2], kept[k, 3], kept[k, 4], kept[k, 5],
        )  # fmt: skip
        state[k, 0] = kept[k, _MEAN] - (p00 * m[0] + p01 * m[1] + p02 * m[2])
        state[k, 1] = kept[k, _MEAN + 1] - (p01 * m[0] + p11 * m[1] + p12 * m[2])
        state[k, 2] = kept[k, _MEAN + 2] - (p02 * m[0] + p12 * m[1] + p22 * m[2])
        if k == n // 2:
            # The diagonal of P - P L P.
            cov[0] = p00 - _square(p00, p01, p02, L)
            cov[1] = p11 - _square(p01, p11, p12, L)
            cov[2] = p22 - _square(p02, p12, p22, L)
        m0, m1 = m[0], m[1]
        m[1] = m1 + h * m0
        m[2] = m[2] + h * m1 + h2 * m0
        if wanted:  # L = F' L F
            for i in range(3):
                L[i, 2] += h * L[i, 1] + h2 * L[i, 0]
                L[i, 1] += h * L[i, 0]
            for i in range(3):
                L[2, i] += h * L[1, i] + h2 * L[0, i]
                L[1, i] += h * L[0, i]
