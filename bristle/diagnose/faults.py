"""Sensor faults as they are told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..data.channels import channel_unit
from ..physics.effect import instrument_of
from ..quantity import plain, quantity

UNITS = {
    "gain": "1", "sign": "1", "unrelated": "1", "delay": "s", "lag": "s", "derived": "s",
    "high-pass": "rad/s",
}  # fmt: skip
"""Units of faults that do not have their channel's."""


@dataclass(frozen=True)
class SensorFault:
    """A fault of one channel.

    `fault` is "gain" [1], "sign" (-1), "delay" [s], "bias" or "clipping" [the channel's unit], or
    what an instrument does: "lag" [s, of first order], "high-pass" [1/s, its corner]; "derived" [s,
    how late] is a velocity that was computed from the displacement, "unrelated" (0) one of another
    motion. `std` is the uncertainty of `value`; `words` a sentence; `either` the channel that may
    have it instead, as far as the data tell; `run` the run whose channel it is, "" for all. `runs`
    are those that "clipping" was seen in, () for all; no model corrects it, so that `run` is "".
    "clock" [s/s] is what the channel's clock gains on that of the motion. "range" [the channel's
    unit] and "slew" [that per second] limit a command between its record and the coil.
    """

    channel: str
    fault: str
    value: float
    std: float
    words: str
    either: str = ""
    run: str = ""
    runs: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, object]:
        """Return what verdict.json holds of it."""
        entry = {
            "channel": self.channel, "fault": self.fault, "value": self.value, "std": self.std,
            "words": self.words,
        }  # fmt: skip
        more = {"either": self.either, "run": self.run}
        listed = {"runs": list(self.runs)} if self.runs else {}
        return {**entry, **{key: text for key, text in more.items() if text}, **listed}


def instruments_of(sensors: Sequence[SensorFault]) -> tuple[str, ...]:
    """Return the sensor effects that the faults of channels are.

    What one run alone has is no effect of a model, which all runs share: it is corrected there.
    """
    found = (instrument_of(one.channel, one.fault) for one in sensors if not one.run)
    return tuple(dict.fromkeys(name for name in found if name))


def words_of(faults: Sequence[SensorFault]) -> list[str]:
    """Return the sentences of faults."""
    return [fault.words for fault in faults]


def size_text(channel: str, fault: str, value: float) -> str:
    """Return the value of a fault with its unit.

    Parameters
    ----------
    channel, fault, value : as `SensorFault` has them
    """
    if fault == "clock":
        return f"{plain(1e6 * value)} ppm"
    own = channel_unit(channel)
    unit = UNITS.get(fault, f"{own}/s" if fault == "slew" else own)
    return quantity(value, unit, fine=True)
