"""An instrument's channel, sample by sample: low-pass, delay, gain, bias, noise, quantisation."""

from __future__ import annotations

from math import floor, pi
from typing import Any

from ..physics.linear import Row
from .noise import standard_normal
from .sensing import low_passed

FINEST = 1e15
"""Readings of more steps than this are not quantised: floats are no finer there."""


def white_noise(k: int, channel: int, seed: int, deviation: float) -> float:
    """Return the noise of sample k, in the signal's unit: it depends on nothing else."""
    return deviation * standard_normal(seed, channel, k)


def reading(
    k: int, value: float, ring: Row, share: float, gain: float, bias: float, disturbance: float,
    quantisation: float,
) -> float:  # fmt: skip
    """Return what an instrument shows at sample k of a low-passed value.

    `ring` holds the last samples, those on both sides of the delayed instant the oldest; `share` is
    how far that instant lies from the younger to the older of them.
    """
    length = len(ring)
    ring[k % length] = value
    near, far = ring[(k + 2) % length], ring[(k + 1) % length]
    shown = gain * (near + share * (far - near)) + bias + disturbance
    if quantisation > 0.0 and abs(shown / quantisation) < FINEST:
        shown = quantisation * floor(shown / quantisation + 0.5)
    return shown  # type: ignore[no-any-return]


class Instrument:
    """One channel of a measuring system, called once per sample.

    Parameters
    ----------
    channel, seed : int
        They choose the noise: it depends on them and the sample's number alone, so that a run that
        is taken up again meets the same noise.
    period : float
        Sample period [s].
    gain, bias : float
        Reading = gain signal + bias.
    noise_density : float
        Root of the one-sided spectral density of white noise; its standard deviation in samples is
        noise_density sqrt(1/(2 period)).
    quantisation : float
        Step between two readings; 0: none.
    delay : float
        Lag [s]; between two samples the signal is taken as linear.
    cut_off : float
        Corner of a first-order low-pass [Hz]; 0: none.
    """

    def __init__(
        self,
        channel: int,
        seed: int,
        period: float,
        gain: float = 1.0,
        bias: float = 0.0,
        noise_density: float = 0.0,
        quantisation: float = 0.0,
        delay: float = 0.0,
        cut_off: float = 0.0,
    ) -> None:
        self.channel, self.seed, self.period = channel, seed, period
        self.gain, self.bias, self.quantisation = gain, bias, quantisation
        self.deviation = noise_density * (0.5 / period) ** 0.5
        self.corner = 2.0 * pi * cut_off
        self.lag = delay / period
        whole = floor(self.lag)
        self.length = whole + 2  # the ring holds both neighbours of the delayed instant
        self.share = self.lag - whole
        self.rest()

    def rest(self) -> None:
        """Forget all samples; the first one is taken to have stood since ever."""
        self.low = self.before = 0.0
        self.ring: list[float] = []

    def __call__(self, k: int, value: float) -> float:
        """Return the reading of sample k."""
        if not self.ring:
            self.low = self.before = value
            self.ring = [value] * self.length
        if self.corner > 0.0:
            self.low = low_passed(self.low, self.before, value, self.corner, self.period)
        else:
            self.low = value
        self.before = value
        disturbance = self.noise(k) if self.deviation > 0.0 else 0.0
        return reading(
            k, self.low, self.ring, self.share, self.gain, self.bias, disturbance, self.quantisation
        )

    def noise(self, k: int) -> float:
        """Return the noise of sample k, in the signal's unit."""
        return white_noise(k, self.channel, self.seed, self.deviation)

    def get_state(self) -> Any:
        """Return a copy of the state."""
        return [self.low, self.before, list(self.ring)]

    def set_state(self, state: Any) -> None:
        """Take a copy of a state."""
        self.low, self.before = state[0], state[1]
        self.ring = list(state[2])
