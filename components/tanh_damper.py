"""FMU: the MR damper by the hyperbolic tangent law."""

from bristle.fmu.damper import DamperSlave


class TanhDamper(DamperSlave):
    """MR damper, hyperbolic tangent law: hysteresis without memory, a spring, a viscous part."""

    law = "tanh"

    def declare(self):
        super().declare()
