"""The mass of the fluid that the piston accelerates."""

from math import exp

from ..effect import Effect
from ..parameter import Parameter

# Rates [1/s] of exponentials that make up the memory 1/sqrt(pi t), a decade apart, and their
# weights (2/pi) sqrt(rate) ln(10)/2 [1/s^0.5], at the unit frequency of 20 rad/s.
R_1, R_2, R_3, R_4 = 0.4, 4.0, 40.0, 400.0
SCALE = 20.0**0.5 * 0.7329

# What all slower rates make of a motion, a share of the velocity, and all faster ones, a share of
# the acceleration: (2/ln 10) sqrt(rate/sqrt(10)) and (2/ln 10)/sqrt(rate sqrt(10)) of the ends.
SLOWER = 0.8686 * (R_1 / 10.0**0.5) ** 0.5
FASTER = 0.8686 / (R_4 * 10.0**0.5) ** 0.5


class FluidInertia(Effect):
    """Fluid inertia: the fluid in the gap is accelerated with the piston.

        F = m_f a + m_h sqrt(20/s) int a(q)/sqrt(pi (t - q)) dq

    The second part is the unsteady shear of the fluid beside the gap (none by default). Leaves out
    the compressibility of the fluid: doubt it when the force rings at a frequency of its own.
    """

    name = "fluid_inertia"
    sites = ("damper",)
    kind = "inertia"
    needs = ("v", "a", "dt")
    passive = True
    zero_at_rest = True
    source = (
        "Peel, Stanway & Bullough (1996), Smart Mater. Struct. 5(5), 591-606; memory: Basset "
        "(1888), A Treatise on Hydrodynamics II, ch. 21"
    )
    expect = "a force in phase with acceleration, largest at the highest frequencies"
    states = {"v_1": "m/s", "v_2": "m/s", "v_3": "m/s", "v_4": "m/s"}
    amount = "m_f"
    parameters = {
        "m_f": Parameter(0.3, "kg", (0.0, 1e4), "mass that moves with the piston"),
        "m_h": Parameter(0.0, "kg", (0.0, 1e4), "what the memory weighs at 20 rad/s"),
    }
    mass = "m_f"
    lookalikes = {
        "a mass of the base that the file does not know": "a mass that moves with the piston and "
        "one of the base add up to one force"
    }

    @staticmethod
    def force(q, z, p):
        memory = R_1**0.5 * z.v_1 + R_2**0.5 * z.v_2 + R_3**0.5 * z.v_3 + R_4**0.5 * z.v_4
        memory += SLOWER * q.v + FASTER * q.a
        return p.m_f * q.a + p.m_h * SCALE * memory

    @staticmethod
    def advance(q, z, p):
        e_1, e_2 = exp(-R_1 * q.dt), exp(-R_2 * q.dt)
        e_3, e_4 = exp(-R_3 * q.dt), exp(-R_4 * q.dt)
        return (
            z.v_1 * e_1 + q.a * (1.0 - e_1) / R_1,
            z.v_2 * e_2 + q.a * (1.0 - e_2) / R_2,
            z.v_3 * e_3 + q.a * (1.0 - e_3) / R_3,
            z.v_4 * e_4 + q.a * (1.0 - e_4) / R_4,
        )
