"""The base meets its stops."""

from ..effect import Effect
from ..parameter import Parameter

D_REF = 1e-3  # m; keeps the unit of k for every shape


class EndStop(Effect):
    """End stop: beyond the clearance a buffer pushes back, with a spring and a loss.

        F = k D_r (d/D_r)^shape (1 + loss d') + c d',   d = |x| - clearance > 0,   D_r = 1 mm

    It never pulls. Leaves out the ringing of what is hit: doubt it when accelerations go on after
    the contact.
    """

    name = "end_stop"
    sites = ("structure", "damper")
    needs = ("x", "v")
    passive = True
    zero_at_rest = True
    contact = True
    source = (
        "Anagnostopoulos (1988), Earthq. Eng. Struct. Dyn. 16(3), 443-456; loss: Hunt & Crossley "
        "(1975), J. Appl. Mech. 42(2), 440-445"
    )
    expect = "spikes of force and acceleration at the largest displacements"
    amount = "k"
    parameters = {
        "clearance": Parameter(0.02, "m", (1e-4, 10.0), "travel before contact, to either side"),
        "k": Parameter(5e3, "N/m", (0.0, 1e9), "stiffness of the buffer, at D_r for every shape"),
        "c": Parameter(10.0, "N.s/m", (0.0, 1e7), "damping of the buffer"),
        "shape": Parameter(1.0, "1", (1.0, 3.0), "1 linear, 1.5 Hertz"),
        "loss": Parameter(0.0, "s/m", (0.0, 100.0), "loss by the closing speed"),
    }
    start_shares = ({"clearance": (0.55, 0.75, 0.9), "k": (1.0,), "c": (1e-3,)},)
    # A stop that is met nearer than that is met so often that it is a spring.
    start_limits = {"clearance": (0.4, 1.0)}

    @staticmethod
    def force(q, z, p):
        beyond = abs(q.x) - p.clearance
        if beyond <= 0.0:
            return 0.0
        side = 1.0 if q.x > 0.0 else -1.0
        push = p.k * D_REF * (beyond / D_REF) ** p.shape * (1.0 + p.loss * side * q.v)
        return side * max(push + p.c * side * q.v, 0.0)
