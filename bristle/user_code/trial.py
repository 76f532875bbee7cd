"""Calls hooks where it counts, in a child process: finite, of the right kind, without jumps."""

from __future__ import annotations

import faulthandler
import json
import re
import subprocess
import sys
import traceback
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import suppress
from functools import partial
from itertools import pairwise, product
from math import copysign, cos, inf, isfinite, pi, sin
from typing import Any

from ..core.child import in_child
from ..physics import damper
from ..physics.effect import OFFERED, Effect, Q, Sizes
from ..physics.law import Law
from ..physics.parameter import CHOICES, Parameter, fields_of
from ..physics.tuples import Inputs
from .reading import FlawError

_ONES = ("yield_factor", "viscous_factor", "reach", "factor")
"""Hooks that return a factor: 1 where there is no effect."""


def refuse_amount(
    effect: type[Effect], signals: list[Q], value: Callable[[str, Q, float], tuple[float, ...]]
) -> None:
    """Refuse an `amount` with which the effect does not become smaller.

    Effects with a `joint` are not checked: the integrator solves for their motion, so that hooks
    alone do not show it.

    Parameters
    ----------
    effect : the class; one without `amount` is right
    signals : where the hooks are called
    value : what a hook gives at signals with a value of that parameter

    Raises
    ------
    FlawError
        Naming the parameter.
    """
    if not effect.amount or effect.joint:
        return
    name = effect.amount.removeprefix("1/")
    parameter = effect.parameters[name]
    low, high = parameter.bounds
    none = high if effect.amount.startswith("1/") else min(max(0.0, low), high)
    hooks = _forces(effect)

    def size(at: float) -> float:
        """Return by how much the hooks differ from those of no effect, the largest of all."""
        return max(
            abs(got - without)
            for q in signals
            for hook in hooks
            for got, without in zip(value(hook, q, at), _without(hook, q), strict=False)
        )

    default, least = size(parameter.value), size(none)
    if none != parameter.value and least >= default > 0.0:
        raise FlawError(
            f'amount = "{effect.amount}", but the effect is no smaller at {name} = {none:g} than '
            f"at {parameter.value:g}: a parameter with which it vanishes is right, or none."
        )


def _without(hook: str, q: Q) -> tuple[float, ...]:
    """Return what a hook gives where there is no effect."""
    if hook in _ONES:
        return (1.0,)
    if hook == "motion":
        return (q.x, q.v)
    if hook in ("channel", "changed"):
        return (q.value,)
    passed_on = {"voltage": q.V, "yield_force": copysign(1.0, q.v)}
    return (passed_on.get(hook, 0.0),)


ROUNDING = 1e-12
"""Change of a hook, by its size, that is none."""

JUMP = 1e-3
"""A change within nothing, by the whole range of a hook, that counts as a jump."""


def call(
    function: Callable[..., Any],
    given: tuple[Any, Any, Any],
    count: int | None,
    place: Callable[[], str],
    finite: bool = True,
) -> tuple[float, ...]:
    """Return what a hook gives, as a tuple.

    Parameters
    ----------
    function : the hook
    given : its q, z, p
    count : how many numbers its tuple must hold; None: it returns a number
    place : says where it was called, in words
    finite : whether the numbers must be finite

    Raises
    ------
    FlawError
        If that is not right.
    """
    hook, line = function.__name__, function.__code__.co_firstlineno + 1
    try:
        found = function(*given)
    except Exception as error:  # a hook of the user's own may raise whatever it likes
        frames = traceback.extract_tb(error.__traceback__)
        inner = [f.lineno for f in frames if f.filename == function.__code__.co_filename]
        raise FlawError(
            f"{hook} raises {type(error).__name__}: {error}, at {place()}.",
            (inner[-1] or 0) if inner else line,
        ) from None
    if count is not None:
        if not isinstance(found, tuple) or len(found) != count:
            what = "x, v" if hook == "motion" else f"a tuple of {count}: the states"
            raise FlawError(f"{hook} returns {found!r}; {what} is right.", line)
    else:
        found = (found,)
    for value in found:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise FlawError(f"{hook} returns {value!r}; a number is right.", line)
        if finite and not isfinite(value):
            raise FlawError(f"{hook} returns {value!r} at {place()}.", line)
    return tuple(float(value) for value in found)


