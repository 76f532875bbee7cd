"""FMU: the MR damper by Dahl's law."""

from bristle.fmu.damper import DamperSlave


class DahlDamper(DamperSlave):
    """MR damper, Dahl's law: friction that builds up with travel, and a viscous part."""

    law = "dahl"

    def declare(self):
        super().declare()
