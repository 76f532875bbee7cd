"""The fluid thins as the damper heats itself."""

from math import exp

from ..effect import Effect
from ..parameter import Parameter


def thinned(T, curve):
    """Return what is left of a force at a relative temperature T [1]."""
    if abs(curve) < 1e-9:
        return max(exp(-min(T, 300.0)), 0.02)
    base = 1.0 + curve * T
    return max(base ** (-1.0 / curve), 0.02) if base > 0.0 else 0.02


class Temperature(Effect):
    """Temperature: dissipated heat thins the fluid; it cools with a time constant.

        heat' = (1 - housing) F v - heat/tau,   kept' = housing F v - kept/(20 tau)
        T = (heat + kept)/E_0,   viscous factor = thinned(T),   yield factor = thinned(part T)
        thinned(T) = (1 + curve T)^(-1/curve);   curve 0: exp(-T), -1: 1 - T;   0.02 at least

    `housing` is the share of the heat that the steel takes, which cools twenty times slower.
    Leaves out the temperature of the room: doubt it when runs of different days differ from the
    start.
    """

    name = "temperature"
    sites = ("damper",)
    needs = ("v", "force", "dt")
    passive = True
    zero_at_rest = True
    source = (
        "Gordaninejad & Breese (1999), J. Intell. Mater. Syst. Struct. 10(8), 634-645; Arrhenius "
        "part: Dogruoz et al. (2003), J. Intell. Mater. Syst. Struct. 14(2), 79-86"
    )
    expect = "the force declines through a run, the faster the more energy it dissipates"
    states = {"heat": "J", "kept": "J"}
    amount = "1/E_0"
    parameters = {
        "E_0": Parameter(4.0, "J", (1e-3, 1e9), "heat at which the viscous part has fallen to 1/e"),
        "tau": Parameter(60.0, "s", (0.1, 1e5), "time constant of cooling"),
        "part": Parameter(1.0, "1", (0.0, 2.0), "how much the yield force falls with it"),
        "curve": Parameter(
            0.0, "1", (-1.0, 2.0), "0 exponential, -1 linear, above 0: less and less"
        ),
        "housing": Parameter(0.0, "1", (0.0, 0.7), "share of the heat that the steel takes"),
    }
    start_grid = {"E_0": (1.0, 4.0, 15.0), "tau": (0.07, 0.3)}
    mimics = ("late_drive",)

    @staticmethod
    def yield_factor(q, z, p):
        return thinned(p.part * (z.heat + z.kept) / p.E_0, p.curve)

    @staticmethod
    def viscous_factor(q, z, p):
        return thinned((z.heat + z.kept) / p.E_0, p.curve)

    @staticmethod
    def advance(q, z, p):
        decay = exp(-q.dt / p.tau)
        slow = exp(-q.dt / (20.0 * p.tau))
        power = q.force * q.v * p.tau
        heat = z.heat * decay + (1.0 - p.housing) * power * (1.0 - decay)
        kept = z.kept * slow + p.housing * power * 20.0 * (1.0 - slow)
        return max(heat, 0.0), max(kept, 0.0)
