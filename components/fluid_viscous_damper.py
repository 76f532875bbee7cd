"""FMU: the fluid viscous damper."""

from bristle.fmu.damper import DamperSlave


class FluidViscousDamper(DamperSlave):
    """Fluid viscous damper: a power of the speed, behind a spring."""

    law = "fluid_viscous"

    def declare(self):
        super().declare()
