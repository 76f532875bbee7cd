"""FMU: the clipped-optimal switch on an H-infinity command."""

from bristle.component.controller import CLIPPED
from bristle.fmu.controller import LinearSlave, declare_force_threshold


class ClippedOptimal(LinearSlave):
    """Clipped-optimal controller: all or no voltage, as the damper's force lags the command."""

    design = "hinf"
    law_kind = CLIPPED
    files = ("component/data/hinf.json",)

    def declare_law(self):
        super().declare_law()
        declare_force_threshold(self)
