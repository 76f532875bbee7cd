"""The mass of the fluid that the piston accelerates."""

from ..effect import Effect, Parameter


class FluidInertia(Effect):
    """Fluid inertia: the fluid in the gap is accelerated with the piston.

    F = m_f a
    """

    name = "fluid_inertia"
    site = "damper"
    needs = ("a",)
    passive = True
    zero_at_rest = True
    source = "Peel, Stanway & Bullough (1996), Smart Mater. Struct. 5(5), 591-606"
    expect = "a force in phase with acceleration, largest at the highest frequencies"
    parameters = {"m_f": Parameter(0.3, "kg", (0.0, 1e4), "mass that moves with the piston")}

    @staticmethod
    def force(q, z, p):
        return p.m_f * q.a
