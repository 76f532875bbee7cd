"""The Bouc-Wen law: hysteresis that rounds off as it yields, a spring and a viscous part."""

from __future__ import annotations

from math import atan, sqrt, tan, tanh

from ..command import Linear
from ..law import Law, Shape
from ..parameter import Parameter


def yielded(bent: float, v: float, slip: float, sigma: float, dt: float) -> float:
    """Return the deflection [m] after a step at constant velocity, exactly.

    Of z' = v (1 - (sigma sgn(v z) + 1 - sigma) (slip z)^2): towards yielding it is a tanh of the
    travel, back to the middle a tan.

    Parameters
    ----------
    bent : deflection at the start [m]
    v : velocity [m/s]
    slip : inverse of the deflection in sliding [1/m]
    sigma : share of gamma in beta + gamma [1], 0.5 or more
    dt : length of the step [s]
    """
    way = 1.0 if v >= 0.0 else -1.0
    left = slip * abs(v) * dt
    y = way * slip * bent
    if y < 0.0:
        root = sqrt(max(2.0 * sigma - 1.0, 0.0))
        back = atan(root * -y) / root if root > 1e-6 else -y
        if left < back:
            gone = tan(root * left) / root if root > 1e-6 else left
            return way * (y + gone) / (1.0 - root * root * y * gone) / slip
        left -= back
        y = 0.0
    gone = tanh(left)
    return way * (y + gone) / (1.0 + y * gone) / slip


class BoucWen(Law):
    """Bouc-Wen damper: f = (f_c + f_v V) rho z + (c_0 + c_v V) v + k x + f_0.

        z' = v - rho^2 (sigma |v| z |z| + (1 - sigma) v z^2)

    The simple model of Spencer et al. (1997), f = alpha z + c_0 x' + k_0 (x - x_0), with n = 2, and
    with the voltage as in their modified model. As A only scales z it is 1 here: with beta and
    gamma of that scale rho = (beta + gamma)^(1/2), sigma = gamma/(beta + gamma), alpha = (f_c + f_v
    V) rho and f_0 = -k_0 x_0 (the normal form of Ikhouane, Manosa & Rodellar 2007). sigma >= 1/2 is
    what makes it dissipate; published is beta = gamma, so 1/2. Published values are those of a
    damper of 3 kN; the defaults are chosen for one of 10 N.
    """

    name = "bouc_wen"
    parts = ("yield", "bristle", "viscous", "spring")
    contains = ("spring",)
    offset = "f_0"
    source = (
        "Spencer, Dyke, Sain & Carlson (1997), J. Eng. Mech. 123(3), 230-238, eqs. 3, 4; normal "
        "form: Ikhouane, Manosa & Rodellar (2007), Syst. Control Lett. 56(6), 455-461"
    )
    states = {"deflection": "m"}
    parameters = {
        "f_c": Parameter(1.3, "N", (0.0, 1e5), "yield force without voltage"),
        "f_v": Parameter(0.83, "N/V", (0.0, 1e5), "yield force per volt"),
        "c_0": Parameter(10.0, "N.s/m", (0.0, 1e7), "viscous coefficient without voltage"),
        "c_v": Parameter(2.0, "N.s/(m.V)", (0.0, 1e7), "viscous coefficient per volt"),
        "k": Parameter(60.0, "N/m", (0.0, 1e7), "stiffness of the accumulator"),
        "f_0": Parameter(0.0, "N", (-1e5, 1e5), "force of the accumulator at mid-stroke"),
        "rho": Parameter(500.0, "1/m", (1.0, 1e7), "inverse of the deflection in sliding"),
        "sigma": Parameter(0.8, "1", (0.5, 2.0), "gamma/(beta + gamma): shape of the unloading"),
    }
    command = {"yield_force": Linear("f_c", "f_v"), "viscosity": Linear("c_0", "c_v")}
    shapes = {
        "rho": Shape(0.5, 500.0, 13, ("f_c", "f_v")),
        "sigma": Shape(0.55, 1.2, 3, ("f_c", "f_v")),
    }

    @staticmethod
    def yielding(q, z, p):
        return p.yield_force * p.rho * z.deflection

    @staticmethod
    def viscous(q, z, p):
        return p.viscosity * q.v

    @staticmethod
    def elastic(q, z, p):
        return p.k * q.x + p.f_0

    @staticmethod
    def rate(q, z, p):
        y = p.rho / p.slip_length * z.deflection
        return (q.v - (p.sigma * abs(q.v) * abs(y) + (1.0 - p.sigma) * q.v * y) * y,)

    @staticmethod
    def advance(q, z, p):
        return (yielded(z.deflection, q.v, p.rho / p.slip_length, p.sigma, q.dt),)
