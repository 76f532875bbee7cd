"""Dry friction in the isolation layer, or in a damper."""

from math import exp

from ..effect import Effect
from ..parameter import Parameter


class BaseFriction(Effect):
    """Base friction: a dry contact under the base, or in the damper, rubs, and holds as it sticks.

        |F| <= limit mu,   mu = 1 - (1 - slow) exp(-|v|/v_r);   with x_s: F = limit mu m

    m' = (v - |v| m)/x_s gives the contact an elastic travel x_s (0: none). Leaves out the vertical
    load's changes: doubt it when friction follows the rocking. With a force reconstructed from base
    equilibrium it cannot be told from the damper's own yield force f_c.
    """

    name = "base_friction"
    sites = ("structure", "damper")
    needs = ("v", "dt", "halt")
    passive = True
    zero_at_rest = True
    contact = True
    source = (
        "Coulomb (1821), Theorie des machines simples; speed: Constantinou, Mokha & Reinhorn "
        "(1990), J. Struct. Eng. 116(2), 455-474; time stepping: Moreau (1988), CISM 302"
    )
    expect = "an error with the sign of the velocity; motion smaller than predicted, or none at all"
    states = {"share": "1"}
    amount = "limit"
    parameters = {
        "limit": Parameter(0.5, "N", (0.0, 1e7), "friction force at high speed"),
        "slow": Parameter(1.0, "1", (0.1, 3.0), "friction as v -> 0 by that at high speed"),
        "v_r": Parameter(0.02, "m/s", (1e-4, 1.0), "speed over which it changes"),
        "x_s": Parameter(0.0, "m", (0.0, 0.1), "elastic travel before it slides; below 1 um none"),
    }
    start_shares = ({"limit": (0.1,), "x_s": (0.0, 0.05), "v_r": (0.1,)},)
    absorbed_by = "yield"
    lookalikes = {
        "f_c of the damper": "dry friction and the damper's own yield force add up to one force"
    }

    @staticmethod
    def force(q, z, p):
        limit = p.limit * (1.0 - (1.0 - p.slow) * exp(-abs(q.v) / p.v_r))
        if p.x_s >= 1e-6:
            return limit * z.share
        return min(max(q.halt, -limit), limit)

    @staticmethod
    def advance(q, z, p):
        if p.x_s < 1e-6 or q.v == 0.0:
            return (z.share,)
        side = 1.0 if q.v > 0.0 else -1.0
        return (side + (z.share - side) * exp(-abs(q.v) * q.dt / p.x_s),)
