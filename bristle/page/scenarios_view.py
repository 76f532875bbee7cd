"""View 7, Simulate: scenarios that can be moved, studies with a damper for them, ground motions."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..system.scenario import stock_scenarios
from .simulate_view import records


def answer(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the stock scenarios by name, the studies, and the ground motions.

    Parameters
    ----------
    folder : that holds studies
    arguments : none are taken
    """
    studies = [file.parent.name for file in sorted(folder.glob("*/study.toml"))]
    return {
        "scenarios": [file.stem for file in stock_scenarios()],
        "studies": [name for name in studies if not name.startswith(".")],
        "records": records(folder),
    }
