"""The modified Bouc-Wen law: behind a dashpot, beside an accumulator, its command lagging."""

from __future__ import annotations

from math import exp

from ..command import Linear
from ..law import Law, Shape
from ..parameter import Parameter
from .bouc_wen import yielded

MOST_TRIALS = 60
"""How many velocities of the inner element are tried in a step; five or so are the rule."""

CLOSE = 1e-9
"""Change of that velocity, by the first bracket's width, at which it is found."""


def mean_share(steep: float) -> float:
    """Return at which share of a step's change its mean lies [1]: 1/2, or near 1 for what is stiff.

    Exact for what relaxes as exp(-t/tau); `steep` is the step by tau.
    """
    if steep < 1e-3:
        return 0.5 + steep / 12.0
    return 1.0 / (1.0 - exp(-steep)) - 1.0 / steep


def excess(u, spring_share, q, z, p):
    """Return by how much the inner element carries more than the dashpot at its velocity u [N].

    `spring_share` is at which share of a step's change the mean of the spring's deflection lies.
    """
    c_0, slip = p.viscosity * p.viscous_factor, p.rho / p.slip_length
    end = yielded(z.deflection, u, slip, p.sigma, q.dt)
    bent = z.deflection + mean_share(2.0 * slip * abs(u) * q.dt) * (end - z.deflection)
    spring = z.inner + spring_share * u * q.dt
    held = p.yield_force * p.yield_factor * p.rho * bent + p.k_0 * spring
    return held + (c_0 + p.series_damping) * u - p.series_damping * q.v


def inner_velocity(q, z, p):
    """Return the mean velocity x' - y' [m/s] over a step, from the balance of its mean forces.

    The excess grows with the velocity, at least as the dashpots alone make it: that brackets the
    one root, which regula falsi with the Illinois rule then finds.
    """
    damping = p.viscosity * p.viscous_factor + p.series_damping
    spring_share = mean_share(p.k_0 * q.dt / damping)
    at_rest = p.yield_force * p.yield_factor * p.rho * z.deflection + p.k_0 * z.inner
    at_low = at_rest - p.series_damping * q.v
    low, high = 0.0, -at_low / damping
    width = abs(high)
    if width == 0.0:
        return 0.0
    at_high = excess(high, spring_share, q, z, p)
    u, last = high, 0
    for _ in range(MOST_TRIALS):
        if at_high == at_low or abs(high - low) <= CLOSE * width:
            break
        u = (low * at_high - high * at_low) / (at_high - at_low)
        found = excess(u, spring_share, q, z, p)
        if abs(found) <= CLOSE * width * p.series_damping:
            break
        if (found > 0.0) == (at_high > 0.0):
            high, at_high = u, found
            at_low *= 0.5 if last > 0 else 1.0
            last = 1
        else:
            low, at_low = u, found
            at_high *= 0.5 if last < 0 else 1.0
            last = -1
    return u


def series_rate(q, z, p):
    """Return the velocity y' [m/s] of the point between the two dashpots, from their balance."""
    c_0 = p.viscosity * p.viscous_factor
    held = p.yield_force * p.yield_factor * p.rho * z.deflection + p.k_0 * z.inner
    return (held + c_0 * q.v) / (c_0 + p.series_damping)


