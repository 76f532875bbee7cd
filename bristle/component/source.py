"""Sources: a signal that depends on time alone, and its rate where the component shows that too."""

from __future__ import annotations

from typing import NamedTuple

from ..physics.linear import Row
from ..physics.signals import rate, value


class Constants(NamedTuple):
    """A signal: `scale` times that of `physics.signals.value`, `delay` [s] later.

    The rate is shown behind the value if it is `rated`.
    """

    kind: int
    p: Row
    times: Row
    samples: Row
    scale: float = 1.0
    delay: float = 0.0
    rated: bool = False


def start(time: float, inputs: Row, c: Constants, state: Row, outputs: Row, work: Row) -> int:
    """Show the signal."""
    return output(time, inputs, c, state, outputs, work)


def step(
    clock: tuple[float, float, int], before: Row, now: Row, c: Constants, state: Row,
    new_state: Row, outputs: Row, work: Row,
) -> int:  # fmt: skip
    """Show the signal at the step's end."""
    return output(clock[0] + clock[1], now, c, state, outputs, work)


def output(time: float, inputs: Row, c: Constants, state: Row, outputs: Row, work: Row) -> int:
    """Show the signal."""
    t = time - c.delay
    outputs[0] = c.scale * value(c.kind, t, c.p, c.times, c.samples)
    if c.rated:
        outputs[1] = c.scale * rate(c.kind, t, c.p, c.times, c.samples)
    return 0
