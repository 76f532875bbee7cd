"""The base of components whose computing is pure functions: it calls them as a host steps.

See `bristle.component` for the functions. The texts of their codes live in the component's class.
"""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple, Optional

from ..component import source
from ..physics.drive import VOLTAGE, declared_for, states_for, text_for, unit_for
from ..physics.effect import Effect, effects_of
from ..physics.generate import Functions, Owner, Sets
from ..physics.motion_file import ANY_HEADER, read_two_column
from ..physics.parameter import Parameter
from ..physics.signals import KINDS, PARAMETERS, read_steps
from .slave import STEPPING, Slave

SWITCH = ".on"
"""What the name of an effect's switch ends with."""

OUTSIDE = "outside"
"""The output of a damper that knows the range of its data: see `component.damper.outside`."""


class EffectSlave(Slave):
    """A component that offers the effects of its site, each with a switch and its parameters."""

    drive = VOLTAGE
    """What commands the damper."""
    functions: ClassVar[Any]

    def add_effects(self, site: str, law: str = "") -> None:
        """Declare `EFFECT.on`, `EFFECT.PARAMETER`, `EFFECT.STATE_0` for the effects of a site."""
        self._called: dict[str, str] = {}
        self._effects = self.offered(site, law)
        for effect in self._effects:
            about = text_for(effect.first_line(), self.drive)
            self.add_parameter(effect.name + SWITCH, False, None, about)
            for name, parameter in effect.parameters.items():
                if name in effect.channels:
                    continue  # an input
                self.add_physical(f"{effect.name}.{name}", declared_for(parameter, self.drive))
            for name, called in states_for(effect.states, self.drive).items():
                unit = effect.states[name]
                text = f"start value of the state {called}"
                start = f"{effect.name}.{called}_0"
                if called != name:
                    self._called[start] = f"{effect.name}.{name}_0"
                self.add_parameter(start, 0.0, unit_for(unit, self.drive), text)

    def offered(self, site: str, law: str = "") -> tuple[type[Effect], ...]:
        """Return the effects that the component offers at a site."""
        own = self.baked.get("own", [])  # a user's, in this process; an FMU's are its library's
        only = self.baked.get("effects")
        return tuple(
            effect
            for effect in effects_of(site, law)
            if (not effect.own or effect.name in own) and (only is None or effect.name in only)
        )

    def functions_of(self, sets: Sets, *owners: Owner) -> Functions:
        """Return the functions of what is offered; all of a library only where nobody chose."""
        return (sets.offering if self.baked.get("effects") is None else sets.of)(*owners)

    def take(self, made: Functions) -> None:
        """Compute with the functions of a set of laws and effects."""
        self.made = made
        self.functions = made.link.all_of(type(self).functions)  # type: ignore[misc]

    def add_physical(self, name: str, parameter: Parameter) -> None:
        """Declare a parameter of a law or effect."""
        value = float(parameter.value)  # one that was declared as 0 is no Integer
        self.add_parameter(name, value, parameter.unit, parameter.text, parameter.bounds)

    def effects_on(self) -> list[str]:
        """Return the names of the effects that are switched on."""
        return [effect.name for effect in self._effects if self[effect.name + SWITCH]]

    def numbers(self) -> dict[str, float]:
        """Return every Real parameter by its full name, as laws and effects know it."""
        names = ((self.vars[index].name, self._values[index]) for index in self._parameters)
        return {
            self._called.get(name, name): value for name, value in names if isinstance(value, float)
        }


class SampleFile(NamedTuple):
    """A parameter, a text, that samples are read from where another one is a certain word.

    Without a `chooser` it always is.
    """

    parameter: str
    chooser: str = ""
    word: str = ""


class Played(NamedTuple):
    """What samples of a signal are read from: a CSV, or TIME:VALUE pairs; None: never from that.

    The CSV's header is `header`, as `motion_file` has them.
    """

    file: Optional[SampleFile]  # noqa: UP045 (read by Python 3.9)
    pairs: Optional[SampleFile]  # noqa: UP045
    header: str


_show = source.output

STEP_LENGTH = "step_length"
"""What a text calls the length of the step [s]."""


class _Told:
    """The values that texts name."""

    def __init__(self, slave: Slave, step: float) -> None:
        self.slave, self.step = slave, step

    def __getitem__(self, name: str) -> Any:
        return self.step if name == STEP_LENGTH else self.slave[name]


