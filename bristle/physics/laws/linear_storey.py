"""The linear storey of a building."""

from __future__ import annotations

from ..law import Law
from .linear_layer import DAMPING, OFFSET, STIFFNESS


class LinearStorey(Law):
    """Linear storey: F = k drift + c drift_rate + offset."""

    name = "linear_storey"
    site = "structure"
    place = "storey"
    stiffness = "k"
    parts = ("spring", "viscous")
    source = "Chopra (2012), Dynamics of Structures, 4th ed., ch. 9"
    parameters = {"k": STIFFNESS, "c": DAMPING, "offset": OFFSET}

    @staticmethod
    def force(q, z, p):
        return p.k * q.x + p.c * q.v + p.offset
