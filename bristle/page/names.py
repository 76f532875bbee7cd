"""Names that a page sends: of studies and files. None can be an option or lead out of a folder."""

from __future__ import annotations

import re

from ..findings import written
from .message import RequestError

UPLOADS = "uploads"
"""The folder beside the studies where files go that were dropped on the page."""

_NAME = re.compile(r"\w[\w .+-]{0,79}")
_BATCH = re.compile(r"[0-9a-z][0-9a-z-]{0,39}")


def file_name(text: object, what: str = "a name") -> str:
    """Return a text that is the name of a file or folder and no path.

    Raises
    ------
    RequestError
        If it is not.
    """
    if not isinstance(text, str) or not _NAME.fullmatch(text) or text.endswith((".", " ")):
        raise RequestError(
            f"{what}: {written(text)}; letters, digits, spaces, dots and dashes are right, "
            "beginning with a letter or digit."
        )
    return text


def batch_name(text: object) -> str:
    """Return a text that names files that were dropped together; RequestError if it does not."""
    if not isinstance(text, str) or not _BATCH.fullmatch(text):
        raise RequestError(f"a batch of files: {written(text)} is no name of one.")
    return text
