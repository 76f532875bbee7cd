"""The file that `bristle new controller NAME` writes."""

TEMPLATE = '''"""FMU: {title}, a controller of my own."""

from math import exp, pi

from bristle.fmu.own_controller import OwnController


class {cls}(OwnController):
    """{title}: brakes the base the more, the faster it moves."""

    # Values that are kept from one sample to the next, 0 at first; () for none.
    memory = ("speed",)

    def declare_law(self):
        super().declare_law()  # the sample period
        # Name, value, SI unit, meaning, bounds. In `command` it is self.NAME; in a scenario
        # parameters = {{ NAME = VALUE }}. A parameter without a unit is "1".
        text = "volts per speed of the base"
        self.add_parameter("gain", 60.0, "V.s/m", text, (0.0, 1e6))
        text = "the speed is low-passed at this frequency"
        self.add_parameter("corner", 10.0, "Hz", text, (1e-3, 1e4))

    # Called at every sample. `measured` has floor_acceleration [m/s2], base_displacement [m],
    # base_velocity [m/s] and damper_force [N]; `memory` has the values of the previous sample.
    # Returns the wanted voltage [V], which is limited to 0 .. v_max, and the new memory.
    # Use only Python 3.9 and its standard library, because the FMU contains this file.
    def command(self, measured, memory):
        share = 1.0 - exp(-2.0 * pi * self.corner * self.sample_period)
        speed = memory.speed + share * (abs(measured.base_velocity) - memory.speed)
        return self.gain * speed, (speed,)
'''


def class_name(name: str) -> str:
    """Return the class, and so the FMU, of a controller's name: MyController of my_controller."""
    return "".join(word[:1].upper() + word[1:] for word in name.split("_"))


def template(name: str) -> str:
    """Return the text of a working file with a controller of this name."""
    title = " ".join(name.split("_")).strip().capitalize()
    return TEMPLATE.format(title=title, cls=class_name(name))
