"""Many runs of one scenario: ensembles, and the best constant voltage.

An ensemble runs one scenario many times, with what is uncertain drawn anew each time:

    import bristle
    found = bristle.ensemble("my_ensemble.toml", out="results/mine")
    found.quantiles, found.runs, found.failures

Run i depends on the seed and on i alone; a killed ensemble goes on where it was.
"""

from __future__ import annotations

from .ensemble import Ensemble, EnsembleInterrupted, ensemble
from .ensemble_file import EnsemblePlan, read_ensemble, stock_ensembles

__all__ = [
    "Ensemble",
    "EnsembleInterrupted",
    "EnsemblePlan",
    "ensemble",
    "read_ensemble",
    "stock_ensembles",
]
