"""A level's motion from all its instruments, and effects along a motion, compiled."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..physics import structure
from ..physics.effect import EFFECTS

Array = NDArray[np.float64]

effect_forces = structure.effect_forces
contact_force = structure.contact_force
advance_effects = structure.advance_effects


def _gain(P, B, h1, h2, A, G):  # type: ignore[no-untyped-def]
    """Fill G with P F^T B^-1, B symmetric and positive; A is room to work."""
    for i in range(3):
        A[i, 0] = P[i, 0] + h1 * P[i, 1] + h2 * P[i, 2]
        A[i, 1] = P[i, 1] + h1 * P[i, 2]
        A[i, 2] = P[i, 2]
    # Scaled by its diagonal, for its elements differ by many powers of ten.
    s0, s1, s2 = 1.0 / np.sqrt(B[0, 0]), 1.0 / np.sqrt(B[1, 1]), 1.0 / np.sqrt(B[2, 2])
    b, c, e = B[0, 1] * s0 * s1, B[0, 2] * s0 * s2, B[1, 2] * s1 * s2
    det = 1.0 - e * e - b * b - c * c + 2.0 * b * c * e
    i00, i11, i22 = (1.0 - e * e) / det, (1.0 - c * c) / det, (1.0 - b * b) / det
    i01, i02, i12 = (c * e - b) / det, (b * e - c) / det, (b * c - e) / det
    for i in range(3):
        a0, a1, a2 = A[i, 0] * s0, A[i, 1] * s1, A[i, 2] * s2
        G[i, 0] = (a0 * i00 + a1 * i01 + a2 * i02) * s0
        G[i, 1] = (a0 * i01 + a1 * i11 + a2 * i12) * s1
        G[i, 2] = (a0 * i02 + a1 * i12 + a2 * i22) * s2


def smooth_level(y, r, have, dt, jerk, backward, state, cov):  # type: ignore[no-untyped-def]
    """Kalman filter and smoother for [x, v, a] under white jerk; return -log likelihood.

    Parameters
    ----------
    y : (n, 3) measured x, v, a [m, m/s, m/s2]
    r, have : (3,) their variances; (3,) which of them count
    dt : sampling step [s]
    jerk : (n,) intensity on the way to each sample [m2/s5]
    backward : whether to smooth, and to fill `state` and `cov`
    state, cov : (n, 3) the motion; (3,) its variances away from the ends
    """
    n = len(y)
    h1, h2 = dt, 0.5 * dt * dt
    unit = (dt**5 / 20.0, dt**4 / 8.0, dt**3 / 6.0, dt**3 / 3.0, dt**2 / 2.0, dt)
    m = np.zeros(3)
    P = np.zeros((3, 3))
    spread = np.zeros(3)
    for c in range(3):
        if have[c]:
            m[c] = y[0, c]
        for k in range(n):
            spread[c] = max(spread[c], abs(y[k, c]))
    guess = max(spread[0], spread[1] * dt, spread[2] * dt * dt) + 1e-12
    P[0, 0] = r[0] * 4.0 if have[0] else guess * guess
    P[1, 1] = r[1] * 4.0 if have[1] else (guess / dt) ** 2 / n
    P[2, 2] = r[2] * 4.0 if have[2] else (guess / dt**2) ** 2 / n
    means = np.zeros((n, 3))
    predicted = np.zeros((n, 3))
    covs = np.zeros((n, 3, 3))
    predicted_covs = np.zeros((n, 3, 3))
    G = np.zeros((3, 3))
    A = np.zeros((3, 3))
    total = 0.0
    for k in range(n):
        if k > 0:
            m[0] += h1 * m[1] + h2 * m[2]
            m[1] += h1 * m[2]
            for j in range(3):  # P <- F P F^T + Q
                P[0, j] += h1 * P[1, j] + h2 * P[2, j]
                P[1, j] += h1 * P[2, j]
            for i in range(3):
                P[i, 0] += h1 * P[i, 1] + h2 * P[i, 2]
                P[i, 1] += h1 * P[i, 2]
            q = jerk[k]
            P[0, 0] += q * unit[0]
            P[0, 1] += q * unit[1]
            P[0, 2] += q * unit[2]
            P[1, 1] += q * unit[3]
            P[1, 2] += q * unit[4]
            P[2, 2] += q * unit[5]
            P[1, 0], P[2, 0], P[2, 1] = P[0, 1], P[0, 2], P[1, 2]
        for i in range(3):
            predicted[k, i] = m[i]
            for j in range(3):
                predicted_covs[k, i, j] = P[i, j]
        for c in range(3):
            if not have[c]:
                continue
            S = P[c, c] + r[c]
            e = y[k, c] - m[c]
            total += 0.5 * (np.log(S) + e * e / S)
            for i in range(3):
                spread[i] = P[c, i]
            for i in range(3):
                m[i] += spread[i] / S * e
                for j in range(3):
                    P[i, j] -= spread[i] / S * spread[j]
        for i in range(3):
            means[k, i] = m[i]
            for j in range(3):
                covs[k, i, j] = P[i, j]
    if not backward:
        return total
    for i in range(3):
        state[n - 1, i] = means[n - 1, i]
        for j in range(3):
            P[i, j] = covs[n - 1, i, j]
    for k in range(n - 2, -1, -1):
        _gain(covs[k], predicted_covs[k + 1], h1, h2, A, G)  # type: ignore[no-untyped-call]
        for i in range(3):
            state[k, i] = means[k, i]
            for j in range(3):
                state[k, i] += G[i, j] * (state[k + 1, j] - predicted[k + 1, j])
                P[i, j] -= predicted_covs[k + 1, i, j]
        for i in range(3):
            for j in range(3):
                A[i, j] = G[i, 0] * P[0, j] + G[i, 1] * P[1, j] + G[i, 2] * P[2, j]
        for i in range(3):
            for j in range(3):
                P[i, j] = covs[k, i, j] + (
                    A[i, 0] * G[j, 0] + A[i, 1] * G[j, 1] + A[i, 2] * G[j, 2]
                )
        if k == n // 2:
            for i in range(3):
                cov[i] = P[i, i]
    return total


@cache
def compiled_smooth_level() -> Callable[..., float]:
    """Return the compiled `smooth_level`; the first call on a machine takes seconds."""
    from ..jit import compiled

    function: Callable[..., float] = compiled(smooth_level, allocates=True)
    return function


def forces_along(
    n: int, stiffnesses: Any, isolated: bool, x: Any, v: Any, dt: float, z: Any, p: Any, on: Any,
    level: Any, forces: Any, z1: Any, out: Any,
) -> None:  # fmt: skip
    """Fill `out` (m,) with what effects add to the force of the highest of n levels.

    The levels below rest. A contact slides wherever the motion is not zero: whoever asks leaves out
    the samples at rest.

    Parameters
    ----------
    n : levels up to the one that moves
    stiffnesses : (n,) N/m below each level
    isolated : whether the first level is the base on its isolation layer
    x, v : (m,) motion relative to the level below [m, m/s]
    dt : sampling step [s]
    z : states of all effects, moved on in place
    p, on : flat parameters of all effects [SI], and (effects,) whether each is on
    level, forces, z1 : room for (2 n,), (n,) floats and for as many states
    out : (m,) N, filled
    """
    for k in range(len(x)):
        if k > 0:
            level[n - 1] = 0.5 * (x[k - 1] + x[k])
            level[2 * n - 1] = 0.5 * (v[k - 1] + v[k])
            stick_force = 1e300 if level[2 * n - 1] > 0.0 else -1e300
            advance_effects(
                n, isolated, stiffnesses, level, dt, 0.0, stick_force, 0.0, z, p, on, z1
            )
            for i in range(len(z)):
                z[i] = z1[i]
        level[n - 1] = x[k]
        level[2 * n - 1] = v[k]
        stick_force = 1e300 if v[k] > 0.0 else -1e300
        effect_forces(n, isolated, stiffnesses, level, dt, 0.0, stick_force, z, p, on, forces)
        out[k] = forces[n - 1]
        if n == 1:
            out[k] += contact_force(n, isolated, stiffnesses, level, dt, 0.0, stick_force, z, p, on)


def compiled_forces() -> Callable[..., None]:
    """Return the compiled `forces_along`; the first call on a machine takes seconds."""
    return _compiled(structure.effect_forces)


@cache
def _compiled(effect_forces_now: Any) -> Callable[..., None]:
    """Compile with the generated functions of now: there are new ones after a new effect."""
    global effect_forces, contact_force, advance_effects
    from ..jit import compiled

    effect_forces = effect_forces_now
    contact_force, advance_effects = structure.contact_force, structure.advance_effects
    function: Callable[..., None] = compiled(forces_along)
    return function


class Along:
    """Evaluates effects of the structure along a motion.

    Parameters
    ----------
    effects : list of str
        The effects that are on; those of other sites are left out.
    storey : int
        0 for the isolation layer, else the number of the storey whose drift the motion is.
    """

    def __init__(self, effects: list[str], storey: int) -> None:
        slots = structure.SLOTS
        self.on = np.array([e.name in effects for e in slots.effects], dtype=np.bool_)
        self.active = bool(self.on.any())
        self._storey = storey
        self._forces = compiled_forces()

    def force(
        self, x: Array, v: Array, dt: float, stiffness: float, values: dict[str, float]
    ) -> Array:
        """Return the effects' force (m,) [N] along a motion.

        Parameters
        ----------
        x, v : (m,) motion relative to the level below [m, m/s]
        dt : sampling step [s]
        stiffness : of the linear spring there [N/m]
        values : parameters in SI by name, effect.parameter; missing ones take their defaults
        """
        out = np.zeros(len(x))
        if not self.active:
            return out
        slots = structure.SLOTS
        p = np.zeros(max(1, slots.p_size))
        for name, slot in slots.parameters.items():
            effect, own = name.split(".", 1)
            p[slot] = values.get(name, EFFECTS[effect].parameters[own].value)
        n = max(1, self._storey)
        z = np.array(structure.start_states(n, values) or [0.0])
        self._forces(
            n, np.full(n, stiffness), self._storey == 0, np.ascontiguousarray(x),
            np.ascontiguousarray(v), dt, z, p, self.on, np.zeros(2 * n), np.zeros(n),
            np.zeros_like(z), out,
        )  # fmt: skip
        return out
