"""The form of the command in a model.toml: the keys `command` and `command_knots`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..core.config import Document, Key
from ..errors import PhysicsError
from ..physics.forms import FORMS, TABLE_FORM, joined_form
from ..physics.laws import base_and_variant

FORM_KEYS = {
    "command": Key(str, "", choices=FORMS), "command_knots": Key([float], (), "V")
}  # fmt: skip


def law_in_form(document: Document, found: Mapping[str, Any], law: str, known: bool = True) -> str:
    """Return a law's name with the form of the command that a file names.

    Parameters
    ----------
    document, found : takes what is wrong; what the file holds
    law : the name that stands in it
    known : whether the law is registered; else it is not asked whether it can have the form

    Raises
    ------
    StudyError
        If the form does not suit the law, or the knots are not right.
    """
    form, knots = found["command"], found["command_knots"]
    if knots and form != TABLE_FORM:
        right = f'command = "{TABLE_FORM}" beside them'
        document.error(("command_knots",), f"command_knots are given: expected {right}.")
    document.check()
    try:
        name = joined_form(law, form, knots)
        if known:
            base_and_variant(name)
    except PhysicsError as error:
        document.error(("command",), str(error))
        document.check()
    return name
