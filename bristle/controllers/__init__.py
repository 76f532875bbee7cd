"""Controllers compared on one's own building, motions, damper: `bristle.compare_controllers`.

    import bristle
    found = bristle.compare_controllers(
        ["el_centro_1940_ns,peak=0.4g", "my_record.AT2"],
        ["LqgClipped", "my_design.json", "MyController.fmu"],
        building="tower.toml", out="results/mine",
    )
    found.verdict, found.table

choice, folder     what a user chooses, as text; the folder that scenarios lie in
motions, site, dampers, entries    ground motions, building, damper, controllers
anew               designs made again for the building
cells              the scenarios, run and measured; constant voltages
robust, limits     the worst case over an ensemble; how far any control could go
compare, result    the comparison and what came of it
verdict, picture   in sentences, and as figures
"""

from __future__ import annotations

from .compare import compare_controllers
from .result import ControllerComparison
from .robust import Spread

__all__ = ["ControllerComparison", "Spread", "compare_controllers"]
