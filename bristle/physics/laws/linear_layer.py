"""The linear isolation layer of a building."""

from __future__ import annotations

from ..law import Law
from ..parameter import Parameter

WIDE = (-1e12, 1e12)
STIFFNESS = Parameter(1000.0, "N/m", (0.0, 1e12), "stiffness")
DAMPING = Parameter(0.0, "N.s/m", WIDE, "damping beyond the building's")
OFFSET = Parameter(0.0, "N", WIDE, "constant force: an accelerometer's or load cell's zero")


class LinearLayer(Law):
    """Linear isolation layer: F = k x + c v + added_mass a + offset."""

    name = "linear_layer"
    site = "structure"
    place = "layer"
    stiffness = "k"
    parts = ("spring", "viscous")
    source = "Chopra (2012), Dynamics of Structures, 4th ed., ch. 21"
    parameters = {
        "k": STIFFNESS,
        "c": DAMPING,
        "added_mass": Parameter(0.0, "kg", WIDE, "mass of the base beyond the building's"),
        "offset": OFFSET,
    }

    @staticmethod
    def force(q, z, p):
        return p.k * q.x + p.c * q.v + p.offset + p.added_mass * q.a
