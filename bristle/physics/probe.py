"""Calls the hooks of an effect where it counts: finite, of the right kind, without jumps."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import product
from math import copysign, inf, isfinite
from typing import Any, Callable

from .effect import Effect, Q, Sizes
from .parameter import CHOICES
from .probe_amount import refuse_amount
from .probe_call import call, refuse_jump
from .probe_reads import refuse_reads
from .user_text import FlawError

RANGES = {
    "x": 0.01, "v": 0.2, "a": 5.0, "V": 8.0, "drift": 0.01, "drift_rate": 0.1, "rod_x": 0.01,
    "rod_v": 0.2, "value": 5.0,
}  # fmt: skip
"""How far the signals of a small rig go, over which a hook is asked for jumps."""

FURTHER = (10.0, 0.1, 100.0, 0.01, 1e3)
"""Factors on the signals at which a parameter that moved nothing is looked at again."""

BETWEEN = 33
"""Values of one signal, the others kept, at which such a parameter is looked at as well."""

Within = tuple[str, float, float]
"""A parameter and between which values it is moved."""

SHARES = (0.0, 0.2, 0.5, 0.8, 1.0)
"""Shares of a parameter's range at which it is."""


def probe(effect: type[Effect]) -> None:
    """Call every hook at rest, in motion and at the bounds.

    Raises
    ------
    FlawError
        If one raises, returns what is no finite number or too few of them, reads a signal that is
        not named or not there, jumps with a signal or a parameter, if a parameter moves nothing, or
        if the effect does not vanish with its `amount`.
    """
    defaults = {name: p.value for name, p in effect.parameters.items()}
    corners = [defaults]
    for name, parameter in effect.parameters.items():
        corners += [{**defaults, name: bound} for bound in parameter.bounds]
    for values in corners:
        for q in _signals(effect):
            z = _state(effect, q, values)
            for hook in effect.hooks():
                _call(effect, hook, q, z, values)
            if "advance" in effect.hooks():
                for dt in (0.0, inf):  # without time, and before the first step
                    if dt == 0.0 or effect.site != "sensor":
                        _call(effect, "advance", q._replace(dt=dt), z, values, dt < inf)
    for q, hook in product(_signals(effect), effect.hooks()):
        refuse_reads(effect, hook, q, _state(effect, q, defaults), effect.values_of(defaults))
    _smooth_in_signals(effect, defaults)
    _smooth_in_parameters(effect, defaults)
    refuse_amount(effect, _signals(effect)[1:], partial(_at_amount, effect, defaults))
    for values in corners:
        _start(effect, values)


def _at_amount(
    effect: type[Effect], defaults: dict[str, float], hook: str, q: Q, amount: float
) -> tuple[float, ...]:
    """Return what a hook gives where the parameter that `amount` names has a value."""
    values = {**defaults, effect.amount.removeprefix("1/"): amount}
    return _call(effect, hook, q, _state(effect, q, values), values)


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


