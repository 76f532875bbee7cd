"""The bases of controllers and sensors: a clock of their own, ports, the baked-in design.

A sample is taken when a step ends on or passes a sample instant, from the inputs as they stand at
that step: with Gauss-Seidel and the controller after what it measures, these are the values at
the instant, the damper's force with the voltage before. The voltage then stands until the next
sample, whatever is set in between: so no output follows an input, and no loop arises through the
damper, whose force follows the voltage at once.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar
from xml.etree.ElementTree import Element

from ..component import SAMPLED, clock, control_laws, controller
from ..component.control_laws import LARGEST
from ..component.controller_file import Controller, read_controller
from ..errors import BristleError
from ..physics.damper_source import LIBRARY
from ..physics.laws import DEFAULT, DEFAULT_OF_DESIGN, Law, law_code
from .component import ComponentSlave
from .slave import Slave

MEASURED = {
    "floor_acceleration": ("m/s2", "absolute acceleration of the controlled floor"),
    "base_displacement": ("m", "displacement across the damper"),
    "base_velocity": ("m/s", "velocity across the damper"),
    "damper_force": ("N", "force of the damper, positive against +x"),
}
"""Inputs of every controller, in the order in which a sample takes them, with unit and text."""

SAMPLE_PERIOD = 0.002
"""Sample period [s] where no design fixes it."""

_CLOCK_TEXTS = {
    clock.LONG_STEP: (
        "stepped by {step_length:g} s, longer than its sample period of {sample_period:g} s: "
        "samples in between take the inputs as linear, and what they answer shows late."
    ),
    clock.TOO_MANY_SAMPLES: (
        "a step of {step_length:g} s holds too many samples of {sample_period:g} s."
    ),
}


class SampledSlave(ComponentSlave):
    """A component that samples `MEASURED` at t = 0, h, 2h ... and holds its outputs in between."""

    icon = "controller"
    changes = "discrete"
    in_place = True
    texts: ClassVar[dict[int, str]] = _CLOCK_TEXTS
    warns_first: ClassVar[dict[int, int]] = {clock.TOO_MANY_SAMPLES: clock.LONG_STEP}

    def configure(self) -> None:
        super().configure()
        self.state[clock.ORIGIN] = self.time
        self._new_state = self.state  # no step is made twice

    def declare_measured(self) -> None:
        """Declare the inputs."""
        for name, (unit, text) in MEASURED.items():
            self.add_input(name, unit, text, over_step=SAMPLED)

    def declare_period(self, fixed: float | None = None) -> None:
        """Declare the sample period; a design fixes it."""
        text = "sample period, whatever the communication step"
        low, high = (1e-6, 10.0) if fixed is None else (fixed, fixed)
        self.add_parameter("sample_period", fixed or SAMPLE_PERIOD, "s", text, (low, high))

    def declare_law(self) -> None:
        """Declare the sample period and the law's own parameters."""
        self.declare_period()

    def _structure(self, structure: Element) -> None:
        """Say that the first sample follows motion; the damper's force it takes as it is given."""
        super()._structure(structure)
        motion = [index + 1 for index in self._inputs if self.vars[index].name != "damper_force"]
        shown = {str(index + 1) for index in self._outputs}
        for node in structure.iterfind("InitialUnknowns/Unknown"):
            if node.attrib["index"] in shown:
                known = [*motion, *map(int, node.attrib["dependencies"].split())]
                node.set("dependencies", " ".join(map(str, sorted(known))))


class ControllerSlave(SampledSlave):
    """A controller: the ports that all share, limits, and the velocity it works with.

    `law_kind` says which law `component.controller` runs, None where a parameter does. The values
    that it needs are found among the parameters by their names.
    """

    functions: ClassVar[Any] = controller
    law_kind: ClassVar[int | None] = None
    command_unit: ClassVar[str] = "N"

    def declare(self) -> None:
        self.declare_measured()
        self.add_output("voltage", "V", "voltage of the coil, held between samples")
        text = "command before limits and inverse"
        self.add_output("command_raw", self.command_unit, text)
        self.add_output("scheduling", "m/s", "velocity that the law works with")
        self.add_parameter("v_max", 8.0, "V", "largest voltage", (1e-3, 1e4))
        text = "one of direct, filtered: the rate of the low-passed base_displacement"
        words = ("direct", "filtered")
        self.add_parameter("velocity", "direct", None, text, words=words)
        said = "velocity {velocity!r} is neither direct nor filtered."
        self.texts = {**self.texts, controller.NO_VELOCITY: said}  # type: ignore[misc]
        text = "corner frequency of that low-pass"
        self.add_parameter("velocity_corner", 18.0, "Hz", text, (1e-3, 1e5))
        self.declare_law()

    def designed(self) -> Controller | None:
        """Return the design of the state-space law, None where there is none."""
        return None

    def bake(self) -> list[float]:
        names = self.parameter_names()
        known = {law.name: (law_code(law.name), names_of(law)) for law in invertible()}
        laws = known if "inverse" in names else {}
        kind, states = self.law_kind, LIBRARY.slots.law_states
        return controller.bake(names, kind, self.designed(), laws, states)


