"""Where the residual of a model lives, in units of the noise, and what an engineer would say."""

from __future__ import annotations

from .comparison import compare, compare_predictions, compare_sites
from .misfit import RunMisfit, SiteMisfit
from .patterns import ResidualPattern
from .predictions import RunPrediction, run_predictions
from .result import Comparison

__all__ = [
    "Comparison",
    "ResidualPattern",
    "RunMisfit",
    "RunPrediction",
    "SiteMisfit",
    "compare",
    "compare_predictions",
    "compare_sites",
    "run_predictions",
]
