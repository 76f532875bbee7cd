"""What is set right in a run's channel as it is read: a gain, a zero, a sign, a delay, a line.

study.toml names them with the run:

[[runs]]
file = "data/run_3.csv"
correct = [
  { channel = "force", fault = "gain", value = 1.25 },  # it shows 1.25 times what it should
  { channel = "force", fault = "line", value = 50.0 },  # Hz
]
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..quantity import plain, quantity
from .channels import channel_unit
from .command_limits import LIMITS, limited
from .line_removal import without_lines
from .table import Array

FAULTS = {
    "gain": "what it shows by what it should show",
    "bias": "what it shows too much, in its SI unit",
    "sign": "-1",
    "delay": "s by which it is late",
    "clock": "seconds that its clock gains per second",
    "line": "Hz of a sinusoid that is taken off",
    "range": "the most of a command that reaches the coil, in its SI unit",
    "slew": "the most by which a command changes at the coil, per second",
}
"""Faults that can be set right, and what their value is."""

TIMING = ("clock", "delay")
"""Those of a channel's time; see `timing`."""


LEFT_OUT = 'leave it out: role = "exclude" in its [[runs]] of study.toml'
"""How a run is left out, for what names a run that does not belong."""


class Correction(NamedTuple):
    """A fault of a channel that is set right: which, one of `FAULTS`, and its value."""

    channel: str
    fault: str
    value: float

    def is_like(self, other: Correction) -> bool:
        """Return whether another one sets the same right, by nearly the same value."""
        return self[:2] == other[:2] and bool(np.isclose(self.value, other.value, rtol=5e-3))

    @property
    def text(self) -> str:
        """What is done, as people write it."""
        value, unit = self.value, channel_unit(self.channel)
        return {
            "gain": f"{self.channel} is divided by {plain(value, 4)}",
            "bias": f"{quantity(value, unit, 3, fine=True)} is taken off {self.channel}",
            "sign": f"{self.channel} is turned",
            "delay": f"{self.channel} is moved ahead by {plain(1e3 * value)} ms",
            "clock": f"the clock of {self.channel} is set right by {plain(1e6 * value)} ppm",
            "line": f"a line at {plain(value, 4)} Hz is taken off {self.channel}",
            "range": f"{self.channel} reaches the coil up to {quantity(value, unit, 4)}",
            "slew": f"{self.channel} reaches the coil no faster than {plain(value, 4)} {unit}/s",
        }[self.fault]


def wrong_value(fault: str, value: float) -> str:
    """Return what is wrong with a correction's value, "" where it is right."""
    if not np.isfinite(value):
        return "a finite number is right."
    if fault == "gain" and value <= 0.0:
        return 'a positive number is right; fault = "sign" turns a channel.'
    if fault == "sign" and value != -1.0:
        return "-1 is right."
    if fault == "line" and value <= 0.0:
        return "a frequency in Hz is right."
    if fault in LIMITS and value <= 0.0:
        return "a positive number is right."
    if fault == "clock" and abs(value) > 0.01:
        return "100 ppm are 1e-4; no clock is off by a hundredth."
    return ""


def set_right(
    channels: Mapping[str, Array], step: float, corrections: Sequence[Correction]
) -> dict[str, Array]:
    """Return channels (n,) as they would be without their faults, those of their time left in.

    Parameters
    ----------
    channels : name to (n,) in SI, evenly spaced
    step : s
    corrections : of these channels; others are passed over. A sign and a gain are on what an
        instrument shows with its zero, so that the zero is taken off first
    """
    out = dict(channels)
    for name, y in channels.items():
        own = [one for one in corrections if one.channel == name]
        lines = [one.value for one in own if one.fault == "line" and one.value < 0.5 / step]
        y = without_lines(y, step, lines) if lines else y
        for kind in ("bias", "gain", "sign", *LIMITS):
            for one in own:
                y = _without(y, step, one) if one.fault == kind else y
        out[name] = y
    return out


def _without(y: Array, step: float, correction: Correction) -> Array:
    """Return a channel (n,) without one fault."""
    value = correction.value
    if correction.fault == "bias":
        return y - value
    if correction.fault == "gain":
        return y / value
    if correction.fault == "sign":
        return -y
    return limited(y, step, correction.fault, value)


def gain_of(corrections: Sequence[Correction], channel: str) -> float:
    """Return what a channel shows by what it should show, by its corrections: 1 without any."""
    gains = [one.value for one in corrections if (one.channel, one.fault) == (channel, "gain")]
    return float(np.prod(gains))


def after(known: Sequence[Correction], found: Sequence[Correction]) -> list[Correction]:
    """Return corrections that were found where others are made already, beside those.

    Parameters
    ----------
    known : corrections that were made
    found : of the channels as they are with them: a zero is in corrected units, and is taken off
        before a gain and a sign are
    """
    return [
        one._replace(value=one.value * _shown_by(known, one.channel))
        if one.fault == "bias"
        else one
        for one in found
    ]


def _shown_by(known: Sequence[Correction], channel: str) -> float:
    """Return what a channel shows of a unit, by corrections of its gain and sign."""
    turned = sum((one.channel, one.fault) == (channel, "sign") for one in known)
    return gain_of(known, channel) * (-1.0) ** turned
