"""Steel that stays magnetised after the voltage has gone."""

from ..effect import Effect, Parameter


class Remanence(Effect):
    """Remanence: the field lags behind the voltage by a fixed width, however slowly it moves.

    The play operator: V_felt rests while the voltage moves inside V_felt +- width, and is carried
    along at the edges; never below zero. Leaves out minor loops of other width and
    demagnetisation by vibration.
    """

    name = "remanence"
    site = "damper"
    needs = ("V",)
    passive = True
    zero_at_rest = True
    source = "Visintin (1994), Differential Models of Hysteresis, ch. III (play operator)"
    expect = "at one voltage two forces, the larger one while the voltage falls"
    states = {"voltage": "V"}
    parameters = {"width": Parameter(0.5, "V", (0.0, 10.0), "half the width of the loop")}

    @staticmethod
    def voltage(q, z, p):
        return max(z.voltage, 0.0)

    @staticmethod
    def advance(q, z, p):
        return (min(max(z.voltage, q.V - p.width), q.V + p.width),)