def refuse_jump(
    function: Callable[..., Any],
    given: Callable[[float], tuple[float, ...]],
    between: tuple[float, float],
    what: str,
    count: int = 40,
) -> bool:
    """Refuse a hook that jumps between two values; return whether it changes at all.

    Parameters
    ----------
    function : the hook
    given : what it gives, over one of its signals or parameters
    between : low and high of that one
    what : its name, as in "q.v"
    count : at how many values it is looked at first

    Raises
    ------
    FlawError
        If it jumps.
    """
    low, high = between
    points = [low + (high - low) * (k + 0.37) / count for k in range(-1, count + 1)]
    points = [min(max(point, low), high) for point in points]
    rows = [given(point) for point in points]
    moved = False
    for column in range(len(rows[0])):
        values = [row[column] for row in rows]
        size = max(values) - min(values)
        if size <= ROUNDING * max(map(abs, values)):
            continue
        moved = True
        steps = [abs(b - a) for a, b in pairwise(values)]
        k = steps.index(max(steps))
        a, b = points[k], points[k + 1]
        left, right = values[k], values[k + 1]
        for _ in range(50):
            middle = 0.5 * (a + b)
            between_them = given(middle)[column]
            if abs(between_them - left) >= abs(right - between_them):
                b, right = middle, between_them
            else:
                a, left = middle, between_them
        if abs(right - left) > JUMP * size:
            raise FlawError(
                f"{function.__name__} jumps by {abs(right - left):.3g} with {what}: it is not "
                "differentiable, and no fit could follow it. A smooth step such as tanh(v/v_s) is "
                "right.",
                function.__code__.co_firstlineno + 1,
            )
    return moved


_STATES = ("rate", "advance")
Made = Effect | Law


def refuse_reads(effect: type[Effect], hook: str, q: Q, z: Any, p: Any) -> None:
    """Refuse a hook that reads a signal which `needs` does not name, or which is 0 there.

    Parameters
    ----------
    effect, hook : the class and one of its hooks
    q, z, p : what the hook is called with; it is known to take them

    Raises
    ------
    FlawError
        Naming the signal.
    """
    function = getattr(effect, hook)
    line = function.__code__.co_firstlineno + 1
    found = _reads(function, q, z, p)
    for site in effect.sites:
        offered = _offered(effect, hook, site)
        for name in (one for one in Q._fields if one in found):
            if name not in offered:
                raise FlawError(
                    f"{hook} reads q.{name}, which is 0 there; it may read {', '.join(offered)}.",
                    line,
                )
            if name not in effect.needs:
                raise FlawError(f'{hook} reads q.{name}: add "{name}" to needs.', line)


def _offered(effect: type[Effect], hook: str, site: str) -> tuple[str, ...]:
    """Return the signals that a hook gets at a site; all others are 0."""
    zero: tuple[str, ...] = ()
    if hook == "changed":
        return ("value",)
    if site == "structure":
        zero = _zero_in_structure(hook, effect.hooks())
    elif site == "damper":
        # The law's force is known to what is computed after it alone.
        after = hook in (*_STATES, "reaction") or (effect.contact and hook == "force")
        zero = ("value",) if after else ("force", "value")
    return tuple(name for name in OFFERED[site] if name not in zero)


def _zero_in_structure(hook: str, hooks: Collection[str]) -> tuple[str, ...]:
    """Return the signals that are 0 where a structure calls a hook.

    `force` is called for the isolation layer, which has x and v, and `spring` for each storey,
    which has a drift; states move on beside either, and know its force.
    """
    moves_on = hook in _STATES
    if moves_on and "force" in hooks and "spring" in hooks:
        return ()
    of_storey = hook == "spring" or (moves_on and "spring" in hooks)
    zero = ("x", "v") if of_storey else ("drift", "drift_rate", "storey")
    return zero if moves_on else (*zero, "force")


