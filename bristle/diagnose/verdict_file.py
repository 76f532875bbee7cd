"""verdict.json as any version of this package wrote it, in the words of the present one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import StudyError
from .verdict_text import HEADINGS

SCHEMA = 2
_KIND_NOW = {"class": "ambiguous"}
"""Kinds of schema 1 that have another name now."""


def current(verdict: Mapping[str, Any], where: str = "verdict.json") -> dict[str, Any]:
    """Return the content of a verdict file in the present schema.

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
    if schema not in (1, SCHEMA):
        raise StudyError(
            f"{where}: schema = {schema!r}; this version reads 1 and {SCHEMA}. "
            "bristle diagnose writes it again."
        )
    if schema == 1:
        kind = _KIND_NOW.get(str(kind), kind)
    if kind not in HEADINGS:
        raise StudyError(
            f"{where}: kind = {kind!r}; there are {', '.join(HEADINGS)}. "
            "bristle diagnose writes it again."
        )
    return {**verdict, "schema": SCHEMA, "kind": kind}
