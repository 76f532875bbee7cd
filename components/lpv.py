"""FMU: the controller that is scheduled by the base velocity."""

from bristle.control.switching import applied_signed, signed_voltage
from bristle.fmu.controller import LinearSlave, declare_anti_windup


class Lpv(LinearSlave):
    """Linear parameter-varying controller: a signed voltage, scheduled by the base velocity."""

    design = "lpv"
    command_unit = "V"
    files = ("control/data/lpv.json",)

    def declare_law(self):
        super().declare_law()
        declare_anti_windup(self, 200.0)

    def act(self, y, v, f):
        w = self.command(v)
        voltage = signed_voltage(w, v, self.v_max)
        self.move(y, self.anti_windup * (applied_signed(voltage, v) - w))
        return voltage, w
