"""The base of the dampers: ports, parameters and the effects of the site."""

from __future__ import annotations

from typing import Any, ClassVar

from ..component import HELD, damper
from ..physics import damper as laws
from ..physics.damper import refusals
from ..physics.drive import Drive, declared_for, drive_named, text_for, unit_for
from ..physics.generate import Functions
from ..physics.laws import LAWS
from .component import OUTSIDE, ComponentSlave

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

    icon = "damper"
    law: ClassVar[str] = ""
    functions: ClassVar[Any] = damper

    def declare(self) -> None:
        ranged = self.baked.get("ranged", False)
        self.hidden = 1 if ranged else 2  # the friction; and how far outside of unknown data it is
        drive = self.drive = drive_named(self.baked.get("drive", ""))
        offered = self.offered("damper", self.law)
        self.take(self.functions_of(laws.SETS, LAWS[self.law].base, *offered))
        lines = text_for(self.description or "", drive), self.baked.get("about", "")
        self.description = " ".join(one for one in lines if one)
        self.add_input("displacement", "m", "displacement of the rod", over_step=HELD)
        self.add_input("velocity", "m/s", "velocity of the rod", over_step=HELD)
        commanded = LAWS[self.law].has("command")
        about = _ABOUT[drive.name] if commanded else "not used by this law"
        self.add_input(drive.name, drive.unit, about, over_step=HELD, optional=not commanded)
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
        if ranged:
            text = (
                "0 within the range of the data that the model is from; else what the worst of "
                f"displacement, speed and {drive.name} exceeds it by: 0.3 is 30 % of half the "
                f"stroke, of the speed, of the largest {drive.name}"
            )
            moved = ["displacement", "velocity", drive.name]
            self.add_output(OUTSIDE, "1", text, depends=moved)
        for name, parameter in LAWS[self.law].parameters.items():
            self.add_physical(name, declared_for(parameter, drive))
        self.add_parameter("stroke", 0.02, "m", "from the middle to either end", (1e-6, 1e3))
        text = f"largest {drive.name}; the damper saturates"
        self.add_parameter(drive.limit, drive.largest, drive.unit, text, (0.0, 1e4))
        text = "mass that the damper moves; 0: no holding force, sliding law"
        self.add_parameter("moving_mass", 0.0, "kg", text, (0.0, 1e9))
        if ranged:
            self._add_range(drive)
        for name, unit in LAWS[self.law].states.items():
            text = f"start value of the {name.replace('_', ' ')}"
            self.add_parameter(f"{name}_0", 0.0, unit_for(unit, drive), text)
        self.add_effects("damper", self.law)

    def _add_range(self, drive: Drive) -> None:
        """Declare the range of the data, wide open until it is told."""
        units = "m", "m", "m/s", drive.unit, drive.unit
        texts = (
            "lowest displacement of the data", "highest displacement of the data",
            "highest speed of the data", f"lowest {drive.name} of the data",
            f"highest {drive.name} of the data",
        )  # fmt: skip
        for name, unit, text in zip(damper.RANGE, units, texts):
            start = -damper.WIDE if name.endswith("_low") else damper.WIDE
            least = 1e-9 if name == "range.speed" else -damper.WIDE
            self.add_parameter(name, start, unit, text, (least, damper.WIDE))

    def take(self, made: Functions) -> None:
        super().take(made)
        drive = self.drive
        said = f"the {drive.name} left 0 .. {{{drive.limit}:g}} {drive.unit}; the damper saturates."
        self.texts = {damper.SATURATED: said, **refusals(made.slots)}  # type: ignore[misc]

    def _add_channels(self) -> list[str]:
        """Declare an input for each channel that effects follow; return their names."""
        self.following: dict[str, list[str]] = {}
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

    def bake(self) -> list[float]:
        ports = {self.vars[index].name: k for k, index in enumerate(self._inputs)}
        tracks = [
            (parameter, ports[name])
            for name, parameters in self.following.items()
            for parameter in parameters
        ]
        return damper.bake(self.law, self.known_names(), tracks, self.made.slots)

    def setup(self) -> tuple[Any, list[float], int]:
        self._acceleration = self._index["acceleration"]
        on = tuple(f"{name}." for name in self.effects_on())
        tracked = (one for parameters in self.following.values() for one in parameters)
        self._follows = any(one.startswith(on) for one in tracked)
        return super().setup()

    def known_names(self) -> list[str]:
        """Return the names of all parameters in their order, as law and effects know them."""
        limit = self.drive.limit  # what the functions call v_max, whatever the command
        return [
            "v_max" if name == limit else self._called.get(name, name)
            for name in self.parameter_names()
        ]

    def _bind(self) -> None:
        """Take the acceleration into account from the moment on at which a host sets it."""
        damper.bind(self.inputs_set(), self._store)
        self.constants = damper.constants(self._store)

    def _update(self) -> None:
        """Take over what follows the inputs and who has set them."""
        if (self._acceleration in self._set) is not self.constants.measured:
            self._bind()
        if self._follows:
            damper.follow(self._values[self._first : self._after], self.constants)

    def advance(self, time: float, step: float) -> None:
        self._update()
        super().advance(time, step)

    def refresh(self) -> None:
        self._update()
        super().refresh()
