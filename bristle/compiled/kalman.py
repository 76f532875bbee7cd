"""The numeric kernels of the motion smoother, compiled."""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(cache=True)
def kalman_smooth(y, r, have, dt, jerk, backward, state, cov, loss):  # type: ignore[no-untyped-def]
    """Kalman filter and smoother for [x, v, a]; fill `state` (n, 3), `cov` (3,); return -log L."""
    n = len(y)
    F = np.array([[1.0, dt, 0.5 * dt * dt], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])
    Q = jerk * np.array(
        [
            [dt**5 / 20.0, dt**4 / 8.0, dt**3 / 6.0],
            [dt**4 / 8.0, dt**3 / 3.0, dt**2 / 2.0],
            [dt**3 / 6.0, dt**2 / 2.0, dt],
        ]
    )
    m = np.zeros(3)
    m[0], m[1] = y[0, 0], y[0, 1]
    P = np.diag(
        np.array([r[0] * 4.0 + 1e-30, r[1] * 4.0 + 1e-30, 1e4 * r[1] / (dt * dt) / n + 1e-30])
    )
    means = np.zeros((n, 3))
    predicted = np.zeros((n, 3))
    covs = np.zeros((n, 3, 3))
    predicted_covs = np.zeros((n, 3, 3))
    total = 0.0
    loss[:] = 0.0
    for k in range(n):
        if k > 0:
            m = F @ m
            P = F @ P @ F.T + Q
        predicted[k] = m
        predicted_covs[k] = P
        for c in range(2):
            if not have[c]:
                continue
            S = P[c, c] + r[c]
            e = y[k, c] - m[c]
            total += 0.5 * (np.log(S) + e * e / S)
            loss[c] += e * e / S / n
            gain = P[:, c] / S
            m = m + gain * e
            row = P[c].copy()
            for i in range(3):
                for j in range(3):
                    P[i, j] -= gain[i] * row[j]
        means[k] = m
        covs[k] = P
    if not backward:
        return total
    state[n - 1] = means[n - 1]
    Ps = covs[n - 1].copy()
    middle = np.zeros(3)
    for k in range(n - 2, -1, -1):
        G = covs[k] @ F.T @ np.linalg.inv(predicted_covs[k + 1])
        state[k] = means[k] + G @ (state[k + 1] - predicted[k + 1])
        Ps = covs[k] + G @ (Ps - predicted_covs[k + 1]) @ G.T
        if k == n // 2:
            for i in range(3):
                middle[i] = Ps[i, i]
    for i in range(3):
        cov[i] = middle[i]
    return total


@numba.njit(cache=True)
def random_walk(F, steps):  # type: ignore[no-untyped-def]
    path = np.zeros_like(steps)
    for k in range(1, len(steps)):
        path[k] = F @ path[k - 1] + steps[k]
    return path
