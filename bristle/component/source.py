"""Sources: a signal that depends on time alone, and its rate where the component shows that too."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ..physics.linear import Row, open_row, packed, place, row
from ..physics.signals import CONSTANT, CSV, PARAMETERS, STEPS, rate, value


class Constants(NamedTuple):
    """A signal: `scale` times that of `physics.signals.value`, `delay` [s] later.

    The rate is shown behind the value if it is `rated`. That is the motion of a rod: before and
    after samples of the kind "csv" it stands at the nearest of them, where others are zero.
    """

    kind: int
    p: Row
    times: Row
    samples: Row
    scale: float = 1.0
    delay: float = 0.0
    rated: bool = False


NO_KIND, NO_PEAK, JUMPS = -1, -2, -3
"""Why a source cannot be set up: its kind is unknown; its samples are all zero and have no peak to
scale; it shows a rate, and its signal jumps."""

_KIND, _RATED, _CHOOSES, _PEAK, _FACTOR, _START = range(6)
_NUMBERS, _P = range(2)
_CODE, _SCALE, _DELAY, _SHOWS_RATE, _TO_PEAK = range(5)


def bake_constant(names: Sequence[str]) -> list[float]:
    """Return what a build fixes of a constant source: the values hold its `level`."""
    return packed([CONSTANT, False, -1, -1, -1, -1], [names.index("level")])


def bake_record(names: Sequence[str]) -> list[float]:
    """Return what a build fixes of a source of samples: values hold `peak`, `factor`, `start`."""
    scaled = [names.index(name) for name in ("peak", "factor", "start")]
    return packed([CSV, False, -1, *scaled], [])


def bake_signal(names: Sequence[str], rated: bool) -> list[float]:
    """Return what a build fixes of a test signal: values hold `kind` and `signals.PARAMETERS`."""
    numbers = [names.index(name) for name in PARAMETERS]
    return packed([-1, rated, names.index("kind"), -1, -1, -1], numbers)


def sizes(values: Row, baked: Row, counts: Row) -> int:
    """Fill in how many floats constants, state, outputs and work take.

    Parameters
    ----------
    values, baked : as in `setup`
    counts : (4,) filled

    Returns
    -------
    int
        0.
    """
    counts[0] = 2 + _TO_PEAK + 1 + len(row(baked, 1))
    counts[1], counts[2], counts[3] = 0.0, 1.0 + row(baked, 0)[_RATED], 0.0
    return 0


def setup(values: Row, given: Row, baked: Row, store: Row, state: Row) -> int:
    """Fill in what parameters imply; `scale_samples` comes next.

    Parameters
    ----------
    values : of the parameters, in the order of the names that were baked
    given, state : not used: a source has no inputs and no state
    baked : as `bake_constant`, `bake_record` or `bake_signal` returns it
    store : of the size of `sizes`, filled

    Returns
    -------
    int
        0 or `NO_KIND`.
    """
    fixed, indices = row(baked, 0), row(baked, 1)
    at, p = open_row(store, _NUMBERS, _TO_PEAK + 1), open_row(store, _P, len(indices))
    for i in range(len(indices)):
        store[p + i] = values[int(indices[i])]
    kind = values[int(fixed[_CHOOSES])] if fixed[_KIND] < 0.0 else fixed[_KIND]
    if kind < 0.0:
        return NO_KIND
    store[at + _CODE], store[at + _SHOWS_RATE] = kind, fixed[_RATED]
    store[at + _SCALE], store[at + _DELAY], store[at + _TO_PEAK] = 1.0, 0.0, 0.0
    if fixed[_PEAK] >= 0.0:
        store[at + _TO_PEAK] = values[int(fixed[_PEAK])]
        store[at + _SCALE] = values[int(fixed[_FACTOR])]
        store[at + _DELAY] = values[int(fixed[_START])]
    return 0


def scale_samples(times: Row, samples: Row, store: Row) -> int:
    """Take over what the samples imply: once they are there, after `setup`.

    Parameters
    ----------
    times, samples : (n,) s and in the signal's unit
    store : as `setup` has filled it

    Returns
    -------
    int
        0, `NO_PEAK` or `JUMPS`.
    """
    at = place(store, _NUMBERS)
    if store[at + _CODE] == STEPS and store[at + _SHOWS_RATE] != 0.0:
        return JUMPS
    if store[at + _TO_PEAK] > 0.0:
        peak = 0.0
        for i in range(len(samples)):
            peak = max(peak, abs(samples[i]))
        if peak == 0.0:
            return NO_PEAK
        store[at + _SCALE] *= store[at + _TO_PEAK] / peak
    return 0


def constants(store: Row, times: Row, samples: Row) -> Constants:
    """Return what `start`, `step` and `output` take; in compiled code its rows are views.

    Parameters
    ----------
    store : as `setup` and `scale_samples` have filled it
    times, samples : (n,) as of `scale_samples`; not used where the signal has none
    """
    c = row(store, _NUMBERS)
    rated = c[_SHOWS_RATE] != 0.0
    return Constants(int(c[_CODE]), row(store, _P), times, samples, c[_SCALE], c[_DELAY], rated)


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
        Time at the start [s], dt [s], sweep (not used).
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
    at = time - delay
    if rated:
        outputs[1] = scale * rate(kind, at, p, times, samples)
        if kind == CSV:  # with a velocity of zero it cannot go back to zero
            at = min(max(at, times[0]), times[len(times) - 1])
    outputs[0] = scale * value(kind, at, p, times, samples)
    return 0
