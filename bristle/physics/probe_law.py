"""Calls the hooks of a law where it counts, and moves a damper of it through closed cycles."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import product
from math import cos, inf, isfinite, pi, sin
from typing import Any

from . import damper
from .inputs import Inputs
from .law import Law
from .parameter import CHOICES, fields_of
from .probe_call import call, refuse_jump
from .user_text import FlawError

RANGES = {"x": 0.01, "v": 0.2, "V": 8.0}
"""How far the signals of a small rig go, over which a hook is asked for jumps."""

FURTHER = (1.0, 10.0, 0.1, 100.0, 0.01)
"""Factors on the signals at which a parameter is looked at until it moves something."""

SHARES = (0.0, 0.2, 0.5, 0.8, 1.0)
"""Shares of a parameter's range at which it is."""

CYCLES = ((0.006, 2.0, 4.0), (0.001, 5.0, 8.0), (0.015, 0.5, 0.0), (0.015, 5.0, 8.0))
"""Amplitudes [m], frequencies [Hz] and voltages [V] of cycles in which no energy may come out."""

STEPS = 200
"""Steps of a cycle."""

GAIN = 1e-3
"""Work of a closed cycle, by its amplitude and its largest force, that is energy created."""


def probe_law(law: type[Law]) -> None:
    """Call every hook at rest, in motion and at the bounds; then move a damper in closed cycles.

    The damper is moved with the defaults, and with each parameter at either of its bounds: a fit
    may lead there.

    Raises
    ------
    FlawError
        If a hook raises, returns what is no finite number or too few of them, jumps with a signal
        or a parameter; if a parameter moves nothing, or cannot be zero though the force is said to
        be linear in it; if a step gives a force that is not finite, or a closed cycle gives energy.
    """
    defaults = {name: p.value for name, p in law.parameters.items()}
    for values in [{**defaults, **end} for end in ends(law)]:
        for q in _signals():
            z = _state(law, q, values)
            for hook in law.hooks():
                _call(law, hook, q, z, values)
            if law.hook("advance"):
                _call(law, "advance", q._replace(dt=0.0), z, values)
                _call(law, "advance", q._replace(dt=inf), z, values, finite=False)
    _smooth(law, defaults)
    _moving(law, defaults)
    _at_zero(law, defaults)
    for values in ends(law):
        for amplitude, frequency, V in CYCLES:
            cycle(law, values, amplitude, frequency, V)


def ends(law: type[Law]) -> Iterator[dict[str, float]]:
    """Give what differs from the defaults: nothing, then each parameter at each of its bounds."""
    yield {}
    for name, parameter in law.parameters.items():
        for bound in parameter.bounds:
            yield {name: bound}


def cycle(
    law: type[Law], values: dict[str, float], amplitude: float, frequency: float, V: float
) -> float:
    """Return the work [J] of the third of three cycles of a damper.

    Parameters
    ----------
    law : registered
    values : parameters by name in SI; missing ones take their defaults
    amplitude, frequency, V : m, Hz, V

    Raises
    ------
    FlawError
        If a force is not finite, or the cycle gives energy.
    """
    model = damper.DamperModel(law.name, values)
    w, dt = 2.0 * pi * frequency, 1.0 / (frequency * STEPS)
    where = f"at {1e3 * amplitude:g} mm, {frequency:g} Hz and {V:g} V"
    where += "".join(f", where {name} = {value:g}," for name, value in values.items())
    work, most = 0.0, 1e-9
    for k in range(1, 3 * STEPS + 1):
        t = k * dt
        x, v = amplitude * sin(w * t), amplitude * w * cos(w * t)
        try:
            force = model.step(x, v, -w * w * x, V, dt, 0.0, 0.0, False)
        except (ArithmeticError, ValueError) as error:
            raise FlawError(f"a step raises {type(error).__name__}: {error}, {where}.") from None
        if not isfinite(force):
            raise FlawError(f"a step of {dt:g} s gives a force of {force!r}, {where}.")
        if k > 2 * STEPS:
            work += dt * v * force
            most = max(most, abs(force))
    if work < -GAIN * amplitude * most:
        raise FlawError(
            f"it creates energy: a closed cycle {where} gives {-work:.3g} J. A damper takes it; "
            "forces are positive where they resist motion along +x."
        )
    return work


def _signals(factor: float = 1.0) -> list[Inputs]:
    """Return signals at rest and in motion."""
    found = [Inputs(0.0, 0.0, 0.0, 0.0, 0.002, 0.0, 0.0, False)]
    for v, x, V in product((-0.15, -1e-4, 0.03), (-0.008, 0.004), (0.0, 5.0)):
        v, x = factor * v, factor * x
        found.append(Inputs(x, v, 20.0 * v, V, 0.002, 0.3 * factor, 0.0, False))
    return found


