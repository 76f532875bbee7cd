"""Isolation springs that stiffen or soften."""

from ..effect import Effect, Parameter


class Duffing(Effect):
    """Duffing spring: the isolation springs grow stiffer, or softer, with displacement.

    F = k_3 |x|^(shape - 1) x,   shape 3 for Duffing's cubic
    """

    name = "duffing"
    site = "structure"
    needs = ("x",)
    passive = True
    zero_at_rest = True
    source = "Duffing (1918), Erzwungene Schwingungen bei veraenderlicher Eigenfrequenz"
    expect = "a force in phase with base displacement that grows faster than it"
    parameters = {
        "k_3": Parameter(1e6, "N/m3", (-1e12, 1e12), "coefficient (for shape 3)"),
        "shape": Parameter(3.0, "1", (2.0, 5.0), "exponent"),
    }

    @staticmethod
    def force(q, z, p):
        return p.k_3 * abs(q.x) ** (p.shape - 1.0) * q.x
