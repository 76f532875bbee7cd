"""Ensembles: one scenario run many times, with what is uncertain drawn anew each time.

    import bristle
    found = bristle.ensemble("my_ensemble.toml", out="results/mine")
    found.quantiles, found.runs, found.failures

Run i depends on the seed and on i alone; a killed ensemble goes on where it was.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any

from .execute import Ensemble, EnsembleInterrupted, ensemble
from .file import read_ensemble, stock_ensembles
from .plan import Plan

__all__ = [
    "Ensemble",
    "EnsembleInterrupted",
    "Plan",
    "ensemble",
    "read_ensemble",
    "stock_ensembles",
]


class _Ensemble(ModuleType):
    """This package, called as the function that it is named after; see `bristle.run`."""

    def __call__(self, *arguments: Any, **named: Any) -> Ensemble:
        return ensemble(*arguments, **named)


sys.modules[__name__].__class__ = _Ensemble
