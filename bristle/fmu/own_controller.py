"""The base of a controller of one's own: clock, ports and limits are here, `command` is not.

A subclass declares its parameters in `declare_law` and answers one sample in `command`; its FMU is
made by `bristle build FILE.py`.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, ClassVar, NamedTuple

from ..component.clock import COMING, ORIGIN, first_sample, last_sample, measure, step_code
from ..physics.generate import with_globals
from ..physics.linear import copy, open_row, packed, row
from ..physics.tuples import made, record
from .controller import SampledSlave

COMPILED_MAY_USE = (
    "Where it is compiled, `command` may use its parameters that are numbers or switches as "
    "self.NAME, the fields of measured and memory, arithmetic, if, for, tuples, `math`, and plain "
    "functions of its file that do the same; no text, list, dict, or anything else of self."
)
"""What a user reads whose controller the compiler refuses."""


class Measured(NamedTuple):
    """What a controller measures at a sample: the values of its inputs, in their order.

    `floor_acceleration` [m/s2] and `base_displacement` [m], `base_velocity` [m/s], `damper_force`
    [N].
    """

    floor_acceleration: float
    base_displacement: float
    base_velocity: float
    damper_force: float


VOLTAGE, COMMAND_RAW, SCHEDULING = range(3)

_VALUES, _INDICES = range(2)
_PERIOD, _V_MAX, _KEPT = range(3)


class Constants(NamedTuple):
    """What a controller of one's own computes with: `answer` is its `command` of one sample."""

    period: float
    v_max: float
    answer: Callable[[Measured, Any], Any]
    memory: Any
    kept: int


class Numbers(NamedTuple):
    """The same in compiled code: the record `parameters` is what `command` gets as `self`."""

    period: float
    v_max: float
    parameters: Any


class Functions:
    """The functions of `bristle.component`, for a law that is a method; see `component.clock`.

    `compiled_form` has them as compiled code takes them, with `constants` too.
    """

    @staticmethod
    def sizes(values: Any, baked: Any, counts: Any) -> int:
        """Fill in how many floats constants, state, outputs and work take.

        Parameters
        ----------
        values, baked : as in `setup`
        counts : (4,) filled
        """
        counts[0] = 2 + len(values) + _KEPT + 1
        counts[1], counts[2], counts[3] = row(baked, 0)[_KEPT] + 2, 3, 4
        return 0

    @staticmethod
    def setup(values: Any, given: Any, baked: Any, store: Any, state: Any) -> int:
        """Fill in the parameters.

        Parameters
        ----------
        values : of all parameters, in their order
        given : (4,) not used
        baked : indices of the sample period and of the largest voltage among the values, and how
            many numbers are remembered; packed
        store, state : of the sizes of `sizes`, zero; the store is filled
        """
        copy(values, 0, store, open_row(store, _VALUES, len(values)), len(values))
        indices = row(baked, 0)
        copy(indices, 0, store, open_row(store, _INDICES, len(indices)), len(indices))
        return 0

    @staticmethod
    def start(time: float, inputs: Any, c: Constants, state: Any, outputs: Any, work: Any) -> int:
        """Take the first sample, with nothing remembered.

        Parameters
        ----------
        time : time of sample 0 [s]
        inputs : (4,) those of `Measured`
        c : Constants
        state : (kept + 2,) what is remembered, and what `component.clock` keeps; filled
        outputs : (3,) voltage [V], command before limits [V], velocity [m/s]; filled
        work : (4,) room to work
        """
        for i in range(len(state)):
            state[i] = 0.0
        state[ORIGIN], state[COMING] = time, 1.0
        _sample(inputs, c, state, outputs)
        return 0

    @staticmethod
    def step(
        clock: tuple[float, float, int], before: Any, now: Any, c: Constants, state: Any,
        new_state: Any, outputs: Any, work: Any,
    ) -> int:  # fmt: skip
        """Take the samples that a step ends on or passes.

        Parameters
        ----------
        clock : time at the start [s], length of the step [s], sweep (not used)
        before, now : (4,) inputs at begin and end, as in `start`
        c : Constants
        state, new_state : one and the same sequence, as in `start`, moved on in place
        outputs : (3,) as in `start`, filled where a sample is taken
        work : (4,) room to work
        """
        time, dt, _ = clock
        origin, coming = state[ORIGIN], state[COMING]
        last = last_sample(time + dt, c.period, origin)
        code = step_code(dt, c.period, last - coming)
        if code < 0:
            return code
        for k in range(first_sample(time, c.period, origin, coming), last + 1):
            measure(origin + k * c.period - time, dt, c.period, before, now, work)
            _sample(work, c, new_state, outputs)
            new_state[COMING] = k + 1.0
        return code

    @staticmethod
    def output(time: float, inputs: Any, c: Constants, state: Any, outputs: Any, work: Any) -> int:
        """Hold the outputs: none follows an input.

        Parameters
        ----------
        time, inputs, c, state, outputs, work
            As in `start`; nothing is read or filled.
        """
        return 0


