"""The current in the coil follows the voltage late."""

from math import exp

from ..effect import Effect
from ..parameter import Parameter


class CoilLag(Effect):
    """Coil lag: the field follows the voltage with the coil's time constant L/R.

        tau_i i' = V - i,   tau_i = tau fall^(-1/2) rising, tau fall^(1/2) falling

    Eddy currents add a second lag, eddy tau_i, behind it; both are exact for a voltage held over
    the step. Leaves out a supply that limits the current: doubt it when large steps take longer
    than small ones.
    """

    name = "coil_lag"
    sites = ("damper",)
    kind = "lag"
    needs = ("V", "dt")
    passive = True
    zero_at_rest = True
    source = (
        "Spencer, Dyke, Sain & Carlson (1997), J. Eng. Mech. 123(3), 230-238, eq. 10; two times: "
        "Koo, Goncalves & Ahmadian (2006), Smart Mater. Struct. 15(2), 351-358"
    )
    expect = "error just after each change of voltage, too much force falling, too little rising"
    states = {"voltage": "V", "field": "V"}
    starts = {"voltage": "V", "field": "V"}
    amount = "tau"
    parameters = {
        "tau": Parameter(0.02, "s", (1e-4, 1.0), "time constant of the coil, L/R"),
        "fall": Parameter(1.0, "1", (0.1, 10.0), "how much longer it takes to fall than to rise"),
        "eddy": Parameter(0.0, "1", (0.0, 0.95), "second time constant by the first"),
    }
    start_grid = {"tau": (0.1, 0.5, 2.0)}
    mimics = ("late_drive", "limited_drive")

    @staticmethod
    def voltage(q, z, p):
        return z.voltage if p.eddy <= 0.0 else z.field

    @staticmethod
    def advance(q, z, p):
        gap = z.voltage - q.V
        tau = p.tau * p.fall**0.5 if gap > 0.0 else p.tau / p.fall**0.5
        coil = exp(-q.dt / tau)
        if p.eddy <= 0.0:
            return q.V + gap * coil, q.V + gap * coil
        late = exp(-q.dt / (p.eddy * tau))
        share = gap / (1.0 - p.eddy)
        return q.V + gap * coil, q.V + share * coil + (z.field - q.V - share) * late
