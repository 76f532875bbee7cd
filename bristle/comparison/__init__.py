"""Where the residual of a model lives, in units of the noise, and what an engineer would say."""

from __future__ import annotations

from .comparison import Comparison, compare, compare_predictions, compare_sites
from .misfit import RunError, SiteError
from .patterns import ResidualPattern, dependence
from .predictions import RunPrediction, run_predictions

__all__ = [
    "Comparison",
    "ResidualPattern",
    "RunError",
    "RunPrediction",
    "SiteError",
    "compare",
    "compare_predictions",
    "compare_sites",
    "dependence",
    "run_predictions",
]
