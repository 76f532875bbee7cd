"""FMU: the friction damper."""

from bristle.fmu.damper import DamperSlave


class FrictionDamper(DamperSlave):
    """Friction damper: plates that bend before they slip, with play in their joints."""

    law = "friction_damper"

    def declare(self):
        super().declare()
