"""The recorder shows the force late."""

from math import exp

from ..effect import Effect, Parameter

SLOTS = 64  # samples that the ring holds
LAST = SLOTS - 1.001


class Delay(Effect):
    """Delay: the force channel reaches the recorder late, by buffers, filters and transmission.

        shown(t) = force(t - time),   a share `filtered` of the time in a low-pass of second order

    The ring holds 64 samples; what is older is shown as the oldest. Between samples the force is
    taken as linear. Leaves out a clock that drifts: doubt it when the lag grows through a run.
    """

    name = "delay"
    sites = ("sensor",)
    shows = "force"
    late = ("time", "filtered")
    needs = ("value", "dt")
    passive = False
    zero_at_rest = True
    source = (
        "Horiuchi, Inoue, Konno & Namita (1999), Earthq. Eng. Struct. Dyn. 28(10), 1121-1141 "
        "(delays in dynamic tests); filter: Thomson (1949), Proc. IEE 96(44), 487-490"
    )
    expect = "the whole residual follows the rate of the force, whatever the motion and voltage"
    states = {"half": "N", "low": "N", **{f"past_{k}": "N" for k in range(SLOTS)}}
    starts = dict.fromkeys(states, "value")
    amount = "time"
    parameters = {
        "time": Parameter(0.005, "s", (0.0, 0.2), "how late the force is shown"),
        "filtered": Parameter(0.5, "1", (0.0, 1.0), "share of the time that a filter takes"),
    }
    start_grid = {"time": (0.02, 0.1, 0.4, 1.0, 2.5), "filtered": (0.0, 0.2, 1.0)}
    faults = ("delay",)
    mimics = ("late_drive",)

    @staticmethod
    def channel(q, z, p):
        late = min((1.0 - p.filtered) * p.time / q.dt, LAST)
        whole = int(late)
        begin = z[2 + whole]
        return begin + (late - whole) * (z[3 + whole] - begin)

    @staticmethod
    def advance(q, z, p):
        lag = 0.5 * p.filtered * p.time
        if lag < 0.1 * q.dt:
            return (q.value, q.value, q.value, *z[2:-1])
        fade = exp(-q.dt / lag)
        half = q.value + (z.half - q.value) * fade
        low = q.value + (z.low - q.value) * fade + (z.half - q.value) * (q.dt / lag) * fade
        return (half, low, low, *z[2:-1])
