"""The forces of a building's effects along a motion, compiled."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..physics import structure
from ..physics.structure import advance_effects, contact_force, effect_forces

Array = NDArray[np.float64]


class Chain(NamedTuple):
    """The levels up to the one that moves, as effects of a building see them.

    `n` their number; `stiffnesses` (n,) below each [N/m]; `isolated` whether the first is the base
    on its isolation layer; `dt` the sampling step [s]; `level` (2 n,), `forces` (n,) and `states`
    room to work.
    """

    n: int
    stiffnesses: Array
    isolated: bool
    dt: float
    level: Array
    forces: Array
    states: Array


def forces_along(chain: Any, x: Any, v: Any, z: Any, p: Any, on: Any, out: Any) -> None:
    """Fill `out` (m,) with what effects add to the force of the highest level [N].

    The levels below rest. A contact slides wherever the motion is not zero: whoever asks leaves out
    the samples at rest.

    Parameters
    ----------
    chain : the levels up to the one that moves
    x, v : (m,) motion relative to the level below [m, m/s]
    z : states of all effects, moved on in place
    p, on : flat parameters of all effects [SI], and (effects,) whether each is on
    out : (m,) N, filled
    """
    n, stiffnesses, isolated, dt = chain.n, chain.stiffnesses, chain.isolated, chain.dt
    level, forces, z1 = chain.level, chain.forces, chain.states
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
        from ..jit import compiled

        functions = structure.functions_of(effects)
        self._slots = functions.slots
        self.on = np.array([e.name in effects for e in self._slots.effects], dtype=np.bool_)
        self.active = bool(self.on.any())
        self._storey = storey
        self._forces = compiled(functions.link(forces_along))  # seconds, once on a machine

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
        p = np.array(structure.pack(values, self._slots) or [0.0])
        n = max(1, self._storey)
        z = np.array(structure.start_states(n, values, self._slots) or [0.0])
        chain = Chain(
            n, np.full(n, stiffness), self._storey == 0, dt, np.zeros(2 * n), np.zeros(n),
            np.zeros_like(z),
        )  # fmt: skip
        path = np.ascontiguousarray(x), np.ascontiguousarray(v)
        self._forces(chain, *path, z, p, self.on, out)
        return out
