"""FMU: a test signal for any input."""

from bristle.fmu.source import SignalSlave
from bristle.physics.signals import value


class SignalSource(SignalSlave):
    """Test signal: constant, sine, chirp, steps, half sine or the samples of a CSV file."""

    def declare(self):
        self.declare_signal("")
        self.add_output("value", "", "the signal, in the unit of the input that it feeds")

    def refresh(self):
        self.value = value(self.code, self.time, self.numbers, self.times, self.samples)
