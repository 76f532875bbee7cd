"""FMU: the building on its isolation, from ground motion and device forces to its response."""

from bristle.component import HELD, LINEAR, structure
from bristle.fmu.component import ComponentSlave
from bristle.physics.building import from_data, paper_building
from bristle.physics.structure import matrices


class Structure(ComponentSlave):
    """Building, isolated or fixed, under ground motion and the forces of one or two devices."""

    functions = structure

    def declare(self):
        data = self.baked.get("building")
        self.building = from_data(data) if data else paper_building()
        forces = ["ground_acceleration", "damper_force", "extra_force"]
        text = "acceleration of the ground, positive along +x"
        self.add_input("ground_acceleration", "m/s2", text, over_step=LINEAR)
        text = "force of the damper, positive against +x"
        self.add_input("damper_force", "N", text, over_step=HELD)
        text = "force of a second device, positive against +x"
        self.add_input("extra_force", "N", text, over_step=HELD, optional=True)
        levels = self.building.levels()
        coupled = matrices(self.building).M_inverse
        for i, level in enumerate(levels):
            self.add_output(level + "_displacement", "m", "relative to the ground", nominal=0.01)
            self.add_output(level + "_velocity", "m/s", "relative to the ground", nominal=0.1)
            depends = forces if coupled[i * len(levels)] else []
            text = "absolute acceleration"
            self.add_output(level + "_acceleration_absolute", "m/s2", text, depends=depends)
        first = 1 if self.building.isolated else 0
        for i in range(first, len(levels)):
            self.add_output(f"drift{i + 1 - first}", "m", "storey drift", nominal=0.01)
        text = (
            "damper force at which the damper's level would not accelerate relative to the ground"
        )
        depends = ["ground_acceleration", "extra_force"]
        self.add_output("holding_force", "N", text, depends=depends)
        self.add_parameter("attached_mass", 0.0, "kg", "adds to the damper's level", (0.0, 1e9))
        self.add_effects("structure")

    def setup(self):
        self._steps = {}
        building = self.building.with_attached_mass(self.attached_mass)
        return structure.setup(building, self.numbers(), self.effects_on())

    def advance(self, time, step):
        known = self._steps.get(step)
        if known is None:
            if len(self._steps) >= 8:  # a host with ever new steps must not fill the memory
                self._steps.clear()
            known = self._steps[step] = structure.discretise(step, self.constants)
        self.constants = known
        super().advance(time, step)
