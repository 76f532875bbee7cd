"""Steel that stays magnetised after the voltage has gone."""

from ..effect import Effect
from ..parameter import Parameter


def play(at, V, width):
    """Return where a play of this half width rests once the voltage has come to V [V]."""
    return min(max(at, V - width), V + width)


def lagged(at, V, width, turn):
    """Return the voltage felt behind a play of the half width turn width that rests there [V].

    The play's way from edge to edge, turn times as long as the loop is wide, takes the voltage felt
    from one branch of the loop to the other.
    """
    return V - (V - play(at, V, turn * width)) / turn


class Remanence(Effect):
    """Remanence: the field lags behind the voltage by a fixed width, however slowly it moves.

        V_felt = mean of four loops of the widths width (1 + spread (-3, -1, 1, 3)/4)
        loop of a width w: V - (V - P)/turn,   P a play operator of the width turn w

    A play rests while the voltage moves inside P +- turn w and is carried along at the edges;
    V_felt is never below zero. Spread 0 is one loop, 1 many that round off like iron's. Turn 1 is
    the play itself, which rests while the voltage turns; towards 0 the field jumps from one branch
    to the other as a relay does.
    Leaves out demagnetisation by vibration: doubt it when the loop shrinks over time.
    """

    name = "remanence"
    sites = ("damper",)
    needs = ("V",)
    passive = True
    zero_at_rest = True
    source = (
        "Visintin (1994), Differential Models of Hysteresis, ch. III (play, and Prandtl and "
        "Ishlinskii's sums of it) and ch. IV (relay)"
    )
    expect = "at one voltage two forces, the larger one while the voltage falls"
    states = {"voltage": "V", "second": "V", "third": "V", "fourth": "V"}
    amount = "width"
    parameters = {
        "width": Parameter(0.5, "V", (0.0, 10.0), "half the width of the loop"),
        "spread": Parameter(
            0.0, "1", (0.0, 1.3), "spread of the widths: 0 one, 1 from zero to twice"
        ),
        "turn": Parameter(
            1.0, "1", (0.02, 1.0), "way of a reversal by the loop's width: 1 a play, 0 a relay"
        ),
    }
    start_grid = {"width": (0.3, 1.0), "turn": (0.1, 1.0)}
    mimics = ("late_drive", "limited_drive")

    @staticmethod
    def voltage(q, z, p):
        # A play follows at once: a voltage that has just jumped is felt before time goes on.
        small = max(p.width * (1.0 - 0.75 * p.spread), 0.0)
        middle, large = p.width * (1.0 - 0.25 * p.spread), p.width * (1.0 + 0.25 * p.spread)
        felt = lagged(z.voltage, q.V, small, p.turn) + lagged(z.second, q.V, middle, p.turn)
        felt += lagged(z.third, q.V, large, p.turn)
        felt += lagged(z.fourth, q.V, p.width * (1.0 + 0.75 * p.spread), p.turn)
        return max(0.25 * felt, 0.0)

    @staticmethod
    def advance(q, z, p):
        small = max(p.width * (1.0 - 0.75 * p.spread), 0.0)
        middle, large = p.width * (1.0 - 0.25 * p.spread), p.width * (1.0 + 0.25 * p.spread)
        return (
            play(z.voltage, q.V, p.turn * small),
            play(z.second, q.V, p.turn * middle),
            play(z.third, q.V, p.turn * large),
            play(z.fourth, q.V, p.turn * p.width * (1.0 + 0.75 * p.spread)),
        )
