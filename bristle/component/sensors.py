"""Sensors, sample by sample: low-pass, delay, gain, bias, noise, quantisation on each channel."""

from __future__ import annotations

from collections.abc import Sequence
from math import floor, pi
from typing import NamedTuple

from ..control.noise import standard_normal
from ..control.sensing import low_passed
from ..physics.linear import Row
from .clock import COMING, ORIGIN, first_sample, last_sample, measure, step_code

FINEST = 1e15
"""Readings of more steps than this are not quantised: floats are no finer there."""


class Channel(NamedTuple):
    """What an instrument makes of one signal.

    Reading = gain signal + bias; the root of the one-sided spectral density of white noise, whose
    deviation in samples is noise_density sqrt(1 / (2 period)); the step between two readings (0:
    none); the lag [s], the signal linear between two samples; the corner of a first-order low-pass
    [Hz] (0: none).
    """

    gain: float = 1.0
    bias: float = 0.0
    noise_density: float = 0.0
    quantisation: float = 0.0
    delay: float = 0.0
    cut_off: float = 0.0


class Constants(NamedTuple):
    """What sensors of m channels compute with; each sequence has an entry per channel.

    `seed` chooses the noise of `deviation`; `corner` [rad/s]; the last `length` samples of a
    channel lie in a ring of the state from `ring` on, those on both sides of the delayed instant
    the oldest; `share` is how far that instant lies from the younger to the older of them. `size`
    is the size of all rings.
    """

    period: float
    seed: int
    size: int
    gains: Row
    biases: Row
    deviation: Row
    quantisation: Row
    corner: Row
    share: Row
    length: Row
    ring: Row


def setup(
    time: float, period: float, seed: int, channels: Sequence[Channel]
) -> tuple[Constants, list[float], int]:
    """Return constants, state and size of work.

    The state holds the rings, then the low-passed signal of every channel, then the signals before.

    Parameters
    ----------
    time : time of sample 0 [s]
    period : time between two samples [s]
    seed : int, chooses the noise
    channels : (m,) sequence of Channel
    """
    lags = [channel.delay / period for channel in channels]
    lengths = [floor(lag) + 2 for lag in lags]  # a ring holds both neighbours of the instant
    c = Constants(
        period, seed, sum(lengths),
        gains=[channel.gain for channel in channels],
        biases=[channel.bias for channel in channels],
        deviation=[channel.noise_density * (0.5 / period) ** 0.5 for channel in channels],
        quantisation=[channel.quantisation for channel in channels],
        corner=[2.0 * pi * channel.cut_off for channel in channels],
        share=[lag - floor(lag) for lag in lags],
        length=lengths,
        ring=[sum(lengths[:j]) for j in range(len(channels))],
    )  # fmt: skip
    m = len(channels)
    return c, [0.0] * (c.size + 2 * m) + [time, 0.0], m


def start(time: float, inputs: Row, c: Constants, state: Row, outputs: Row, work: Row) -> int:
    """Take the first sample; the signals are taken to have stood since ever.

    Parameters
    ----------
    time : time of sample 0 [s]
    inputs : (m,) signals, each in its own unit
    c : Constants
    state : as `setup` returns it, filled
    outputs : (m,) readings, filled
    work : (m,) not used

    Returns
    -------
    int
        0.
    """
    state[ORIGIN], state[COMING] = time, 1.0
    for j in range(len(inputs)):
        outputs[j] = reading(j, 0, inputs[j], c, state)
    return 0


def step(
    clock: tuple[float, float, int], before: Row, now: Row, c: Constants, state: Row,
    new_state: Row, outputs: Row, work: Row,
) -> int:  # fmt: skip
    """Take the samples that the step ends on or passes.

    Parameters
    ----------
    clock : tuple
        Time at the begin [s], dt [s], sweep (not used).
    before, now : (m,) signals at begin and end, each in its own unit
    c : Constants
    state, new_state : one and the same sequence, as `setup` returns it, moved on in place
    outputs : (m,) readings, filled where a sample is taken
    work : (m,) room to work

    Returns
    -------
    int
        0, `LONG_STEP` or `TOO_MANY_SAMPLES` of `clock`.
    """
    time, dt, _ = clock
    origin, coming = state[ORIGIN], state[COMING]
    last = last_sample(time + dt, c.period, origin)
    code = step_code(dt, c.period, last - coming)
    if code < 0:
        return code
    for k in range(first_sample(time, c.period, origin, coming), last + 1):
        measure(origin + k * c.period - time, dt, c.period, before, now, work)
        for j in range(len(now)):
            outputs[j] = reading(j, k, work[j], c, new_state)
        new_state[COMING] = k + 1.0
    return code


def output(time: float, inputs: Row, c: Constants, state: Row, outputs: Row, work: Row) -> int:
    """Hold the readings: none follows an input.

    Parameters
    ----------
    time, inputs, c, state, outputs, work
        As in `start`; nothing is read or filled.
    """
    return 0


def reading(j: int, k: int, value: float, c: Constants, state: Row) -> float:
    """Return what a channel shows of a signal at a sample, in the signal's unit.

    Parameters
    ----------
    j, k : number of the channel; number of the sample, 0 the first
    value : the signal at the sample's instant
    c : Constants
    state : as `setup` returns it; the channel's part is moved on in place
    """
    begin, length = c.ring[j], c.length[j]
    low, before = c.size + j, c.size + len(c.gains) + j
    if k == 0:
        state[low] = state[before] = value
        for i in range(length):
            state[begin + i] = value
    if c.corner[j] > 0.0:
        state[low] = low_passed(state[low], state[before], value, c.corner[j], c.period)
    else:
        state[low] = value
    state[before] = value
    state[begin + k % length] = state[low]
    near, far = state[begin + (k + 2) % length], state[begin + (k + 1) % length]
    shown = c.gains[j] * (near + c.share[j] * (far - near)) + c.biases[j]
    if c.deviation[j] > 0.0:
        shown += c.deviation[j] * standard_normal(c.seed, j, k)
    step = c.quantisation[j]
    if step > 0.0 and abs(shown / step) < FINEST:
        shown = step * floor(shown / step + 0.5)
    return shown  # type: ignore[no-any-return]
