"""FMU: an H-infinity command through a damper law's inverse."""

from bristle.fmu.controller import DamperInverse, LinearSlave, declare_anti_windup


class HinfInverse(LinearSlave):
    """H-infinity controller: the voltage at which the damper's law gives the commanded force."""

    design = "hinf"
    files = ("control/data/hinf.json",)

    def declare_law(self):
        super().declare_law()
        declare_anti_windup(self, 0.0)
        DamperInverse.declare(self)

    def configure(self):
        super().configure()
        self.inverted = DamperInverse(self)
        self.inverted.configure()

    def rest(self):
        super().rest()
        self.state += DamperInverse.at_rest()  # after the linear law's states

    def act(self, y, v, f):
        u = self.command(v)
        n = self.controller.n
        voltage, applied, self.state[n:] = self.inverted(u, v, self.state[n:])
        self.move(y, self.anti_windup * (applied - u))
        return voltage, u
