"""View 7, Simulate: the scenarios that can be moved, and the studies with a damper for them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..scenario.scenario import stock_scenarios


def answer(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the stock scenarios by name, and the studies.

    Parameters
    ----------
    folder : that holds studies
    arguments : none are taken
    """
    studies = [file.parent.name for file in sorted(folder.glob("*/study.toml"))]
    return {
        "scenarios": [file.stem for file in stock_scenarios()],
        "studies": [name for name in studies if not name.startswith(".")],
    }
