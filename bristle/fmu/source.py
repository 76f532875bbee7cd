"""The base of components that play a test signal."""

from __future__ import annotations

from ..physics.record import read_two_column
from ..physics.signals import CSV, KINDS, PARAMETERS, STEPS, read_steps
from .slave import Slave


class SignalSlave(Slave):
    """Parameters of a test signal, and what follows from them."""

    def declare_signal(self, unit: str) -> None:
        """Declare the parameters of a signal in this unit."""
        self.add_parameter("kind", "constant", None, "one of " + ", ".join(KINDS))
        for name, parameter in PARAMETERS.items():
            own = parameter.unit or unit
            self.add_parameter(name, parameter.value, own, parameter.text, parameter.bounds)
        self.add_parameter("steps", "0:0", None, "TIME:VALUE pairs of the kind steps")
        text = "two-column CSV of the kind csv, its header `time [s],NAME [UNIT]`"
        self.add_parameter("file", "", None, text)

    def configure(self) -> None:
        if self["kind"] not in KINDS:
            raise ValueError("kind {!r} is none of {}.".format(self["kind"], ", ".join(KINDS)))
        self.code = KINDS[self["kind"]]
        self.numbers: list[float] = [self[name] for name in PARAMETERS]
        self.times, self.samples = [0.0], [0.0]
        if self.code == STEPS:
            self.times, self.samples = read_steps(self["steps"])
        elif self.code == CSV:
            self.times, self.samples = read_two_column(self["file"], header=None)
