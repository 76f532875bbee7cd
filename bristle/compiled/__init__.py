"""The fast path: any scenario of built-in components, as one coupled system, through numba.

`simulate(scenario)` gives the same columns as a master-algorithm run, from the same laws, without
coupling error: in each substep the forces are iterated until they and the motion agree.
"""

from __future__ import annotations

from .model import simulate as simulate

__all__ = ["simulate"]
