"""FMU: the MR damper by the modified Bouc-Wen law."""

from bristle.fmu.damper import DamperSlave


class ModifiedBoucWenDamper(DamperSlave):
    """MR damper, modified Bouc-Wen law: behind a dashpot, beside an accumulator, with a lag."""

    law = "modified_bouc_wen"

    def declare(self):
        super().declare()
