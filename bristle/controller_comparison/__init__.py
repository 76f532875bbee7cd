"""Controllers compared on one's own building, motions, damper: `bristle.compare_controllers`.

    import bristle
    found = bristle.compare_controllers(
        ["el_centro_1940_ns,peak=0.4g", "my_record.AT2"],
        ["LqgClipped", "my_design.json", "MyController.fmu"],
        building="tower.toml", out="results/mine",
    )
    found.verdict, found.table

choice, folder     what a user chooses, as text; the folder that scenarios lie in
motions, site, dampers, entry      ground motions, building, damper, controller
entries            the controllers from what a user chose
anew               designs made again for the building
cells              the scenarios, run and measured; constant voltages
robust, limits     the worst case over an ensemble; how far any control could go
compare, result    the comparison and what came of it
verdict, notes, tables, picture    in sentences, texts and figures
"""

from __future__ import annotations

from .compare import compare_controllers
from .result import ControllerComparison
from .worst_case import Spread

__all__ = ["ControllerComparison", "Spread", "compare_controllers"]
