"""Copies of stock scenarios, to be edited."""

from __future__ import annotations

import re
from pathlib import Path

from ..core.config import toml_content
from ..core.text import unknown
from ..errors import ScenarioError
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
        where the schema stands is left out: it holds beside the stock scenarios alone. A building
        of the scenario's own goes with it, to the same place beside it.

    Raises
    ------
    ScenarioError
        If there is no such scenario, or a file is there already or cannot be written.
    """
    stock = {file.stem: file for file in stock_scenarios()}
    source = stock.get(name.removesuffix(".toml"))
    if source is None:
        raise ScenarioError(unknown("stock scenario", name, list(stock)))
    file = target or Path(source.name)
    text = source.read_text(encoding="utf-8")
    components = toml_content(source)["components"].values()
    buildings = [component["building"] for component in components if "building" in component]
    _write_new(file, _SCHEMA.sub("", text))
    for building in buildings:
        copied = file.parent / building
        content = (source.parent / building).read_text(encoding="utf-8")
        if not copied.is_file() or copied.read_text(encoding="utf-8") != content:
            copied.parent.mkdir(parents=True, exist_ok=True)
            _write_new(copied, content)
    return file


def _write_new(file: Path, text: str) -> None:
    """Write a file that is not there yet."""
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise ScenarioError(f"{file} is there already; another file, or remove it.") from None
    except OSError as error:
        raise ScenarioError(f"{file}: cannot be written ({error.strerror or error}).") from None
