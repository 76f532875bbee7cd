"""What a model makes of the tables of a scenario."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ..model.model import Model
from ..physics.effect import EFFECTS
from ..physics.forms import split_form
from ..user_code.load import own_effects, own_laws

Parameters = dict[str, float | bool]
DamperTable = Callable[[Parameters], Mapping[str, Any]]
"""Parameters that the scenario knows to the table of its damper."""


def source_of(damper: Model) -> dict[str, Any]:
    """Return what a damper is made from where it is no FMU of its own: law, form, own effects.

    Parameters
    ----------
    damper : the model with the effects of the damper alone
    """
    plain, form, knots = split_form(damper.base_law)
    source: dict[str, Any] = {"law": str(own_laws().get(plain, plain))}
    source |= {"command": form} if form else {}
    source |= {"command_knots": list(knots)} if knots else {}
    own = [str(own_effects()[name]) for name in damper.effects if EFFECTS[name].own]
    return source | ({"effects": own} if own else {})


def values_of(damper: Model) -> Parameters:
    """Return what such a damper is given: values of its law and effects, and their switches."""
    values = {
        name: value
        for name, value in damper.values.items()
        if "." not in name or name.partition(".")[0] in damper.effects
    }
    return {**values, **{f"{effect}.on": True for effect in damper.effects}}