def _reads(function: Any, q: Q, z: Any, p: Any) -> set[str]:
    """Return the signals that a hook reads of q."""
    found: set[str] = set()

    class Watched(Q):
        """Signals that tell which of them are read."""

        def __getattribute__(self, name: str) -> Any:
            if name in Q._fields:
                found.add(name)
            return super().__getattribute__(name)

        def __getitem__(self, key: Any) -> Any:
            read = Q._fields[key]
            found.update(read if isinstance(read, tuple) else (read,))
            return super().__getitem__(key)

    function(Watched(*q), z, p)
    return found


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
    _smooth_in_signals(effect, _signals(effect), defaults)
    _check_parameters(effect, _signals(effect), [*effect.hooks()], defaults)
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


def _state(made: type[Made], q: Any, values: dict[str, float], dt: float = 1e-6) -> Any:
    """Return the states after a few steps under a signal, from rest; of `dt` [s] by their rates."""
    z = made.State(*(0.0 for _ in made.states))
    for _ in range(3):
        if "advance" in made.hooks():
            z = made.State(*_call(made, "advance", q, z, values))
        elif "rate" in made.hooks():
            rates = _call(made, "rate", q, z, values)
            z = made.State(*(s + dt * rate for s, rate in zip(z, rates, strict=False)))
    return z


def _call(
    made: type[Made], hook: str, q: Any, z: Any, values: dict[str, float], finite: bool = True
) -> tuple[float, ...]:
    """Return what a hook gives, as a tuple; FlawError if that is not right."""
    wanted = {"rate": len(made.states), "advance": len(made.states), "motion": 2}.get(hook)
    p = made.values_of(values) if issubclass(made, Effect) else made.at(values, q.V)
    place = partial(_place, q, _read_by(made), values)
    return call(getattr(made, hook), (q, z, p), wanted, place, finite)


def _read_by(made: type[Made]) -> tuple[str, ...]:
    """Return the signals that hooks read: of a law those that a rig moves."""
    return tuple(made.needs) if issubclass(made, Effect) else ("x", "v", "V")


def _place(q: Any, read: tuple[str, ...], values: dict[str, float]) -> str:
    signals = ", ".join(f"{name} = {getattr(q, name):g}" for name in read)
    numbers = ", ".join(f"{name} = {value:g}" for name, value in values.items())
    return "; ".join(text for text in (signals, numbers) if text) or "any motion"


def _forces(made: type[Made]) -> list[str]:
    """Return the hooks that give no states."""
    return [hook for hook in made.hooks() if hook not in _STATES]


def _smooth_in_signals(made: type[Made], signals: Sequence[Any], values: dict[str, float]) -> None:
    for signal in _read_by(made):
        if signal not in RANGES:
            continue
        low = 0.0 if signal == "V" else -RANGES[signal]
        for q, hook in product(signals[1:7], _forces(made)):
            given = partial(_at_signal, made, hook, q, _state(made, q, values), values, signal)
            refuse_jump(getattr(made, hook), given, (low, RANGES[signal]), f"q.{signal}")


def _at_signal(
    made: type[Made], hook: str, q: Any, z: Any, values: dict[str, float], signal: str,
    value: float,
) -> tuple[float, ...]:  # fmt: skip
    return _call(made, hook, q._replace(**{signal: value}), z, values)