def _signals(effect: type[Effect]) -> list[Q]:
    """Return signals at rest and in motion; of a storey those of the one where the effect acts."""
    which = effect.parameters.get("which")
    storey = which.value if which is not None and which.value else 1.0
    zero = Q(*(0.0 for _ in Q._fields))
    found = [zero._replace(dt=0.002)]
    for v, x, V in product((-0.15, -1e-4, 0.03), (-0.008, 0.004), (0.0, 5.0)):
        found.append(
            zero._replace(
                x=x, v=v, a=20.0 * v, V=V, dt=0.002, drift=0.5 * x, drift_rate=0.5 * v, energy=0.3,
                force=5.0 * copysign(1.0, v), rod_x=x, rod_v=v, halt=3.0, stiffness=1000.0,
                storey=storey, value=2.0 * v,
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
    wanted = {"rate": len(effect.states), "advance": len(effect.states), "motion": 2}.get(hook)
    given = (q, z, effect.values_of(values))
    return call(getattr(effect, hook), given, wanted, partial(_place, effect, q, values), finite)


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
        for q, hook in product(_signals(effect)[1:7], hooks):
            given = partial(_at_signal, effect, hook, q, _state(effect, q, values), values, signal)
            refuse_jump(getattr(effect, hook), given, (low, RANGES[signal]), f"q.{signal}")


def _at_signal(
    effect: type[Effect], hook: str, q: Q, z: Any, values: dict[str, float], signal: str,
    value: float,
) -> tuple[float, ...]:  # fmt: skip
    return _call(effect, hook, q._replace(**{signal: value}), z, values)


def _smooth_in_parameters(effect: type[Effect], values: dict[str, float]) -> None:
    moving: dict[str, bool] = {}
    within: dict[str, list[Within]] = {}
    field_of = {name: field for field, names in effect.fields().items() for name in names}
    for name, parameter in effect.parameters.items():
        low, high = parameter.bounds
        if not (low > 0.0 and high > 100.0 * low):  # near the default: bounds may be far away
            reach = 3.0 * abs(parameter.value) or 1.0
            low, high = max(low, parameter.value - reach), min(high, parameter.value + reach)
        moved = False
        for q, hook in product(_signals(effect), effect.hooks()):
            z = _state(effect, q, values)
            given = partial(_at_parameters, effect, hook, q, z, values, [(name, low, high)])
            if name in CHOICES:
                moved = moved or given(0.0) != given(1.0)
            else:
                jumped = refuse_jump(getattr(effect, hook), given, (0.0, 1.0), f"p.{name}", 24)
                moved = jumped or moved
        moving[field_of[name]] = moved or moving.get(field_of[name], False)
        within.setdefault(field_of[name], []).append((name, low, high))
    for field in [field for field, moved in moving.items() if not moved]:
        # Of a table some knots may lie where no signal of any rig comes: all at once, then each.
        alone = [[one] for one in within[field]]
        moving[field] = any(
            _moved_far_out(effect, some, values) or _moved_between(effect, some, values)
            for some in (alone if len(alone) == 1 else [within[field], *alone])
        )
    for field, moved in moving.items():
        if not moved:
            line = getattr(effect, next(iter(effect.hooks()))).__code__.co_firstlineno
            raise FlawError(f"p.{field} moves nothing: no measurement could tell it.", line)


def _moved_far_out(effect: type[Effect], within: list[Within], values: dict[str, float]) -> bool:
    """Return whether parameters move a hook in larger or smaller motion than that of the rig.

    What begins beyond a knot, such as a stop behind a gap, does nothing before it.
    """
    for factor, signal, hook in product(FURTHER, _signals(effect)[1:], effect.hooks()):
        q = Q(*(factor * one for one in signal))._replace(dt=signal.dt, storey=signal.storey)
        try:
            z = _state(effect, q, values)
            given = partial(_at_parameters, effect, hook, q, z, values, within)
            if len({given(share) for share in SHARES}) > 1:
                return True
        except FlawError:  # so far out it need not be right
            continue
    return False


def _moved_between(effect: type[Effect], within: list[Within], values: dict[str, float]) -> bool:
    """Return whether parameters move a hook anywhere on the way of one signal.

    A row of a table counts near its own level alone, and so it does of a channel that it follows.
    """
    for factor, signal, hook in product((1.0, *FURTHER), _signals(effect)[1:7], effect.hooks()):
        still = Q(*(factor * one for one in signal))._replace(dt=signal.dt, storey=signal.storey)
        for q, others in _ways(effect, still, factor, values):
            try:
                z = _state(effect, q, others)
                given = partial(_at_parameters, effect, hook, q, z, others, within)
                if given(0.0) != given(1.0):
                    return True
            except FlawError:  # so far out it need not be right
                continue
    return False


def _ways(
    effect: type[Effect], still: Q, factor: float, values: dict[str, float]
) -> Iterator[tuple[Q, dict[str, float]]]:
    """Yield signals and parameters along the way of one signal, or of a channel's parameter."""
    for signal in (one for one in effect.needs if one in RANGES):
        reach = factor * RANGES[signal]
        low = 0.0 if signal == "V" else -reach
        for k in range(BETWEEN):
            yield still._replace(**{signal: low + (reach - low) * k / (BETWEEN - 1)}), values
    for name in effect.channels:
        low, high = effect.parameters[name].bounds
        default = effect.parameters[name].value
        reach = min(high - low, 4.0 * abs(default) or 1.0)
        for k in range(BETWEEN):
            at = min(max(default + reach * (k / (BETWEEN - 1) - 0.5), low), high)
            yield still, {**values, name: at}


def _at_parameters(
    effect: type[Effect], hook: str, q: Q, z: Any, values: dict[str, float],
    within: list[Within], share: float,
) -> tuple[float, ...]:  # fmt: skip
    """Call a hook with parameters between low and high, by decades where they span many."""
    given = dict(values)
    for name, low, high in within:
        by_decades = low > 0.0 and high > 100.0 * low
        given[name] = low * (high / low) ** share if by_decades else low + (high - low) * share
    return _call(effect, hook, q, z, given)
