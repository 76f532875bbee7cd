"""A closed loop of its own for searches: the paper's building and LuGre damper under four laws.

The controllers' laws and the damper's are the library's; motion by Runge-Kutta, four steps per
sample of 2 ms (two in searches). Measured without noise, with the voltage before; the new one acts
at once.
"""

from __future__ import annotations

from functools import cache
from math import exp
from pathlib import Path
from typing import Any

import numpy as np
from scipy import linalg

from bristle.component import control_laws
from bristle.component.controller_file import read_controller
from bristle.core.arrays import Array
from bristle.core.jit import compiled
from bristle.physics.building import paper_building
from bristle.physics.laws import law_code
from bristle.physics.laws.lugre import LuGre

SAMPLE = 0.002
"""Sample period [s]."""
PARTS = 8
"""Values of the ground acceleration per sample period."""
PASSIVE, CLIPPED, FEEDBACK, ESTIMATED = range(4)
STILL = 0.3
"""Force per volt [N/V] below which the voltage does next to nothing: it is then held."""

LUGRE = law_code("lugre")
force_of_law = control_laws.force_of_law
estimate_states = control_laws.estimate_states
clipped_voltage = control_laws.clipped_voltage
limited = control_laws.limited
command, advance = control_laws.command, control_laws.advance


def rates(x, ground, V, K, C, mass, p, out):  # type: ignore[no-untyped-def]
    """Fill out (7,) with the rates of x (7,): displacements, velocities, bristle deflection."""
    force = force_of_law(LUGRE, p, x[3], V, x[6:7])
    for i in range(3):
        out[i] = x[3 + i]
        load = force if i == 0 else 0.0
        for j in range(3):
            load += K[i, j] * x[j] + C[i, j] * x[3 + j]
        out[3 + i] = -load / mass[i] - ground
    out[6] = x[3] - p[6] * abs(x[3]) * x[6]


def step(x, ground, at, stride, V, h, K, C, mass, p, work):  # type: ignore[no-untyped-def]
    """Advance x by h [s]; `ground` is read at `at`, half a step and a step later."""
    k1, k2, k3, k4, mid = work[0], work[1], work[2], work[3], work[4]
    rates(x, ground[at], V, K, C, mass, p, k1)
    for i in range(7):
        mid[i] = x[i] + 0.5 * h * k1[i]
    rates(mid, ground[at + stride], V, K, C, mass, p, k2)
    for i in range(7):
        mid[i] = x[i] + 0.5 * h * k2[i]
    rates(mid, ground[at + stride], V, K, C, mass, p, k3)
    for i in range(7):
        mid[i] = x[i] + h * k3[i]
    rates(mid, ground[at + 2 * stride], V, K, C, mass, p, k4)
    for i in range(7):
        x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])


def voltage(gains, x, swing, z, p):  # type: ignore[no-untyped-def]
    """Return the voltage [V] at which a state x (6,) gets the force that feedback asks for.

    The feedback is linear at a given `swing` [m], the base's recent drift.
    """
    u, share = 0.0, swing / (swing + 0.008) - 0.5
    for i in range(6):
        u += (gains[i] + share * gains[6 + i]) * x[i]
    f_0 = force_of_law(LUGRE, p, x[3], 0.0, z)
    slope = force_of_law(LUGRE, p, x[3], 1.0, z) - f_0
    if abs(slope) < STILL:
        return limited(gains[13], 0.0, 8.0)
    return limited((u - f_0) / slope, 0.0, 8.0)


def observe(e, y, x, v, seen, correct, out):  # type: ignore[no-untyped-def]
    """Correct the predicted state e (6,) by what is measured, into out (6,)."""
    shown = -y
    for i in range(6):
        shown += seen[i] * e[i]
    for i in range(6):
        out[i] = e[i] - correct[i, 0] * shown - correct[i, 1] * (e[0] - x)
        out[i] -= correct[i, 2] * (e[3] - v)


def simulate(  # type: ignore[no-untyped-def]
    law, ground, steps, K, C, mass, p, gains, n, A, B, W, hidden, free, push, seen, correct, work,
    state, out,
):  # fmt: skip
    """Fill out (samples + 1, 2) with the second floor's absolute acceleration and the voltage."""
    x, e, spare, z = work[5], work[6], work[7], work[8, :1]
    swing, V = 0.0, gains[13] if law == 0 else 0.0
    kept = exp(-0.002 / (0.3 + abs(gains[12])))
    stride = 8 // (2 * steps)
    for k in range(len(out)):
        y = -(seen[6] * x[1] + seen[7] * x[2] + seen[8] * x[4] + seen[9] * x[5])
        swing = max(abs(x[0]), swing * kept)
        if law == 1:
            u = command(n, hidden, 0, state[0])
            V = clipped_voltage(u, force_of_law(LUGRE, p, x[3], V, x[6:7]), 0.5, 8.0)
            advance(n, A, B, W, 0, state[0], (y, 0.0), state[1])
        elif law == 2:
            V = voltage(gains, x, swing, x[6:7], p)
        elif law == 3:
            observe(e, y, x[0], x[3], seen, correct, spare)
            V = voltage(gains, spare, swing, z, p)
            force = force_of_law(LUGRE, p, x[3], V, z)
            estimate_states(LUGRE, p, x[3], V, 0.002, z)
            for i in range(6):
                e[i] = push[i] * force
                for j in range(6):
                    e[i] += free[i, j] * spare[j]
        out[k, 0], out[k, 1] = y, V
        if k == len(out) - 1:
            break
        for q in range(steps):
            at = 8 * k + 2 * stride * q
            step(x, ground, at, stride, V, 0.002 / steps, K, C, mass, p, work)


