"""The law of a damper that a scenario names: of the library or a user's own, in a chosen form."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import BristleError, TrustError
from ..findings import Findings, unknown, written
from ..physics.forms import FORMS, TABLE_FORM
from .library import Library
from .parts import Part, existing_file


def choose_law(
    part: Part, settings: Mapping[str, Any], folder: Path, library: Library, findings: Findings
) -> bool:
    """Read `law`, `command` and `command_knots` of a component; return whether they are right.

    Parameters
    ----------
    part, settings : the component, which gets its law
    folder : where relative names begin
    library, findings : where laws are looked up; takes what is found

    Raises
    ------
    TrustError
        If nobody consented to the code of a user's own law.
    """
    where = f"[components.{part.name}]"
    law = _named(part, settings, folder, library, findings)
    form = _form(part, settings, findings)
    if law is None or form is None:
        return False
    try:
        part.law = library.damper_of(law, *form)
    except TrustError:
        raise  # no mistake of the file, and it is asked about
    except BristleError as error:
        key = "command" if "command" in settings and "law" not in settings else "law"
        findings.error((*part.path, key), f"{where}: {error}")
        return False
    part.fmu = part.law.shown
    return True


def _named(
    part: Part, settings: Mapping[str, Any], folder: Path, library: Library, findings: Findings
) -> str | Path | None:
    """Return the law that is named, by itself or by a built-in damper; None where none is."""
    where = f"[components.{part.name}]"
    fmu, path = settings.get("fmu"), (*part.path, "law")
    if "law" not in settings:
        own = library.law_of(str(fmu)) if fmu in library.names() else ""
        if not own:
            words = (
                f"{where}: only a built-in damper takes a form of the command, or law = ... does."
            )
            findings.error((*part.path, "command"), words)
        return own or None
    value = settings["law"]
    if "fmu" in settings:
        words = f"{where}: fmu and law both say what the damper is; one of them must go."
        findings.error((*part.path, "fmu"), words)
        return None
    if not isinstance(value, str) or not value:
        words = f'law is {written(value)}; the name of a law, or "FILE.py" of your own, is right.'
        findings.error(path, f"{where}: {words}")
        return None
    if not value.endswith(".py"):
        return value
    return existing_file(value, folder, path, f"{where} law", findings)


def _form(
    part: Part, settings: Mapping[str, Any], findings: Findings
) -> tuple[str, tuple[float, ...]] | None:
    """Return the form of the command and the knots [V] of a table; None where they are wrong."""
    where = f"[components.{part.name}]"
    form, knots = settings.get("command", ""), settings.get("command_knots", [])
    if form not in ("", *FORMS):
        text = unknown("form of the command", form, FORMS) if isinstance(form, str) else ""
        text = text or f"command is {written(form)}; one of {', '.join(FORMS)} is right."
        findings.error((*part.path, "command"), f"{where}: {text}")
        return None
    numbers = isinstance(knots, list) and all(type(one) in (int, float) for one in knots)
    if not numbers or bool(knots) != (form == TABLE_FORM):
        findings.error(
            (*part.path, "command_knots"),
            f"{where}: command_knots is {written(knots)}; a list of numbers [V] beside "
            f'command = "{TABLE_FORM}", and none beside another form, is right.',
        )
        return None
    return form, tuple(map(float, knots))
