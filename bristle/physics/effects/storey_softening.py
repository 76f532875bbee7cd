"""Storeys that lose stiffness as they sway, elastically or by yielding."""

from ..effect import Effect
from ..parameter import Parameter


class StoreySoftening(Effect):
    """Storey softening: a storey's spring gives way as its drift grows.

        storey force = k ((1 - yields) d/(1 + (|d|/d_half)^shape) + yields e)
        e' = d' (1 - (|e|/d_y)^sharpness  where e d' > 0)

    The first part is elastic; what yields follows the elastic drift e and loses energy. Leaves out
    strength that fades from cycle to cycle: doubt it when the same shaking moves it more each time.
    """

    name = "storey_softening"
    sites = ("structure",)
    needs = ("drift", "drift_rate", "dt", "stiffness", "storey")
    passive = True
    zero_at_rest = True
    source = (
        "Darendeli (2001), PhD thesis, University of Texas at Austin: G/G_max = 1/(1 + (g/g_r)^a), "
        "here for a storey's secant stiffness; yielding: Wen (1976), J. Eng. Mech. Div. 102(2), "
        "249-263"
    )
    expect = (
        "storey drifts larger, and floor accelerations lower and slower, in strong shaking only"
    )
    states = {"elastic": "m"}
    amount = "1/d_half"
    parameters = {
        "d_half": Parameter(
            0.01, "m", (1e-4, 10.0), "drift at which the secant stiffness has halved"
        ),
        "shape": Parameter(2.0, "1", (1.0, 4.0), "exponent of the loss"),
        "which": Parameter(0.0, "1", (0.0, 20.0), "number of the storey; 0: every storey"),
        "yields": Parameter(0.0, "1", (0.0, 1.0), "share of the stiffness that yields"),
        "d_y": Parameter(0.005, "m", (1e-5, 10.0), "drift at which that share has yielded"),
        "sharpness": Parameter(2.0, "1", (1.0, 10.0), "how sharply it does"),
    }
    start_shares = (
        {"d_half": (0.7, 2.5)},
        {"d_half": (5.0,), "yields": (0.3,), "d_y": (0.15, 0.4)},
    )

    @staticmethod
    def spring(q, z, p):
        if p.which != 0.0 and p.which != q.storey:
            return 0.0
        loss = (abs(q.drift) / p.d_half) ** p.shape
        soft = (1.0 - p.yields) * q.drift * loss / (1.0 + loss)
        return -q.stiffness * (soft + p.yields * (q.drift - z.elastic))

    @staticmethod
    def advance(q, z, p):
        e, way = z.elastic, q.drift_rate * q.dt
        count = 1 + int(min(8.0 * abs(way) / p.d_y, 100.0))
        way /= count
        for _ in range(count):  # Heun's rule
            first = way
            if e * way > 0.0:
                first -= way * (abs(e) / p.d_y) ** p.sharpness
            last, then = way, e + first
            if then * way > 0.0:
                last -= way * min(abs(then) / p.d_y, 1.0) ** p.sharpness
            e = min(max(e + 0.5 * (first + last), -p.d_y), p.d_y)
        return (e,)
