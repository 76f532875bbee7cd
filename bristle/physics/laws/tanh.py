"""The hyperbolic tangent law: hysteresis without memory, from velocity and displacement."""

from __future__ import annotations

from math import tanh

from ..command import Linear
from ..law import Law, Shape
from ..parameter import Parameter


class Tanh(Law):
    """Hyperbolic tangent damper: f = (f_c + f_v V) z + (c_0 + c_v V) v + k x + f_0.

        z = tanh(v/v_s + delta tanh(x/x_s))

    Kwok et al. (2006): f = c x' + k x + alpha z + f_0, z = tanh(beta x' + delta sgn(x)). Here
    beta = 1/v_s, and sgn(x) is smoothed over x_s, for a jump in mid-stroke could not be followed by
    a fit; with x_s -> 0 it is as published. It stores (f_c + f_v V) tanh(delta) |x| at most and
    dissipates the rest. Published are k, f_0 and delta linear and alpha quadratic in the current;
    here k, f_0 and delta are constant, alpha is linear. Defaults are chosen for a damper of 10 N.
    """

    name = "tanh"
    parts = ("yield", "viscous", "spring")
    contains = ("spring",)
    offset = "f_0"
    source = "Kwok, Ha, Nguyen, Li & Samali (2006), Sens. Actuators A 132(2), 441-451"
    parameters = {
        "f_c": Parameter(1.3, "N", (0.0, 1e5), "yield force without voltage"),
        "f_v": Parameter(0.83, "N/V", (0.0, 1e5), "yield force per volt"),
        "c_0": Parameter(10.0, "N.s/m", (0.0, 1e7), "viscous coefficient without voltage"),
        "c_v": Parameter(2.0, "N.s/(m.V)", (0.0, 1e7), "viscous coefficient per volt"),
        "k": Parameter(60.0, "N/m", (0.0, 1e7), "stiffness of the accumulator"),
        "f_0": Parameter(0.0, "N", (-1e5, 1e5), "force of the accumulator at mid-stroke"),
        "v_s": Parameter(0.02, "m/s", (1e-4, 1e2), "speed over which the yield force builds up"),
        "delta": Parameter(0.6, "1", (0.0, 5.0), "width of the hysteresis"),
        "x_s": Parameter(2e-4, "m", (1e-7, 1.0), "displacement over which sgn(x) is smoothed"),
    }
    command = {"yield_force": Linear("f_c", "f_v"), "viscosity": Linear("c_0", "c_v")}
    shapes = {
        "v_s": Shape(0.02, 5.0, 9, ("f_c", "f_v")),
        "delta": Shape(0.1, 1.6, 4, ("f_c", "f_v")),
    }
    assumed = ("x_s",)

    @staticmethod
    def yielding(q, z, p):
        return p.yield_force * tanh(q.v / p.v_s + p.delta * tanh(q.x / p.x_s))

    @staticmethod
    def viscous(q, z, p):
        return p.viscosity * q.v

    @staticmethod
    def elastic(q, z, p):
        return p.k * q.x + p.f_0
