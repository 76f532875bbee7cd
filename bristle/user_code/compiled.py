"""Whether numba compiles a user's effect or law, and instruments over time, compiled."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cache
from math import isclose
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.files import cache_folder
from ..physics.effect import Effect, Q
from ..physics.generate import Slots, with_globals
from ..physics.law import Law
from ..physics.signals import instrument
from ..physics.tuples import Inputs
from . import load

Array = NDArray[np.float64]


def usable(effects: Iterable[load.Loaded]) -> list[load.Loaded]:
    """Return the same, with those left out, and unregistered, that numba cannot compile.

    All laws and effects of a site are compiled into one function, so a bad one would take the
    others along. What has passed is remembered in the cache by its digest.
    """
    out = []
    for loaded in effects:
        flaw = refused(loaded.made) if loaded.made is not None else None
        if flaw is not None:
            message = f"{loaded.path}, line {flaw[0]}: {flaw[1]}"
            load.leave_out(loaded.made, message)
            loaded = load.Loaded(loaded.path, None, message)
        out.append(loaded)
    return out


def refused(made: type[Effect] | type[Law]) -> tuple[int, str] | None:
    """Return line and reason why a hook of an effect or law cannot be compiled, None if all can."""
    from ..core.jit import compiled, digest

    q, p = _given(made)
    z = made.State(*(0.01 for _ in made.states))
    for hook, function in made.hooks().items():
        shape = f"{len(made.states)}_{len(made.parameters)}"
        mark = cache_folder() / "numba" / "passed" / f"{digest(function)}_{shape}"
        if mark.is_file():
            continue
        line, plain = function.__code__.co_firstlineno + 1, function(q, z, p)
        try:
            found = compiled(function, keep=False)(q, z, p)
        except Exception as error:  # numba's errors, and what hooks raise, have no base in common
            return line, f"{hook} cannot be compiled: {_reason(error)}"
        if not _same(found, plain):
            return line, f"{hook} gives {found!r} compiled and {plain!r} in Python."
        with suppress(OSError):  # without a cache it is compiled again next time
            mark.parent.mkdir(parents=True, exist_ok=True)
            mark.touch()
    return None


def _given(made: type[Effect] | type[Law]) -> tuple[Any, Any]:
    """Return the q and p that a hook is tried with."""
    if issubclass(made, Law):
        return Inputs(0.01, 0.02, 0.03, 4.0, 0.05, 0.06, 0.0, False), made.at({}, 4.0)
    return Q(*(0.01 * (1 + k) for k in range(len(Q._fields)))), made.values_of({})


def _same(found: Any, plain: Any) -> bool:
    first = found if isinstance(found, tuple) else (found,)
    second = plain if isinstance(plain, tuple) else (plain,)
    return len(first) == len(second) and all(
        isclose(a, b, rel_tol=1e-12, abs_tol=1e-300) for a, b in zip(first, second, strict=True)
    )


def _reason(error: Exception) -> str:
    """Return the line of numba's long text that says what it is about."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    telling = [
        line for line in lines if not line.startswith(("Failed in", "File ", "During", "->"))
    ]
    return (telling[0] if telling else type(error).__name__)[:200]


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
    from ..core.jit import compiled

    show, slots = instrument(effect)
    return compiled(with_globals(channel_history, {"show": show})), slots
