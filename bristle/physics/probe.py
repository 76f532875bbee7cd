"""Calls the hooks of an effect where it counts: finite, of the right kind, without jumps."""

from __future__ import annotations

import traceback
from functools import partial
from itertools import product
from math import copysign, inf, isfinite
from typing import Any, Callable

from .effect import Effect, Q, Sizes
from .parameter import CHOICES

"""Parameters that are choices of a form: they may make a hook jump."""

RANGES = {
    "x": 0.01, "v": 0.2, "a": 5.0, "V": 8.0, "drift": 0.01, "drift_rate": 0.1, "rod_x": 0.01,
    "rod_v": 0.2, "value": 5.0,
}  # fmt: skip
"""How far the signals of a small rig go, over which a hook is asked for jumps."""

JUMP = 1e-3
"""A change within nothing, by the whole range of a hook, that counts as a jump."""


class FlawError(Exception):
    """What is wrong with an effect of a user's, and the line where."""

    def __init__(self, text: str, line: int = 0) -> None:
        super().__init__(text)
        self.line = line


def probe(effect: type[Effect]) -> None:
    """Call every hook at rest, in motion and at the bounds.

    Raises
    ------
    FlawError
        If one raises, returns what is no finite number or too few of them, jumps with a signal or
        a parameter, or if a parameter moves nothing.
    """
    defaults = {name: p.value for name, p in effect.parameters.items()}
    corners = [defaults]
    for name, parameter in effect.parameters.items():
        corners += [{**defaults, name: bound} for bound in parameter.bounds]
    for values in corners:
        for q in _signals():
            z = _state(effect, q, values)
            for hook in effect.hooks():
                _call(effect, hook, q, z, values)
            if "advance" in effect.hooks():
                for dt in (0.0, inf):  # without time, and before the first step
                    if dt == 0.0 or effect.site != "sensor":
                        _call(effect, "advance", q._replace(dt=dt), z, values, dt < inf)
    _smooth_in_signals(effect, defaults)
    _smooth_in_parameters(effect, defaults)
    for values in corners:
        _start(effect, values)


def _start(effect: type[Effect], values: dict[str, float]) -> None:
    """Call what gives start values, at the bounds too; FlawError if that is not right."""
    p = effect.values_of(values)
    sizes = Sizes(x=5e-3, v=0.07, V=5.0, force=4.0)
    for name, given, count in (
        ("tie", (p, sizes), len(effect.start_ties)),
        ("yield_share", (p,), 1),
    ):
        if not hasattr(effect, name):
            continue
        function: Callable[..., Any] = getattr(effect, name)
        line = function.__code__.co_firstlineno + 1
        try:
            found = function(*given)
        except ZeroDivisionError:  # a start is not taken at such a bound
            continue
        except Exception as error:
            raise FlawError(f"{name} raises {type(error).__name__}: {error}.", line) from None
        found = found if name == "tie" else (found,)
        if not isinstance(found, tuple) or len(found) != count:
            raise FlawError(
                f"{name} returns {found!r}; a tuple of {count}: start_ties is right.", line
            )
        if not all(isinstance(one, (int, float)) and isfinite(one) for one in found):
            raise FlawError(f"{name} returns {found!r}; finite numbers are right.", line)


def _signals() -> list[Q]:
    """Return signals at rest and in motion."""
    zero = Q(*(0.0 for _ in Q._fields))
    found = [zero._replace(dt=0.002)]
    for v, x, V in product((-0.15, -1e-4, 0.03), (-0.008, 0.004), (0.0, 5.0)):
        found.append(
            zero._replace(
                x=x, v=v, a=20.0 * v, V=V, dt=0.002, drift=0.5 * x, drift_rate=0.5 * v, energy=0.3,
                force=5.0 * copysign(1.0, v), rod_x=x, rod_v=v, halt=3.0, stiffness=1000.0,
                storey=1.0, value=2.0 * v,
            )
        )  # fmt: skip
    return found


def _state(effect: type[Effect], q: Q, values: dict[str, float]) -> Any:
    """Return the states after a few steps under a signal, from rest."""
    z = effect.State(*(0.0 for _ in effect.states))
    for _ in range(3):
        if "advance" in effect.hooks():
            z = effect.State(*_call(effect, "advance", q, z, values))
        elif "rate" in effect.hooks():
            rates = _call(effect, "rate", q, z, values)
            z = effect.State(*(s + 1e-6 * rate for s, rate in zip(z, rates)))
    return z


