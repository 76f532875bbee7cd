"""Normal noise from a counter: the sample's number decides the draw, and nothing has to be kept.

Philox 2x32-10 (Salmon, Moraes, Dror & Shaw 2011, Parallel random numbers: as easy as 1, 2, 3,
SC'11) and the Box-Muller transform. No product exceeds 2^63, so that plain Python, whose integers
have no end, and compiled code, whose integers wrap, compute the same bits.
"""

from __future__ import annotations

from math import cos, log, pi, sqrt

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
