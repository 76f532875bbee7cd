"""bristle: base-isolated buildings with MR dampers, as FMUs and as models that learn.

    import bristle

    results = bristle.run("el_centro_lugre_passive")    # a scenario: rows of all outputs
    found = bristle.identify("lab/*.csv", "lugre")      # a damper's parameters from measurements
    verdict = bristle.diagnose("lab/*.csv", found)      # the effects that its model misses

`dir(bristle)` lists what is public. Each name is imported on first use, so that `import bristle`
takes hundredths of a second.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

from .version import __version__

if TYPE_CHECKING:
    from .campaign.ensemble import Ensemble as Ensemble
    from .campaign.ensemble import ensemble as ensemble
    from .comparison.result import Comparison as Comparison
    from .controller_comparison.compare import compare_controllers as compare_controllers
    from .data.measurement import Measurement as Measurement
    from .diagnosis.verdict import Diagnosis as Diagnosis
    from .engine.results import Results as Results
    from .engine.results import load_results as load_results
    from .engine.run import run as run
    from .errors import BristleError as BristleError
    from .physics.effect import Effect as Effect
    from .physics.law import Law as Law
    from .physics.parameter import Parameter as Parameter
    from .planning.api import plan as plan
    from .planning.plan import Plan as Plan
    from .study.api import compare as compare
    from .study.api import diagnose as diagnose
    from .study.api import identify as identify
    from .study.identify import Identified as Identified
    from .study.study import Study as Study
    from .synthesis import design as design
    from .synthesis.analysis import DesignResult as DesignResult

_LAZY = {
    "BristleError": "errors",
    "Comparison": "comparison.result",
    "DesignResult": "synthesis.analysis",
    "Diagnosis": "diagnosis.verdict",
    "Effect": "physics.effect",
    "Ensemble": "campaign.ensemble",
    "Identified": "study.identify",
    "Law": "physics.law",
    "Measurement": "data.measurement",
    "Parameter": "physics.parameter",
    "Plan": "planning.plan",
    "Results": "engine.results",
    "Study": "study.study",
    "compare": "study.api",
    "compare_controllers": "controller_comparison.compare",
    "design": "synthesis",
    "diagnose": "study.api",
    "ensemble": "campaign.ensemble",
    "identify": "study.api",
    "load_results": "engine.results",
    "plan": "planning.api",
    "run": "engine.run",
}
"""The public names, and the modules that they are in."""

__all__ = [
    "BristleError",
    "Comparison",
    "DesignResult",
    "Diagnosis",
    "Effect",
    "Ensemble",
    "Identified",
    "Law",
    "Measurement",
    "Parameter",
    "Plan",
    "Results",
    "Study",
    "__version__",
    "compare",
    "compare_controllers",
    "design",
    "diagnose",
    "ensemble",
    "identify",
    "load_results",
    "plan",
    "run",
]


class _Package(ModuleType):
    """The package as a module whose public functions no subpackage of the same name hides.

    Importing bristle.identify makes Python set it as the attribute `identify` of bristle, and the
    function of that name would be gone. The subpackage is found in sys.modules all the same.
    """

    def __setattr__(self, name: str, value: object) -> None:
        if name not in _LAZY or not isinstance(value, ModuleType):
            super().__setattr__(name, value)


if not TYPE_CHECKING:  # a type checker is to see a name that there is not

    def __getattr__(name: str) -> object:
        if name in _LAZY:
            return getattr(import_module(f".{_LAZY[name]}", __name__), name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)


sys.modules[__name__].__class__ = _Package
