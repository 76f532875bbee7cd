"""FMU: the same voltage all the time."""

from bristle.component import source
from bristle.fmu.component import SourceSlave


class ConstantVoltage(SourceSlave):
    """Constant voltage for a damper, the simplest of all controllers."""

    changes = "discrete"

    def declare(self):
        self.add_parameter("level", 4.0, "V", "the voltage", (-1e3, 1e3))
        self.add_output("voltage", "V", "voltage for the damper")

    def bake(self):
        return source.bake_constant(self.parameter_names())
