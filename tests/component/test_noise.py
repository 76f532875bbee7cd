"""Noise from a counter: its published numbers, its statistics, the same bits compiled."""

from __future__ import annotations

from math import erfc, sqrt

import numpy as np
import pytest

from bristle.component.sensors import random_words, standard_normal
from bristle.core.jit import compiled

N = 100_000


def drawn(seed: int, channel: int) -> np.ndarray:
    return np.array([standard_normal(seed, channel, k) for k in range(N)])


def fill(seed, channel, first, out):
    for k in range(len(out)):
        out[k] = standard_normal(seed, channel, first + k)


@pytest.fixture(scope="module")
def sequence() -> np.ndarray:
    return drawn(7, 2)


@pytest.mark.parametrize(
    ("key", "counter", "words"),
    [
        (0x00000000, (0x00000000, 0x00000000), (0xFF1DAE59, 0x6CD10DF2)),
        (0xFFFFFFFF, (0xFFFFFFFF, 0xFFFFFFFF), (0x2C3F628B, 0xAB4FD7AD)),
        (0x13198A2E, (0x243F6A88, 0x85A308D3), (0xDD7CE038, 0xF62A4C12)),
    ],
)
def test_words_are_those_of_philox(
    key: int, counter: tuple[int, int], words: tuple[int, int]
) -> None:
    """Known answers of philox2x32-10: Random123 1.14, kat_vectors."""
    assert random_words(key, *counter) == words


@pytest.mark.parametrize(("seed", "channel", "first"), [(7, 2, 0), (2**31 - 1, 63, 2**40)])
def test_compiled_code_draws_the_same_bits(seed: int, channel: int, first: int) -> None:
    found = np.zeros(N)
    compiled(fill)(seed, channel, first, found)
    expected = [standard_normal(seed, channel, first + k) for k in range(N)]
    assert np.array_equal(found, expected)


def test_moments_are_those_of_a_standard_normal(sequence: np.ndarray) -> None:
    assert abs(sequence.mean()) < 4.0 / sqrt(N)
    assert abs(sequence.var() - 1.0) < 4.0 * sqrt(2.0 / N)
    assert abs((sequence**3).mean()) < 4.0 * sqrt(15.0 / N)
    assert abs((sequence**4).mean() - 3.0) < 4.0 * sqrt(96.0 / N)


@pytest.mark.parametrize("bound", [0.5, 1.0, 2.0, 3.0, 4.0])
def test_tails_hold_their_share(sequence: np.ndarray, bound: float) -> None:
    share = erfc(bound / sqrt(2.0))
    for side in (sequence > bound, sequence < -bound):
        assert abs(side.mean() - share / 2.0) < 4.0 * sqrt(share / 2.0 / N)


@pytest.mark.parametrize("lag", [1, 2, 3, 7, 64, 1024])
def test_samples_do_not_follow_each_other(sequence: np.ndarray, lag: int) -> None:
    for one in (sequence, sequence**2 - 1.0):
        assert abs(np.mean(one[lag:] * one[:-lag])) < 4.5 * one.var() / sqrt(N - lag)


@pytest.mark.parametrize(("seed", "channel"), [(7, 3), (7, 1), (8, 2), (2, 7), (0, 0)])
def test_channels_and_seeds_are_independent(sequence: np.ndarray, seed: int, channel: int) -> None:
    other = drawn(seed, channel)
    for lag in (0, 1, 5):
        a, b = sequence[lag:], other[: N - lag]
        assert abs(np.mean(a * b)) < 4.5 / sqrt(N - lag)
        assert abs(np.mean((a**2 - 1.0) * (b**2 - 1.0))) < 4.5 * 2.0 / sqrt(N - lag)


def test_seeds_near_each_other_draw_as_others_do() -> None:
    """The first sample over neighbouring seeds is as random as one seed's samples."""
    first = np.array([standard_normal(seed, 0, 0) for seed in range(20_000)])
    assert abs(first.mean()) < 4.0 / sqrt(len(first))
    assert abs(first.var() - 1.0) < 4.0 * sqrt(2.0 / len(first))
    assert abs(np.mean(first[1:] * first[:-1])) < 4.5 / sqrt(len(first))
