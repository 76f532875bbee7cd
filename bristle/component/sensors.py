"""Sensors, sample by sample: low-pass, delay, gain, bias, noise, quantisation on each channel."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, floor, log, pi, sqrt
from typing import NamedTuple

from ..physics.linear import Row, open_row, packed, row
from .clock import COMING, ORIGIN, first_sample, last_sample, measure, step_code
from .control_laws import low_passed

# Normal noise from a counter: the sample's number decides the draw, and nothing has to be kept.
#
# Philox 2x32-10 (Salmon, Moraes, Dror & Shaw 2011, Parallel random numbers: as easy as 1, 2, 3,
# SC'11) and the Box-Muller transform. No product exceeds 2^63, so that plain Python, whose integers
# have no end, and compiled code, whose integers wrap, compute the same bits.

ROUNDS = 10
MULTIPLIER = 0xD256D193
KEY_STEP = 0x9E3779B9
WORD = 0xFFFFFFFF
HALF_WORD = 0xFFFF
SCALE = 1.0 / 4294967296.0  # one word, 2^-32


def random_words(key: int, low: int, high: int) -> tuple[int, int]:
    """Return two random words of 32 bits for a key and a counter, each of 32 bits."""
    for _ in range(ROUNDS):
        # The product of two words in parts: its upper and its lower word.
        part = (MULTIPLIER & HALF_WORD) * low
        rest = (MULTIPLIER >> 16) * low + (part >> 16)
        low = (rest >> 16) ^ key ^ high
        high = (rest & HALF_WORD) << 16 | (part & HALF_WORD)
        key = (key + KEY_STEP) & WORD
    return low, high


def standard_normal(seed: int, channel: int, k: int) -> float:
    """Return sample k of a standard normal sequence that seed and channel choose.

    Parameters
    ----------
    seed : int
        0 .. 2^32 - 1.
    channel : int
        0 .. 2^15 - 1.
    k : int
        0 .. 2^48 - 1.
    """
    first, second = random_words(seed, k & WORD, channel << 16 | k >> 32)
    return sqrt(-2.0 * log((first + 0.5) * SCALE)) * cos(2.0 * pi * SCALE * second)


FINEST = 1e15
"""Readings of more steps than this are not quantised: floats are no finer there."""


KEYS = ("gain", "bias", "noise_density", "quantisation", "delay", "cut_off")
"""Parameters of each channel, in the order in which `bake` asks for them.

Reading = gain signal + bias; the root of the one-sided spectral density of white noise, whose
deviation in samples is noise_density sqrt(1 / (2 period)); the step between two readings (0: none);
the lag [s], the signal linear between two samples; the corner of a first-order low-pass [Hz] (0:
none).
"""

_NUMBERS, _GAINS, _BIASES, _DEVIATION, _QUANTISATION, _CORNER, _SHARE, _LENGTH, _RING = range(9)
_PERIOD, _SEED, _SIZE = range(3)
_GAIN, _BIAS, _NOISE, _STEP, _DELAY, _CUT_OFF = range(len(KEYS))


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


def bake(names: Sequence[str], channels: Sequence[str]) -> list[float]:
    """Return what a build fixes of sensors: where the values of each channel are.

    Parameters
    ----------
    names : of the values in their order: "sample_period", "seed", and CHANNEL.KEY for all of `KEYS`
    channels : (m,) names of the channels
    """
    own = [names.index(f"{channel}.{key}") for channel in channels for key in KEYS]
    return packed([names.index("sample_period"), names.index("seed")], own)


def sizes(values: Row, baked: Row, counts: Row) -> int:
    """Fill in how many floats constants, state, outputs and work take; delays decide the state's.

    Parameters
    ----------
    values, baked : as in `setup`
    counts : (4,) filled

    Returns
    -------
    int
        0.
    """
    period, own = values[int(row(baked, 0)[_PERIOD])], row(baked, 1)
    m, rings = len(own) // len(KEYS), 0
    for j in range(m):
        rings += ring_length(values[int(own[len(KEYS) * j + _DELAY])], period)
    counts[0], counts[1] = _RING + 1 + _SIZE + 1 + _RING * m, rings + 2 * m + 2
    counts[2], counts[3] = m, m
    return 0


def ring_length(delay: float, period: float) -> int:
    """Return how many samples a ring holds: both neighbours of the delayed instant.

    Parameters
    ----------
    delay, period : the lag and the time between two samples [s]
    """
    return floor(delay / period) + 2


def setup(values: Row, given: Row, baked: Row, store: Row, state: Row) -> int:
    """Fill in what parameters imply.

    The state holds the rings, then the low-passed signal of every channel, then the signals before,
    then what `clock` keeps.

    Parameters
    ----------
    values : of the parameters, in the order of the names that were baked
    given : (m,) not used
    baked : as `bake` returns it
    store, state : of the sizes of `sizes`, zero; the store is filled

    Returns
    -------
    int
        0.
    """
    clocked, own = row(baked, 0), row(baked, 1)
    period, m = values[int(clocked[_PERIOD])], len(own) // len(KEYS)
    at = open_row(store, _NUMBERS, _SIZE + 1)
    gains, biases = open_row(store, _GAINS, m), open_row(store, _BIASES, m)
    deviation, steps = open_row(store, _DEVIATION, m), open_row(store, _QUANTISATION, m)
    corner, share = open_row(store, _CORNER, m), open_row(store, _SHARE, m)
    length, ring = open_row(store, _LENGTH, m), open_row(store, _RING, m)
    size = 0
    for j in range(m):
        first = len(KEYS) * j
        lag = values[int(own[first + _DELAY])] / period
        store[gains + j] = values[int(own[first + _GAIN])]
        store[biases + j] = values[int(own[first + _BIAS])]
        store[deviation + j] = values[int(own[first + _NOISE])] * sqrt(0.5 / period)
        store[steps + j] = values[int(own[first + _STEP])]
        store[corner + j] = 2.0 * pi * values[int(own[first + _CUT_OFF])]
        store[share + j] = lag - floor(lag)
        store[length + j] = float(floor(lag) + 2)
        store[ring + j] = float(size)
        size += floor(lag) + 2
    store[at + _PERIOD], store[at + _SIZE] = period, float(size)
    store[at + _SEED] = values[int(clocked[_SEED])]
    return 0


def constants(store: Row) -> Constants:
    """Return what `start`, `step` and `output` take; in compiled code its rows are views."""
    c = row(store, _NUMBERS)
    return Constants(
        c[_PERIOD], int(c[_SEED]), int(c[_SIZE]), row(store, _GAINS), row(store, _BIASES),
        row(store, _DEVIATION), row(store, _QUANTISATION), row(store, _CORNER),
        row(store, _SHARE), row(store, _LENGTH), row(store, _RING),
    )  # fmt: skip


def start(time: float, inputs: Row, c: Constants, state: Row, outputs: Row, work: Row) -> int:
    """Take the first sample; the signals are taken to have stood since ever.

    Parameters
    ----------
    time : time of sample 0 [s]
    inputs : (m,) signals, each in its own unit
    c : Constants
    state : as `setup` lays it out, filled
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
        Time at the start [s], dt [s], sweep (not used).
    before, now : (m,) signals at begin and end, each in its own unit
    c : Constants
    state, new_state : one and the same sequence, as `setup` lays it out, moved on in place
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
    state : as `setup` lays it out; the channel's part is moved on in place
    """
    begin, length = int(c.ring[j]), int(c.length[j])
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
