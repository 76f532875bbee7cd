"""FMU: the building on its isolation, from ground motion and device forces to its response."""

from bristle.component import HELD, LINEAR, structure
from bristle.fmu.component import ComponentSlave
from bristle.physics import structure as laws
from bristle.physics.building import from_data, paper_building


def moves(coupled, device, level):
    """Return whether a device's force accelerates a level, `coupled` (n, n) the inverse of M."""
    n = round(len(coupled) ** 0.5)
    return any(coupled[level * n + end] for end in device.levels if end >= 0)


class Structure(ComponentSlave):
    """Building, isolated or fixed, under ground motion and the forces of devices."""

    icon = "structure"
    functions = structure

    def declare(self):
        data = self.baked.get("building")
        self.building = from_data(data) if data else paper_building()
        forces = ["ground_acceleration", "damper_force", "extra_force"]
        text = "acceleration of the ground, positive along +x"
        self.add_input("ground_acceleration", "m/s2", text, over_step=LINEAR)
        text = "force of the damper, positive against +x"
        devices = self.building.devices  # one that has its own may do without the damper
        self.add_input("damper_force", "N", text, over_step=HELD, optional=bool(devices))
        text = "force of a second device, positive against +x"
        self.add_input("extra_force", "N", text, over_step=HELD, optional=True)
        for device in devices:
            text = f"force of the device {device.name}, positive against its displacement"
            self.add_input(device.ports.force, "N", text, over_step=HELD)
        levels = self.building.levels()
        coupled = laws.matrices(self.building).M_inverse
        for i, level in enumerate(levels):
            self.add_output(level + "_displacement", "m", "relative to the ground", nominal=0.01)
            self.add_output(level + "_velocity", "m/s", "relative to the ground", nominal=0.1)
            depends = forces if coupled[i * len(levels)] else []
            depends = [*depends, *(d.ports.force for d in devices if moves(coupled, d, i))]
            text = "absolute acceleration"
            self.add_output(level + "_acceleration_absolute", "m/s2", text, depends=depends)
        first = 1 if self.building.isolated else 0
        for i in range(first, len(levels)):
            self.add_output(f"drift{i + 1 - first}", "m", "storey drift", nominal=0.01)
        text = (
            "damper force at which the damper's level would not accelerate relative to the ground"
        )
        depends = ["ground_acceleration", "extra_force"]
        depends += [device.ports.force for device in devices if 0 in device.levels]
        self.add_output("holding_force", "N", text, depends=depends)
        for device in devices:
            self.add_motion(device, coupled)
        self.add_parameter("attached_mass", 0.0, "kg", "adds to the damper's level", (0.0, 1e9))
        self.add_effects("structure")
        self.take(self.functions_of(laws.SETS, *self.offered("structure")))

    def add_motion(self, device, coupled):
        """Declare what a device shows: its motion, and the force that would hold it."""
        ports = device.ports
        above = self.building.levels()[device.upper]
        below = self.building.levels()[device.lower] if device.lower >= 0 else "the ground"
        text = f"of {above} relative to {below}"
        self.add_output(ports.displacement, "m", text, nominal=0.01)
        self.add_output(ports.velocity, "m/s", text, nominal=0.1)
        ends = [level for level in device.levels if level >= 0]
        depends = ["ground_acceleration"]
        if any(coupled[i * self.building.size] for i in ends):
            depends += ["damper_force", "extra_force"]
        for other in self.building.devices:
            if other is not device and any(moves(coupled, other, i) for i in ends):
                depends.append(other.ports.force)
        text = f"force of {device.name} at which {above} would not accelerate relative to {below}"
        self.add_output(ports.holding_force, "N", text, depends=depends)

    def bake(self):
        return structure.bake(self.building, self.parameter_names(), self.made.slots)

    def setup(self):
        self._steps = {}
        return super().setup()

    def constants_of(self, step):
        """Return the constants with the matrices of a step [s]; those of the last ones are kept."""
        known = self._steps.get(step)
        if known is None:
            if len(self._steps) >= 8:  # a host with ever new steps must not fill the memory
                self._steps.clear()
            structure.discretise(step, self._store, self._work)
            known = self._steps[step] = structure.constants(self._store)
        return known

    def advance(self, time, step):
        self.constants = self.constants_of(step)
        super().advance(time, step)
