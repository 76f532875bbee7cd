"""FMU: the clipped-optimal switch on an LQG command."""

from bristle.component.controller import CLIPPED_LQG
from bristle.fmu.controller import LinearSlave, declare_force_threshold


class LqgClipped(LinearSlave):
    """Clipped LQG controller: an optimal regulator on an estimate that knows the damper's force."""

    design = "lqg"
    law_kind = CLIPPED_LQG
    files = ("component/data/lqg.json",)

    def declare_law(self):
        super().declare_law()
        declare_force_threshold(self)