def _call(
    effect: type[Effect], hook: str, q: Q, z: Any, values: dict[str, float], finite: bool = True
) -> tuple[float, ...]:
    """Return what a hook gives, as a tuple; FlawError if that is not right."""
    function: Callable[..., Any] = getattr(effect, hook)
    line = function.__code__.co_firstlineno + 1
    p = effect.values_of(values)
    try:
        found = function(q, z, p)
    except Exception as error:
        frames = traceback.extract_tb(error.__traceback__)
        inner = [f.lineno for f in frames if f.filename == function.__code__.co_filename]
        raise FlawError(
            f"{hook} raises {type(error).__name__}: {error}, at {_place(effect, q, values)}.",
            (inner[-1] or 0) if inner else line,
        ) from None
    wanted = {"rate": len(effect.states), "advance": len(effect.states), "motion": 2}.get(hook)
    if wanted is not None:
        if not isinstance(found, tuple) or len(found) != wanted:
            what = f"a tuple of {wanted}: the states" if hook != "motion" else "x, v"
            raise FlawError(f"{hook} returns {found!r}; {what} is right.", line)
    else:
        found = (found,)
    for value in found:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise FlawError(f"{hook} returns {value!r}; a number is right.", line)
        if finite and not isfinite(value):
            raise FlawError(f"{hook} returns {value!r} at {_place(effect, q, values)}.", line)
    return tuple(float(value) for value in found)


def _place(effect: type[Effect], q: Q, values: dict[str, float]) -> str:
    signals = ", ".join(f"{name} = {getattr(q, name):g}" for name in effect.needs)
    numbers = ", ".join(f"{name} = {value:g}" for name, value in values.items())
    return "; ".join(text for text in (signals, numbers) if text) or "any motion"


def _smooth_in_signals(effect: type[Effect], values: dict[str, float]) -> None:
    hooks = [hook for hook in effect.hooks() if hook not in ("rate", "advance")]
    for signal in effect.needs:
        if signal not in RANGES:
            continue
        low = 0.0 if signal == "V" else -RANGES[signal]
        for q, hook in product(_signals()[1:7], hooks):
            given = partial(_at_signal, effect, hook, q, _state(effect, q, values), values, signal)
            _refuse_jump(effect, hook, given, low, RANGES[signal], f"q.{signal}")


def _at_signal(
    effect: type[Effect], hook: str, q: Q, z: Any, values: dict[str, float], signal: str,
    value: float,
) -> tuple[float, ...]:  # fmt: skip
    return _call(effect, hook, q._replace(**{signal: value}), z, values)


def _smooth_in_parameters(effect: type[Effect], values: dict[str, float]) -> None:
    moving: dict[str, bool] = {}
    field_of = {name: field for field, names in effect.fields().items() for name in names}
    for name, parameter in effect.parameters.items():
        low, high = parameter.bounds
        if not (low > 0.0 and high > 100.0 * low):  # near the default: bounds may be far away
            reach = 3.0 * abs(parameter.value) or 1.0
            low, high = max(low, parameter.value - reach), min(high, parameter.value + reach)
        moved = False
        for q, hook in product(_signals(), effect.hooks()):
            z = _state(effect, q, values)
            given = partial(_at_parameter, effect, hook, q, z, values, name, low, high)
            if name in CHOICES:
                moved = moved or given(0.0) != given(1.0)
            else:
                moved = _refuse_jump(effect, hook, given, 0.0, 1.0, f"p.{name}", 24) or moved
        # Of a table some knots may lie where no signal of this small rig comes.
        moving[field_of[name]] = moving.get(field_of[name], False) or moved
    for field, moved in moving.items():
        if not moved:
            line = getattr(effect, next(iter(effect.hooks()))).__code__.co_firstlineno
            raise FlawError(f"p.{field} moves nothing: no measurement could tell it.", line)


def _at_parameter(
    effect: type[Effect], hook: str, q: Q, z: Any, values: dict[str, float], name: str, low: float,
    high: float, share: float,
) -> tuple[float, ...]:  # fmt: skip
    """Call a hook with a parameter between low and high, by decades where they span many."""
    by_decades = low > 0.0 and high > 100.0 * low
    value = low * (high / low) ** share if by_decades else low + (high - low) * share
    return _call(effect, hook, q, z, {**values, name: value})


def _refuse_jump(
    effect: type[Effect], hook: str, given: Callable[[float], tuple[float, ...]], low: float,
    high: float, what: str, count: int = 40,
) -> bool:  # fmt: skip
    """Refuse a hook that jumps between low and high; return whether it changes at all."""
    points = [low + (high - low) * (k + 0.37) / count for k in range(-1, count + 1)]
    points = [min(max(point, low), high) for point in points]
    rows = [given(point) for point in points]
    moved = False
    for column in range(len(rows[0])):
        values = [row[column] for row in rows]
        size = max(values) - min(values)
        if size == 0.0:
            continue
        moved = True
        steps = [abs(b - a) for a, b in zip(values, values[1:])]
        k = steps.index(max(steps))
        a, b = points[k], points[k + 1]
        left, right = values[k], values[k + 1]
        for _ in range(50):
            middle = 0.5 * (a + b)
            between = given(middle)[column]
            if abs(between - left) >= abs(right - between):
                b, right = middle, between
            else:
                a, left = middle, between
        if abs(right - left) > JUMP * size:
            line = getattr(effect, hook).__code__.co_firstlineno + 1
            raise FlawError(
                f"{hook} jumps by {abs(right - left):.3g} with {what}: it is not differentiable, "
                "and no fit could follow it. A smooth step such as tanh(v/v_s) is right.",
                line,
            )
    return moved
