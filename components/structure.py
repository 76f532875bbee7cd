"""FMU: the building on its isolation, from ground motion and device forces to its response."""

from bristle.fmu.slave import EffectSlave
from bristle.physics.building import from_data, paper_building
from bristle.physics.structure import StructureModel


class Structure(EffectSlave):
    """Building, isolated or fixed, under ground motion and the forces of one or two devices."""

    def declare(self):
        data = self.baked.get("building")
        self.building = from_data(data) if data else paper_building()
        forces = ["damper_force", "extra_force"]
        self.add_input(
            "ground_acceleration", "m/s2", "acceleration of the ground, positive along +x"
        )
        self.add_input("damper_force", "N", "force of the damper, positive against +x")
        text = "force of a second device, positive against +x"
        self.add_input("extra_force", "N", text, optional=True)
        self.first_output = len(self._values)
        levels = self.building.levels()
        coupled = StructureModel(self.building).m.M_inverse
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

    def configure(self):
        building = self.building.with_attached_mass(self.attached_mass)
        self.model = StructureModel(building, self.numbers(), self.effects_on())
        self.ground_before = self.ground_acceleration

    def advance(self, time, step):
        values, at = self._values, self.first_output
        ground, damper, extra = values[0:3]  # the inputs, in the order of their declaration
        self.model.step(step, self.ground_before, ground, damper + extra)
        self.ground_before = ground
        x, n = self.model.x, self.model.m.n
        for i in range(n):
            values[at], values[at + 1] = x[i], x[n + i]
            at += 3
        for i in range(1 if self.model.m.isolated else 0, n):
            values[at] = x[i] - x[i - 1] if i else x[0]
            at += 1

    def refresh(self):
        values, at = self._values, self.first_output + 2
        ground, damper, extra = values[0:3]
        for absolute in self.model.absolute_accelerations(damper + extra):
            values[at] = absolute
            at += 3
        self.holding_force = self.model.holding_force(ground, extra)
        if not self.stepping:  # before the first step the ground has no earlier value
            self.ground_before = ground

    def get_inner(self):
        return [list(self.model.x), list(self.model.z), self.ground_before]

    def set_inner(self, state):
        self.model.x, self.model.z = list(state[0]), list(state[1])
        self.ground_before = state[2]
        self.model.settle()
