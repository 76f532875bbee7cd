"""FMU: a dashpot hung from the sky, as well as a damper can play it."""

from bristle.component.controller import NO_KIND
from bristle.fmu.controller import ControllerSlave, declare_inverse


class Skyhook(ControllerSlave):
    """Skyhook controller: damps the absolute velocity of the floor whose acceleration it gets."""

    def declare_law(self):
        super().declare_law()
        text = "one of switch, inverse: 0 or v_max, or any voltage"
        self.add_parameter("kind", "switch", None, text, words=("switch", "inverse"))
        self.texts = {**self.texts, NO_KIND: "kind {kind!r} is neither switch nor inverse."}
        self.add_parameter("gain", 50.0, "N.s/m", "the dashpot's coefficient", (0.0, 1e9))
        text = "the velocity is the acceleration's integral above this frequency"
        self.add_parameter("integral_corner", 0.2, "Hz", text, (1e-4, 1e4))
        declare_inverse(self)
