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
    """Show the signal.

    Parameters
    ----------
    time : s
    inputs, state, work : not used: a signal has none
    c : Constants
    outputs : (1,) value, in the unit of the samples; (2,) where `c.rated`, with its rate per s;
        filled

    Returns
    -------
    int
        0.
    """
    return output(time, inputs, c, state, outputs, work)


def step(
    clock: tuple[float, float, int], before: Row, now: Row, c: Constants, state: Row,
    new_state: Row, outputs: Row, work: Row,
) -> int:  # fmt: skip
    """Show the signal at the step's end.

    Parameters
    ----------
    clock : tuple
        Time at the begin [s], dt [s], sweep (not used).
    before, now, state, new_state, work : not used: a signal has none
    c : Constants
    outputs : (1,) or (2,) as in `start`, filled

    Returns
    -------
    int
        0.
    """
    return output(clock[0] + clock[1], now, c, state, outputs, work)


def output(time: float, inputs: Row, c: Constants, state: Row, outputs: Row, work: Row) -> int:
    """Show the signal.

    Parameters
    ----------
    time : s
    inputs, state, work : not used: a signal has none
    c : Constants
    outputs : (1,) or (2,) as in `start`, filled

    Returns
    -------
    int
        0.
    """
    kind, p, times, samples, scale, delay, rated = c
    outputs[0] = scale * value(kind, time - delay, p, times, samples)
    if rated:
        outputs[1] = scale * rate(kind, time - delay, p, times, samples)
    return 0
