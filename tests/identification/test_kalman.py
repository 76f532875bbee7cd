"""The smoother against the textbook's: matrices, Rauch, Tung & Striebel (1965), no shortcut."""

from __future__ import annotations

import numpy as np
import pytest

from bristle.identification.kalman import Samples, kalman_smooth, room

N, DT = 400, 0.01


def textbook(samples, jerk):
    """Return the smoothed states (n, 3), the variances in the middle (3,), and -log L."""
    F = np.array([[1.0, DT, DT**2 / 2.0], [0.0, 1.0, DT], [0.0, 0.0, 1.0]])
    Q = np.array(
        [
            [DT**5 / 20.0, DT**4 / 8.0, DT**3 / 6.0],
            [DT**4 / 8.0, DT**3 / 3.0, DT**2 / 2.0],
            [DT**3 / 6.0, DT**2 / 2.0, DT],
        ]
    )
    m, P = samples.mean.copy(), np.zeros((3, 3))
    P[np.triu_indices(3)] = samples.cov
    P = P + np.triu(P, 1).T
    before, after, cost = [], [], 0.0
    for k, row in enumerate(samples.y):
        if k:
            m, P = F @ m, F @ P @ F.T + jerk[k] * Q
        before.append((m, P))
        seen = samples.have & np.isfinite(row)
        if seen.any():
            H = np.eye(3)[seen]
            S, e = H @ P @ H.T + np.diag(samples.r[seen]), row[seen] - H @ m
            K = P @ H.T @ np.linalg.inv(S)
            cost += 0.5 * (np.linalg.slogdet(S)[1] + e @ np.linalg.solve(S, e))
            m, P = m + K @ e, P - K @ S @ K.T
        after.append((m, P))
    states, middle = [m], P
    for k in range(len(samples.y) - 2, -1, -1):
        G = after[k][1] @ F.T @ np.linalg.inv(before[k + 1][1])
        m = after[k][0] + G @ (m - before[k + 1][0])
        P = after[k][1] + G @ (P - before[k + 1][1]) @ G.T
        states.append(m)
        middle = P if k == len(samples.y) // 2 else middle
    return np.array(states[::-1]), np.diag(middle), cost


@pytest.mark.parametrize("have", [(1, 1, 0), (1, 0, 0), (0, 1, 0), (1, 0, 1), (1, 1, 1), (0, 0, 1)])
@pytest.mark.parametrize("what", ["whole", "a gap", "a channel's gap", "a jump"])
def test_the_smoother_is_the_textbooks(have, what):
    random = np.random.default_rng(5)
    r = np.array([1e-3, 1e-2, 1e-1]) ** 2
    t = DT * np.arange(N)
    motion = np.column_stack([np.sin(3.0 * t), 3.0 * np.cos(3.0 * t), -9.0 * np.sin(3.0 * t)])
    y = motion + random.standard_normal((N, 3)) * np.sqrt(r)
    jerk = np.full(N, 30.0)
    if what == "a gap":
        y[150:160] = np.nan
    elif what == "a channel's gap":
        y[150:160, int(np.flatnonzero(have)[0])] = np.nan
    elif what == "a jump":
        jerk[180] = 1e4
    cov = np.array([1e-2, 0.0, 0.0, 1.0, 0.0, 100.0])
    samples = Samples(y, r, np.array(have, dtype=bool), DT, np.array([0.0, 3.0, 0.0]), cov)
    out = room(N)
    cost = kalman_smooth(samples, jerk, out)
    states, middle, expected = textbook(samples, jerk)
    size = np.abs(states).max(axis=0)
    assert np.abs(out.state - states).max(axis=0) == pytest.approx(
        np.zeros(3), abs=1e-7 * size.max()
    )
    assert out.cov == pytest.approx(middle, rel=1e-5)
    assert cost == pytest.approx(expected, rel=1e-9)
    assert kalman_smooth(samples, jerk) == cost
