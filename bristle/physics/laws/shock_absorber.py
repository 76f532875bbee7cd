"""A shock absorber: valves of its own for each direction, a gas cushion, seals that rub."""

from __future__ import annotations

from math import tanh

from ..law import Law, Shape
from ..parameter import Parameter
from .dahl import moved
from .fluid_viscous import AT_ONCE, CLOSE, MOST_TRIALS, late_share, narrowed
from .modified_bouc_wen import mean_share


def valve(u, low, high, knee):
    """Return the force of a valve [N]: `low` u at first, `high` per speed beyond the knee."""
    return high * u + (low - high) * knee * tanh(u / knee)


def opened(u, low, high, knee):
    """Return the slope of a valve's force over its speed [N.s/m]."""
    turned = tanh(u / knee)
    return high + (low - high) * (1.0 - turned * turned)


def valves(u, p):
    """Return the force [N] of the valves at the speed u [m/s] of the oil."""
    if u >= 0.0:
        return valve(u, p.c_r1, p.c_r2, p.v_r)
    return valve(u, p.c_c1, p.c_c2, p.v_c)


def slope(u, p):
    """Return the slope of the valves' force [N.s/m]; it is never negative."""
    if u >= 0.0:
        return opened(u, p.c_r1, p.c_r2, p.v_r)
    return opened(u, p.c_c1, p.c_c2, p.v_c)


def relaxation(resisting, p):
    """Return the time [s] in which the oil follows the rod, at a slope of the valves [N.s/m]."""
    return max(resisting * p.give, AT_ONCE)


def flowing(u, v, p, dt):
    """Return the speed of the oil [m/s] after a step at constant velocity v [m/s].

    What gives way takes up what the valves do not let through: it bends, by their force's rise
    times its compliance, as the rod moves farther than the oil, whose mean speed lies at a share
    of its change. The speed stays between that at the start and the rod's.
    """
    if u == v or dt <= 0.0:
        return u
    share = mean_share(dt / relaxation(slope(v, p), p))
    begin, goal = valves(u, p), dt * (v - (1.0 - share) * u)
    low, high, end = min(u, v), max(u, v), v
    width = high - low
    for _ in range(MOST_TRIALS):
        excess = p.give * (valves(end, p) - begin) + share * dt * end - goal
        before = end
        low, high, end = narrowed(low, high, end, excess, p.give * slope(end, p) + share * dt)
        if abs(end - before) <= CLOSE * width:
            break
    return end


class ShockAbsorber(Law):
    """Shock absorber: f = F_valves(u) + f_s rho z + f_0 + k_g x + k_g2 x^2.

        F_valves = c_2 u + (c_1 - c_2) v_k tanh(u/v_k),   give F_valves' = v - u
        z' = v - rho |v| z

    c_1, c_2 and the knee v_k are those of rebound (c_r1, c_r2, v_r) as +x grows, and of compression
    (c_c1, c_c2, v_c) on the way back: c_2 < c_1 is digressive, a valve that blows off, c_2 > c_1
    progressive. Both rise with speed, so the valves never feed energy. give is the compliance of
    oil, hoses and bushes, f_s the friction of the seals, f_0 the gas force at mid-stroke. Leaves
    out cavitation and the heat of the oil: doubt it when the force fades from cycle to cycle.
    """

    name = "shock_absorber"
    parts = ("yield", "bristle", "viscous", "spring")
    contains = ("spring", "series element", "asymmetry", "quadratic_damping")
    offset = "f_0"
    source = (
        "Besinger, Cebon & Cole (1995), Veh. Syst. Dyn. 24(1), 35-64; Duym (2000), Veh. Syst. Dyn. "
        "33(4), 261-285"
    )
    states = {"flow": "m/s", "deflection": "m", "rod": "m/s"}
    starts = {"flow": "v", "rod": "v"}
    parameters = {
        "c_r1": Parameter(60.0, "N.s/m", (0.0, 1e7), "rebound: damping below the knee"),
        "c_r2": Parameter(20.0, "N.s/m", (0.0, 1e7), "rebound: damping beyond the knee"),
        "v_r": Parameter(0.05, "m/s", (1e-4, 1e2), "rebound: speed of the knee"),
        "c_c1": Parameter(20.0, "N.s/m", (0.0, 1e7), "compression: damping below the knee"),
        "c_c2": Parameter(30.0, "N.s/m", (0.0, 1e7), "compression: damping beyond the knee"),
        "v_c": Parameter(0.05, "m/s", (1e-4, 1e2), "compression: speed of the knee"),
        "f_s": Parameter(2.0, "N", (0.0, 1e5), "friction of the seals"),
        "f_0": Parameter(0.0, "N", (-1e6, 1e6), "gas force at mid-stroke"),
        "k_g": Parameter(40.0, "N/m", (0.0, 1e7), "stiffness of the gas"),
        "k_g2": Parameter(500.0, "N/m2", (-1e9, 1e9), "growth of that stiffness to one end"),
        "give": Parameter(1e-4, "m/N", (0.0, 1.0), "compliance in series with the valves"),
        "rho": Parameter(2000.0, "1/m", (1.0, 1e7), "inverse of the deflection of the seals"),
    }
    shapes = {
        "v_r": Shape(0.1, 3.0, 5, ("c_r1", "c_r2")),
        "v_c": Shape(0.1, 3.0, 5, ("c_c1", "c_c2")),
        "rho": Shape(1.0, 100.0, 3, ("f_s",)),
        "give": Shape(0.03, 0.03, 1, ()),
    }

    @staticmethod
    def yielding(q, z, p):
        return p.f_s * p.rho * z.deflection

    @staticmethod
    def viscous(q, z, p):
        late = late_share(q.dt / relaxation(slope(z.flow, p), p))
        return valves(z.flow + late * (q.v - z.rod), p)

    @staticmethod
    def elastic(q, z, p):
        return p.f_0 + q.x * (p.k_g + q.x * p.k_g2)

    @staticmethod
    def rate(q, z, p):
        slip, follows = p.rho / p.slip_length, relaxation(slope(z.flow, p), p)
        bend = q.v - slip * abs(q.v) * z.deflection
        return (q.v - z.flow) / follows, bend, (q.v - z.rod) / AT_ONCE

    @staticmethod
    def advance(q, z, p):
        bent = moved(z.deflection, q.v, p.rho / p.slip_length, q.dt)
        return flowing(z.flow, q.v, p, q.dt), bent, q.v
