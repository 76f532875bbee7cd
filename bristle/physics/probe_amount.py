"""Checks that an effect vanishes with the parameter that its `amount` names."""

from __future__ import annotations

from collections.abc import Callable
from math import copysign

from .effect import Effect, Q
from .user_text import FlawError

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
    hooks = [hook for hook in effect.hooks() if hook not in ("rate", "advance")]

    def size(at: float) -> float:
        """Return by how much the hooks differ from those of no effect, the largest of all."""
        return max(
            abs(got - without)
            for q in signals
            for hook in hooks
            for got, without in zip(value(hook, q, at), _without(hook, q))
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
    passed_on = {"voltage": q.V, "channel": q.value, "yield_force": copysign(1.0, q.v)}
    return (passed_on.get(hook, 0.0),)
