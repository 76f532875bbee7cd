"""The folder of a comparison: files that its scenarios read lie in it, so that it can be moved."""

from __future__ import annotations

import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ..core.toml_write import toml_key, toml_value
from ..errors import not_usable

FILES, SCENARIOS, ENSEMBLES, LIMITS = "files", "scenarios", "ensembles", "limits"
UNFINISHED = ".unfinished"
"""Stands in the folder until its comparison has come to its end."""
ABOVE = "../.."
"""From a scenario, which lies two folders deep, to the comparison's folder."""


class Part(NamedTuple):
    """A component of a scenario: what it is made from (`fmu`, `law` ...), and its parameters."""

    source: dict[str, Any]
    parameters: dict[str, Any]


class Folder:
    """The folder of a comparison.

    Parameters
    ----------
    path : Path
        Made where it is missing.

    Attributes
    ----------
    goes_on : bool
        Whether a comparison there was interrupted: runs of its ensembles that fit are taken over.

    Raises
    ------
    RunError
        If it cannot be written to, exit code 2.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._kept: dict[str, Path] = {}
        self.goes_on = (path / UNFINISHED).exists()
        self.write(path / FILES / ".keep", "")
        (path / FILES / ".keep").unlink()
        self.write(path / UNFINISHED, "")

    def finish(self) -> None:
        """Say that the comparison came to its end: the next one there begins anew."""
        (self.path / UNFINISHED).unlink(missing_ok=True)

    def keep(self, file: Path, name: str = "") -> str:
        """Copy a file in; return its path as scenarios write it.

        Parameters
        ----------
        file : to copy; another one of the same name gets a number
        name : in place of the file's own
        """
        file = file.absolute()
        stem, ending = Path(name or file.name).stem, Path(name or file.name).suffix
        kept, count = f"{stem}{ending}", 1
        while self._kept.get(kept, file) != file:
            count += 1
            kept = f"{stem}_{count}{ending}"
        self._kept[kept] = file
        target = self.path / FILES / kept
        try:
            if not (target.exists() and target.samefile(file)):
                shutil.copyfile(file, target)
        except OSError as error:
            raise not_usable(f"{target}: cannot be written: {error.strerror or error}.") from error
        return f"{ABOVE}/{FILES}/{kept}"

    def at(self, kind: str, motion: str, name: str) -> Path:
        """Return the path of a file about a motion: kind/motion/name."""
        return self.path / kind / plain_name(motion) / name

    def write(self, path: Path, text: str) -> Path:
        """Write a text file; return its path.

        Raises
        ------
        RunError
            If it cannot be written, exit code 2.
        """
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        except OSError as error:
            raise not_usable(f"{path}: cannot be written: {error.strerror or error}.") from error
        return path


def plain_name(text: str) -> str:
    """Return a text as the name of a file: letters, digits, dots and dashes."""
    return re.sub(r"[^\w.+-]+", "_", text).strip("._") or "unnamed"


def scenario_text(
    title: str, stop: float, step: float, parts: Mapping[str, Part], wires: Mapping[str, Any]
) -> str:
    """Return the text of a scenario.

    Parameters
    ----------
    title : of the scenario
    stop, step : [s]
    parts : components by name, in the order in which they step
    wires : input "component.port" to output, or to a table `{ from, factor }`
    """
    run = {"stop": stop, "step": step, "algorithm": "midpoint"}
    lines = ["schema = 1", f"title = {toml_value(title)}", "", "[run]", *_lines(run)]
    for name, part in parts.items():
        lines += ["", f"[components.{toml_key(name)}]", *_lines(part.source)]
        if part.parameters:
            lines.append(f"parameters = {toml_value(part.parameters)}")
    return "\n".join([*lines, "", "[connections]", *_lines(wires)]) + "\n"


def ensemble_text(content: Mapping[str, Any], tables: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the text of an ensemble file.

    Parameters
    ----------
    content : its keys with their values
    tables : the tables after them, by name
    """
    lines = _lines({"schema": 1, **content})
    for name, table in tables.items():
        lines += ["", f"[{name}]", *_lines(table)]
    return "\n".join(lines) + "\n"


def _lines(table: Mapping[str, Any]) -> list[str]:
    return [f"{toml_key(key)} = {toml_value(value)}" for key, value in table.items()]
