"""The form of the command in a model.toml: the keys `command` and `command_knots`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import PhysicsError
from ..findings import unknown, written
from ..physics.forms import FORMS, TABLE_FORM, joined_form
from ..physics.laws import base_and_variant
from .files import Toml

FORM_KEYS = ("command", "command_knots")


def law_in_form(toml: Toml, data: Mapping[str, Any], law: str, known: bool = True) -> str:
    """Return a law's name with the form of the command that a file names.

    Parameters
    ----------
    toml, data : the file
    law : the name that stands in it
    known : whether the law is registered; else it is not asked whether it can have the form

    Raises
    ------
    StudyError
        If there is no such form, it does not suit the law, or the knots are not right.
    """
    form = toml.text((), data, "command")
    given = data.get("command_knots", [])
    numbers = isinstance(given, list) and all(type(one) in (int, float) for one in given)
    if not numbers or (given and form != TABLE_FORM):
        right = f'a list of numbers [V], beside command = "{TABLE_FORM}", is right'
        toml.error(("command_knots",), f"command_knots is {written(given)}; {right}.")
        toml.check()
    if form and form not in FORMS:
        toml.error(("command",), unknown("form of the command", form, FORMS))
        toml.check()
    try:
        name = joined_form(law, form, tuple(map(float, given)))
        if known:
            base_and_variant(name)
    except PhysicsError as error:
        toml.error(("command",), str(error))
        toml.check()
    return name
