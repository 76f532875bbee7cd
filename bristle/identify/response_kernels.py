"""The forces of a building's effects along a motion, compiled."""

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
