"""Isolation springs that stiffen or soften."""

from ..effect import Effect
from ..parameter import Parameter

X_REF = 0.01  # m; keeps the unit of k_3 for every shape


class Duffing(Effect):
    """Duffing spring: a spring grows stiffer, or softer, with displacement.

        F = k_3 X_r^2 (|x|/X_r)^(shape-1) x,   X_r = 10 mm;   shape 3 is Duffing's cubic

    A softening spring (k_3 < 0) gives F/(1 + |F/(k_b x)|) beside the linear stiffness k_b, so that
    it never pushes outwards. Leaves out the rubber's own damping: doubt it when the loop of the
    isolation has area.
    """

    name = "duffing"
    sites = ("structure", "damper")
    needs = ("x", "stiffness")
    passive = True
    zero_at_rest = True
    source = (
        "Duffing (1918), Erzwungene Schwingungen bei veraenderlicher Eigenfrequenz; to shape 5: "
        "Kelly (1997), Earthquake-Resistant Design with Rubber"
    )
    expect = "a force in phase with base displacement that grows faster than it"
    amount = "k_3"
    parameters = {
        "k_3": Parameter(1e6, "N/m3", (-1e10, 1e10), "coefficient, at X_r for every shape"),
        "shape": Parameter(3.0, "1", (2.0, 7.0), "exponent: 3 cubic, 5 late in the stroke"),
    }
    start_shares = ({"k_3": (0.3, -0.1), "shape": (3.0, 5.0)},)
    lookalikes = {
        "gas_spring": "a spring of the damper and one of the isolation layer add up to one force"
    }

    @staticmethod
    def force(q, z, p):
        added = p.k_3 * X_REF**2 * (abs(q.x) / X_REF) ** (p.shape - 1.0)
        if added >= 0.0:
            return added * q.x
        return added * q.x / (1.0 - added / q.stiffness) if q.stiffness > 0.0 else 0.0
