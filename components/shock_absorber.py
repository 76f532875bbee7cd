"""FMU: the shock absorber."""

from bristle.fmu.damper import DamperSlave


class ShockAbsorber(DamperSlave):
    """Shock absorber: valves of its own for each direction, gas, seals that rub."""

    law = "shock_absorber"

    def declare(self):
        super().declare()
