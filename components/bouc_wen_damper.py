"""FMU: the MR damper by the Bouc-Wen law."""

from bristle.fmu.damper import DamperSlave


class BoucWenDamper(DamperSlave):
    """MR damper, Bouc-Wen law: hysteresis that rounds off, a spring and a viscous part."""

    law = "bouc_wen"

    def declare(self):
        super().declare()
