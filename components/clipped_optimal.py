"""FMU: the clipped-optimal switch on an H-infinity command."""

from bristle.control.switching import clipped_voltage
from bristle.fmu.controller import LinearSlave


class ClippedOptimal(LinearSlave):
    """Clipped-optimal controller: all or no voltage, as the damper's force lags the command."""

    design = "hinf"
    files = ("control/data/hinf.json",)

    def declare_law(self):
        super().declare_law()
        text = "commands of this size or less are not answered"
        self.add_parameter("f_min", 0.5, "N", text, (0.0, 1e9))

    def act(self, y, v, f):
        u = self.command(v)
        self.move(y, 0.0)
        return clipped_voltage(u, f, self.f_min, self.v_max), u
