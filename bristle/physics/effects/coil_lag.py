"""The current in the coil follows the voltage late."""

from math import exp

from ..effect import Effect, Parameter


class CoilLag(Effect):
    """Coil lag: the field follows the voltage with the coil's time constant L/R.

        tau V_felt' = V - V_felt,   exact for a voltage held over the step

    Leaves out eddy currents, which make the lag shorter at first and longer later.
    """

    name = "coil_lag"
    site = "damper"
    needs = ("V", "dt")
    passive = True
    zero_at_rest = True
    source = "Spencer, Dyke, Sain & Carlson (1997), J. Eng. Mech. 123(3), 230-238, eq. 10"
    expect = "error just after each change of voltage, too much force falling, too little rising"
    states = {"voltage": "V"}
    parameters = {"tau": Parameter(0.02, "s", (1e-4, 1.0), "time constant of the coil, L/R")}

    @staticmethod
    def voltage(q, z, p):
        return z.voltage

    @staticmethod
    def advance(q, z, p):
        return (q.V + (z.voltage - q.V) * exp(-q.dt / p.tau),)
