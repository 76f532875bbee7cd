"""FMU: what instruments make of the signals that a controller gets."""

from bristle.component import sensors
from bristle.fmu.controller import MEASURED, SampledSlave


class Sensors(SampledSlave):
    """Sensors: bias, gain, noise, quantisation, delay and cut-off on each measured channel."""

    icon = "sensors"
    functions = sensors

    def declare(self):
        self.declare_measured()
        self.declare_period()
        self.add_parameter("seed", 1, None, "chooses the noise", (0, 2**31 - 1))
        for name, (unit, text) in MEASURED.items():
            self.add_output(name + "_measured", unit, text + ", as the instrument shows it")
        for name, (unit, _) in MEASURED.items():
            self.add_parameter(name + ".gain", 1.0, "1", "multiplies the signal", (-1e6, 1e6))
            self.add_parameter(name + ".bias", 0.0, unit, "adds to it", (-1e9, 1e9))
            text = f"white noise, root of its one-sided spectral density [{unit} per root of Hz]"
            self.add_parameter(name + ".noise_density", 0.0, None, text, (0.0, 1e9))
            text = "step between two readings; 0: none"
            self.add_parameter(name + ".quantisation", 0.0, unit, text, (0.0, 1e9))
            self.add_parameter(name + ".delay", 0.0, "s", "the reading lags so much", (0.0, 10.0))
            text = "corner of a first-order low-pass before sampling; 0: none"
            self.add_parameter(name + ".cut_off", 0.0, "Hz", text, (0.0, 1e6))

    def bake(self):
        return sensors.bake(self.parameter_names(), list(MEASURED))
