"""Storeys that lose stiffness as they sway."""

from ..effect import Effect, Parameter


class StoreySoftening(Effect):
    """Storey softening: a storey's spring gives way as its drift grows, and recovers.

        storey force = k d / (1 + (|d|/d_half)^shape)

    Elastic: no energy is lost. Leaves out yielding with memory: doubt it when the building comes
    to rest out of plumb.
    """

    name = "storey_softening"
    site = "structure"
    needs = ("drift", "stiffness", "storey")
    passive = True
    zero_at_rest = True
    source = (
        "Darendeli (2001), PhD thesis, University of Texas at Austin: G/G_max = 1/(1 + (g/g_r)^a), "
        "here for a storey's secant stiffness"
    )
    expect = (
        "storey drifts larger, and floor accelerations lower and slower, in strong shaking only"
    )
    parameters = {
        "d_half": Parameter(
            0.01, "m", (1e-4, 10.0), "drift at which the secant stiffness has halved"
        ),
        "shape": Parameter(2.0, "1", (1.0, 4.0), "exponent of the loss"),
        "which": Parameter(0.0, "1", (0.0, 20.0), "number of the storey; 0: every storey"),
    }

    @staticmethod
    def spring(q, z, p):
        if p.which != 0.0 and p.which != q.storey:
            return 0.0
        loss = (abs(q.drift) / p.d_half) ** p.shape
        return -q.stiffness * q.drift * loss / (1.0 + loss)
