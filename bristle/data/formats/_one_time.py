"""Channels that were sampled at other times or rates than others, on one time axis."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import Array
from ...core.text import listed, plain
from ...errors import RecordError
from ...units import parse as parse_unit
from ..noise import SHORTEST, is_switched
from ..sampling import between, covered
from ..titles import title

AnyArray: TypeAlias = NDArray[Any]

SECOND, HERTZ = parse_unit("s").dimension, parse_unit("Hz").dimension
SAME = 0.02
"""Share of the step by which samples may be apart and are taken as simultaneous."""
_LITTLE = 0.01  # share of a record that may be cut off at its ends without a word


@dataclass(frozen=True, eq=False)
class Series:
    """Channels of one clock: `time` (n,) s on the clock of the file, and (n,) of each by its name.

    The time increases from sample to sample.
    """

    time: Array
    data: dict[str, AnyArray]

    @property
    def step(self) -> float:
        """The usual spacing [s]."""
        return float(np.median(np.diff(self.time)))

    @property
    def span(self) -> tuple[float, float]:
        """The first and the last time [s]."""
        return float(self.time[0]), float(self.time[-1])


@dataclass(frozen=True, eq=False)
class Joined:
    """Channels (m,) on one time (m,) s, in the order of their series, and what was done for it."""

    time: Array
    data: dict[str, AnyArray]
    remarks: tuple[str, ...]


def overlap(series: Sequence[Series]) -> tuple[float, float]:
    """Return the first and the last time [s] that all series have; in wrong order if none."""
    spans = [one.span for one in series]
    return max(begin for begin, _ in spans), min(end for _, end in spans)


def on_one_time(series: Sequence[Series], name: str) -> Joined:
    """Return channels on the times of the fastest series, cut to the part that all of them have.

    What has no sample at these times is interpolated as uneven times are (see `sampling`); what
    jumps between a few levels, and what holds no numbers, keeps its last value.

    Parameters
    ----------
    series : of one file; no two share the name of a channel
    name : the file, for messages

    Raises
    ------
    RecordError
        If the series do not overlap by the 60 samples of the shortest record.
    """
    fastest = min(one.step for one in series) * (1.0 + 1e-3)
    chosen = max((one for one in series if one.step <= fastest), key=lambda one: len(one.data))
    begin, end = overlap(series)
    slack = SAME * chosen.step
    kept = (chosen.time >= begin - slack) & (chosen.time <= end + slack)
    if int(kept.sum()) < SHORTEST:
        where = "; ".join(_where(one) for one in series[:4])
        few = (
            f"overlap in time by {kept.sum()} samples alone"
            if kept.any()
            else "do not overlap in time"
        )
        raise RecordError(
            f"{name}: its channels {few}: {where}. A measurement needs {SHORTEST} samples that all "
            "of them have: save what was recorded together in one file."
        )
    time = chosen.time[kept]
    data: dict[str, AnyArray] = {}
    remarks: list[str] = []
    for one in series:
        found, interpolated = _at(one, time) if one is not chosen else (_rows(one, kept), False)
        data |= found
        remarks += _notes_on(one, chosen, interpolated)
    slowest = max(one.step for one in series)
    spans = [one.span for one in series]
    lost = max(max(begin - first, last - end) for first, last in spans)
    if lost > min(1.5 * slowest, _LITTLE * (end - begin)):
        remarks.append(
            f"only the part that all channels have is read: {plain(time[0], 5)} s to "
            f"{plain(time[-1], 5)} s"
        )
    return Joined(time, data, tuple(remarks))


def _rows(one: Series, kept: NDArray[Any]) -> dict[str, AnyArray]:
    return {key: array[kept] for key, array in one.data.items()}


def _at(one: Series, time: Array) -> tuple[dict[str, AnyArray], bool]:
    """Return a series' channels at other times (m,) s, and whether they are interpolated."""
    places = np.clip(np.searchsorted(one.time, time), 0, len(one.time) - 1)
    before = np.maximum(places - 1, 0)
    nearer = np.abs(one.time[before] - time) < np.abs(one.time[places] - time)
    places = np.where(nearer, before, places)
    step = min(one.step, float(np.median(np.diff(time))))
    if np.max(np.abs(one.time[places] - time)) <= SAME * step:
        return {key: array[places] for key, array in one.data.items()}, False
    last = np.clip(np.searchsorted(one.time, time + SAME * step, "right") - 1, 0, None)
    return {
        key: _interpolated(one, array, time) if array.dtype.kind in "fiub" else array[last]
        for key, array in one.data.items()
    }, True


