"""The numeric kernels of the motion smoother, compiled.

The covariances of the filter settle after some samples and then stay: from there on gains are kept,
which is what makes smoothing cheap enough to draw errors by it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SETTLED = 1e-12
"""Relative change of a covariance in a sample below which it stays."""


def kalman_smooth(
    y: Array, r: Array, have: NDArray[np.bool_], dt: float, jerk: float, backward: bool,
    state: Array, cov: Array, loss: Array,
) -> float:  # fmt: skip
    """Kalman filter and smoother for [x, v, a] with white jerk; return -log L.

    Parameters
    ----------
    y : (n, 2) displacement and velocity [m, m/s]; what is not finite was not measured
    r, have : (2,) variances [m2, m2/s2]; (2,) whether a channel is there at all
    dt, jerk : step [s], intensity of the jerk [m2/s5]
    backward : whether to smooth, by the recursion of Bryson & Frazier (1963), and to fill
    state, cov : (n, 3) the motion [m, m/s, m/s2]; (3,) its variances in the middle
    loss : (2,) mean squares of the normalised innovations, filled either way
    """
    n = len(y) if backward else 1
    total: float = _compiled()(
        y, r, have, dt, jerk, backward, state, cov, loss, np.zeros((n, 17)), np.zeros((6, 6))
    )
    return total


@cache
def _compiled() -> Callable[..., float]:
    from ..jit import compiled

    function: Callable[..., float] = compiled(_filter)
    return function


def _filter(
    y: Any, r: Any, have: Any, dt: float, jerk: float, backward: bool, state: Any, cov: Any,
    loss: Any, kept: Any, work: Any,
) -> float:  # fmt: skip
    """Do the work of `kalman_smooth`; elements one by one, for slices take seconds to compile.

    `kept` has a row per sample: the predicted covariance (6), two gains (3 each), the prediction
    (3), the shares of the innovations (2). `work` has six rows of room.
    """
    n = len(y)
    h, h2 = dt, 0.5 * dt * dt
    q00, q01, q02 = jerk * dt**5 / 20.0, jerk * dt**4 / 8.0, jerk * dt**3 / 6.0
    q11, q12, q22 = jerk * dt**3 / 3.0, jerk * dt**2 / 2.0, jerk * dt
    p, g, s, logs = work[0], work[1], work[2], work[3]
    x, v = _start(y, r, have, dt, p)
    a = 0.0
    s[0] = s[1] = 1.0
    total = loss[0] = loss[1] = 0.0
    settled = False
    for k in range(n):
        if k > 0:
            x, v, a = x + h * v + h2 * a, v + h * a, a
            if not settled:
                a00, a01, a02, a11, a12, a22 = p[0], p[1], p[2], p[3], p[4], p[5]
                b01, b02, b12 = a01 + h * a11 + h2 * a12, a02 + h * a12 + h2 * a22, a12 + h * a22
                b00 = a00 + h * a01 + h2 * a02
                b11 = a11 + h * a12
                p[0] = b00 + h * b01 + h2 * b02 + q00
                p[1] = b01 + h * b02 + q01
                p[2] = b02 + q02
                p[3] = b11 + h * b12 + q11
                p[4] = b12 + q12
                p[5] = a22 + q22
        if backward:
            kept[k, 12], kept[k, 13], kept[k, 14] = x, v, a
            if not settled:
                for i in range(6):
                    kept[k, i] = p[i]
        change = 0.0
        both = True
        for c in range(2):
            if not have[c]:
                continue
            if not np.isfinite(y[k, c]):
                both = False
                settled = False
                if backward:
                    for i in range(3):
                        kept[k, 6 + 3 * c + i] = 0.0
                continue
            if not settled:
                i0, i1, i2 = (p[0], p[1], p[2]) if c == 0 else (p[1], p[3], p[4])
                size = (i0 if c == 0 else i1) + r[c]
                g0, g1, g2 = i0 / size, i1 / size, i2 / size
                change = max(change, abs(size - s[c]) / size)
                change = max(change, abs(g2 - g[3 * c + 2]) / (abs(g2) + 1e-300))
                s[c], logs[c] = size, 0.5 * np.log(size)
                g[3 * c], g[3 * c + 1], g[3 * c + 2] = g0, g1, g2
                p[0] -= g0 * i0
                p[1] -= g0 * i1
                p[2] -= g0 * i2
                p[3] -= g1 * i1
                p[4] -= g1 * i2
                p[5] -= g2 * i2
            e = y[k, c] - (x if c == 0 else v)
            share = e / s[c]
            total += logs[c] + 0.5 * e * share
            loss[c] += e * share / n
            x += g[3 * c] * e
            v += g[3 * c + 1] * e
            a += g[3 * c + 2] * e
            if backward:
                kept[k, 15 + c] = share
                for i in range(3 * c, 3 * c + 3):
                    kept[k, 6 + i] = g[i]
        if backward and k > 0 and settled:
            for i in range(6):
                kept[k, i] = kept[k - 1, i]
        settled = settled or (both and k > 10 and change < _SETTLED)
    if backward:
        _smooth_back(kept, have, y, r, h, h2, state, cov, work)
    return total


def _start(
    y: Any, r: Any, have: Any, dt: float, p: Any,
) -> tuple[float, float]:  # fmt: skip
    """Return x, v before the first sample; fill their covariance (6,), wide if nothing tells."""
    n = len(y)
    c = 0 if have[0] else 1
    first, before, fastest = 0.0, 0.0, 0.0
    seen = 0
    for k in range(n):
        if np.isfinite(y[k, c]):
            if seen == 0:
                first = y[k, c]
            elif k > 0 and np.isfinite(y[k - 1, c]):
                fastest = max(fastest, abs(y[k, c] - before) / dt)
            before = y[k, c]
            seen += 1
    x, v = 0.0, 0.0
    if have[0]:
        x = first
        p[0] = 4.0 * r[0] + 1e-30
        speed = fastest
    if have[1]:
        speed = 0.0
        for k in range(n):
            if np.isfinite(y[k, 1]):
                v = y[k, 1]
                speed = 2.0 * np.sqrt(r[1])
                break
    if not have[0]:
        p[0] = 1e-30  # where the motion begins is not known: it is called zero
    p[3] = speed * speed + 1e-30
    p[5] = (2.0 * fastest / dt if have[0] else 2.0 * fastest) ** 2 + 1e-30
    if have[0] and have[1]:
        p[5] = 1e4 * r[1] / (dt * dt) / n + 1e-30
    return x, v


def _square(
    a: float, b: float, c: float, L: Any,
) -> float:  # fmt: skip
    """Return w' L w for w = [a, b, c]."""
    return (  # type: ignore[no-any-return]
        a * (L[0, 0] * a + L[0, 1] * b + L[0, 2] * c)
        + b * (L[1, 0] * a + L[1, 1] * b + L[1, 2] * c)
        + c * (L[2, 0] * a + L[2, 1] * b + L[2, 2] * c)
    )


