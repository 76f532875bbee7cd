"""FMU: the MR damper by the modified Bingham law."""

from bristle.fmu.damper import DamperSlave


class BinghamDamper(DamperSlave):
    """MR damper, modified Bingham law: a yield force and a viscous part that dies out with speed."""

    law = "bingham"

    def declare(self):
        super().declare()