class LinearSlave(ControllerSlave):
    """A controller whose command comes from a designed state-space law, baked in as a file.

    `design` is the kind of design that it takes; `files` the default, which a build may replace.
    """

    design: ClassVar[str] = ""

    def declare_law(self) -> None:
        self.wrong = ""
        self.controller: Controller | None = None
        try:
            self.controller = read_controller(self.resource(self.design + ".json"))
            if self.controller.kind != self.design:
                self.wrong = f"the controller file is of the kind {self.controller.kind!r}."
        except BristleError as error:  # a fault from initialisation on; here it would be Fatal
            self.wrong = str(error)
        self.declare_period(self.controller.sample_period if self.controller else SAMPLE_PERIOD)

    def declare(self) -> None:
        super().declare()
        if self.controller is not None:
            take_damper(self, self.controller.design.get("damper", {}))

    def designed(self) -> Controller | None:
        if self.wrong:
            raise ValueError(self.wrong)
        return self.controller


def declare_force_threshold(slave: Slave) -> None:
    """Declare the command below which a clipped switch stays off."""
    text = "commands of this size or less are not answered"
    slave.add_parameter("f_min", 0.5, "N", text, (0.0, 1e9))


def declare_anti_windup(slave: Slave, rate: float) -> None:
    """Declare the rate at which the command is led back to what the damper can give."""
    text = "rate at which the command is led back to what is applied; 0: none"
    slave.add_parameter("anti_windup", rate, "1/s", text, (0.0, 1e4))


def invertible() -> list[type[Law]]:
    """Return the laws that can be inverted, the default first."""
    found = [law for law in LIBRARY.slots.laws if law.affine() and law.exact() and not law.felt]
    return sorted(found, key=lambda law: law.name != DEFAULT)


def names_of(law: type[Law]) -> list[str]:
    """Return what a controller calls the parameters of a law that it inverts: `lugre.sigma_a`."""
    return [f"{law.name}.{name}" for name in law.parameters]


def declare_inverse(slave: ControllerSlave) -> None:
    """Declare the law that is inverted and its parameters: `lugre.sigma_a`, `bingham.f_c` ..."""
    laws = invertible()
    words = [law.name for law in laws]
    text = f"the law that is inverted, one of {', '.join(words)}"
    slave.add_parameter("inverse", DEFAULT, None, text, words=words)
    said = f"inverse {{inverse!r}} is neither {' nor '.join(words)}."
    slave.texts = {**slave.texts, controller.NO_INVERSE: said}  # type: ignore[misc]
    for law in laws:
        for name, p in zip(names_of(law), law.parameters.values()):
            slave.add_parameter(name, p.value, p.unit, p.text, p.bounds)
    text = "no voltage below this speed"
    slave.add_parameter("still", control_laws.STILL, "m/s", text, (0.0, 10.0))
    text = "least force per volt that is divided by"
    slave.add_parameter("least_slope", control_laws.LEAST_SLOPE, "N/V", text, (1e-9, 1e9))


def take_damper(slave: LinearSlave, damper: Mapping[str, Any]) -> None:
    """Let largest voltage and inverted law be those of a design's damper.

    A design that names no damper has the default of designs, which the default inverse fits.
    """
    known = {law.name: law for law in invertible()}
    name = str(damper.get("law", ""))
    law = next((one for one in known if name == one or name.startswith(f"{one}_")), "")
    given = damper.get("parameters", {})
    taken: dict[str, Any] = {"v_max": damper.get("v_max")}
    if law:
        declared = known[law].parameters
        own = {key: given.get(key, parameter.value) for key, parameter in declared.items()}
        usual = all(own[key] == parameter.value for key, parameter in declared.items())
        if name != DEFAULT_OF_DESIGN or not usual:
            taken |= {"inverse": law, **{f"{law}.{key}": value for key, value in own.items()}}
    for key, value in taken.items():
        if value is not None and key in slave._index:
            slave._values[slave._index[key]] = value if isinstance(value, str) else float(value)


def declare_trained(slave: LinearSlave) -> None:
    """Let the largest voltage be that of the training where a design is there."""
    if slave.controller is not None:
        slave._values[slave._index["v_max"]] = slave.controller.C[LARGEST]
