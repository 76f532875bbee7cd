"""verdict.json: which schema and kinds are read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import StudyError
from .verdict_text import TONES

SCHEMA = 2


def current(verdict: Mapping[str, Any], where: str = "verdict.json") -> dict[str, Any]:
    """Return the content of a verdict file, checked.

    Parameters
    ----------
    verdict : the content as it was read
    where : the file, for messages

    Raises
    ------
    StudyError
        If the schema or the kind is none that this version knows.
    """
    schema, kind = verdict.get("schema"), verdict.get("kind")
    if schema != SCHEMA:
        raise StudyError(
            f"{where}: schema = {schema!r}; this version reads {SCHEMA}. "
            "bristle diagnose writes it again."
        )
    if kind not in TONES:
        raise StudyError(
            f"{where}: kind = {kind!r}; there are {', '.join(TONES)}. "
            "bristle diagnose writes it again."
        )
    return dict(verdict)
