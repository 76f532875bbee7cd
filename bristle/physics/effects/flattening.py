"""Shear thinning beyond the base law."""

from math import exp

from ..effect import Effect
from ..parameter import Parameter


class Flattening(Effect):
    """Flattening: the fluid's whole force, yield and viscous part, falls further with speed.

        factor = (1 + shape (|v|/v_f)^bend)^(-1/shape)

    Shape 0 is exp(-(|v|/v_f)^bend). With bend 1: exponential (shape 0), rational (1); with bend 2
    Carreau's. Leaves out a lower plateau: doubt it when the force rises again at the
    highest speeds.
    """

    name = "flattening"
    sites = ("damper",)
    needs = ("v",)
    passive = True
    zero_at_rest = True
    source = (
        "Yasuda, Armstrong & Cohen (1981), Rheologica Acta 20(2), 163-178 (Carreau's and Cross's "
        "laws in one)"
    )
    expect = "too much predicted force at high speed, in both directions alike"
    amount = "1/v_f"
    parameters = {
        "v_f": Parameter(0.5, "m/s", (1e-3, 1e3), "speed over which the force falls"),
        "shape": Parameter(1.0, "1", (0.0, 6.0), "0 exponential, 1 rational, larger: slower fall"),
        "bend": Parameter(
            1.0, "1", (0.5, 2.5), "1: it falls from rest on, 2: beyond v_f (Carreau)"
        ),
    }
    start_grid = {"v_f": (0.1, 0.3, 1.0), "bend": (1.0, 2.0)}

    @staticmethod
    def factor(q, z, p):
        speed = (abs(q.v) / p.v_f) ** p.bend
        if p.shape < 1e-9:
            return exp(-speed)
        return (1.0 + p.shape * speed) ** (-1.0 / p.shape)
