"""The bases of components that play a signal."""

from __future__ import annotations

from typing import Any, ClassVar, Optional

from ..component import source
from ..physics.record import read_two_column
from ..physics.signals import KINDS, PARAMETERS, read_steps
from .component import ComponentSlave, Played, Reading

_output = source.output


class SourceSlave(ComponentSlave):
    """A component whose outputs depend on time alone.

    Its samples come from a CSV that `file_of` names, whose header is `header` (None: `time [s]` and
    any other), or from TIME:VALUE pairs in `pairs_of`.
    """

    functions: ClassVar[Any] = source
    file_of: ClassVar[Optional[Reading]] = None  # noqa: UP045 (read by Python 3.9)
    pairs_of: ClassVar[Optional[Reading]] = None  # noqa: UP045
    header: ClassVar[Optional[str]] = None  # noqa: UP045

    def played(self) -> list[Played]:
        return [Played(self.file_of, self.pairs_of, self.header)]

    def samples(self) -> tuple[list[float], list[float]]:
        """Return times [s] and values of what the component plays, from its parameters."""
        if self.file_of and self._is_read(self.file_of):
            name = self[self.file_of.parameter]
            file = self.resource(f"{name}.csv") if name in self.bundled() else name
            return read_two_column(file, header=self.header)
        if self.pairs_of and self._is_read(self.pairs_of):
            return read_steps(self[self.pairs_of.parameter])
        return [0.0], [0.0]

    def _is_read(self, reading: Reading) -> bool:
        return not reading.chooser or self[reading.chooser] == reading.word

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
    file_of = Reading("file", "kind", "csv")
    pairs_of = Reading("steps", "kind", "steps")
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

    def bundled(self) -> list[str]:
        name = self.baked.get("samples")
        return [name] if name else []
