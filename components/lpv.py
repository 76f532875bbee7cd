"""FMU: the controller that is scheduled by the base velocity."""

from bristle.component.controller import SIGNED
from bristle.fmu.controller import LinearSlave, declare_anti_windup


class Lpv(LinearSlave):
    """Linear parameter-varying controller: a signed voltage, scheduled by the base velocity."""

    design = "lpv"
    law_kind = SIGNED
    command_unit = "V"
    files = ("component/data/lpv.json",)

    def declare_law(self):
        super().declare_law()
        declare_anti_windup(self, 200.0)
