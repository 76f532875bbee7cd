"""Magnetic saturation of the steel and the fluid."""

from ..effect import Effect
from ..parameter import Parameter


class Saturation(Effect):
    """Saturation: the field grows less and less with the voltage.

        V_felt = V / (1 + (V/V_s)^shape)^(1/shape)

    Leaves out hysteresis (see remanence).
    """

    name = "saturation"
    sites = ("damper",)
    kind = "command curve"
    needs = ("V",)
    passive = True
    zero_at_rest = True
    source = "Froelich-Kennelly form; Bozorth (1951), Ferromagnetism, ch. 11"
    expect = "too much predicted force at the highest voltages and too little at middle ones"
    amount = "1/V_s"
    parameters = {
        "V_s": Parameter(8.0, "V", (0.05, 1e4), "voltage at which the field saturates"),
        "shape": Parameter(2.0, "1", (1.0, 6.0), "sharpness of the bend"),
    }
    start_grid = {"V_s": (0.2, 0.4, 1.0)}
    mimics = ("late_drive", "limited_drive")

    @staticmethod
    def voltage(q, z, p):
        return q.V / (1.0 + (max(q.V, 0.0) / p.V_s) ** p.shape) ** (1.0 / p.shape)
