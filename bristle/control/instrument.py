"""An instrument's channel, sample by sample: low-pass, delay, gain, bias, noise, quantisation."""

from __future__ import annotations

from math import floor, isfinite, pi
from random import Random
from typing import Any

from .sensing import low_passed


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
        at = k % self.length
        self.ring[at] = self.low
        near = self.ring[(at + 2) % self.length]
        far = self.ring[(at + 1) % self.length]
        reading = self.gain * (near + self.share * (far - near)) + self.bias
        if self.deviation > 0.0:
            key = (self.seed * 64 + self.channel) * 2**40 + k
            reading += self.deviation * Random(key).gauss(0.0, 1.0)
        if self.quantisation > 0.0 and isfinite(reading / self.quantisation):
            reading = self.quantisation * floor(reading / self.quantisation + 0.5)
        return reading

    def get_state(self) -> Any:
        """Return a copy of the state."""
        return [self.low, self.before, list(self.ring)]

    def set_state(self, state: Any) -> None:
        """Take a copy of a state."""
        self.low, self.before = state[0], state[1]
        self.ring = list(state[2])
