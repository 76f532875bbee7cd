"""Libraries that come with `bristle[formats]`, asked for when a file needs one."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ...errors import RecordError

INSTALL = "pip install 'bristle[formats]'"


def library(module: str, name: str, what: str) -> Any:
    """Return a module that reads a format.

    Parameters
    ----------
    module : what to import
    name : the file, for the message
    what : the format, as in "an Excel workbook"

    Raises
    ------
    RecordError
        If it is not installed, with the command that installs it.
    """
    try:
        return import_module(module)
    except ImportError:
        raise RecordError(f"{name}: this is {what}; to read it:  {INSTALL}") from None
