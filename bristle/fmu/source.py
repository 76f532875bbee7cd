"""The bases of components that play a signal."""

from __future__ import annotations

from typing import Any, ClassVar

from ..component import source
from ..physics.record import read_two_column
from ..physics.signals import CSV, KINDS, PARAMETERS, STEPS, read_steps
from .component import ComponentSlave

_output = source.output


class SourceSlave(ComponentSlave):
    """A component whose outputs depend on time alone."""

    functions: ClassVar[Any] = source

    def made_constants(self) -> Any:
        times, samples = self.samples()
        if code := source.scale_samples(times, samples, self._store):
            self.tell(code, self.time, 0.0)
        return source.constants(self._store, times, samples)

    def advance(self, time: float, step: float) -> None:
        """Keep nothing: what a step would show, `refresh` does."""

    def configure(self) -> None:
        super().configure()
        # A source computes so little that looking things up would show: they lie in one tuple, and
        # the constants in a plain one, which Python takes apart faster than a named one.
        shown = slice(self._shown_first, self._shown_after)
        constants: Any = tuple(self.constants)
        self._bound = self._given, constants, self._values, shown

    def refresh(self) -> None:
        given, constants, values, shown = self._bound
        _output(self.time, given, constants, given, given, given)
        values[shown] = given


class SignalSlave(SourceSlave):
    """Parameters of a test signal, and what follows from them."""

    rated = False
    texts: ClassVar[dict[int, str]] = {
        source.NO_KIND: f"kind {{kind!r}} is none of {', '.join(KINDS)}.",
        source.JUMPS: ("kind 'steps' jumps: no velocity fits it. Take csv with ramps instead."),
    }

    def declare_signal(self, unit: str) -> None:
        """Declare the parameters of a signal in this unit, "" for that of whatever it feeds."""
        text = "one of " + ", ".join(KINDS)
        self.add_parameter("kind", "constant", None, text, words=KINDS)
        for name, parameter in PARAMETERS.items():
            own = parameter.unit or unit
            text = parameter.text if own else parameter.text + ", in the unit of the input"
            self.add_parameter(name, parameter.value, own, text, parameter.bounds)
        self.add_parameter("steps", "0:0", None, "TIME:VALUE pairs of the kind steps")
        text = "two-column CSV of the kind csv, its header `time [s],NAME [UNIT]`"
        self.add_parameter("file", self.baked.get("samples", ""), None, text)

    def bake(self) -> list[float]:
        return source.bake_signal(self.parameter_names(), self.rated)

    def samples(self) -> tuple[list[float], list[float]]:
        code = KINDS.get(self["kind"])
        if code == STEPS:
            return read_steps(self["steps"])
        if code == CSV:
            baked = self["file"] and self["file"] == self.baked.get("samples")
            file = self.resource(f"{self['file']}.csv") if baked else self["file"]
            return read_two_column(file, header=None)
        return [0.0], [0.0]
