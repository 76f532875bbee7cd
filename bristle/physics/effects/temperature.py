"""The fluid thins as the damper heats itself."""

from math import exp

from ..effect import Effect, Parameter


class Temperature(Effect):
    """Temperature: dissipated heat thins the fluid; it cools with a time constant.

        heat' = F v - heat/tau,   viscous factor = exp(-heat/E_0),   yield factor = exp(-part heat/E_0)

    Leaves out the ambient's own drift.
    """

    name = "temperature"
    site = "damper"
    needs = ("v", "force", "dt")
    passive = True
    zero_at_rest = True
    source = "Gordaninejad & Breese (1999), J. Intell. Mater. Syst. Struct. 10(8), 634-645"
    expect = "the force declines through a run, the faster the more energy it dissipates"
    states = {"heat": "J"}
    parameters = {
        "E_0": Parameter(
            20.0, "J", (1e-3, 1e9), "heat at which the viscous part has fallen to 1/e"
        ),
        "tau": Parameter(60.0, "s", (0.1, 1e5), "time constant of cooling"),
        "part": Parameter(1.0, "1", (0.0, 2.0), "how much the yield force falls with it"),
    }

    @staticmethod
    def viscous_factor(q, z, p):
        return exp(-z.heat / p.E_0)

    @staticmethod
    def yield_factor(q, z, p):
        return exp(-p.part * z.heat / p.E_0)

    @staticmethod
    def advance(q, z, p):
        decay = exp(-q.dt / p.tau)
        return (max(z.heat * decay + q.force * q.v * p.tau * (1.0 - decay), 0.0),)
