"""The drop of the yield force when sliding sets in."""

from math import exp

from ..effect import Effect
from ..parameter import Parameter


class Stribeck(Effect):
    """Stribeck effect: the yield force is larger at creeping speed and drops as sliding sets in.

        yield factor = 1 + rise exp(-(|v|/v_s)^shape)

    `way` 0 lets the force follow the speed at once; 1 moves the deflection at which bristles slip,
    so that it follows over their travel (laws with bristles alone; both are the same in steady
    sliding). Leaves out memory of the rest before it (rebuilding): doubt it when the first
    breakaway after a long rest is larger than the next ones.
    """

    name = "stribeck"
    sites = ("damper",)
    needs = ("v",)
    passive = True
    zero_at_rest = True
    source = (
        "Armstrong-Helouvry, Dupont & Canudas de Wit (1994), Automatica 30(7), 1083-1138, eq. 4; "
        "in the bristles: Canudas de Wit, Olsson, Astrom & Lischinsky (1995), IEEE Trans. Automat. "
        "Control 40(3), 419-425"
    )
    expect = "excess force in the direction of motion at the lowest speeds, gone at higher speed"
    amount = "rise"
    parameters = {
        "rise": Parameter(0.3, "1", (0.0, 5.0), "excess of the yield force as v -> 0"),
        "v_s": Parameter(0.01, "m/s", (1e-4, 1.0), "speed over which the excess dies out"),
        "shape": Parameter(2.0, "1", (0.4, 3.0), "exponent: 2 Gaussian, 1 exponential"),
        "way": Parameter(0.0, "1", (0.0, 1.0), "0: of the force, 1: of the bristles' deflection"),
    }
    start_grid = {"rise": (1.0, 8.0), "v_s": (0.3, 1.0, 3.0)}

    bristles = ("way",)

    @staticmethod
    def yield_factor(q, z, p):
        excess = p.rise * exp(-((abs(q.v) / p.v_s) ** p.shape))
        return (1.0 + excess) / (1.0 + p.way * excess)

    @staticmethod
    def reach(q, z, p):
        return 1.0 + p.way * p.rise * exp(-((abs(q.v) / p.v_s) ** p.shape))

    @staticmethod
    def yield_share(p):
        # The law's yield force holds part of the excess in its mean.
        return 1.0 + 0.5 * p.rise
