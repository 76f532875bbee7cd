"""Shear thinning beyond the base law."""

from math import exp

from ..effect import Effect, Parameter


class Flattening(Effect):
    """Flattening: the fluid's whole force, yield and viscous part, falls further with speed.

        factor = (1 + shape |v|/v_f)^(-1/shape);   shape -> 0: exp(-|v|/v_f), 1: rational

    Leaves out a lower plateau: doubt it when the force rises again at the highest speeds.
    """

    name = "flattening"
    site = "damper"
    needs = ("v",)
    passive = True
    zero_at_rest = True
    source = "Cross-type shear thinning; Bird, Armstrong & Hassager (1987), Dynamics of Polymeric Liquids 1"
    expect = "too much predicted force at high speed, in both directions, at every voltage alike"
    parameters = {
        "v_f": Parameter(0.5, "m/s", (1e-3, 1e3), "speed over which the force falls"),
        "shape": Parameter(1.0, "1", (0.0, 2.0), "0 exponential, 1 rational"),
    }

    @staticmethod
    def factor(q, z, p):
        speed = abs(q.v) / p.v_f
        if p.shape < 1e-6:
            return exp(-speed)
        return (1.0 + p.shape * speed) ** (-1.0 / p.shape)
