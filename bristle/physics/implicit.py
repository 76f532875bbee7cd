"""Advances a damper's states that move by `rate`, implicitly."""

from __future__ import annotations

from .damper_source import evaluate
from .inputs import Inputs, Setup
from .linear import Row, solve_in_place

IMPLICIT_STEP = 5e-4
"""Longest substep [s] of states that move by `rate`."""

_GAMMA = 1.0 - 0.5 * 2.0**0.5


def between(begin: Inputs, end: Inputs, share: float, dt: float) -> Inputs:
    """Return the inputs at a share of the way from begin to end.

    Parameters
    ----------
    begin, end : Inputs
    share : 0 at begin, 1 at end; motion and voltage are linear between, the rest is that of the end
    dt : length of the step that the result is for [s]
    """
    return Inputs(
        begin.x + share * (end.x - begin.x),
        begin.v + share * (end.v - begin.v),
        begin.a + share * (end.a - begin.a),
        begin.V + share * (end.V - begin.V),
        dt,
        end.energy,
        end.stick_force,
        end.sticks,
    )


def advance_implicit(setup: Setup, begin: Inputs, end: Inputs, z: Row, work: Row) -> None:
    """Advance the states that move by `rate` over a step, with inputs linear in time.

    Rosenbrock's method of order two and L-stable (ROS2: Verwer, Spee, Blom & Hundsdorfer 1999,
    SIAM J. Sci. Comput. 20(4)), Jacobian by differences. As many equal substeps as keep each below
    `IMPLICIT_STEP`.

    Parameters
    ----------
    setup : Setup
    begin, end : Inputs at begin and end of the step of end.dt [s]
    z : (k,) state, advanced in place
    work : room for `damper.room` floats or more
    """
    moving, n, size = setup.moving, setup.n_moving, len(z)
    f = work[0:size]
    g = work[size : 2 * size]
    y = work[2 * size : 3 * size]
    unused = work[3 * size : 4 * size]
    k1 = work[4 * size : 5 * size]
    k2 = work[5 * size : 6 * size]
    drift = work[6 * size : 7 * size]
    matrix = work[7 * size : 7 * size + n * n]
    copy = work[7 * size + n * n : 7 * size + 2 * n * n]
    count = max(1, int(end.dt / IMPLICIT_STEP + 0.999999))
    h = end.dt / count
    for k in range(count):
        now = between(begin, end, k / count, h)
        then = between(begin, end, (k + 1.0) / count, h)
        for i in range(size):
            y[i] = z[i]
        evaluate(setup, now, y, f, unused)
        evaluate(setup, then, y, g, unused)
        for i in range(n):
            at = int(moving[i])  # a whole number, but a float among the others of a store
            drift[i] = _GAMMA * (g[at] - f[at])  # gamma h times the rate's own rate
        for j in range(n):
            slot = int(moving[j])
            nudge = 1e-8 + 1e-6 * abs(z[slot])
            y[slot] = z[slot] + nudge
            evaluate(setup, then, y, unused, k1)
            y[slot] = z[slot]
            for i in range(n):
                at = int(moving[i])
                matrix[i * n + j] = -_GAMMA * h * (unused[at] - g[at]) / nudge
            # What grows is left to the explicit part: 1 - gamma h J would pass through zero there,
            # and the method keeps its order with any matrix.
            matrix[j * n + j] = 1.0 + max(matrix[j * n + j], 0.0)
        for i in range(n):
            k1[i] = f[int(moving[i])] + drift[i]
        for i in range(n * n):
            copy[i] = matrix[i]
        solve_in_place(copy, k1, n)
        for i in range(n):
            at = int(moving[i])
            y[at] = z[at] + h * k1[i]
        evaluate(setup, then, y, g, unused)
        for i in range(n):
            k2[i] = g[int(moving[i])] - 2.0 * k1[i] - drift[i]
        solve_in_place(matrix, k2, n)
        for i in range(n):
            z[int(moving[i])] += h * (1.5 * k1[i] + 0.5 * k2[i])
