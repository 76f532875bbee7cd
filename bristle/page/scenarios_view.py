"""View 7, Simulate: the scenarios that can be moved, stock ones and those that studies exported."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..scenario.scenario import stock_scenarios


def answer(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the scenarios by name, each with its first comment line.

    Parameters
    ----------
    folder : that holds studies
    arguments : none are taken
    """
    stock = [{"name": file.stem, "file": file.stem, "study": ""} for file in stock_scenarios()]
    exported = [
        {"name": file.stem, "file": file.relative_to(folder).as_posix(),
         "study": file.relative_to(folder).parts[0]}
        for file in sorted(folder.glob("*/export/*.toml"))
    ]  # fmt: skip
    return {"scenarios": [*exported, *stock]}
