"""FMU: the same voltage all the time."""

from bristle.fmu.slave import Slave


class ConstantVoltage(Slave):
    """Constant voltage for a damper, the simplest of all controllers."""

    def declare(self):
        self.add_parameter("level", 4.0, "V", "the voltage", (-1e3, 1e3))
        self.add_output("voltage", "V", "voltage for the damper")

    def refresh(self):
        self.voltage = self.level
