"""Consent to a study's own effects and laws from the page: to the text that was shown, to no other.

The commands that the page starts are never given `--trust`: they run what was consented to here.
"""

from __future__ import annotations

from http import HTTPStatus
from pathlib import Path
from typing import Any

from ..physics.user_text import text_of
from ..trust import digest, is_trusted, readable, remember
from .message import RequestError


def own_files(folder: Path) -> list[Path]:
    """Return the files of a study's own laws and effects."""
    return [file for name in ("laws", "effects") for file in sorted((folder / name).glob("*.py"))]


def waiting_texts(folder: Path) -> list[dict[str, Any]]:
    """Return what has not run on this machine before: file, text, digest.

    In the text nothing hides: what moves a cursor or turns writing is spelled.
    """
    found = []
    for file in own_files(folder):
        text = text_of(file, "replace")
        if not is_trusted(text):
            name = file.relative_to(folder).as_posix()
            found.append({"file": name, "text": readable(text), "digest": digest(text)})
    return found


def consent(folder: Path, name: object, shown: object) -> None:
    """Remember that the user consents to the file of this name with the text of this digest.

    Raises
    ------
    RequestError
        If there is no such file, or its text is no longer the one that was shown.
    TrustError
        If consent cannot be kept.
    """
    for file in own_files(folder):
        if file.relative_to(folder).as_posix() != name:
            continue
        text = text_of(file, "replace")
        if digest(text) != shown:
            raise RequestError(
                f"{name}: the file has changed since it was shown. Read it again.",
                HTTPStatus.CONFLICT,
            )
        remember(file, text)
        return
    raise RequestError(f"{name}: the study has no such file.", HTTPStatus.NOT_FOUND)
