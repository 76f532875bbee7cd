"""The gas cushion of the accumulator, which carries the damper's rod volume."""

from ..effect import Effect
from ..parameter import Parameter


class GasSpring(Effect):
    """Gas spring: the accumulator pushes the rod back, the more the further it is in.

        F = preload + k x + k_2 x^2 + k_3 x^3

    The series of the polytropic law F_0 (1 - x/L)^-n about mid-stroke: k = n F_0/L and
    k_2 = n (n+1) F_0/(2 L^2). Leaves out heat exchange with the wall: doubt it when the loop of
    the spring itself has area.
    """

    name = "gas_spring"
    sites = ("damper",)
    kind = "spring"
    needs = ("x",)
    passive = True
    zero_at_rest = False
    source = (
        "Spencer, Dyke, Sain & Carlson (1997), J. Eng. Mech. 123(3), 230-238, element k_1 (x - x_0)"
    )
    expect = "a force in phase with displacement, whatever the velocity"
    amount = "k"
    parameters = {
        "k": Parameter(80.0, "N/m", (0.0, 1e6), "stiffness at mid-stroke"),
        "preload": Parameter(0.0, "N", (-1e5, 1e5), "force at mid-stroke"),
        "k_2": Parameter(0.0, "N/m2", (-1e9, 1e9), "growth of the stiffness towards one end"),
        "k_3": Parameter(0.0, "N/m3", (-1e12, 1e12), "growth of the stiffness towards both ends"),
    }
    offset = "preload"
    mimics = ("force_bias",)
    lookalikes = {
        "duffing": "a spring of the damper and one of the isolation layer add up to one force"
    }

    @staticmethod
    def force(q, z, p):
        return p.preload + q.x * (p.k + q.x * (p.k_2 + q.x * p.k_3))
