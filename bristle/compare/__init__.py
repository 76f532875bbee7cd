"""Where the residual of a model lives, in units of the noise, and what an engineer would say."""

from __future__ import annotations

from .comparison import Comparison, compare, compare_held
from .errors import RunError, SiteError
from .held import Held, held_runs
from .sites import compare_sites
from .where import Place, organised

__all__ = [
    "Comparison",
    "Held",
    "Place",
    "RunError",
    "SiteError",
    "compare",
    "compare_held",
    "compare_sites",
    "held_runs",
    "organised",
]
