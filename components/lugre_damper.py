"""FMU: the MR damper by the modified LuGre law."""

from bristle.fmu.damper import DamperSlave


class LuGreDamper(DamperSlave):
    """MR damper, modified LuGre law: bristles that bend before they slip, stiffer under voltage."""

    law = "lugre"

    def declare(self):
        super().declare()
