"""Consent to code that came with a file: an effect of somebody's own runs after its user said yes.

A study or a scenario may come from somebody else, and the effects in it are Python. The loader of
such files (`user_code.load`) asks here before it runs any text. Consent is remembered by the digest
of the text, in a folder of this user on this machine: a text that changes asks again, one that
moves does not. The check that the loader makes of a text keeps hooks pure; it is no fence against
somebody who means harm.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path

from .core.files import state_folder
from .errors import TrustError

VARIABLE = "BRISTLE_TRUST"
"""The environment variable that consents to all code, for CI: 1 is yes."""

_granted: ContextVar[bool] = ContextVar("granted", default=False)
_declined: ContextVar[set[str] | None] = ContextVar("declined", default=None)


def digest(text: str) -> str:
    """Return the SHA-256 of a text, 64 hexadecimal digits."""
    return hashlib.sha256(text.encode()).hexdigest()


def readable(text: str) -> str:
    """Return a text in which nothing hides: what moves a cursor or turns writing is spelled."""
    return "".join(
        one if one in "\n\t" or one.isprintable() else one.encode("unicode_escape").decode()
        for one in text
    )


def is_trusted(text: str) -> bool:
    """Return whether this user consented to a text before, or to all in this process."""
    return os.environ.get(VARIABLE) == "1" or _consent(text).is_file()


def remember(path: Path, text: str) -> None:
    """Keep that this user consents to a text, which was read at a path.

    Raises
    ------
    TrustError
        If it cannot be kept.
    """
    _write(_consent(text), {"schema": 1, "read_at": str(path.absolute())}, path)


def remember_made(path: Path, text: str) -> None:
    """Keep that bristle made a file here: its text is trusted, and its user may check later ones.

    Raises
    ------
    TrustError
        If it cannot be kept.
    """
    remember(path, text)
    _write(_made(path), {"schema": 1, "file": str(path.resolve())}, path)


def is_made_here(path: Path) -> bool:
    """Return whether bristle made the file at a path, on this machine for this user."""
    return _made(path).is_file()


@contextmanager
def granted(yes: bool = True) -> Iterator[None]:
    """Consent to all code that is read in a context, and remember it; nothing without `yes`."""
    before = _granted.set(yes or _granted.get())
    try:
        yield
    finally:
        _granted.reset(before)


def require(path: Path, text: str) -> None:
    """Pass where a text may run on this machine.

    Parameters
    ----------
    path : path
        The file, as it is shown to the user.
    text : str
        What the file holds, and what is about to run.

    Raises
    ------
    TrustError
        If nobody consented, with path and text; or if consent cannot be kept.
    """
    if is_trusted(text):
        return
    if not _granted.get():
        raise TrustError(path, text)
    remember(path, text)


@contextmanager
def asking() -> Iterator[set[str]]:
    """Let `can_do_without` ask first; give the digests of the texts whose user said no."""
    declined: set[str] = set()
    before = _declined.set(declined)
    try:
        yield declined
    finally:
        _declined.reset(before)


def can_do_without(untrusted: TrustError) -> None:
    """Pass where work may go on without a text that must not run here.

    Raises
    ------
    TrustError
        The same, where somebody can be asked (`asking`) and was not yet.
    """
    declined = _declined.get()
    if declined is not None and digest(untrusted.text) not in declined:
        untrusted.optional = True
        raise untrusted


def _consent(text: str) -> Path:
    return state_folder() / "trusted" / digest(text)


def _made(path: Path) -> Path:
    return state_folder() / "made" / digest(str(path.resolve()))


def _write(file: Path, content: dict[str, object], path: Path) -> None:
    draft = file.with_name(f"{file.name}.{os.getpid()}")
    try:
        file.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        draft.write_text(json.dumps(content) + "\n", encoding="utf-8")
        draft.replace(file)
    except OSError as error:
        with suppress(OSError):
            draft.unlink(missing_ok=True)
        why = f"{file.parent} cannot be written ({error.strerror or error})"
        raise TrustError(path, why=why) from None
