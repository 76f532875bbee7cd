"""The base of the dampers: ports, parameters and the effects of the site."""

from __future__ import annotations

from typing import Any, ClassVar

from ..component import HELD, damper
from ..physics import damper as laws
from ..physics.drive import Drive, declared_for, drive_named, text_for, unit_for
from ..physics.laws import LAWS
from .component import ComponentSlave

_ABOUT = {
    "voltage": "voltage of the coil",
    "current": "current of the coil",
    "duty": "duty cycle of the amplifier",
    "field": "flux density in the gap",
}


def input_of(channel: str, law: str, drive: Drive) -> str:
    """Return what the input for a measured channel is called.

    As the channel, but where the damper of a law under a command has a parameter of that name.
    """
    own = LAWS[law]
    taken = {*own.parameters, *(f"{state}_0" for state in own.states), drive.limit}
    return f"measured_{channel}" if channel in taken else channel


class DamperSlave(ComponentSlave):
    """A damper of one law, from motion and voltage to the force that resists it."""

    law: ClassVar[str] = ""
    functions: ClassVar[Any] = damper
    hidden = 1  # the friction

    def declare(self) -> None:
        drive = self.drive = drive_named(self.baked.get("drive", ""))
        said = f"the {drive.name} left 0 .. {{{drive.limit}:g}} {drive.unit}; the damper saturates."
        self.texts = {damper.SATURATED: said}  # type: ignore[misc]
        self.description = text_for(self.description or "", drive)
        self.add_input("displacement", "m", "displacement of the rod", over_step=HELD)
        self.add_input("velocity", "m/s", "velocity of the rod", over_step=HELD)
        self.add_input(drive.name, drive.unit, _ABOUT[drive.name], over_step=HELD)
        text = "force that keeps the structure from accelerating; needs moving_mass"
        self.add_input("holding_force", "N", text, over_step=HELD, optional=True)
        text = "acceleration of the rod; else from differences of velocity"
        self.add_input("acceleration", "m/s2", text, over_step=HELD, optional=True)
        follows = ["displacement", "velocity", drive.name, "holding_force", "acceleration"]
        follows += self._add_channels()
        text = "force on the structure, positive against +x"
        jumps = "holding_force" if LAWS[self.law].has("sign") else ""
        self.add_output("force", "N", text, depends=follows, nominal=10.0, jumps_without=jumps)
        text = "integral of force times velocity, stored energy included"
        moved = [name for name in follows if name != drive.name]  # a jump counts from then on
        self.add_output("dissipated_energy", "J", text, depends=moved)
        text = "displacement over stroke: beyond 1 the piston would hit its end"
        self.add_output("stroke_ratio", "1", text, depends=["displacement"])
        for name, parameter in LAWS[self.law].parameters.items():
            self.add_physical(name, declared_for(parameter, drive))
        self.add_parameter("stroke", 0.02, "m", "from the middle to either end", (1e-6, 1e3))
        text = f"largest {drive.name}; the damper saturates"
        self.add_parameter(drive.limit, drive.largest, drive.unit, text, (0.0, 1e4))
        text = "mass that the damper moves; 0: no holding force, sliding law"
        self.add_parameter("moving_mass", 0.0, "kg", text, (0.0, 1e9))
        for name, unit in LAWS[self.law].states.items():
            text = f"start value of the {name.replace('_', ' ')}"
            self.add_parameter(f"{name}_0", 0.0, unit_for(unit, drive), text)
        self.add_effects("damper", self.law)

    def _add_channels(self) -> list[str]:
        """Declare an input for each channel that effects follow; return their names."""
        self.following: dict[str, list[str]] = {}
        self._tracks: list[tuple[int, int]] = []
        for effect in self.offered("damper", self.law):
            for parameter, channel in effect.channels.items():
                name = input_of(channel, self.law, self.drive)
                if name not in self.following:
                    known = effect.parameters[parameter]
                    text = f"{channel.replace('_', ' ')}, which effects of the damper follow"
                    self.add_input(
                        name, known.unit, text, over_step=HELD, start=known.value, optional=True
                    )
                self.following.setdefault(name, []).append(f"{effect.name}.{parameter}")
        return [*self.following]

    def setup(self) -> tuple[Any, list[float], int]:
        self._acceleration = self._index["acceleration"]
        measured = self._acceleration in self._set
        values = self.numbers()
        values["v_max"] = values[self.drive.limit]  # what the functions call any limit
        self._tracks = [
            (laws.SLOTS.parameters[parameter], self._index[name])
            for name, parameters in self.following.items()
            for parameter in parameters
        ]
        return damper.setup(self.law, values, self.effects_on(), measured)

    def _take_channels(self) -> None:
        """Let parameters that follow a channel have its newest value."""
        for slot, index in self._tracks:
            self.constants.setup.p[slot] = self._values[index]

    def _bind(self) -> None:
        """Take the acceleration for measured from the moment on at which a host sets it."""
        self.constants = self.constants._replace(measured=self._acceleration in self._set)

    def advance(self, time: float, step: float) -> None:
        if (self._acceleration in self._set) is not self.constants.measured:
            self._bind()
        self._take_channels()
        super().advance(time, step)

    def refresh(self) -> None:
        if (self._acceleration in self._set) is not self.constants.measured:
            self._bind()
        self._take_channels()
        super().refresh()
