"""FMU: the clipped-optimal switch on an LQG command."""

from bristle.control.switching import clipped_voltage
from bristle.fmu.controller import LinearSlave


class LqgClipped(LinearSlave):
    """Clipped LQG controller: an optimal regulator on an estimate that knows the damper's force."""

    design = "lqg"
    files = ("control/data/lqg.json",)

    def declare_law(self):
        super().declare_law()
        text = "commands of this size or less are not answered"
        self.add_parameter("f_min", 0.5, "N", text, (0.0, 1e9))

    def act(self, y, v, f):
        u = self.command(v)
        self.move(y, f)
        return clipped_voltage(u, f, self.f_min, self.v_max), u