def _smooth_back(
    kept: Any, have: Any, y: Any, r: Any, h: float, h2: float, state: Any, cov: Any, work: Any,
) -> None:  # fmt: skip
    """Fill `state` and `cov` from what the filter kept."""
    n = len(y)
    m, across, L = work[0], work[1], work[2:5]
    for i in range(5):
        for j in range(6):
            work[i, j] = 0.0
    for k in range(n - 1, -1, -1):
        wanted = k >= n // 2
        for c in (1, 0):
            if not have[c] or not np.isfinite(y[k, c]):
                continue
            g0, g1, g2 = kept[k, 6 + 3 * c], kept[k, 7 + 3 * c], kept[k, 8 + 3 * c]
            own = g0 if c == 0 else g1
            m[c] -= g0 * m[0] + g1 * m[1] + g2 * m[2] + kept[k, 15 + c]
            if wanted:  # L = (I - g H)' L (I - g H) + H' H / s
                # The variance of this channel's innovation, behind the other's update for c = 1.
                size = r[c] / (1.0 - own) if own < 1.0 else kept[k, 0] + r[c]
                for i in range(3):
                    across[i] = g0 * L[0, i] + g1 * L[1, i] + g2 * L[2, i]
                for i in range(3):
                    L[c, i] -= across[i]
                for i in range(3):
                    across[i] = L[i, 0] * g0 + L[i, 1] * g1 + L[i, 2] * g2
                for i in range(3):
                    L[i, c] -= across[i]
                L[c, c] += 1.0 / size
        p00, p01, p02, p11, p12, p22 = (
            kept[k, 0], kept[k, 1], kept[k, 2], kept[k, 3], kept[k, 4], kept[k, 5],
        )  # fmt: skip
        state[k, 0] = kept[k, 12] - (p00 * m[0] + p01 * m[1] + p02 * m[2])
        state[k, 1] = kept[k, 13] - (p01 * m[0] + p11 * m[1] + p12 * m[2])
        state[k, 2] = kept[k, 14] - (p02 * m[0] + p12 * m[1] + p22 * m[2])
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