def _interpolated(one: Series, array: AnyArray, time: Array) -> Array:
    """Return a channel between its samples, NaN where one of them is missing."""
    y = np.asarray(array, dtype=float)
    finite = np.isfinite(y)
    if int(finite.sum()) < 2:
        return np.full(len(time), np.nan)
    out = between(time, one.time[finite], y[finite])
    # Where a value is held, the end of the last sample is half a step further.
    slack = np.clip(time, *one.span)
    out[~covered(slack, one.time[finite], one.step)] = np.nan
    return out


def _notes_on(one: Series, chosen: Series, interpolated: bool) -> list[str]:
    """Return what is to be known of a series beside that on whose times it is."""
    names, others = listed(f'"{key}"' for key in one.data), _others(chosen)
    several = len(one.data) > 1
    told = []
    late = one.time[0] - chosen.time[0]
    if abs(late) > SAME * chosen.step:
        order = "later" if late > 0 else "earlier"
        told.append(f"begin{'s' * (not several)} {_ms(abs(late))} {order} than {others}")
    if abs(one.step - chosen.step) > 1e-3 * chosen.step:
        verb = "are" if several else "is"
        told.append(f"{verb} sampled every {_ms(one.step)}, and {others} every {_ms(chosen.step)}")
    if not told and not interpolated:
        return []
    how = ""
    if interpolated:
        held = [
            key
            for key, array in one.data.items()
            if array.dtype.kind not in "fiub" or is_switched(np.asarray(array, dtype=float))
        ]
        how = ", interpolated"
        if held:
            how += f" ({listed(held)}: the last value counts)"
    what = "; ".join(told) or f"{'have' if several else 'has'} other times than {others}"
    return [f"{names} {what}: put on one time{how}"]


def _others(chosen: Series) -> str:
    return listed([f'"{key}"' for key in chosen.data], 3)


def _where(one: Series) -> str:
    begin, end = one.span
    names = listed([f'"{key}"' for key in one.data], 3)
    return f"{names} from {plain(begin, 5)} s to {plain(end, 5)} s"


def _ms(seconds: float) -> str:
    """Return a time in ms, in s where that is longer than a second."""
    return f"{plain(seconds, 4)} s" if seconds >= 1.0 else f"{plain(1e3 * seconds, 4)} ms"


# Numbers that tell how far samples are apart, by their names: dt, fs, sampling rate.

OF_SAMPLES = r"(?:sampl\w*|abtast|scan|acquisition|mess)[ _-]?"
_STEP = re.compile(
    r"dt|ts|t_s|dx|delta[ _-]t|step|tsample|(?:sampl\w*|abtast)[ _-]?(?:time|zeit)"
    rf"|{OF_SAMPLES}(?:interval|period)\w*",
    re.IGNORECASE,
)
RATE = re.compile(rf"fs|f_s|fsample|rate|sampling|{OF_SAMPLES}(?:rate|freq\w*)", re.IGNORECASE)
"""How a number is called that is a rate."""


def step_in(key: str, value: float) -> float:
    """Return the step [s] that a number tells by its name, as dt, fs, dt_ms or fs_kHz; 0 if none.

    Parameters
    ----------
    key : name of the number
    value : the number, in the unit of its name; in s or Hz where that has none
    """
    name, factor, quantity = key.rpartition(".")[2], 1.0, ""
    if not (_STEP.fullmatch(name) or RATE.fullmatch(name)):
        named = title(0, name)
        if named.unit is None or named.unit.dimension not in (SECOND, HERTZ):
            return 0.0
        name, factor = named.name, named.unit.factor
        quantity = "step" if named.unit.dimension == SECOND else "rate"
    if not 0.0 < value < np.inf:
        return 0.0
    if _STEP.fullmatch(name) and quantity != "rate":
        return value * factor
    return 1.0 / (value * factor) if RATE.fullmatch(name) and quantity != "step" else 0.0


def unset_step(called: str, step: float) -> list[str]:
    """Return that the step [s] of which a time is made is that of a waveform which nobody set."""
    doubt = f"the time is made from {called} = 1 s, which may be the step that nobody set; --step S"
    return [f"{doubt}, the sampling step in s, or the channel of the time says it"] * (step == 1.0)


def by_length(
    data: Mapping[str, AnyArray], series: Sequence[Series]
) -> tuple[list[Series], dict[str, AnyArray]]:
    """Return series with the channels of no known time that are as long, and the other channels.

    Parameters
    ----------
    data : channels of no known time, by name
    series : those that have one; the first one of a length takes the channels of that length
    """
    out, rest = list(series), dict(data)
    for index, one in enumerate(out):
        own = {key: array for key, array in rest.items() if len(array) == len(one.time)}
        rest = {key: array for key, array in rest.items() if key not in own}
        out[index] = Series(one.time, {**one.data, **own})
    return out, rest
