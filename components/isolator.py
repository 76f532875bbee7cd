"""FMU: the elastomeric or lead-rubber isolator."""

from bristle.fmu.damper import DamperSlave


class Isolator(DamperSlave):
    """Isolator of rubber, with or without a lead core."""

    law = "isolator"

    def declare(self):
        super().declare()
