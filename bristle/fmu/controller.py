"""The base of controllers and instruments: a clock of their own, ports, the baked-in design.

A sample is taken when a step ends on or passes a sample instant, from the inputs as they stand at
that step: with Gauss-Seidel and the controller after what it measures, these are the values at
the instant, the damper's force with the voltage before. The voltage then stands until the next
sample, whatever is set in between: so no output follows an input, and no loop arises through the
damper, whose force follows the voltage at once.
"""

from __future__ import annotations

from math import ceil, floor, pi
from typing import Any, ClassVar
from xml.etree.ElementTree import Element

from ..control import inverse, linear
from ..control.controller import Controller, read_controller
from ..control.sensing import filtered_velocity, low_passed
from ..errors import BristleError
from ..physics import damper
from ..physics.laws import DEFAULT, LAWS, Law, law_code, laws_of
from .slave import Slave

MEASURED = {
    "floor_acceleration": ("m/s2", "absolute acceleration of the controlled floor"),
    "base_displacement": ("m", "displacement across the damper"),
    "base_velocity": ("m/s", "velocity across the damper"),
    "damper_force": ("N", "force of the damper, positive against +x"),
}
"""Inputs of every controller, in the order in which `sample` gets them, with unit and text."""

SAMPLE_PERIOD = 0.002
"""Sample period [s] where no design fixes it."""

_ROUNDING = 1e-6
"""Share of a sample period by which a step's end may miss an instant."""
_MOST_SAMPLES = 1_000_000
"""Samples in one step beyond which the step is taken for a mistake."""


class SampledSlave(Slave):
    """A component that samples `MEASURED` at t = 0, h, 2h ... and holds its outputs in between.

    A component fills `sample`, which answers with the outputs in the order of their declaration,
    `rest`, and `get_law`, `set_law` for its state.
    """

    def declare_measured(self) -> None:
        """Declare the inputs."""
        for name, (unit, text) in MEASURED.items():
            self.add_input(name, unit, text)

    def declare_period(self, fixed: float | None = None) -> None:
        """Declare the sample period; a design fixes it."""
        text = "sample period, whatever the communication step"
        low, high = (1e-6, 10.0) if fixed is None else (fixed, fixed)
        self.add_parameter("sample_period", fixed or SAMPLE_PERIOD, "s", text, (low, high))

    def rest(self) -> None:
        """Put the law's state to where it is before the first sample."""

    def sample(self, k: int, measured: list[float]) -> list[float]:
        """Return the outputs after sample k of what `MEASURED` names, and move the state on."""
        raise NotImplementedError

    def get_law(self) -> Any:
        """Return a copy of the law's state."""
        return None

    def set_law(self, state: Any) -> None:
        """Take a copy of the law's state."""

    def configure(self) -> None:
        self.origin = self.time
        self.samples = 0
        self.measured = self._measure()
        self.shown: list[float] = [0.0] * len(self._outputs)

    def _measure(self) -> list[float]:
        return [self._values[index] for index in self._inputs]

    def advance(self, time: float, step: float) -> None:
        h = self["sample_period"]
        if step > h * (1.0 + _ROUNDING):
            self.warn_once(
                f"stepped by {step:g} s, longer than its sample period of {h:g} s: samples in "
                "between take the inputs as linear, and what they answer shows late."
            )
        before, now = self.measured, self._measure()
        last = floor((time + step - self.origin) / h + _ROUNDING)
        if last - self.samples > _MOST_SAMPLES:
            raise ValueError(f"{last - self.samples} samples in a step of {step:g} s.")
        first = ceil((time - self.origin) / h - _ROUNDING)
        for k in range(max(self.samples, first), last + 1):
            share = (self.origin + k * h - time) / step
            if share > 1.0 - _ROUNDING * h / step:
                at = now
            else:
                at = [a + max(share, 0.0) * (b - a) for a, b in zip(before, now)]
            self.shown = self.sample(k, at)
            self.samples = k + 1
        self.measured = now

    def refresh(self) -> None:
        if not self.stepping:  # the sample at t = 0 follows its inputs until the first step
            self.origin = self.time
            self.measured = self._measure()
            self.rest()
            self.shown = self.sample(0, self.measured)
            self.samples = 1
        for index, value in zip(self._outputs, self.shown):
            self._values[index] = value

    def _structure(self, structure: Element) -> None:
        """Say that the first sample follows motion; the damper's force it takes as it is given."""
        super()._structure(structure)
        motion = [index + 1 for index in self._inputs if self.vars[index].name != "damper_force"]
        shown = {str(index + 1) for index in self._outputs}
        for node in structure.iterfind("InitialUnknowns/Unknown"):
            if node.attrib["index"] in shown:
                known = [*motion, *map(int, node.attrib["dependencies"].split())]
                node.set("dependencies", " ".join(map(str, sorted(known))))

    def get_inner(self) -> Any:
        clock = [self.origin, self.samples, list(self.measured), list(self.shown)]
        return [clock, self.get_law()]

    def set_inner(self, state: Any) -> None:
        (self.origin, self.samples, measured, shown), law = state
        self.measured, self.shown = list(measured), list(shown)
        self.rest()
        self.set_law(law)


