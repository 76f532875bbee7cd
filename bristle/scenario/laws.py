"""The law of a damper that a scenario names: of the library or a user's own, in a chosen form."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..core.config import Document
from ..errors import BristleError, TrustError
from ..physics.forms import TABLE_FORM
from .library import Library
from .parts import Part, existing_file


def choose_law(
    part: Part, settings: Mapping[str, Any], found: Mapping[str, Any], folder: Path,
    library: Library, document: Document,
) -> bool:  # fmt: skip
    """Read `law`, `command` and `command_knots` of a component; return whether they are right.

    Parameters
    ----------
    part, settings, found : the component, which gets its law; its table; what could be read in it
    folder : where relative names begin
    library, document : where laws are looked up; takes what is found

    Raises
    ------
    TrustError
        If nobody consented to the code of a user's own law.
    """
    where = f"[components.{part.name}]"
    law = _named(part, settings, found, folder, library, document)
    form = _form(part, settings, found, document)
    if law is None or form is None:
        return False
    try:
        part.law = library.damper_of(law, *form)
    except TrustError:
        raise  # no mistake of the file, and it is asked about
    except BristleError as error:
        key = "command" if "command" in settings and "law" not in settings else "law"
        document.error((*part.path, key), f"{where}: {error}")
        return False
    part.fmu = part.law.shown
    return True


def _named(
    part: Part, settings: Mapping[str, Any], found: Mapping[str, Any], folder: Path,
    library: Library, document: Document,
) -> str | Path | None:  # fmt: skip
    """Return the law that is named, by itself or by a built-in damper; None where none is."""
    where = f"[components.{part.name}]"
    fmu, path = found["fmu"], (*part.path, "law")
    value: str | None = found["law"]
    if "law" not in settings:
        own = library.law_of(fmu) if fmu in library.names() else ""
        if not own:
            words = (
                f"{where}: only a built-in damper takes a form of the command, or law = ... does."
            )
            document.error((*part.path, "command"), words)
        return own or None
    if "fmu" in settings:
        words = f"{where}: fmu and law both say what the damper is; one of them must go."
        document.error((*part.path, "fmu"), words)
        return None
    if value == "":
        words = 'law is missing: expected the name of a law, or "FILE.py" of your own.'
        document.error(path, f"{where}: {words}")
    if not value:
        return None
    if not value.endswith(".py"):
        return value
    return existing_file(value, folder, path, f"{where} law", document)


def _form(
    part: Part, settings: Mapping[str, Any], found: Mapping[str, Any], document: Document
) -> tuple[str, tuple[float, ...]] | None:
    """Return the form of the command and the knots [V] of a table; None where they are wrong."""
    if any(key in settings and found[key] is None for key in ("command", "command_knots")):
        return None
    form, knots = found["command"] or "", found["command_knots"] or ()
    if bool(knots) != (form == TABLE_FORM):
        document.error(
            (*part.path, "command_knots"),
            f"[components.{part.name}]: command_knots is {'a list' if knots else 'missing'}: "
            f'expected a list of numbers [V] beside command = "{TABLE_FORM}", and none beside '
            "another form.",
        )
        return None
    return form, knots
