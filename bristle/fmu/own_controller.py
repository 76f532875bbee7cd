"""The base of a controller of one's own: clock, ports and limits are here, `command` is not.

A subclass declares its parameters in `declare_law` and answers one sample in `command`; its FMU is
made by `bristle build FILE.py`.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

from ..component.clock import COMING, ORIGIN, first_sample, last_sample, measure, step_code
from .controller import MEASURED, SampledSlave


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


class Constants(NamedTuple):
    """What a controller of one's own computes with: `answer` is its `command` of one sample."""

    period: float
    v_max: float
    answer: Callable[[Measured, Any], Any]
    memory: Any
    kept: int


class Functions:
    """The functions of `bristle.component`, for a law that is a method; see `component.clock`."""

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
        state[:] = [0.0] * c.kept + [time, 1.0]
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
        clock : time at the begin [s], length of the step [s], sweep (not used)
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
    wanted = float(wanted)
    outputs[VOLTAGE] = min(max(wanted, 0.0), c.v_max)
    outputs[COMMAND_RAW], outputs[SCHEDULING] = wanted, measured.base_velocity


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

    def declare_law(self) -> None:
        """Declare the sample period and the law's own parameters."""
        self.declare_period()

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

    def setup(self) -> tuple[Any, list[float], int]:
        named = namedtuple("Memory", self.memory)  # type: ignore[misc]
        count = len(self.memory)
        c = Constants(self["sample_period"], self["v_max"], self.command, named, count)
        return c, [0.0] * count + [self.time, 0.0], len(MEASURED)