class ComponentSlave(EffectSlave):
    """A component made of ports, functions and texts.

    A component fills `bake`; `functions` has `sizes`, `setup`, `constants`, `start`, `step` and
    `output`; `texts` tells what a code means, with parameters in braces, `warns_first` which
    warning comes before that of a code. `hidden` outputs have no port.
    """

    texts: ClassVar[dict[int, str]] = {}
    warns_first: ClassVar[dict[int, int]] = {}
    hidden = 0
    in_place: ClassVar[bool] = False
    """Whether a step moves the state on where it lies, as no step is made twice."""

    def bake(self) -> list[float]:
        """Return what the build fixes, as the component's `setup` takes it."""
        raise NotImplementedError

    def flat_functions(self) -> Any:
        """Return the component's functions in the form that compiled code is made of."""
        return self.functions

    def parameter_names(self) -> list[str]:
        """Return the names of the parameters in their order."""
        return [self.vars[index].name for index in sorted(self._parameters)]

    def flat_values(self) -> list[float]:
        """Return the parameters in their order as numbers, as `bristle.component` takes them."""
        return [self._number(index) for index in sorted(self._parameters)]

    def _number(self, index: int) -> float:
        value = self._values[index]
        if not isinstance(value, str):
            return float(value)
        words = self._words.get(index)
        if words is None:
            return 0.0
        return float(words.index(value)) if value in words else -1.0

    def inputs_set(self) -> list[float]:
        """Return 1 for each input that the host has set, else 0."""
        return [1.0 if index in self._set else 0.0 for index in self._inputs]

    def played(self) -> list[Played]:
        """Return from what the samples of each signal that the component plays are read."""
        return []

    def bundled(self) -> list[str]:
        """Return the names of files that came with the component; others are paths."""
        return []

    def setup(self) -> tuple[Any, list[float], int]:
        """Return constants, state and size of work; raise what is wrong with the parameters."""
        functions, baked, values = self.functions, self.bake(), self.flat_values()
        counts = [0.0] * 4
        functions.sizes(values, baked, counts)
        self._store, state = ([0.0] * int(count) for count in counts[:2])
        code = functions.setup(values, self.inputs_set(), baked, self._store, state)
        if code:
            self.tell(code, self.time, 0.0)
        return self.made_constants(), state, int(counts[3])

    def made_constants(self) -> Any:
        """Return the record of constants from what `setup` has filled in."""
        return self.functions.constants(self._store)

    def configure(self) -> None:
        self.constants, self.state, work = self.setup()
        self._new_state = list(self.state)
        self._work = [0.0] * work
        self._first, self._after = _span(self._inputs)
        self._shown_first, self._shown_after = _span(self._outputs)
        count = self._shown_after - self._shown_first
        self._given = [0.0] * (count + self.hidden)
        self._count = count
        self.before = self._values[self._first : self._after]
        self._fresh = False

    def advance(self, time: float, step: float) -> None:
        now = self._values[self._first : self._after]
        code = self.functions.step(
            (time, step, 0), self.before, now, self.constants, self.state, self._new_state,
            self._given, self._work,
        )  # fmt: skip
        if code:
            self.tell(code, time, step)
        self.state, self._new_state = self._new_state, self.state
        self.before = now
        self._values[self._shown_first : self._shown_after] = self._given[: self._count]
        self._fresh = True

    def refresh(self) -> None:
        if self._fresh:  # as the step has left them
            self._fresh = False
            return
        now = self._values[self._first : self._after]
        if self._mode == STEPPING:
            show = self.functions.output
        else:  # until the first step the state follows the inputs
            show = self.functions.start
            self.before = now
        code = show(self.time, now, self.constants, self.state, self._given, self._work)
        if code:
            self.tell(code, self.time, 0.0)
        self._values[self._shown_first : self._shown_after] = self._given[: self._count]

    def part_of(self, code: int) -> str:
        """Return the output that tells the fault of the part that a code is about; "": there is no
        part."""
        return ""

    def tell(self, code: int, time: float, step: float) -> None:
        """Warn of what a code says, or raise it; texts may name the `STEP_LENGTH` [s] as well."""
        if code in self.warns_first:
            self.tell(self.warns_first[code], time, step)
        text = self.texts[code].format_map(_Told(self, step))
        if code < 0:
            raise ValueError(text)
        self.warn_once(text)

    def get_inner(self) -> Any:
        return [list(self.state), list(self.before), list(self._given)]

    def set_inner(self, state: Any) -> None:
        self.state[:], self.before, self._given[:] = state[0], list(state[1]), state[2]


def _span(indices: list[int]) -> tuple[int, int]:
    """Return begin and end of variables that are neighbours."""
    return (indices[0], indices[-1] + 1) if indices else (0, 0)


class SourceSlave(ComponentSlave):
    """A component whose outputs depend on time alone.

    Its samples come from a CSV that `file_of` names, whose header is `header`, or from TIME:VALUE
    pairs in `pairs_of`.
    """

    icon = "source"
    functions: ClassVar[Any] = source
    file_of: ClassVar[Optional[SampleFile]] = None  # noqa: UP045 (read by Python 3.9)
    pairs_of: ClassVar[Optional[SampleFile]] = None  # noqa: UP045
    header: str = ANY_HEADER
    signal: Optional[tuple[list[float], list[float]]] = None  # noqa: UP045
    """Times [s] and values that are played in place of a file."""

    def played(self) -> list[Played]:
        return [Played(self.file_of, self.pairs_of, self.header)]

    def samples(self) -> tuple[list[float], list[float]]:
        """Return times [s] and values of what the component plays, from its parameters."""
        if self.signal:
            return self.signal
        if self.file_of and self._is_read(self.file_of):
            name = self[self.file_of.parameter]
            file = self.resource(f"{name}.csv") if name in self.bundled() else name
            return read_two_column(file, header=self.header)
        if self.pairs_of and self._is_read(self.pairs_of):
            return read_steps(self[self.pairs_of.parameter])
        return [0.0], [0.0]

    def _is_read(self, reading: SampleFile) -> bool:
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
        _show(self.time, given, constants, given, given, given)
        values[shown] = given


class SignalSlave(SourceSlave):
    """Parameters of a test signal, and what follows from them."""

    rated = False
    file_of = SampleFile("file", "kind", "csv")
    pairs_of = SampleFile("steps", "kind", "steps")
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
        self.header = ANY_HEADER.replace("UNIT", unit or "UNIT")
        text = f"two-column CSV of the kind csv, its header `{self.header}`"
        self.add_parameter("file", self.baked.get("samples", ""), None, text)

    def bake(self) -> list[float]:
        return source.bake_signal(self.parameter_names(), self.rated)

    def bundled(self) -> list[str]:
        name = self.baked.get("samples")
        return [name] if name else []
