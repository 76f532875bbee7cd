"""Dry friction in the isolation layer."""

from ..effect import Effect, Parameter


class BaseFriction(Effect):
    """Base friction: the slider under the base rubs with a constant force.

    While it sticks it carries whatever holds the base, up to its limit. With a force reconstructed
    from base equilibrium it cannot be told from the damper's own yield force f_c.
    """

    name = "base_friction"
    site = "structure"
    needs = ("halt",)
    passive = True
    zero_at_rest = True
    source = "Coulomb (1821), Theorie des machines simples; time stepping after Moreau (1988)"
    expect = "base motion smaller than predicted and stuck in weak shaking"
    parameters = {"limit": Parameter(0.5, "N", (0.0, 1e7), "friction force")}

    @staticmethod
    def force(q, z, p):
        return min(max(q.halt, -p.limit), p.limit)
