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
    from .batch.execute import Ensemble as Ensemble
    from .batch.execute import ensemble as ensemble
    from .compare.comparison import Comparison as Comparison
    from .controllers.compare import compare_controllers as compare_controllers
    from .data.measurement import Measurement as Measurement
    from .design import design as design
    from .design.result import DesignResult as DesignResult
    from .diagnose.verdict import Diagnosis as Diagnosis
    from .errors import BristleError as BristleError
    from .physics.effect import Effect as Effect
    from .physics.law import Law as Law
    from .physics.parameter import Parameter as Parameter
    from .plan.plan import Plan as Plan
    from .plan.public import plan as plan
    from .simulate.frame import Results as Results
    from .simulate.results import load_results as load_results
    from .simulate.run import run as run
    from .study.identified import Identified as Identified
    from .study.public import compare as compare
    from .study.public import diagnose as diagnose
    from .study.public import identify as identify
    from .study.study import Study as Study

_LAZY = {
    "BristleError": "errors",
    "Comparison": "compare.comparison",
    "DesignResult": "design.result",
    "Diagnosis": "diagnose.verdict",
    "Effect": "physics.effect",
    "Ensemble": "batch.execute",
    "Identified": "study.identified",
    "Law": "physics.law",
    "Measurement": "data.measurement",
    "Parameter": "physics.parameter",
    "Plan": "plan.plan",
    "Results": "simulate.frame",
    "Study": "study.study",
    "compare": "study.public",
    "compare_controllers": "controllers.compare",
    "design": "design",
    "diagnose": "study.public",
    "ensemble": "batch.execute",
    "identify": "study.public",
    "load_results": "simulate.results",
    "plan": "plan.public",
    "run": "simulate.run",
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
