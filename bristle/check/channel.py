"""What an instrument shows of a signal, compiled: the hooks of one sensor's effect, in time."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..physics.codegen import Slots, with_globals
from ..physics.effect import Effect
from ..physics.sensor import instrument

Array = NDArray[np.float64]


def channel_history(signal: Any, dt: float, z: Any, p: Any, out: Any) -> None:
    """Fill `out` (n,) with what the instrument shows of a signal (n,) sampled every dt [s].

    Parameters
    ----------
    signal, out : (n,) in the channel's unit
    dt : sampling step [s]
    z : (states,) of the effect, moved on in place
    p : flat parameters of the effect [SI]
    """
    for k in range(len(signal)):
        out[k] = show(signal[k], dt, z, p)  # type: ignore[name-defined]  # noqa: F821


def shown(effect: type[Effect], values: dict[str, float], signal: Array, dt: float) -> Array:
    """Return what an instrument shows (n,) of a signal (n,) sampled every dt [s].

    Parameters
    ----------
    effect : Effect of the site "sensor"
    values : parameters of the effect by their own names ("gain"), in SI; missing ones default
    signal : (n,) in the channel's unit
    dt : sampling step [s]
    """
    history, slots = _history(effect)  # type: ignore[arg-type]  # a class can be hashed
    p, z = np.zeros(max(1, slots.p_size)), np.zeros(max(1, slots.z_size))
    for name, known in effect.parameters.items():
        p[slots.parameters[f"{effect.name}.{name}"]] = values.get(name, known.value)
    for state in effect.starts:
        z[slots.states[f"{effect.name}.{state}"]] = signal[0]
    out = np.empty(len(signal))
    history(np.ascontiguousarray(signal, dtype=np.float64), dt, z, p, out)
    return out


@cache
def _history(effect: type[Effect]) -> tuple[Callable[..., None], Slots]:
    """Return the compiled time loop of one effect's hooks over a signal."""
    from ..jit import compiled

    show, slots = instrument(effect)
    return compiled(with_globals(channel_history, {"show": show})), slots
