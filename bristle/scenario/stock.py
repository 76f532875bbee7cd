"""Copies of stock scenarios, to be edited."""

from __future__ import annotations

import re
from pathlib import Path

from ..errors import ScenarioError
from ..findings import unknown
from .scenario import stock_scenarios

_SCHEMA = re.compile(r"^#:schema .*\n", re.MULTILINE)


def copy_scenario(name: str, target: Path | None = None) -> Path:
    """Copy a stock scenario; return the file that was written.

    Parameters
    ----------
    name : str
        Of a stock scenario.
    target : Path, optional
        The file that is written; else NAME.toml in the current folder. The line that tells editors
        where the schema stands is left out: it holds beside the stock scenarios alone.

    Raises
    ------
    ScenarioError
        If there is no such scenario, or the file is there already or cannot be written.
    """
    stock = {file.stem: file for file in stock_scenarios()}
    source = stock.get(name.removesuffix(".toml"))
    if source is None:
        raise ScenarioError(unknown("stock scenario", name, list(stock)))
    file = target or Path(source.name)
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(_SCHEMA.sub("", source.read_text(encoding="utf-8")))
    except FileExistsError:
        raise ScenarioError(f"{file} is there already; another file, or remove it.") from None
    except OSError as error:
        raise ScenarioError(f"{file}: cannot be written ({error.strerror or error}).") from None
    return file
