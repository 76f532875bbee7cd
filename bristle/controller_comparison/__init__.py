"""Controllers compared on one's own building, motions, damper: `bristle.compare_controllers`.

import bristle
found = bristle.compare_controllers(
    ["el_centro_1940_ns,peak=0.4g", "my_record.AT2"],
    ["LqgClipped", "my_design.json", "MyController.fmu"],
    building="tower.toml", out="results/mine",
)
found.verdict, found.table
"""

from __future__ import annotations

from .compare import compare_controllers
from .result import ControllerComparison
from .runs import Spread

__all__ = ["ControllerComparison", "Spread", "compare_controllers"]
