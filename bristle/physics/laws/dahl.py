"""Dahl's law: friction that builds up with travel, and a viscous part."""

from __future__ import annotations

from math import expm1

from ..command import Linear
from ..law import Law, Shape
from ..parameter import Parameter


def slid(bent: float, travel: float, slip: float) -> float:
    """Return the deflection [m] after a travel [m] along it, exactly.

    Of dz/ds = 1 - slip z.

    Parameters
    ----------
    bent : deflection at the start [m]
    travel : how far it went, 0 or more [m]
    slip : inverse of the deflection in sliding [1/m]
    """
    return bent + (bent - 1.0 / slip) * expm1(-slip * travel)


def moved(bent: float, v: float, slip: float, dt: float) -> float:
    """Return the deflection [m] after a step of dt [s] at constant velocity v [m/s], exactly."""
    way = 1.0 if v >= 0.0 else -1.0
    return way * slid(way * bent, abs(v) * dt, slip)


class Dahl(Law):
    """Dahl damper: f = (f_c + f_v V) rho z + (c_0 + c_v V) v, z' = v - rho |v| z.

    The viscous Dahl model of Ikhouane & Dyke (2007) with w = rho z, |w| <= 1, k_w = f_c + f_v V and
    k_x = c_0 + c_v V. It is LuGre's law without the damping of its bristles and without the fall of
    the viscous part: sigma_a = f_c rho, sigma_0 = f_v rho, a_0 = rho. Defaults are chosen for a
    damper of 10 N: the yield force and the bristles are those of the LuGre law's defaults.
    """

    name = "dahl"
    parts = ("yield", "bristle", "viscous")
    source = (
        "Dahl (1968), A Solid Friction Model, Aerospace Corp. TOR-0158(3107-18)-1; of an MR "
        "damper: Ikhouane & Dyke (2007), Smart Mater. Struct. 16(3), 605-616"
    )
    states = {"deflection": "m"}
    parameters = {
        "f_c": Parameter(1.3, "N", (0.0, 1e5), "yield force without voltage"),
        "f_v": Parameter(0.83, "N/V", (0.0, 1e5), "yield force per volt"),
        "c_0": Parameter(10.0, "N.s/m", (0.0, 1e7), "viscous coefficient without voltage"),
        "c_v": Parameter(2.0, "N.s/(m.V)", (0.0, 1e7), "viscous coefficient per volt"),
        "rho": Parameter(500.0, "1/m", (1.0, 1e7), "inverse of the deflection in sliding"),
    }
    command = {"yield_force": Linear("f_c", "f_v"), "viscosity": Linear("c_0", "c_v")}
    shapes = {"rho": Shape(0.5, 500.0, 13, ("f_c", "f_v"))}

    @staticmethod
    def yielding(q, z, p):
        return p.yield_force * p.rho * z.deflection

    @staticmethod
    def viscous(q, z, p):
        return p.viscosity * q.v

    @staticmethod
    def rate(q, z, p):
        return (q.v - p.rho / p.slip_length * abs(q.v) * z.deflection,)

    @staticmethod
    def advance(q, z, p):
        return (moved(z.deflection, q.v, p.rho / p.slip_length, q.dt),)
