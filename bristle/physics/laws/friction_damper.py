"""A friction damper: clamped plates, elastic before they slip, with play in their joints."""

from __future__ import annotations

from math import log1p

from ..law import Law, Shape
from ..parameter import Parameter
from .dahl import slid

ROUND = 1.0 - 1e-6
"""Exponent from which on it is taken for 1: the power of the formula would be too large."""


def bent_on(bent, travel, slip, gamma):
    """Return the deflection [m] after a travel [m] along it: w^(1-gamma) falls on a line."""
    if gamma >= ROUND:
        return slid(bent, travel, slip)
    left = max(1.0 - slip * bent, 0.0) ** (1.0 - gamma) - (1.0 - gamma) * slip * travel
    return (1.0 - (left ** (1.0 / (1.0 - gamma)) if left > 0.0 else 0.0)) / slip


def way_back(bent, slip, gamma):
    """Return the travel [m] in which plates that are bent [m] the other way spring straight."""
    if gamma >= ROUND:
        return log1p(slip * bent) / slip
    return ((1.0 + slip * bent) ** (1.0 - gamma) - 1.0) / (1.0 - gamma) / slip


def carried_on(offset, v, slip, gamma, play, dt):
    """Return the travel between rod and plates [m] after a step at constant velocity, exactly.

    Parameters
    ----------
    offset : at the start [m]: within `play` nothing is carried, beyond it the plates bend
    v : velocity [m/s]
    slip : inverse of the deflection in sliding [1/m]
    gamma : Dahl's exponent [1]
    play : half of the play [m]
    dt : length of the step [s]
    """
    way = 1.0 if v >= 0.0 else -1.0
    left = abs(v) * dt
    at = way * offset
    if at < -play:  # it springs back first
        back = way_back(-at - play, slip, gamma)
        if left < back:
            return way * (bent_on(at + play, left, slip, gamma) - play)
        left -= back
        at = -play
    if at < play:
        if left < play - at:
            return way * (at + left)
        left -= play - at
        at = play
    return way * (bent_on(at - play, left, slip, gamma) + play)


def beyond(offset, play):
    """Return how far the plates are bent [m]."""
    return offset - min(max(offset, -play), play)


class FrictionDamper(Law):
    """Friction damper: f = f_c rho b + c v + k x + f_0.

        b = s beyond +-play,   s' = v (1 - sgn(v) rho b)^gamma

    b is how far the plates are bent, once the rod has crossed their play; f_c is the friction
    coefficient times the preload of the bolts. Dahl's law behind play: gamma 1 rounds off, gamma 0
    is elastic up to the slip, a large rho Coulomb friction, play 0 a tight joint. Leaves out the
    wear of the plates and the impact as the play closes: doubt it when the force rings after that.
    """

    name = "friction_damper"
    parts = ("yield", "bristle", "viscous", "spring")
    contains = ("spring", "series element")
    offset = "f_0"
    source = (
        "Pall & Marsh (1982), J. Struct. Div. 108(6), 1313-1323; Dahl (1968), A Solid Friction "
        "Model, Aerospace Corp. TOR-0158(3107-18)-1; play: Nordin & Gutman (2002), Automatica "
        "38(10), 1633-1649"
    )
    states = {"offset": "m"}
    parameters = {
        "f_c": Parameter(5.0, "N", (0.0, 1e8), "friction force under the preload"),
        "c": Parameter(5.0, "N.s/m", (0.0, 1e8), "viscous coefficient"),
        "k": Parameter(20.0, "N/m", (0.0, 1e9), "stiffness beside the friction"),
        "f_0": Parameter(0.0, "N", (-1e7, 1e7), "force at mid-stroke"),
        "rho": Parameter(1000.0, "1/m", (1.0, 1e7), "inverse of the deflection in sliding"),
        "play": Parameter(2e-4, "m", (0.0, 0.1), "half the play of the joints"),
        "gamma": Parameter(1.0, "1", (0.0, 1.0), "exponent: 1 rounds the onset of slip, 0 not"),
    }
    shapes = {
        "rho": Shape(0.5, 500.0, 9, ("f_c",)),
        "play": Shape(1e-3, 1.0, 7, ("f_c",)),
        "gamma": Shape(0.1, 1.0, 2, ("f_c",)),
    }

    @staticmethod
    def yielding(q, z, p):
        return p.f_c * p.rho * beyond(z.offset, p.play)

    @staticmethod
    def viscous(q, z, p):
        return p.c * q.v

    @staticmethod
    def elastic(q, z, p):
        return p.k * q.x + p.f_0

    @staticmethod
    def rate(q, z, p):
        way = 1.0 if q.v >= 0.0 else -1.0
        left = 1.0 - way * p.rho / p.slip_length * beyond(z.offset, p.play)
        return (q.v * (left**p.gamma if left > 0.0 else 0.0),)

    @staticmethod
    def advance(q, z, p):
        slip = p.rho / p.slip_length
        return (carried_on(z.offset, q.v, slip, p.gamma, p.play, q.dt),)