def _sample(inputs: Any, c: Constants, state: Any, outputs: Any) -> None:
    """Ask the law, keep what it remembers, limit the voltage."""
    measured = Measured(*inputs)
    wanted, kept = c.answer(measured, c.memory(*state[: c.kept]))
    kept = [float(value) for value in kept]
    if len(kept) != c.kept:
        raise ValueError(
            f"command returned {len(kept)} numbers to remember; memory names {c.kept}."
        )
    state[: c.kept] = kept
    _show(float(wanted), measured, c.v_max, outputs)


def _show(wanted: float, measured: Measured, v_max: float, outputs: Any) -> None:
    """Limit the voltage."""
    outputs[VOLTAGE] = min(max(wanted, 0.0), v_max)
    outputs[COMMAND_RAW], outputs[SCHEDULING] = wanted, measured.base_velocity


_COMPILED = """
def sample(inputs, c, state, outputs):
    measured = record(Measured, (inputs[0], inputs[1], inputs[2], inputs[3]))
    wanted, kept = command(c.parameters, measured, {memory})
    {remember}
    show(float(wanted), measured, c.v_max, outputs)


def constants(store):
    values, indices = row(store, {values}), row(store, {indices})
    period, v_max = values[int(indices[{period}])], values[int(indices[{v_max}])]
    return record(Numbers, (period, v_max, {record}))
"""


def compiled_form(
    command: Any, memory: tuple[str, ...], kinds: dict[str, type | None]
) -> SimpleNamespace:
    """Return the functions of a controller of one's own in the form that compiled code is made of.

    Parameters
    ----------
    command : function
        The law's `command`; the compiler looks into it only later.
    memory : tuple of str
        What is remembered.
    kinds : dict
        Name of each parameter, in their order, to its type: float, int, bool, or None where it is
        of no use in compiled code.
    """
    sources = {float: "values[{}]", int: "int(values[{}])", bool: "values[{}] != 0.0"}
    known = {
        name: sources[kind].format(index)
        for index, (name, kind) in enumerate(kinds.items())
        if kind is not None and name.isidentifier()
    }
    text = _COMPILED.format(
        memory=made("Memory", [f"state[{k}]" for k in range(len(memory))]),
        remember="".join(f"state[{k}], " for k in range(len(memory))) + "= kept" if memory else "",
        values=_VALUES, indices=_INDICES, period=_PERIOD, v_max=_V_MAX,
        record=made("Parameters", list(known.values())),
    )  # fmt: skip
    namespace: dict[str, Any] = {
        "Measured": Measured, "Numbers": Numbers, "Memory": namedtuple("Memory", memory),
        "Parameters": namedtuple("Parameters", list(known)), "command": command, "show": _show,
        "record": record, "row": row, "__name__": __name__,
    }  # fmt: skip
    exec(compile(text, "<compiled own controller>", "exec"), namespace)
    sampled = {"_sample": namespace["sample"]}
    return SimpleNamespace(
        sizes=Functions.sizes, setup=Functions.setup, constants=namespace["constants"],
        start=with_globals(Functions.start, sampled), step=with_globals(Functions.step, sampled),
        output=Functions.output,
    )  # fmt: skip


class OwnController(SampledSlave):
    """A controller of one's own: `command` is asked at t = 0, h, 2h ... and its voltage held.

    `memory` names the numbers that are kept from sample to sample; all are 0 before the first.
    """

    functions: ClassVar[Any] = Functions
    memory: ClassVar[tuple[str, ...]] = ()

    def declare(self) -> None:
        self.declare_measured()
        self.add_output("voltage", "V", "voltage of the coil, held between samples")
        self.add_output("command_raw", "V", "command before limits")
        self.add_output("scheduling", "m/s", "velocity across the damper at the sample")
        self.add_parameter("v_max", 8.0, "V", "largest voltage", (1e-3, 1e4))
        self.declare_law()

    def command(self, measured: Measured, memory: Any) -> tuple[float, tuple[float, ...]]:
        """Return the wanted voltage [V] at one sample, and what is remembered until the next.

        Parameters
        ----------
        measured : Measured
            `floor_acceleration` [m/s2], `base_displacement` [m], `base_velocity` [m/s],
            `damper_force` [N].
        memory : named tuple
            The numbers that `memory` names, as the sample before has returned them.
        """
        raise NotImplementedError

    def bake(self) -> list[float]:
        names = self.parameter_names()
        return packed([names.index("sample_period"), names.index("v_max"), len(self.memory)])

    def made_constants(self) -> Constants:
        named = namedtuple("Memory", self.memory)  # type: ignore[misc]
        values, indices = row(self._store, _VALUES), row(self._store, _INDICES)
        period, v_max = (values[int(indices[k])] for k in (_PERIOD, _V_MAX))
        return Constants(period, v_max, self.command, named, len(self.memory))

    def flat_functions(self) -> SimpleNamespace:
        kinds = {
            name: None if isinstance(self[name], str) else type(self[name])
            for name in self.parameter_names()
        }
        return compiled_form(type(self).command, self.memory, kinds)