def _check_parameters(
    made: type[Made], signals: Sequence[Any], hooks: Sequence[str], values: dict[str, float]
) -> None:
    """Refuse hooks that jump with a parameter; a parameter, or a table, that moves nothing."""
    idle: dict[str, list[Within]] = {}
    for field, names in fields_of(made.parameters, made.tables).items():
        within = [(name, *_span(made.parameters[name])) for name in names]
        moved = False
        for one, q, hook in product(within, signals, hooks):
            z = _state(made, q, values)
            given = partial(_at_parameters, made, hook, q, z, values, [one])
            if one[0] in CHOICES:
                moved = moved or given(0.0) != given(1.0)
            else:
                jumped = refuse_jump(getattr(made, hook), given, (0.0, 1.0), f"p.{one[0]}", 24)
                moved = jumped or moved
        if not moved:
            idle[field] = within
    for field, within in idle.items():
        # Of a table some knots may lie where no signal of any rig comes: all at once, then each.
        alone = [[one] for one in within]
        for some in alone if len(alone) == 1 else [within, *alone]:
            if _moved_far_out(made, some, values):
                break
            if issubclass(made, Effect) and _moved_between(made, some, values):
                break
        else:
            line = getattr(made, next(iter(made.hooks()))).__code__.co_firstlineno
            raise FlawError(f"p.{field} moves nothing: no measurement could tell it.", line)


def _moved_far_out(made: type[Made], within: list[Within], values: dict[str, float]) -> bool:
    """Return whether parameters move a hook in larger or smaller motion than that of the rig.

    What begins beyond a knot, such as a stop behind a gap, does nothing before it.
    """
    for factor, dt in product((1.0, *FURTHER), (1e-6, 2e-3)):
        for q, hook in product(_further(made, factor), made.hooks()):
            try:
                z = _state(made, q, values, dt)
                given = partial(_at_parameters, made, hook, q, z, values, within)
                if len({given(share) for share in SHARES}) > 1:
                    return True
            except FlawError:  # so far out it need not be right
                continue
    return False


def _further(made: type[Made], factor: float) -> list[Any]:
    """Return signals in motion, times a factor."""
    if issubclass(made, Law):
        return [*_law_signals(factor)[1:]]
    return [
        Q(*(factor * one for one in signal))._replace(dt=signal.dt, storey=signal.storey)
        for signal in _signals(made)[1:]
    ]


def _moved_between(effect: type[Effect], within: list[Within], values: dict[str, float]) -> bool:
    """Return whether parameters move a hook anywhere on the way of one signal.

    A row of a table counts near its own level alone, and so it does of a channel that it follows.
    """
    far = ((factor, still) for factor in (1.0, *FURTHER) for still in _further(effect, factor)[:6])
    for (factor, still), hook in product(far, effect.hooks()):
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
    made: type[Made], hook: str, q: Any, z: Any, values: dict[str, float],
    within: list[Within], share: float,
) -> tuple[float, ...]:  # fmt: skip
    """Call a hook with parameters between low and high, by decades where they span many."""
    given = dict(values)
    for name, low, high in within:
        given[name] = _between(low, high, share)
    return _call(made, hook, q, z, given)


def _span(parameter: Parameter) -> tuple[float, float]:
    """Return between which values a parameter is looked at."""
    low, high = parameter.bounds
    if low > 0.0 and high > 100.0 * low:
        return low, high
    reach = 3.0 * abs(parameter.value) or 1.0  # near the default: bounds may be far away
    return max(low, parameter.value - reach), min(high, parameter.value + reach)


def _between(low: float, high: float, share: float) -> float:
    """Return a value between two, by decades where they span many."""
    by_decades = low > 0.0 and high > 100.0 * low
    return low * (high / low) ** share if by_decades else low + (high - low) * share


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
        for q in _law_signals():
            z = _state(law, q, values)
            for hook in law.hooks():
                _call(law, hook, q, z, values)
            if law.hook("advance"):
                _call(law, "advance", q._replace(dt=0.0), z, values)
                _call(law, "advance", q._replace(dt=inf), z, values, finite=False)
    # The sign of the yield force may jump.
    _smooth_in_signals(law, _law_signals(), defaults)
    _check_parameters(law, _law_signals()[1:7], _forces(law), defaults)
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