def _state(law: type[Law], q: Inputs, values: dict[str, float], dt: float = 1e-6) -> Any:
    """Return the states after a few steps under a signal, from rest; of `dt` [s] by their rates."""
    z = law.State(*(0.0 for _ in law.states)) if law.states else ()
    for _ in range(3 if law.states else 0):
        if law.hook("advance"):
            z = law.State(*_call(law, "advance", q, z, values))
        else:
            rates = _call(law, "rate", q, z, values)
            z = law.State(*(s + dt * rate for s, rate in zip(z, rates)))
    return z


def _call(
    law: type[Law], hook: str, q: Inputs, z: Any, values: dict[str, float], finite: bool = True
) -> tuple[float, ...]:
    """Return what a hook gives, as a tuple; FlawError if that is not right."""
    count = len(law.states) if hook in ("rate", "advance") else None
    given = (q, z, law.at(values, q.V))
    return call(getattr(law, hook), given, count, partial(_place, q, values), finite)


def _place(q: Inputs, values: dict[str, float]) -> str:
    numbers = ", ".join(f"{name} = {value:g}" for name, value in values.items())
    return f"x = {q.x:g}, v = {q.v:g}, V = {q.V:g}; {numbers}"


def _span(law: type[Law], name: str) -> tuple[float, float, bool]:
    """Return between which values a parameter is looked at, and whether by equal ratios."""
    parameter = law.parameters[name]
    low, high = parameter.bounds
    by_ratio = low > 0.0 and high > 100.0 * low
    if not by_ratio:  # near the default: bounds may be far away
        reach = 3.0 * abs(parameter.value) or 1.0
        low, high = max(low, parameter.value - reach), min(high, parameter.value + reach)
    return low, high, by_ratio


def _with(
    law: type[Law], hook: str, q: Inputs, z: Any, values: dict[str, float], name: str, share: float
) -> tuple[float, ...]:
    """Call a hook with a parameter at a share of its range."""
    low, high, by_ratio = _span(law, name)
    value = low * (high / low) ** share if by_ratio else low + (high - low) * share
    return _call(law, hook, q, z, {**values, name: value})


def _at(
    law: type[Law], hook: str, q: Any, z: Any, values: dict[str, float], signal: str,
    value: float,
) -> tuple[float, ...]:  # fmt: skip
    moved: dict[str, Any] = {signal: value}
    return _call(law, hook, q._replace(**moved), z, values)


def _forces(law: type[Law]) -> Iterator[str]:
    return (hook for hook in law.hooks() if hook not in ("rate", "advance"))


def _smooth(law: type[Law], values: dict[str, float]) -> None:
    """Refuse hooks that jump with a signal or a parameter; the sign of the yield force may."""
    for q in _signals()[1:7]:
        z = _state(law, q, values)
        for signal, hook in product(RANGES, _forces(law)):
            given: Callable[[float], tuple[float, ...]] = partial(
                _at, law, hook, q, z, values, signal
            )
            low = 0.0 if signal == "V" else -RANGES[signal]
            refuse_jump(getattr(law, hook), given, (low, RANGES[signal]), f"q.{signal}")
        for name, hook in product(law.parameters, _forces(law)):
            if name not in CHOICES:
                given = partial(_with, law, hook, q, z, values, name)
                refuse_jump(getattr(law, hook), given, (0.0, 1.0), f"p.{name}", 24)


def _moving(law: type[Law], values: dict[str, float]) -> None:
    """Refuse a parameter, or a table, that moves nothing."""
    for field, names in fields_of(law.parameters, law.tables).items():
        if not any(_moves(law, name, values) for name in names):
            line = getattr(law, next(iter(law.hooks()))).__code__.co_firstlineno
            raise FlawError(f"p.{field} moves nothing: no measurement could tell it.", line)


def _at_zero(law: type[Law], values: dict[str, float]) -> None:
    """Refuse a parameter that may not be zero, and that no `shapes` names: a fit begins there."""
    for name in law.linear():
        for q, hook in product(_signals()[1:], _forces(law)):
            try:
                _call(law, hook, q, _state(law, q, values), {**values, name: 0.0})
            except FlawError as flaw:
                raise FlawError(
                    f"{hook} is not linear in {name}, for it cannot be zero. Name what the force "
                    f'is not linear in: shapes = {{"{name}": Shape(...)}} is right.',
                    flaw.line,
                ) from None


def _moves(law: type[Law], name: str, values: dict[str, float]) -> bool:
    for factor, dt in product(FURTHER, (1e-6, 2e-3)):
        for q, hook in product(_signals(factor)[1:], law.hooks()):
            try:
                z = _state(law, q, values, dt)
                if len({_with(law, hook, q, z, values, name, share) for share in SHARES}) > 1:
                    return True
            except FlawError:  # so far out it need not be right
                continue
    return False
