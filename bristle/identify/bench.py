"""A damper on a test bench, compiled: the force that a model predicts from a measured motion."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..physics import damper

Array = NDArray[np.float64]

damper_step = damper.step
damper_step_law = damper.step_law
damper_jump = damper.jump
damper_evaluate = damper.evaluate


_ONE_AT_A_TIME = Lock()

JUMP = 8.0
"""How many times the changes beside it a change of voltage exceeds that is a jump."""


def before_jump(V: Any, k: int) -> float:
    """Return the voltage [V] just before sample k, to which it goes from sample k - 1.

    A step of a voltage falls on a sample, so what jumps there was held before; what is smooth is
    linear between samples. A jump stands out against the changes before and after it.
    """
    change = JUMP * max(
        abs(V[k - 1] - V[k - 2]) if k > 1 else 0.0,
        abs(V[k + 1] - V[k]) if k + 1 < len(V) else 0.0,
    )
    return V[k - 1] if abs(V[k] - V[k - 1]) > change else V[k]  # type: ignore[no-any-return]


def jumps(V: Array) -> NDArray[np.bool_]:
    """Return at which samples of a voltage (n,) `before_jump` sees a jump."""
    change = np.abs(np.diff(V, prepend=V[:1]))
    beside = np.maximum(np.append(0.0, change[:-1]), np.append(change[1:], 0.0))
    found: NDArray[np.bool_] = change > JUMP * beside
    return found


def force_history(
    law: int, x: Any, v: Any, a: Any, V: Any, dt: float, z: Any, p: Any, on: Any, moving: Any,
    n_moving: int, advances: bool, z1: Any, work: Any, out: Any,
) -> None:  # fmt: skip
    """Fill `out` (n,) with the force at each sample of a motion that is linear between them.

    So is the voltage, but where it jumps: see `before_jump`.
    """
    size = len(z)
    energy = 0.0
    out[0] = damper_evaluate(
        law, x[0], v[0], a[0], V[0], dt, 0.0, 0.0, False, z, p, on, work[0:size],
        work[size : 2 * size],
    )[0]  # fmt: skip
    for k in range(1, len(x)):
        V1 = before_jump(V, k)
        out[k] = damper_step(
            law, x[k - 1], v[k - 1], a[k - 1], V[k - 1], x[k], v[k], a[k], V1, dt, energy, 0.0,
            False, z, p, on, moving, n_moving, advances, z1, work,
        )[0]  # fmt: skip
        if V[k] != V1:
            out[k] = damper_jump(law, x[k], v[k], a[k], V[k], dt, energy, z1, p, on, work)
        energy += 0.5 * dt * (out[k - 1] * v[k - 1] + out[k] * v[k])
        for i in range(size):
            z[i] = z1[i]


def law_history(
    law: int, x: Any, v: Any, a: Any, V: Any, dt: float, z: Any, p: Any, on: Any, moving: Any,
    n_moving: int, advances: bool, z1: Any, work: Any, out: Any,
) -> None:  # fmt: skip
    """Do what `force_history` does where no effect is on, without the code of any effect.

    The law knows the voltage of its own moment only, so a jump needs no care.
    """
    out[0] = damper_step_law(
        law, v[0], x[0], v[0], a[0], V[0], 0.0, 0.0, 0.0, False, z, p, on, z1, work
    )[0]
    for k in range(1, len(x)):
        out[k] = damper_step_law(
            law, v[k - 1], x[k], v[k], a[k], V[k], dt, 0.0, 0.0, False, z, p, on, z1, work
        )[0]
        z[0] = z1[0]


def compiled_history(effects: bool = True) -> Callable[..., None]:
    """Return the compiled `force_history`, or `law_history` where there are no effects.

    The first call on a machine takes seconds, that without effects one or two.
    """
    with _ONE_AT_A_TIME:  # threads that try effects ask for it at once
        return _compiled(damper.evaluate) if effects else _compiled_law()


@cache
def _compiled(evaluate: Any) -> Callable[..., None]:
    """Compile the history with this woven function: there is a new one after a new effect."""
    global damper_evaluate
    from ..jit import compiled

    damper_evaluate = evaluate
    function: Callable[..., None] = compiled(force_history)
    return function


@cache
def _compiled_law() -> Callable[..., None]:
    from ..jit import compiled

    function: Callable[..., None] = compiled(law_history)
    return function


class Bench:
    """Predicts the damper's force for one law and one set of effects.

    Parameters
    ----------
    law : {"bingham", "lugre"}
    effects : list of str
        The effects that are on.
    """

    def __init__(self, law: str, effects: list[str]) -> None:
        self.law = law
        self.effects = list(effects)
        layout = damper.LAYOUT
        self._code = damper.LAW_CODES[law]
        self._on = np.array([e.name in effects for e in layout.effects], dtype=np.bool_)
        moving = damper.moving_states(law, self.effects)
        self._n_moving = len(moving)
        self._moving = np.array([*moving, *[0] * (layout.z_size - len(moving))], dtype=np.int64)
        self._advances = damper.advances(self.effects)
        self._history = compiled_history(bool(self._on.any()))

    def force(
        self, x: Array, v: Array, a: Array, V: Array, dt: float, values: dict[str, float]
    ) -> Array:
        """Return the force (n,) [N] for a motion x, v, a (n,) [m, m/s, m/s2] and V (n,) [V].

        `values` are the parameters by name in SI; missing ones take their defaults. The start
        values of states end in `_0`; those that start with a signal take its first value.
        """
        layout = damper.LAYOUT
        p = np.array(damper.pack(self.law, values))
        z = np.zeros(layout.z_size)
        z[0] = values.get("bristle_deflection_0", 0.0)
        first = {"x": x[0], "v": v[0], "a": a[0], "V": V[0]}
        for effect in layout.effects:
            for state in effect.states:
                name = f"{effect.name}.{state}"
                begin = first.get(effect.starts.get(state, ""), 0.0)
                z[layout.states[name]] = values.get(name + "_0", begin)
        out = np.empty(len(x))
        self._history(
            self._code, x, v, a, V, dt, z, p, self._on, self._moving, self._n_moving,
            self._advances, np.zeros_like(z), np.zeros(damper.work_size()), out,
        )  # fmt: skip
        return out
