"""The recorder shows the force late."""

from math import cos, exp, sin, sqrt

from ..effect import Effect
from ..parameter import Parameter

SLOTS = 64  # samples that the ring holds
LAST = SLOTS - 1.001


class Delay(Effect):
    """Delay: the force channel reaches the recorder late, by buffers, filters and transmission.

        shown(t) = force(t - time),   a share `filtered` of the time in a low-pass of second order,
        y'' + 2 d w y' + w^2 y = w^2 u,   2 d/w = filtered time,   d the damping ratio

    Its damping ratio is 1 for two equal lags, 0.87 for Bessel's filter, 0.71 for Butterworth's.
    The ring holds 64 samples; what is older is shown as the oldest. Between samples the force is
    taken as linear. Leaves out a clock that drifts: doubt it when the lag grows through a run.
    """

    name = "delay"
    sites = ("sensor",)
    shows = "force"
    late = ("time", "filtered", "damping")
    needs = ("value", "dt")
    passive = False
    zero_at_rest = True
    source = (
        "Horiuchi, Inoue, Konno & Namita (1999), Earthq. Eng. Struct. Dyn. 28(10), 1121-1141 "
        "(delays in dynamic tests); filter: Thomson (1949), Proc. IEE 96(44), 487-490"
    )
    expect = "the whole residual follows the rate of the force, whatever the motion"
    states = {"half": "N", "low": "N", **{f"past_{k}": "N" for k in range(SLOTS)}}
    starts = dict.fromkeys(states, "value")
    amount = "time"
    parameters = {
        "time": Parameter(0.005, "s", (0.0, 0.2), "how late the force is shown"),
        "filtered": Parameter(0.5, "1", (0.0, 1.0), "share of the time that a filter takes"),
        "damping": Parameter(1.0, "1", (0.4, 1.0), "damping ratio of that filter"),
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
        d, lag = p.damping, 0.5 * p.filtered * p.time / p.damping
        if lag < 0.1 * q.dt:
            return (q.value, q.value, q.value, *z[2:-1])
        # Exact for a force that is held: with half = low + lag low', both relax by one matrix.
        angle, turn = q.dt / lag, sqrt(1.0 - d * d)
        fade = exp(-d * angle)
        kept = fade * cos(turn * angle)
        mixed = fade * (sin(turn * angle) / turn if turn > 1e-6 else angle)
        off, more = z.low - q.value, z.half - q.value
        low = q.value + kept * off + mixed * (more - (1.0 - d) * off)
        half = q.value + kept * more + mixed * (1.0 - d) * (more - 2.0 * off)
        return (half, low, low, *z[2:-1])
