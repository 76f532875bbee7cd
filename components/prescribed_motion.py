"""FMU: a test bench that moves a damper's rod."""

from bristle.fmu.component import SignalSlave


class PrescribedMotion(SignalSlave):
    """Prescribed motion of a test bench: displacement as a test signal, velocity its derivative.

    Before and after the samples of a CSV the rod stands still where the nearest of them is.
    """

    rated = True

    def declare(self):
        self.declare_signal("m")
        self.add_output("displacement", "m", "displacement of the rod")
        self.add_output("velocity", "m/s", "velocity of the rod")
