"""A seismic isolator of rubber, with or without a lead core."""

from __future__ import annotations

from ..law import Law, Shape
from ..parameter import Parameter
from .bouc_wen import yielded


class Isolator(Law):
    """Elastomeric isolator: f = q rho z + k x + k_3 x^3 + c v + f_0.

        z' = v - rho^2 (sigma |v| z |z| + (1 - sigma) v z^2)

    A lead core yields at the force q, over the travel 1/rho; the rubber has the stiffness k,
    hardens at large shear by k_3 and has losses c v. High-damping rubber has a small rho, lead a
    large one. The hysteresis has the normal form of `bouc_wen`. Leaves out that lead heats and
    rubber scrags: doubt it when the first cycle is larger than the others.
    """

    name = "isolator"
    parts = ("yield", "bristle", "viscous", "spring")
    contains = ("spring", "duffing")
    offset = "f_0"
    source = (
        "Robinson (1982), Earthq. Eng. Struct. Dyn. 10(4), 593-604; hysteresis: Wen (1976), "
        "J. Eng. Mech. Div. 102(2), 249-263; hardening: Kikuchi & Aiken (1997), Earthq. Eng. "
        "Struct. Dyn. 26(2), 215-231"
    )
    states = {"deflection": "m"}
    parameters = {
        "q": Parameter(4.0, "N", (0.0, 1e8), "characteristic strength: the force of the lead core"),
        "k": Parameter(300.0, "N/m", (0.0, 1e10), "stiffness of the rubber"),
        "k_3": Parameter(2e5, "N/m3", (0.0, 1e12), "hardening at large shear"),
        "c": Parameter(5.0, "N.s/m", (0.0, 1e8), "viscous losses of the rubber"),
        "f_0": Parameter(0.0, "N", (-1e7, 1e7), "force at mid-stroke"),
        "rho": Parameter(800.0, "1/m", (1.0, 1e7), "inverse of the deflection at yield"),
        "sigma": Parameter(0.8, "1", (0.5, 2.0), "shape of the unloading"),
    }
    shapes = {
        "rho": Shape(0.5, 500.0, 13, ("q",)),
        "sigma": Shape(0.55, 1.2, 3, ("q",)),
    }

    @staticmethod
    def yielding(q, z, p):
        return p.q * p.rho * z.deflection

    @staticmethod
    def viscous(q, z, p):
        return p.c * q.v

    @staticmethod
    def elastic(q, z, p):
        return q.x * (p.k + q.x * q.x * p.k_3) + p.f_0

    @staticmethod
    def rate(q, z, p):
        y = p.rho / p.slip_length * z.deflection
        return (q.v - (p.sigma * abs(q.v) * abs(y) + (1.0 - p.sigma) * q.v * y) * y,)

    @staticmethod
    def advance(q, z, p):
        return (yielded(z.deflection, q.v, p.rho / p.slip_length, p.sigma, q.dt),)
