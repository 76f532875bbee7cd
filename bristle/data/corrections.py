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
from math import copysign
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.arrays import Array, Flags
from ..core.text import plain, quantity
from .channels import channel_unit

# A command as it reaches the coil: limited in slew or in range behind the point of its record.
#
# A supply or an amplifier gives no more than its limit, and changes it no faster than it can. What
# was recorded before it is the command, and not what the damper felt.

LIMITS = ("range", "slew")
"""Faults of a command that `limited` knows, in the order in which they are put on it."""

JUMP = 8.0
"""How many times the changes beside it a change of a command exceeds that is a jump."""


def jumps(V: Array) -> Flags:
    """Return at which samples of a command (n,) it jumps: it was held until then."""
    change = np.abs(np.diff(V, prepend=V[:1]))
    beside = np.maximum(np.append(0.0, change[:-1]), np.append(change[1:], 0.0))
    found: Flags = change > JUMP * beside
    return found


def limited(V: Array, step: float, fault: str, value: float) -> Array:
    """Return a command (n,) as it reaches the coil.

    Parameters
    ----------
    V : (n,) the command, in its unit
    step : sampling step [s]
    fault : "range", no more than `value` on either side of zero; "slew", no faster than `value`
        per second
    value : the limit, in the command's unit, or in that per second
    """
    if fault == "range":
        return np.clip(V, -value, value)
    return _slowed(V, value * step)


def _slowed(V: Array, most: float) -> Array:
    """Return a command (n,) that changes by so much per sample at the most.

    A jump falls on a sample: until then the command was held, so that a ramp begins there.
    """
    if not np.any(np.abs(np.diff(V)) > most):
        return V
    held = np.append(V[:1], V[:-1])
    target = np.where(jumps(V), held, V)
    out = target.copy()
    count, done = len(V), 0
    for first in (1 + np.flatnonzero(np.abs(np.diff(target)) > most)).tolist():
        k = max(first, done)
        y = float(out[k - 1])
        while k < count and abs(gap := float(target[k]) - y) > most:
            y += copysign(most, gap)
            out[k] = y
            k += 1
        done = max(done, k)
    return out


# A sinusoid taken off a channel, all else left as it is.

Complex = NDArray[np.complex128]

_SLOW = 40.0  # Hz; what is slower is taken off before the jumps of a force are cut down
_CUT = 4.0  # standard deviations, told from the median, at which they are cut
_HALF_PIECE = 5.0  # s, half of a piece in which a sinusoid keeps its amplitude
BETA = 14.0  # of the Kaiser window: 100 dB, so that no motion leaks to where lines are looked for


def without_lines(y: Array, step: float, frequencies: Sequence[float]) -> Array:
    """Return a channel without lines: the sinusoids that fit it best are taken off.

    The sinusoid is fitted in pieces of ten seconds that overlap, so that it may drift. All else
    that the channel holds stays, at other frequencies to 0.1 Hz.

    Parameters
    ----------
    y : (n,) evenly spaced
    step : s
    frequencies : Hz
    """
    out = np.array(y, dtype=float)
    time = step * np.arange(len(y))
    for frequency in frequencies:
        wave = np.exp(2j * np.pi * frequency * time)
        out -= np.real(drifting_amplitude(out, step, frequency) * wave)
    return out


def drifting_amplitude(y: Array, step: float, frequency: float) -> Complex:
    """Return the complex amplitude (n,) of a sinusoid in a channel, told where it does not jump.

    It is linear between the middles of pieces of ten seconds that overlap by half.

    Parameters
    ----------
    y : (n,) evenly spaced
    step : s
    frequency : Hz
    """
    fast, most = without_slow(y, step)
    wave = np.exp(2j * np.pi * frequency * step * np.arange(len(y)))
    weight = (np.abs(fast) <= most).astype(float)
    n, half = len(y), max(round(_HALF_PIECE / step), 2)
    centres = np.linspace(0.0, n - 1.0, max(n // half - 1, 1)) if n > 2 * half else np.zeros(1)
    begins = [int(np.clip(centre - half, 0, max(n - 2 * half, 0))) for centre in centres]
    parts = [slice(begin, begin + 2 * half) for begin in begins]
    found = [amplitude_of(fast[part], wave[part], weight[part]) for part in parts]
    at = np.arange(n)
    real, imaginary = (np.interp(at, centres, of(found)) for of in (np.real, np.imag))
    return np.asarray((real + 1j * imaginary) / _passed(frequency, step), dtype=complex)


def amplitude_of(y: Array, wave: Complex, weight: Array | float = 1.0) -> complex:
    """Return the complex amplitude of a wave (n,) in y (n,): y = Re(amplitude wave).

    Under a Kaiser window, so that motions far below do not leak in; samples may have a weight (n,).
    """
    window = weight * np.kaiser(len(y), BETA)
    return complex(2.0 * np.sum(window * y * np.conj(wave)) / max(float(np.sum(window)), 1e-300))


def without_slow(y: Array, step: float) -> tuple[Array, float]:
    """Return a channel (n,) without what is slow, and the size at which its jumps are cut down."""
    fast = np.asarray(y - _slow(y, step), dtype=float)
    most = _CUT * 1.4826 * float(np.median(np.abs(fast)))
    return fast, most or float(np.max(np.abs(fast)))


def _slow(y: Array, step: float) -> Array:
    """Return the mean of a channel (n,) about each sample, weighted by a Hann window."""
    half = max(round(1.0 / (_SLOW * step)), 2)
    taps = np.hanning(2 * half + 1)[1:-1]
    padded = np.pad(y, half - 1, mode="reflect", reflect_type="odd")
    return np.asarray(np.convolve(padded, taps / taps.sum(), "valid"), dtype=float)


def _passed(frequency: float, step: float) -> float:
    """Return what `without_slow` leaves of a line's amplitude."""
    half = max(round(1.0 / (_SLOW * step)), 2)
    taps = np.hanning(2 * half + 1)[1:-1]
    turns = np.cos(2.0 * np.pi * frequency * step * np.arange(1 - half, half))
    return 1.0 - float(taps @ turns) / float(taps.sum())


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
