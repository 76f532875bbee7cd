"""Steel that stays magnetised after the voltage has gone."""

from ..effect import Effect, Parameter


def play(at, V, width):
    """Return where a play of this half width rests once the voltage has come to V [V]."""
    return min(max(at, V - width), V + width)


class Remanence(Effect):
    """Remanence: the field lags behind the voltage by a fixed width, however slowly it moves.

        V_felt = mean of four play operators of the widths width (1 + spread (-3, -1, 1, 3)/4)

    A play rests while the voltage moves inside V_felt +- width and is carried along at the edges;
    V_felt is never below zero. Spread 0 is one play, 1 a loop that rounds off like iron's.
    Leaves out demagnetisation by vibration: doubt it when the loop shrinks over time.
    """

    name = "remanence"
    sites = ("damper",)
    needs = ("V",)
    passive = True
    zero_at_rest = True
    source = (
        "Visintin (1994), Differential Models of Hysteresis, ch. III (play, and Prandtl and "
        "Ishlinskii's sums of it)"
    )
    expect = "at one voltage two forces, the larger one while the voltage falls"
    states = {"voltage": "V", "second": "V", "third": "V", "fourth": "V"}
    parameters = {
        "width": Parameter(0.5, "V", (0.0, 10.0), "half the width of the loop"),
        "spread": Parameter(
            0.0, "1", (0.0, 1.3), "spread of the widths: 0 one, 1 from zero to twice"
        ),
    }
    start_grid = {"width": (0.3, 1.0)}
    mimics = ("late_drive",)

    @staticmethod
    def voltage(q, z, p):
        # A play follows at once: a voltage that has just jumped is felt before time goes on.
        small = max(p.width * (1.0 - 0.75 * p.spread), 0.0)
        middle, large = p.width * (1.0 - 0.25 * p.spread), p.width * (1.0 + 0.25 * p.spread)
        felt = play(z.voltage, q.V, small) + play(z.second, q.V, middle)
        felt += play(z.third, q.V, large)
        felt += play(z.fourth, q.V, p.width * (1.0 + 0.75 * p.spread))
        return max(0.25 * felt, 0.0)

    @staticmethod
    def advance(q, z, p):
        small = max(p.width * (1.0 - 0.75 * p.spread), 0.0)
        middle, large = p.width * (1.0 - 0.25 * p.spread), p.width * (1.0 + 0.25 * p.spread)
        return (
            play(z.voltage, q.V, small),
            play(z.second, q.V, middle),
            play(z.third, q.V, large),
            play(z.fourth, q.V, p.width * (1.0 + 0.75 * p.spread)),
        )
