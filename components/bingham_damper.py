"""FMU: the MR damper by the modified Bingham law."""

from bristle.fmu.damper import DamperSlave


class BinghamDamper(DamperSlave):
    """MR damper, modified Bingham law: a yield force, a viscous part that fades with speed."""

    law = "bingham"

    def declare(self):
        super().declare()