@cache
def _compiled() -> Any:
    return compiled(simulate)


@cache
def _plant() -> tuple[Array, Array, Array, Array, Array]:
    """Return K, C, mass, A (6, 6) and the column of the damper's force (6, 1)."""
    b = paper_building()
    K, C, mass = np.array(b.K), np.array(b.C), np.diag(np.array(b.M)).copy()
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-K / mass[:, None], -C / mass[:, None]]])
    return K, C, mass, A, np.array([[0.0], [0.0], [0.0], [-1.0 / mass[0]], [0.0], [0.0]])


def floor_row() -> Array:
    """Return the row (6,) that gives the second floor's absolute acceleration of a state."""
    K, C, mass, _, _ = _plant()
    row: Array = np.concatenate([-K[2], -C[2]]) / mass[2]
    return row


def lq_gains(drift: float, force: float) -> Array:
    """Return the gains (6,) that minimise the mean of y^2 + drift x_b^2 + force u^2."""
    A, B = _plant()[3:]
    Q = np.outer(floor_row(), floor_row()) + np.diag([drift, 0.0, 0.0, 0.0, 0.0, 0.0])
    P = linalg.solve_continuous_are(A, B, Q, [[force]])
    gains: Array = -(B.T @ P)[0] / force
    return gains


@cache
def _observer() -> tuple[Array, Array, Array]:
    """Return the sampled plant (6, 6), its force's column (6,), and the filter's gain (6, 3).

    A Kalman filter for white ground acceleration of 1 m/s2 and noise of 0.04 m/s2, 0.1 mm, 1 mm/s.
    """
    A, B = _plant()[3:]
    ground = np.array([[0.0], [0.0], [0.0], [-1.0], [-1.0], [-1.0]])
    both = np.zeros((8, 8))
    both[:6, :6], both[:6, 6:] = A, np.hstack([B, ground])
    stepped = linalg.expm(both * SAMPLE)
    free, push, shaken = stepped[:6, :6], stepped[:6, 6], stepped[:6, 7:]
    seen = np.vstack([floor_row(), np.eye(6)[0], np.eye(6)[3]])
    noise = np.diag([0.04**2, 1e-4**2, 1e-3**2])
    P = linalg.solve_discrete_are(free.T, seen.T, shaken @ shaken.T + 1e-12 * np.eye(6), noise)
    gain = P @ seen.T @ np.linalg.inv(seen @ P @ seen.T + noise)
    return free.copy(), push.copy(), gain


@cache
def _hinf() -> Any:
    import bristle

    return read_controller(Path(bristle.__file__).parent / "component" / "data" / "hinf.json")


def run(law: int, ground: Array, gains: Array, quick: bool = False) -> Array:
    """Return (samples + 1, 2): the second floor's absolute acceleration [m/s2], the voltage [V].

    Parameters
    ----------
    law : int
        PASSIVE (gains[13] is the voltage), CLIPPED (the reference H-infinity design), FEEDBACK of
        the true state, ESTIMATED: of what an observer makes of y, base displacement and velocity.
    ground : (n,) array
        Ground acceleration [m/s2] every 0.25 ms.
    gains : (14,) array
        Of displacements and velocities [N/m, N s/m]; what is added to them times a share that goes
        from -1/2 at rest to 1/2 under large swings; how long a swing is remembered, less 0.3 s;
        the voltage [V] where it does next to nothing.
    quick : bool
        Two steps per sample in place of four.
    """
    K, C, mass, _, _ = _plant()
    free, push, correct = _observer()
    c, row = _hinf(), floor_row()
    seen = np.concatenate([row, -row[[1, 2, 4, 5]]])
    p = np.array([parameter.value for parameter in LuGre.parameters.values()])
    out = np.zeros(((len(ground) - 1) // PARTS + 1, 2))
    _compiled()(
        law, ground, 2 if quick else 4, K, C, mass, p, np.asarray(gains, dtype=np.float64), c.n,
        np.array(c.A), np.array(c.B), np.array(c.W), np.array(c.C), free, push, seen, correct,
        np.zeros((9, 7)), np.zeros((2, c.n)), out,
    )  # fmt: skip
    return out


def peak(law: int, ground: Array, gains: Array, quick: bool = False) -> float:
    """Return the peak of the second floor's absolute acceleration [m/s2]; see `run`."""
    return float(np.abs(run(law, ground, gains, quick)[:, 0]).max())
