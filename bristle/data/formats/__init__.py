"""File formats of measurements, one module each, found by standing in this folder.

A module has two functions: `recognises(content, suffix)` says whether a file's bytes, or the ending
of its name (".mat"), are of its format; `read(content, name)` returns the `Table` in it, or raises
RecordError with `name`, the place in the file and what would be right; where a file has sheets,
`read_sheet(content, name, sheet)` reads one, or all. The first module that
recognises a file reads it, in the order of `ORDER` (0 where a module has none) and of their names:
formats that are known and not read come behind those that are (`unread`, 1), delimited text last
(2), for it takes whatever is left. A helper's name begins with an underscore.
"""

from __future__ import annotations

import pkgutil
from functools import cache
from importlib import import_module
from types import ModuleType
from typing import Any

from ...core.text import install
from ...errors import RecordError
from ..table import Table, without_codes

DAMAGED = (
    OSError, ValueError, LookupError, TypeError, AttributeError, ArithmeticError, EOFError,
    RuntimeError, MemoryError,
)  # fmt: skip
"""What a damaged file surfaces as from the parsing of a library that reads its format."""


@cache
def formats() -> tuple[ModuleType, ...]:
    """Return the modules of the formats in the order in which they are asked."""
    names = [one.name for one in pkgutil.iter_modules(__path__) if not one.name.startswith("_")]
    modules = [import_module(f"{__name__}.{name}") for name in sorted(names)]
    return tuple(sorted(modules, key=lambda module: int(getattr(module, "ORDER", 0))))


def read(content: bytes, suffix: str, name: str, sheet: str = "") -> Table:
    """Return the table in a file's bytes.

    Parameters
    ----------
    content : the file, decompressed
    suffix : the ending of its name in lower case, with the dot
    name : what messages call it
    sheet : of a workbook, the title of the sheet, "*" for all that hold runs; "" for the likeliest

    Raises
    ------
    RecordError
        If the file is damaged, of a format that is not read, or has no such sheet.
    """
    module = next(one for one in formats() if one.recognises(content, suffix))
    if sheet and not hasattr(module, "read_sheet"):
        raise RecordError(f"{name}: this is no workbook, and has no sheet to choose.")
    table: Table = module.read_sheet(content, name, sheet) if sheet else module.read(content, name)
    return without_codes(table)


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
        raise RecordError(f"{name}: this is {what}; to read it:  {install('formats')}") from None
