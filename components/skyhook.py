"""FMU: a dashpot hung from the sky, as well as a damper can play it."""

from math import pi

from bristle.control.sensing import leaky_integral, skyhook_command, skyhook_switch
from bristle.fmu.controller import ControllerSlave, DamperInverse


class Skyhook(ControllerSlave):
    """Skyhook controller: damps the absolute velocity of the floor whose acceleration it gets."""

    def declare_law(self):
        super().declare_law()
        text = "one of switch, inverse: 0 or v_max, or any voltage"
        self.add_parameter("kind", "switch", None, text)
        self.add_parameter("gain", 50.0, "N.s/m", "the dashpot's coefficient", (0.0, 1e9))
        text = "the velocity is the acceleration's integral above this frequency"
        self.add_parameter("integral_corner", 0.2, "Hz", text, (1e-4, 1e4))
        DamperInverse.declare(self)

    def configure(self):
        super().configure()
        if self.kind not in ("switch", "inverse"):
            raise ValueError(f"kind {self.kind!r} is neither switch nor inverse.")
        self.inverted = DamperInverse(self)
        self.inverted.configure()

    def rest(self):
        super().rest()
        # Absolute velocity, acceleration before, states of the law.
        self.state = [0.0, 0.0, *DamperInverse.at_rest()]

    def act(self, y, v, f):
        absolute, before, *z = self.state
        corner = 2.0 * pi * self.integral_corner
        absolute = leaky_integral(absolute, before, y, corner, self.sample_period)
        u = skyhook_command(absolute, self.gain)
        voltage, _, z = self.inverted(u, v, z)
        self.state = [absolute, y, *z]
        if self.kind == "switch":
            voltage = skyhook_switch(absolute, v, self.v_max)
        return voltage, u
