"""FMU: an H-infinity command through a damper law's inverse."""

from bristle.component.controller import INVERSE
from bristle.fmu.controller import LinearSlave, declare_anti_windup, declare_inverse


class HinfInverse(LinearSlave):
    """H-infinity controller: the voltage at which the damper's law gives the commanded force."""

    design = "hinf"
    law_kind = INVERSE
    files = ("component/data/hinf.json",)

    def declare_law(self):
        super().declare_law()
        declare_anti_windup(self, 0.0)
        declare_inverse(self)