def _law_signals(factor: float = 1.0) -> list[Inputs]:
    """Return signals at rest and in motion."""
    found = [Inputs(0.0, 0.0, 0.0, 0.0, 0.002, 0.0, 0.0, False)]
    for v, x, V in product((-0.15, -1e-4, 0.03), (-0.008, 0.004), (0.0, 5.0)):
        v, x = factor * v, factor * x
        found.append(Inputs(x, v, 20.0 * v, V, 0.002, 0.3 * factor, 0.0, False))
    return found


def _at_zero(law: type[Law], values: dict[str, float]) -> None:
    """Refuse a parameter that may not be zero, and that no `shapes` names: a fit begins there."""
    for name in law.linear():
        for q, hook in product(_law_signals()[1:], _forces(law)):
            try:
                _call(law, hook, q, _state(law, q, values), {**values, name: 0.0})
            except FlawError as flaw:
                raise FlawError(
                    f"{hook} is not linear in {name}, for it cannot be zero. Name what the force "
                    f'is not linear in: shapes = {{"{name}": Shape(...)}} is right.',
                    flaw.line,
                ) from None


# Runs users' files in a child process first, under a limit of time and memory.
#
# What the text of a file does not show, such as a power that takes a year, would hang whoever reads
# it. So a file that is new here runs in a child before it runs in this process.

SECONDS = 20.0
"""Time [s] within which a file has to define its class and its hooks to pass their trial."""

BYTES = 4 << 30
"""Memory that the child may ask for, where the system can limit it."""

_MOST_RESTARTS = 20


def tried(orders: list[dict[str, str]]) -> list[FlawError | None]:
    """Return what is wrong with each file, None where nothing is.

    Parameters
    ----------
    orders : list of dict
        Of each file what the child needs: "path", "shown", "word" and "text".
    """
    found: list[FlawError | None] = []
    for _ in range(_MOST_RESTARTS):
        if len(found) == len(orders):
            return found
        found += _answers(orders[len(found) :])
    return found + [FlawError("it cannot be tried: too many files before it fail.")] * (
        len(orders) - len(found)
    )


def _answers(orders: list[dict[str, str]]) -> list[FlawError | None]:
    """Return what a child says of the files, as far as it came: at least of one."""
    most = (SECONDS + 10.0) * len(orders) + 60.0
    child = in_child(f"from {__package__}.load import serve; serve()", orders, most)
    rows = [json.loads(row) for row in child.stdout.splitlines() if row.startswith("{")]
    found = [FlawError(row["error"], row["line"]) if row["error"] else None for row in rows]
    if len(found) < len(orders):  # the child ended at the next one
        found.append(_ended(child, orders[len(found)]["path"]))
    return found


def _ended(child: subprocess.CompletedProcess[str], path: str) -> FlawError:
    """Return why the child ended at a file, and the line where it was."""
    lines = re.findall(rf'File "{re.escape(path)}", line (\d+)', child.stderr)
    line = int(lines[0]) if lines else 0
    if "Timeout" in child.stderr:
        return FlawError(
            f"it does not end within {SECONDS:g} s. A hook is called some hundred thousand times "
            "in a simulation: arithmetic that takes microseconds is right.",
            line,
        )
    told = child.stderr.strip().splitlines()
    last = told[-1] if told else f"status {child.returncode}"
    return FlawError(f"it ends the process that tries it: {last}.", line)


def serve(run: Callable[[dict[str, Any]], None]) -> None:
    """Try the files that stand on the standard input; the child's end of `tried`.

    Parameters
    ----------
    run : callable
        Takes an order and raises FlawError if its file is not right.
    """
    with suppress(ImportError, ValueError, OSError):  # not every system can limit memory
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))
    for order in json.load(sys.stdin):
        faulthandler.dump_traceback_later(SECONDS, exit=True)
        answer: dict[str, Any] = {"error": "", "line": 0}
        try:
            run(order)
        except FlawError as flaw:
            answer = {"error": str(flaw), "line": flaw.line}
        faulthandler.cancel_dump_traceback_later()
        print(json.dumps(answer), flush=True)