class ModifiedBoucWen(Law):
    """Modified Bouc-Wen damper: a Bouc-Wen element in series with a dashpot, and an accumulator.

        f  = alpha z + C_0 u + k_0 d + k_1 x + f_0  =  C_1 y' + k_1 x + f_0
        z' = u - rho^2 (sigma |u| z |z| + (1 - sigma) u z^2),   d = x - y,   u = d'
        alpha = (f_c + f_v w) rho,  C_0 = c_0 + c_v w,  C_1 = c_1 + c_1v w,  w' = eta (V - w)

    Spencer et al. (1997), eqs. 5 to 10, with n = 2: alpha_a = f_c rho, alpha_b = f_v rho, the
    accumulator k_1 (x - x_0) with f_0 = -k_1 x_0, and the hysteresis in the normal form that
    `bouc_wen` explains. Their values (3 kN: k_1 = 5 N/cm, x_0 = 14.3 cm, eta = 190/s ...) are those
    of a damper 300 times as strong; the defaults are chosen for one of 10 N.
    """

    name = "modified_bouc_wen"
    parts = ("yield", "bristle", "viscous", "spring")
    # No "series element": a dashpot never springs back, so that mounts and gaps join. No "lag"
    # either: coils, supplies and fluids may each follow late, and this law has one of them.
    contains = ("spring",)
    offset = "f_0"
    source = "Spencer, Dyke, Sain & Carlson (1997), J. Eng. Mech. 123(3), 230-238, eqs. 5 to 10"
    states = {"deflection": "m", "inner": "m", "command": "V"}
    starts = {"command": "V"}
    felt = "command"
    parameters = {
        "f_c": Parameter(1.3, "N", (0.0, 1e5), "yield force without voltage"),
        "f_v": Parameter(0.83, "N/V", (0.0, 1e5), "yield force per volt"),
        "c_0": Parameter(10.0, "N.s/m", (0.0, 1e7), "viscous coefficient without voltage"),
        "c_v": Parameter(2.0, "N.s/(m.V)", (0.0, 1e7), "viscous coefficient per volt"),
        "k_0": Parameter(60.0, "N/m", (0.0, 1e7), "stiffness beside the hysteresis"),
        "k_1": Parameter(30.0, "N/m", (0.0, 1e7), "stiffness of the accumulator"),
        "f_0": Parameter(0.0, "N", (-1e5, 1e5), "force of the accumulator at mid-stroke"),
        "c_1": Parameter(150.0, "N.s/m", (1e-3, 1e8), "dashpot in series without voltage"),
        "c_1v": Parameter(50.0, "N.s/(m.V)", (0.0, 1e8), "dashpot in series per volt"),
        "rho": Parameter(500.0, "1/m", (1.0, 1e7), "inverse of the deflection in sliding"),
        "sigma": Parameter(0.8, "1", (0.5, 2.0), "gamma/(beta + gamma): shape of the unloading"),
        "eta": Parameter(60.0, "1/s", (0.1, 1e4), "rate at which the command follows the voltage"),
    }
    command = {
        "yield_force": Linear("f_c", "f_v"),
        "viscosity": Linear("c_0", "c_v"),
        "series_damping": Linear("c_1", "c_1v"),
    }
    shapes = {
        "rho": Shape(0.5, 100.0, 6, ("f_c", "f_v")),
        "c_1": Shape(2.0, 50.0, 3, ("f_c", "f_v", "c_0", "c_v", "k_0")),
        "c_1v": Shape(0.5, 0.5, 1, ()),
        "sigma": Shape(0.8, 0.8, 1, ()),
        "eta": Shape(20.0, 200.0, 3, ("f_v", "c_v")),
    }

    @staticmethod
    def yielding(q, z, p):
        return p.yield_force * p.rho * z.deflection

    @staticmethod
    def viscous(q, z, p):
        return p.viscosity * (q.v - series_rate(q, z, p))

    @staticmethod
    def elastic(q, z, p):
        return p.k_0 * z.inner + p.k_1 * q.x + p.f_0

    @staticmethod
    def rate(q, z, p):
        u = q.v - series_rate(q, z, p)
        y = p.rho / p.slip_length * z.deflection
        bend = u - (p.sigma * abs(u) * abs(y) + (1.0 - p.sigma) * u * y) * y
        return bend, u, p.eta * (q.V - z.command)

    @staticmethod
    def advance(q, z, p):
        u = inner_velocity(q, z, p)
        slip = p.rho / p.slip_length
        return (
            yielded(z.deflection, u, slip, p.sigma, q.dt),
            z.inner + u * q.dt,
            q.V + (z.command - q.V) * exp(-p.eta * q.dt),
        )