class ControllerSlave(SampledSlave):
    """A controller: the ports that all share, limits, and the velocity it works with.

    A component fills `act`; its own state goes into the list `self.state`.
    """

    command_unit: ClassVar[str] = "N"

    def declare(self) -> None:
        self.declare_measured()
        self.add_output("voltage", "V", "voltage of the coil, held between samples")
        text = "command before limits and inverse"
        self.add_output("command_raw", self.command_unit, text)
        self.add_output("scheduling", "m/s", "velocity that the law works with")
        self.add_parameter("v_max", 8.0, "V", "largest voltage", (1e-3, 1e4))
        text = "one of direct, filtered: the rate of the low-passed base_displacement"
        self.add_parameter("velocity", "direct", None, text)
        text = "corner frequency of that low-pass"
        self.add_parameter("velocity_corner", 18.0, "Hz", text, (1e-3, 1e5))
        self.declare_law()

    def declare_law(self) -> None:
        """Declare the sample period and the law's own parameters."""
        self.declare_period()

    def act(self, y: float, v: float, f: float) -> tuple[float, float]:
        """Return voltage [V] and raw command at floor acceleration, velocity, damper force."""
        raise NotImplementedError

    def configure(self) -> None:
        super().configure()
        if self["velocity"] not in ("direct", "filtered"):
            raise ValueError(f"velocity {self.velocity!r} is neither direct nor filtered.")
        self.rest()

    def rest(self) -> None:
        self.state: list[float] = []
        self.low = [0.0, 0.0]  # low-passed displacement, displacement, at the last sample

    def sample(self, k: int, measured: list[float]) -> list[float]:
        y, x, v, f = measured
        if self["velocity"] == "filtered":
            corner = 2.0 * pi * self["velocity_corner"]
            if k == 0:  # nothing is known of the past: the filter has settled
                self.low = [x, x]
            low = low_passed(self.low[0], self.low[1], x, corner, self["sample_period"])
            self.low = [low, x]
            v = filtered_velocity(low, x, corner)
        voltage, command = self.act(y, v, f)
        return [voltage, command, v]

    def get_law(self) -> Any:
        return [list(self.state), list(self.low)]

    def set_law(self, state: Any) -> None:
        self.state, self.low = list(state[0]), list(state[1])


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

    def configure(self) -> None:
        if self.wrong or self.controller is None:
            raise ValueError(self.wrong)
        super().configure()
        self.spare = [0.0] * self.controller.n

    def rest(self) -> None:
        super().rest()
        assert self.controller is not None
        self.state = [0.0] * self.controller.n
        self.row = 0

    def command(self, v: float) -> float:
        """Return the command at velocity v [m/s]."""
        c = self.controller
        assert c is not None
        self.row = linear.table_row(v, c.v_top, c.rows) if c.rows > 1 else 0
        return linear.command(c.n, c.C, self.row, self.state)

    def move(self, y: float, second: float) -> None:
        """Move the state on by a sample, given the floor acceleration and the second input."""
        c = self.controller
        assert c is not None
        linear.advance(c.n, c.A, c.B, c.W, self.row, self.state, y, second, self.spare)


def declare_anti_windup(slave: Slave, rate: float) -> None:
    """Declare the rate at which the command is led back to what the damper can give."""
    text = "rate at which the command is led back to what is applied; 0: none"
    slave.add_parameter("anti_windup", rate, "1/s", text, (0.0, 1e4))


def invertible() -> list[type[Law]]:
    """Return the laws that can be inverted, the default first."""
    found = [law for law in laws_of("damper") if law.affine() and law.exact()]
    return sorted(found, key=lambda law: law.name != DEFAULT)


class DamperInverse:
    """The voltage of a commanded force, by a law's inverse, as parameters of a component.

    Parameters are named `lugre.sigma_a`, `bingham.f_c` ...; `z` are the law's states that the
    controller estimates, as `at_rest` begins them.
    """

    def __init__(self, slave: Slave) -> None:
        self.slave = slave

    @staticmethod
    def declare(slave: Slave) -> None:
        """Declare the parameters."""
        laws = invertible()
        text = f"the law that is inverted, one of {', '.join(law.name for law in laws)}"
        slave.add_parameter("inverse", DEFAULT, None, text)
        for law in laws:
            for name, p in law.parameters.items():
                slave.add_parameter(f"{law.name}.{name}", p.value, p.unit, p.text, p.bounds)
        text = "no voltage below this speed"
        slave.add_parameter("still", inverse.STILL, "m/s", text, (0.0, 10.0))
        text = "least force per volt that is divided by"
        slave.add_parameter("least_slope", inverse.LEAST_SLOPE, "N/V", text, (1e-9, 1e9))

    @staticmethod
    def at_rest() -> list[float]:
        """Return the states before the first sample, as many as the largest law has."""
        return [0.0] * damper.SLOTS.law_states

    def configure(self) -> None:
        """Read the parameters; ValueError where the law is not known."""
        chosen = self.slave["inverse"]
        names = [law.name for law in invertible()]
        if chosen not in names:
            raise ValueError(f"inverse {chosen!r} is neither {' nor '.join(names)}.")
        self.law = law_code(chosen)
        self.p = [self.slave[f"{chosen}.{name}"] for name in LAWS[chosen].parameters]
        self.limits = tuple(self.slave[name] for name in ("still", "least_slope", "v_max"))

    def __call__(
        self, command: float, v: float, z: list[float]
    ) -> tuple[float, float, list[float]]:
        """Return voltage [V], the force [N] it gives by the law, and the states a sample later."""
        voltage = inverse.voltage_of_law(self.law, self.p, command, v, z, *self.limits)
        applied = inverse.force_of_law(self.law, self.p, v, voltage, z)
        later = list(z)
        inverse.estimate_states(self.law, self.p, v, voltage, self.slave["sample_period"], later)
        return voltage, applied, later
