"""Where the residual of a model lives, in units of the noise, and what an engineer would say."""

from __future__ import annotations

from .comparison import Comparison, compare, compare_predictions
from .errors import RunError, SiteError
from .patterns import ResidualPattern, dependence
from .prediction import RunPrediction, run_predictions
from .sites import compare_sites

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
