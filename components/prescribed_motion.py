"""FMU: a test bench that moves a damper's rod."""

from bristle.fmu.source import SignalSlave
from bristle.physics.signals import STEPS, rate, value


class PrescribedMotion(SignalSlave):
    """Prescribed motion of a test bench: displacement as a test signal, velocity its derivative."""

    def declare(self):
        self.declare_signal("m")
        self.add_output("displacement", "m", "displacement of the rod")
        self.add_output("velocity", "m/s", "velocity of the rod")

    def configure(self):
        super().configure()
        if self.code == STEPS:
            raise ValueError(
                "kind 'steps' jumps: no velocity fits it. Take csv with ramps instead."
            )

    def refresh(self):
        signal = self.numbers, self.times, self.samples
        self.displacement = value(self.code, self.time, *signal)
        self.velocity = rate(self.code, self.time, *signal)
