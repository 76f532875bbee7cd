"""The numeric kernels of the motion smoother, compiled.

The covariances of the filter settle after some samples and then stay: from there on gains are kept,
which is what makes smoothing cheap enough to draw errors by it.
"""

from __future__ import annotations

import numba
import numpy as np

_SETTLED = 1e-12
"""Relative change of a covariance in a sample below which it stays."""


@numba.njit(cache=True, nogil=True, error_model="numpy")
def kalman_smooth(y, r, have, dt, jerk, backward, state, cov, loss):  # type: ignore[no-untyped-def]
    """Kalman filter and smoother for [x, v, a] with white jerk; return -log L.

    Parameters
    ----------
    y : (n, 2) displacement and velocity; what is not finite was not measured
    r : (2,) variances; have : (2,) whether a channel is there at all
    dt, jerk : step [s], intensity of the jerk [m2/s5]
    backward : whether to smooth, by the recursion of Bryson & Frazier (1963), and to fill
    state, cov : (n, 3) the motion, (3,) its variances in the middle; loss (2,) mean squares of the
        normalised innovations, filled either way
    """
    n = len(y)
    h, h2 = dt, 0.5 * dt * dt
    q00, q01, q02 = jerk * dt**5 / 20.0, jerk * dt**4 / 8.0, jerk * dt**3 / 6.0
    q11, q12, q22 = jerk * dt**3 / 3.0, jerk * dt**2 / 2.0, jerk * dt
    x, v, a, p = _start(y, r, have, dt)
    means = np.zeros((n if backward else 1, 3))
    shares = np.zeros((n if backward else 1, 2))  # innovation over its variance
    kept = np.zeros((n if backward else 1, 12))  # predicted covariance (6), two gains (3 each)
    g = np.zeros(6)
    s, logs = np.ones(2), np.zeros(2)
    total = 0.0
    loss[:] = 0.0
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
            means[k, 0], means[k, 1], means[k, 2] = x, v, a
            if not settled:
                kept[k, :6] = p
        change = 0.0
        both = True
        for c in range(2):
            if not have[c]:
                continue
            if not np.isfinite(y[k, c]):
                both = False
                settled = False
                if backward:
                    kept[k, 6 + 3 * c : 9 + 3 * c] = 0.0
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
                shares[k, c] = share
                kept[k, 6 + 3 * c : 9 + 3 * c] = g[3 * c : 3 * c + 3]
        if backward and k > 0 and settled:
            kept[k, :6] = kept[k - 1, :6]
        settled = settled or (both and k > 10 and change < _SETTLED)
    if backward:
        _smooth_back(means, shares, kept, have, y, r, h, h2, state, cov)
    return total


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _start(y, r, have, dt):  # type: ignore[no-untyped-def]
    """Return x, v, a before the first sample and their covariance (6,), wide if nothing tells."""
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
    p = np.zeros(6)
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
    return x, v, 0.0, p


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _smooth_back(means, shares, kept, have, y, r, h, h2, state, cov):  # type: ignore[no-untyped-def]
    """Fill `state` and `cov` from what the filter kept."""
    n = len(means)
    m = np.zeros(3)
    L = np.zeros((3, 3))
    T = np.zeros((3, 3))
    for k in range(n - 1, -1, -1):
        wanted = k >= n // 2
        for c in (1, 0):
            if not have[c] or not np.isfinite(y[k, c]):
                continue
            g = kept[k, 6 + 3 * c : 9 + 3 * c]
            m[c] -= g[0] * m[0] + g[1] * m[1] + g[2] * m[2] + shares[k, c]
            if wanted:  # L = (I - g H)' L (I - g H) + H' H / s
                p = kept[k]
                # The variance of this channel's innovation, behind the other's update for c = 1.
                size = r[c] / (1.0 - g[c]) if g[c] < 1.0 else p[0] + r[c]
                for i in range(3):
                    T[c, i] = g[0] * L[0, i] + g[1] * L[1, i] + g[2] * L[2, i]
                for i in range(3):
                    L[c, i] -= T[c, i]
                across = L[0, :] * 0.0
                for i in range(3):
                    across[i] = L[i, 0] * g[0] + L[i, 1] * g[1] + L[i, 2] * g[2]
                for i in range(3):
                    L[i, c] -= across[i]
                L[c, c] += 1.0 / size
        p00, p01, p02, p11, p12, p22 = (
            kept[k, 0], kept[k, 1], kept[k, 2], kept[k, 3], kept[k, 4], kept[k, 5],
        )  # fmt: skip
        state[k, 0] = means[k, 0] - (p00 * m[0] + p01 * m[1] + p02 * m[2])
        state[k, 1] = means[k, 1] - (p01 * m[0] + p11 * m[1] + p12 * m[2])
        state[k, 2] = means[k, 2] - (p02 * m[0] + p12 * m[1] + p22 * m[2])
        if k == n // 2:
            P = np.array([[p00, p01, p02], [p01, p11, p12], [p02, p12, p22]])
            after = P - P @ L @ P
            for i in range(3):
                cov[i] = after[i, i]
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


@numba.njit(cache=True, nogil=True, error_model="numpy")
def random_walk(F, steps):  # type: ignore[no-untyped-def]
    """Return the path (n, m) of z_k = F z_k-1 + step_k, from zero."""
    n, m = steps.shape
    path = np.zeros_like(steps)
    for k in range(1, n):
        for i in range(m):
            total = steps[k, i]
            for j in range(m):
                total += F[i, j] * path[k - 1, j]
            path[k, i] = total
    return path
