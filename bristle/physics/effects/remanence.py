"""Steel that stays magnetised after the voltage has gone."""

from ..effect import Effect
from ..parameter import Parameter


def play(at, V, width):
    """Return where a play of this half width rests once the voltage has come to V [V]."""
    return min(max(at, V - width), V + width)


def lagged(at, held, V, width, turn, hold):
    """Return the voltage felt behind a wide and a narrow play [V].

    The way of the wide one from edge to edge, turn times as long as the loop is wide, takes the
    voltage felt from one branch of the loop to the other; over its first part, the way of the
    narrow one, hold times as long, it stays on its branch.

    Parameters
    ----------
    at, held : where the wide and the narrow one rest [V]
    V : voltage [V]
    width : half the width of the loop [V]
    turn, hold : see `Remanence`
    """
    way = turn * width
    return V - (play(held, V, hold * way) - play(at, V, way)) / (turn * (1.0 - hold))


class Remanence(Effect):
    """Remanence: the field lags behind the voltage by a fixed width, however slowly it moves.

        V_felt = mean of four loops of the widths width (1 + spread (-3, -1, 1, 3)/4)
        loop of a width w: V - (H - P)/(turn (1 - hold))
        P, H play operators of the widths turn w and hold turn w

    A play rests while the voltage moves inside P +- turn w and is carried along at the edges;
    V_felt is never below zero. Spread 0 is one loop, 1 many that round off like iron's. Turn 1 is
    the play itself, which rests while the voltage turns; towards 0 the field jumps from one branch
    to the other as a relay does; above 1 it changes branch only as the voltage goes back by more
    than the loop is wide; with hold it stays on its branch for that share of the way back.
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
    states = {
        "voltage": "V", "second": "V", "third": "V", "fourth": "V",
        "held": "V", "held_second": "V", "held_third": "V", "held_fourth": "V",
    }  # fmt: skip
    amount = "width"
    parameters = {
        "width": Parameter(0.5, "V", (0.0, 10.0), "half the width of the loop"),
        "spread": Parameter(
            0.0, "1", (0.0, 1.3), "spread of the widths: 0 one, 1 from zero to twice"
        ),
        "turn": Parameter(
            1.0, "1", (0.02, 12.0), "way of a reversal by the loop's width: 1 a play, 0 a relay"
        ),
        "hold": Parameter(0.0, "1", (0.0, 0.95), "share of that way on which the branch is kept"),
    }
    start_grid = {"width": (0.3, 1.0), "turn": (0.1, 1.0, 4.0)}
    mimics = ("late_drive", "limited_drive")

    @staticmethod
    def voltage(q, z, p):
        # A play follows at once: a voltage that has just jumped is felt before time goes on.
        small = max(p.width * (1.0 - 0.75 * p.spread), 0.0)
        middle, large = p.width * (1.0 - 0.25 * p.spread), p.width * (1.0 + 0.25 * p.spread)
        largest = p.width * (1.0 + 0.75 * p.spread)
        felt = lagged(z.voltage, z.held, q.V, small, p.turn, p.hold)
        felt += lagged(z.second, z.held_second, q.V, middle, p.turn, p.hold)
        felt += lagged(z.third, z.held_third, q.V, large, p.turn, p.hold)
        felt += lagged(z.fourth, z.held_fourth, q.V, largest, p.turn, p.hold)
        return max(0.25 * felt, 0.0)

    @staticmethod
    def advance(q, z, p):
        small = max(p.width * (1.0 - 0.75 * p.spread), 0.0)
        middle, large = p.width * (1.0 - 0.25 * p.spread), p.width * (1.0 + 0.25 * p.spread)
        largest = p.width * (1.0 + 0.75 * p.spread)
        return (
            play(z.voltage, q.V, p.turn * small),
            play(z.second, q.V, p.turn * middle),
            play(z.third, q.V, p.turn * large),
            play(z.fourth, q.V, p.turn * largest),
            play(z.held, q.V, p.hold * p.turn * small),
            play(z.held_second, q.V, p.hold * p.turn * middle),
            play(z.held_third, q.V, p.hold * p.turn * large),
            play(z.held_fourth, q.V, p.hold * p.turn * largest),
        )
