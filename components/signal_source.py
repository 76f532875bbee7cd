"""FMU: a test signal for any input."""

from bristle.fmu.component import SignalSlave


class SignalSource(SignalSlave):
    """Test signal: constant, sine, chirp, steps, half sine or the samples of a CSV file."""

    def declare(self):
        self.declare_signal("")
        self.add_output("value", "", "the signal, in the unit of the input that it feeds")
