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


def smooth_level(y, r, have, dt, jerk, backward, state, cov):  # type: ignore[no-untyped-def]
    """Kalman filter and smoother for [x, v, a] under white jerk; return -log likelihood.

    The way back is that of Bryson & Frazier (1963), which inverts no covariance: where one channel
    alone is measured, those of position, speed and acceleration are nearly singular together.

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
    m, P, column, L = np.zeros(3), np.zeros((3, 3)), np.zeros(3), np.zeros((3, 3))
    _at_rest(y, r, have, dt, m, P, column)  # type: ignore[no-untyped-call]
    predicted, covs = np.zeros((n, 3)), np.zeros((n, 3, 3))
    gains, shares, sizes = np.zeros((n, 3, 3)), np.zeros((n, 3)), np.zeros((n, 3))
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
                covs[k, i, j] = P[i, j]
        for c in range(3):
            if not have[c]:
                continue
            S = P[c, c] + r[c]
            e = y[k, c] - m[c]
            total += 0.5 * (np.log(S) + e * e / S)
            sizes[k, c], shares[k, c] = S, e / S
            for i in range(3):
                column[i] = P[c, i]
            for i in range(3):
                gains[k, c, i] = column[i] / S
                m[i] += gains[k, c, i] * e
            for i in range(3):
                for j in range(3):
                    # The channel's own row without a difference: r may be tiny beside P.
                    if i == c:
                        P[i, j] = column[j] * (r[c] / S)
                    elif j == c:
                        P[i, j] = column[i] * (r[c] / S)
                    else:
                        P[i, j] -= gains[k, c, i] * column[j]
    if backward:
        for i in range(3):
            m[i] = 0.0
        _smooth_back(  # type: ignore[no-untyped-call]
            predicted, covs, gains, shares, sizes, have, h1, h2, state, cov, m, column, L
        )  # fmt: skip
    return total


def _at_rest(y, r, have, dt, m, P, size):  # type: ignore[no-untyped-def]
    """Fill the state m (3,) before the first sample and its covariance P (3, 3).

    Where a channel is missing the fastest change of the one below it says how large its signal is.
    """
    n = len(y)
    fastest = 0.0
    for c in range(3):
        size[c] = 0.0
        if have[c]:
            m[c] = y[0, c]
        for k in range(n):
            size[c] = max(size[c], abs(y[k, c]))
    for k in range(1, n):
        fastest = max(fastest, abs(y[k, 0] - y[k - 1, 0]) / dt)
    guess = max(size[0], size[1] * dt, size[2] * dt * dt) + 1e-12
    speed, rise = guess / dt / np.sqrt(n), guess / dt**2 / np.sqrt(n)
    if have[0] and not have[1]:
        speed = 2.0 * fastest + 1e-12
    if not have[2]:
        rise = 2.0 * (size[1] if have[1] else fastest) / dt + 1e-12
    P[0, 0] = r[0] * 4.0 if have[0] else guess * guess
    P[1, 1] = r[1] * 4.0 if have[1] else speed * speed
    P[2, 2] = r[2] * 4.0 if have[2] else rise * rise


def _smooth_back(  # type: ignore[no-untyped-def]
    predicted, covs, gains, shares, sizes, have, h1, h2, state, cov, m, row, L
):
    """Fill `state` and `cov` from what the filter kept; m, row (3,), L (3, 3) begin at zero."""
    n = len(predicted)
    for k in range(n - 1, -1, -1):
        wanted = k >= n // 2
        for c in (2, 1, 0):
            if not have[c]:
                continue
            g0, g1, g2 = gains[k, c, 0], gains[k, c, 1], gains[k, c, 2]
            m[c] -= g0 * m[0] + g1 * m[1] + g2 * m[2] + shares[k, c]
            if wanted:  # L <- (I - g H)^T L (I - g H) + H^T H / S
                for j in range(3):
                    row[j] = g0 * L[0, j] + g1 * L[1, j] + g2 * L[2, j]
                for j in range(3):
                    L[c, j] -= row[j]
                for i in range(3):
                    row[i] = L[i, 0] * g0 + L[i, 1] * g1 + L[i, 2] * g2
                for i in range(3):
                    L[i, c] -= row[i]
                L[c, c] += 1.0 / sizes[k, c]
        for i in range(3):
            state[k, i] = predicted[k, i]
            for j in range(3):
                state[k, i] -= covs[k, i, j] * m[j]
        if k == n // 2:
            for i in range(3):
                cov[i] = covs[k, i, i]
                for j in range(3):
                    for q in range(3):
                        cov[i] -= covs[k, i, j] * L[j, q] * covs[k, q, i]
        m[2] += h1 * m[1] + h2 * m[0]
        m[1] += h1 * m[0]
        if wanted:  # L <- F^T L F
            for i in range(3):
                L[i, 2] += h1 * L[i, 1] + h2 * L[i, 0]
                L[i, 1] += h1 * L[i, 0]
            for j in range(3):
                L[2, j] += h1 * L[1, j] + h2 * L[0, j]
                L[1, j] += h1 * L[0, j]


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
