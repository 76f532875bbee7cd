"""The base meets its stops."""

from ..effect import Effect, Parameter


class EndStop(Effect):
    """End stop: beyond the clearance a buffer pushes back, with a spring and a dashpot.

    F = k d^shape + c v,   d = |x| - clearance > 0;   never pulling
    """

    name = "end_stop"
    site = "structure"
    needs = ("x", "v")
    passive = True
    zero_at_rest = True
    source = "Anagnostopoulos (1988), Earthq. Eng. Struct. Dyn. 16(3), 443-456"
    expect = "spikes of force and acceleration at the largest displacements"
    parameters = {
        "clearance": Parameter(0.02, "m", (1e-4, 10.0), "travel before contact, to either side"),
        "k": Parameter(5e3, "N/m", (0.0, 1e9), "stiffness of the buffer (for shape 1)"),
        "c": Parameter(10.0, "N.s/m", (0.0, 1e7), "damping of the buffer"),
        "shape": Parameter(1.0, "1", (1.0, 2.5), "1 linear, 1.5 Hertz"),
    }

    @staticmethod
    def force(q, z, p):
        beyond = abs(q.x) - p.clearance
        if beyond <= 0.0:
            return 0.0
        side = 1.0 if q.x > 0.0 else -1.0
        return side * max(p.k * beyond**p.shape + p.c * side * q.v, 0.0)
