"""FMU: a dashpot hung from the sky, as well as a damper can play it."""

from math import pi

from bristle.component.controller import SKYHOOK_INVERSE, SKYHOOK_SWITCH
from bristle.fmu.controller import ControllerSlave, declare_inverse, inverse_law


class Skyhook(ControllerSlave):
    """Skyhook controller: damps the absolute velocity of the floor whose acceleration it gets."""

    def declare_law(self):
        super().declare_law()
        text = "one of switch, inverse: 0 or v_max, or any voltage"
        self.add_parameter("kind", "switch", None, text)
        self.add_parameter("gain", 50.0, "N.s/m", "the dashpot's coefficient", (0.0, 1e9))
        text = "the velocity is the acceleration's integral above this frequency"
        self.add_parameter("integral_corner", 0.2, "Hz", text, (1e-4, 1e4))
        declare_inverse(self)

    def law_constants(self):
        kinds = {"switch": SKYHOOK_SWITCH, "inverse": SKYHOOK_INVERSE}
        if self.kind not in kinds:
            raise ValueError(f"kind {self.kind!r} is neither switch nor inverse.")
        corner = 2.0 * pi * self.integral_corner
        numbers = {"kind": kinds[self.kind], "gain": self.gain, "integral_corner": corner}
        return {**inverse_law(self), **numbers}
