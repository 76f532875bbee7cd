"""Measurements: channels in SI at evenly spaced times, whatever the file looked like.

Units are converted here, once. What was done to the samples is in `notes`; no sample is filtered.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.arrays import Array, Flags
from ..core.text import shown
from ..errors import RecordError, UnitError
from ..units import conversion
from .channels import (
    DRIVE,
    TEMPERATURE,
    ChannelSpec,
    Labels,
    at_device,
    channel_unit,
    is_smooth,
    mean_temperature,
)
from .corrections import Correction, gain_of, set_right
from .decimate import Finer, InTime, decimated, in_time
from .extra_channels import Extra, found_in, read_extra
from .guess import guess_channels, specs, too_few_rows
from .left_out import MASKED, MISSING, SATURATED, any_of, occurring
from .noise import KNOWN, Noise, Spike, estimate_noise, quietest, spikes_of, spikes_text
from .pieces import pieces_of
from .read import read_table
from .sampling import Even, Sampling, evenly
from .table import Table, table_from_frame

if TYPE_CHECKING:
    import pandas as pd


# Longer than 300 lines: a measurement is one class, and every way to make one is here.


@dataclass(frozen=True)
class Known:
    """What is known of a run besides its file.

    `name` of the run, "" for that of its file; `levels` of a command that the file does not hold,
    by channel, in its unit; `labels` what else is known of the whole run; `rate` [Hz] to which
    faster samples are decimated, 0 for none; `mask` whether isolated spikes count as not measured;
    `corrections` what is set right in its channels; `extra` where its extra channels are.
    """

    name: str = ""
    levels: Mapping[str, float] = field(default_factory=dict)
    labels: Labels = field(default_factory=dict)
    rate: float = 0.0
    mask: bool = False
    corrections: tuple[Correction, ...] = ()
    extra: Mapping[str, ChannelSpec] = field(default_factory=dict)


_CALENDAR = 1e8
"""Begin of a time [s] from which on it is that of a calendar."""
_ABSURD = 1e15  # in any SI unit; some recorders write 1e30 where a value is missing


@dataclass(frozen=True, eq=False)
class Measurement:
    """One piece of one run.

    Attributes
    ----------
    time : (n,) array
        [s], evenly spaced.
    channels : dict of (n,) arrays
        By name, in SI; `units` holds the units.
    measured : (n,) array of bool
        False where a sample was missing and is interpolated.
    masked : (n,) array of bool or None
        True where a sample is not measured because a spike there was masked; None for nowhere.
    lost : mapping of (n,) arrays of bool
        By channel: True where that one alone holds nothing, such as beyond the end of its record.
    saturated : mapping of (n,) arrays of bool
        By channel: True where that one may stand at the end of its range.
    parts, since : int, mapping of (n,) arrays
        Where samples were left out, at how many moments per sample a model is evaluated, and by
        command how it went from one sample to the next; see `finer`.
    noise : dict of float
        Standard deviation of each channel in SI; `noise_facts` how it was found, None where given.
    notes : tuple of str
        What was done.
    labels : mapping
        What is known of the whole run, by name: a number or a word.
    spikes : tuple of Spike
        Isolated spikes in the file that this piece is from, as far as they are not masked.
    extra : mapping of Extra
        Channels besides those that bristle knows, by name.

    Examples
    --------
    >>> import bristle, numpy as np, pathlib, tempfile
    >>> folder, t = pathlib.Path(tempfile.mkdtemp()), np.arange(0.0, 4.0, 0.004)
    >>> rows = np.column_stack([t, 72.0 * np.cos(9.0 * t), 5.0 * np.sin(9.0 * t)])
    >>> np.savetxt(
    ...     folder / "run.csv", rows, delimiter=",", header="time [s],v [mm/s],F [N]", comments=""
    ... )
    >>> run = bristle.Study.create(folder / "my_rig", [folder / "run.csv"]).read()[0]
    >>> run.units["velocity"], round(float(run["velocity"].max()), 3)
    ('m/s', 0.072)
    """

    name: str
    time: Array
    channels: dict[str, Array]
    units: dict[str, str]
    measured: Flags
    noise: dict[str, float]
    noise_facts: dict[str, Noise | None]
    sampling: Sampling
    source: str
    notes: tuple[str, ...] = field(default=())
    lost: Mapping[str, Flags] = field(default_factory=dict)
    parts: int = 1
    since: Mapping[str, Array] = field(default_factory=dict)
    labels: Labels = field(default_factory=dict)
    spikes: tuple[Spike, ...] = ()
    extra: Mapping[str, Extra] = field(default_factory=dict)
    saturated: Mapping[str, Flags] = field(default_factory=dict)
    masked: Flags | None = None

    def __repr__(self) -> str:
        rows = (
            f"{name} [{self.units[name]}]: {values.min():.4g} to {values.max():.4g}"
            for name, values in self.channels.items()
        )
        about = f"{self.name}, {len(self.time)} samples, {self.step:g} s apart"
        return shown(self, about, [*rows, *self.notes])

    @property
    def step(self) -> float:
        """Sampling step [s]."""
        return self.sampling.step

    @property
    def duration(self) -> float:
        """Time from the first sample to the last [s]."""
        return float(self.time[-1] - self.time[0])

    def valid(self, *channels: str, but_for: str = "") -> Flags:
        """Return at which samples (n,) all of these channels say something.

        Parameters
        ----------
        channels : their names
        but_for : the one reason that counts, such as "saturated"; "" for every one
        """
        found = self.left_out(*channels)
        if but_for:
            found = {reason: where for reason, where in found.items() if reason == but_for}
        out = any_of(found)
        return np.ones(len(self.time), dtype=np.bool_) if out is None else ~out

    def left_out(self, *channels: str) -> dict[str, Flags]:
        """Return why these channels say nothing at samples (n,): True by reason, if one holds."""
        nowhere = np.zeros(len(self.time), dtype=np.bool_)

        def of(flags: Mapping[str, Flags]) -> Flags:
            own = [flags[channel] for channel in channels if channel in flags]
            return np.asarray(np.any([nowhere, *own], axis=0), dtype=np.bool_)

        masked = nowhere if self.masked is None else self.masked & ~self.measured
        found = {
            MASKED: masked, MISSING: (~self.measured & ~masked) | of(self.lost),
            SATURATED: of(self.saturated),
        }  # fmt: skip
        return occurring(found)

    @property
    def finer(self) -> Finer | None:
        """How a model is evaluated between samples and filtered; None where none were left out."""
        if self.parts == 1:
            return None
        return Finer(self.parts, self.since.get(self.drive, np.ones(len(self.time))))

    @property
    def drive(self) -> str:
        """The channel that commands the damper, "" where none was measured."""
        return next((channel for channel in DRIVE if channel in self.channels), "")

    def has(self, *channels: str) -> bool:
        """Return whether all of these channels were measured."""
        return all(channel in self.channels for channel in channels)

    def __getitem__(self, channel: str) -> Array:
        """Return a channel (n,) in SI; RecordError if it was not measured."""
        if channel not in self.channels:
            raise RecordError(
                f"{self.name}: {channel} was not measured; there are {', '.join(self.channels)}."
            )
        return self.channels[channel]

    def part(self, start: int, stop: int, name: str) -> Measurement:
        """Return the samples from `start` up to `stop` as a measurement of its own."""
        return replace(
            self,
            name=name,
            time=self.time[start:stop],
            channels={key: values[start:stop] for key, values in self.channels.items()},
            measured=self.measured[start:stop],
            lost={key: flags[start:stop] for key, flags in self.lost.items()},
            saturated={key: flags[start:stop] for key, flags in self.saturated.items()},
            masked=None if self.masked is None else self.masked[start:stop],
            since={key: counts[start:stop] for key, counts in self.since.items()},
            extra={key: one.of(slice(start, stop)) for key, one in self.extra.items()},
        )

    def at_device(self, device: str) -> Measurement:
        """Return the measurement as that of one device: its brace_force is `force`.

        Parameters
        ----------
        device : its name; "" for none, and the measurement as it is

        Raises
        ------
        RecordError
            If force or command are there by both names.
        """
        names = {name: at_device(name, device) for name in self.channels}
        if all(name == other for name, other in names.items()):
            return self
        for name, other in names.items():
            if name != other and other in self.channels:
                raise RecordError(
                    f"{self.name}: {name} and {other} are both channels of the device {device!r}, "
                    "which is identified. One of the two is right."
                )

        def named(values: Mapping[str, Any]) -> dict[str, Any]:
            return {names.get(name, name): one for name, one in values.items()}

        return replace(
            self, channels=named(self.channels), units=named(self.units), lost=named(self.lost),
            saturated=named(self.saturated), since=named(self.since),
            noise=named(self.noise), noise_facts=named(self.noise_facts),
            spikes=tuple(one._replace(channel=names.get(one.channel, one.channel))
                         for one in self.spikes),
        )  # fmt: skip

    def digest(self) -> str:
        """Return 12 hex digits that two equal measurements share, whatever their files are."""
        whole = hashlib.sha256()
        for key in sorted(self.channels):
            whole.update(key.encode())
            whole.update(np.round(self.channels[key], 12).tobytes())
        return whole.hexdigest()[:12]


def read_measurements(
    paths: Iterable[Path | str], channels: Mapping[str, ChannelSpec] | None = None
) -> list[Measurement]:
    """Return the measurements in files: one per run, or one per piece where values are missing.

    Parameters
    ----------
    paths : files that `bristle.data.read.read_table` reads
    channels : where each channel is, the same in all files; None guesses (`guess_channels`), and
        the notes say what was guessed and why

    Raises
    ------
    RecordError
        If a file cannot be read, a channel is not there or has no unit, or times are not in order.
    """
    tables = [read_table(path) for path in paths]
    pieces = [piece for table in tables for piece in pieces_of(table, table.split, {})]
    return [one for piece in pieces for one in measurements_of(piece, channels)]


def read_measurement(
    path: Path | str, channels: Mapping[str, ChannelSpec] | None = None
) -> Measurement:
    """Return the measurement in a file; RecordError if gaps cut it into several pieces."""
    found = read_measurements([path], channels)
    if len(found) > 1:
        raise RecordError(
            f"{path}: missing values cut it into {len(found)} pieces. Take read_measurements, "
            "which returns them all."
        )
    return found[0]


def measurements_of_frame(
    frame: pd.DataFrame, name: str = "frame", channels: Mapping[str, ChannelSpec] | None = None
) -> list[Measurement]:
    """Return the measurements in a pandas frame whose titles or `attrs["units"]` give units."""
    return measurements_of(table_from_frame(frame, name), channels)


def measurements_of(
    table: Table,
    channels: Mapping[str, ChannelSpec] | None = None,
    *,
    estimate: bool = True,
    known: Known | None = None,
) -> list[Measurement]:
    """Return the measurements in a table; see `read_measurements`.

    Parameters
    ----------
    table : what a file holds
    channels : where each channel is; None guesses
    estimate : False leaves out noise that is not given
    known : what is known of the run besides
    """
    known = known or Known()
    notes = [*table.notes, *table.remarks]
    if channels is None:
        guesses = guess_channels(table)
        notes += [f"guessed: {guess}" for guess in guesses]
        channels = specs(table, guesses)
        known = replace(known, extra=found_in(table, [g.column for g in guesses], channels))
    time = time_of(table, channels.get("time"))
    units, values = {}, {}
    for channel, spec in channels.items():
        if channel == "time":
            continue
        units[channel] = channel_unit(channel)
        values[channel] = in_si(table, channel, spec)
    labels = dict(known.labels)
    warm = values.pop(TEMPERATURE, None)
    if warm is not None:
        units.pop(TEMPERATURE)
        mean, text = mean_temperature(warm)
        notes.append(text)
        if mean is not None:
            labels.setdefault(TEMPERATURE, mean)
    if not values:
        raise RecordError(f"{table.source}: no channel besides time is named. There is nothing.")
    there = {name: np.isfinite(y) for name, y in values.items()}
    spikes = spikes_of(time, values, mask=known.mask)
    masked = time[np.any([own & ~np.isfinite(values[n]) for n, own in there.items()], axis=0)]
    notes += _masked(spikes) if known.mask else []
    extra = read_extra(table, time, known.extra)
    if warm is not None:
        extra = extra.beside(TEMPERATURE, time, warm, channel_unit(TEMPERATURE))
    even = evenly(time, values, table.lines, table.source, table.place)
    notes += [*extra.notes, *even.notes, *_what_is_missing([*values, *known.levels])]
    even, moved = _set_right(even, known.corrections)
    if known.corrections:
        notes.append(f"corrected: {'; '.join(one.text for one in known.corrections)}")
    fewer = decimated(even, known.rate, moved)
    even, notes = fewer.even, [*notes, *fewer.notes]
    out = []
    stem = known.name or stem_of(table.source)
    for number, (piece, parts, measured) in enumerate(even.pieces, 1):
        name = stem if len(even.pieces) == 1 else f"{stem} ({number} of {len(even.pieces)})"
        noise, facts = _noise(table, channels, parts, estimate, known.corrections)
        if fewer.gain:
            _behind_filter(fewer.gain, fewer.noise[number - 1], parts, noise, facts)
        for channel, level in known.levels.items():
            units[channel], noise[channel], facts[channel] = channel_unit(channel), 0.0, None
            parts[channel] = np.full(len(piece), level)
        out.append(
            Measurement(
                name, piece, parts, units, measured, noise, facts, even.sampling, table.source,
                tuple(notes), labels=labels, spikes=() if known.mask else spikes,
                lost=fewer.lost[number - 1], parts=fewer.parts, since=fewer.since[number - 1],
                extra=extra.at(piece),
                masked=_beside(piece, masked, even.sampling.step) if len(masked) else None,
            )
        )  # fmt: skip
    return out


def _set_right(even: Even, corrections: tuple[Correction, ...]) -> tuple[Even, list[InTime]]:
    """Return pieces whose channels are set right, and what is known of those moved in time."""
    step, start = even.sampling.step, float(even.pieces[0][0][0])
    moved = [
        in_time(
            set_right(channels, step, corrections), dict.fromkeys(channels, measured), step,
            corrections, float(time[0]) - start,
        )
        for time, channels, measured in even.pieces
    ]  # fmt: skip
    pieces = [
        (time, one.channels, measured)
        for (time, _, measured), one in zip(even.pieces, moved, strict=True)
    ]
    return replace(even, pieces=pieces), moved


def _beside(time: Array, masked: Array, step: float) -> Flags:
    """Return which times (n,) [s] lie within a step of one of those that were masked (m,)."""
    ordered = np.sort(masked)
    after = np.searchsorted(ordered, time)
    behind, ahead = ordered[np.maximum(after - 1, 0)], ordered[np.minimum(after, len(ordered) - 1)]
    return np.minimum(np.abs(time - behind), np.abs(ahead - time)) <= step * (1.0 + 1e-6)


def _masked(spikes: tuple[Spike, ...]) -> list[str]:
    """Say what was masked, a sentence per channel."""
    named = dict.fromkeys(one.channel for one in spikes)
    own = [tuple(one for one in spikes if one.channel == name) for name in named]
    return [f"{spikes_text(one)}: masked, they count as not measured" for one in own]


def stem_of(source: str) -> str:
    """Return the name of a file without its folder and its ending."""
    name = Path(source).name
    return name.removesuffix(".gz").rpartition(".")[0] or name


def time_of(table: Table, spec: ChannelSpec | None) -> Array:
    """Return the time (n,) s of a table's rows; RecordError if nothing says it."""
    if spec is not None and spec.step is not None:
        if not spec.step > 0.0:
            raise RecordError(f"{table.source}: time: step = {spec.step!r} s must be positive.")
        return np.arange(table.rows, dtype=np.float64) * spec.step
    if spec is None:
        why = too_few_rows(table) or "no column is the time"
        raise RecordError(
            f"{table.source}: {why}. Name one in [channels.time], or give the sampling step there: "
            "step = 0.002  # s"
        )
    return from_first(in_si(table, "time", spec))


def from_first(time: Array) -> Array:
    """Return times (n,) s as they are, those of a calendar since the first.

    They are large, and of their digits few are left for what lies between two samples.
    """
    known = time[np.isfinite(time)]
    return time - known[0] if known.size and known[0] > _CALENDAR else time


def in_si(table: Table, channel: str, spec: ChannelSpec) -> Array:
    """Return a column (n,) in the channel's SI unit, NaN where a value is missing.

    Parameters
    ----------
    table, channel : what a file holds, and the name of the channel
    spec : where it is in the table

    Raises
    ------
    RecordError
        If there is no such column, or it holds words, has no unit or one of another quantity.
    """
    column = table.find(spec.column)
    if column.text in table.not_numeric:
        raise RecordError(
            f'{table.source}: column "{column.text}" ({channel}): '
            f"{table.not_numeric[column.text]}. Correct the file, or leave the field "
            "empty where a value is missing."
        )
    unit = spec.unit or column.stated
    if not unit:
        raise RecordError(
            f'{table.source}: column "{column.text}" ({channel}) has no unit. Say '
            f"unit = what it is in, such as {channel_unit(channel)}, in [channels.{channel}]."
        )
    if spec.sign not in (1, -1):
        raise RecordError(f"[channels.{channel}]: sign = {spec.sign!r}; 1 or -1 is right.")
    try:
        factor, offset = conversion(unit, channel_unit(channel))
    except UnitError as error:
        raise RecordError(f'{table.source}: column "{column.text}" ({channel}): {error}') from None
    si: Array = float(spec.sign) * (factor * (table.values[column.text] - spec.zero) + offset)
    beyond = np.flatnonzero(np.abs(si) > _ABSURD)
    if len(beyond):
        raise RecordError(
            f'{table.source}, {table.where(int(beyond[0]))}: "{column.text}" ({channel}) is '
            f"{si[beyond[0]]:g} {channel_unit(channel)}, which nothing measures. Leave the field "
            "empty where a value is missing."
        )
    return si


def _noise(
    table: Table, channels: Mapping[str, ChannelSpec], parts: dict[str, Array], estimate: bool,
    corrections: tuple[Correction, ...] = (),
) -> tuple[dict[str, float], dict[str, Noise | None]]:  # fmt: skip
    noise: dict[str, float] = {}
    facts: dict[str, Noise | None] = {}
    for channel, values in parts.items():
        spec = channels[channel]
        if spec.noise is not None:
            column = table.find(spec.column)
            unit = spec.unit or column.stated
            given = spec.noise * conversion(unit, channel_unit(channel))[0]
            noise[channel] = given / gain_of(corrections, channel)
            facts[channel] = None
        elif estimate:
            found = estimate_noise(values)
            noise[channel], facts[channel] = found.std, found
    return noise, facts


def _behind_filter(
    gains: Mapping[str, float], before: Mapping[str, Noise], parts: Mapping[str, Array],
    noise: dict[str, float], facts: dict[str, Noise | None],
) -> None:  # fmt: skip
    """Change the noise of channels into that behind an anti-alias filter or an interpolation.

    That of a force is not white there: it is told from before, and is no better known. A motion
    shows its noise behind its filter too, or what was known before.

    Parameters
    ----------
    gains : by channel, what filter and interpolation leave of white noise
    before : by channel, the noise before them, where it was estimated
    parts : the channels as they are now
    noise, facts : of the channels as they are now, changed in place
    """
    for channel, gain in gains.items():
        now, found = facts.get(channel), before.get(channel)
        if channel in facts and now is None:
            noise[channel] *= gain
        if now is None or found is None:
            continue
        long = is_smooth(channel) and gain < 1.0
        if not long or (now.colour not in KNOWN and found.colour in KNOWN):
            std = gain * found.std
            if found.colour in {"resting", "slow"}:  # low-passed: the filter may leave all of it
                std = max(std, min(found.std, quietest(parts[channel])[0]))
            noise[channel], facts[channel] = std, replace(found, std=std)


def _what_is_missing(values: Sequence[str]) -> list[str]:
    """Say which channels are absent, for much depends on it."""
    notes = []
    x, v = "displacement" in values, "velocity" in values
    bench = x or v or "force" in values
    if bench and x and not v:
        notes.append("no velocity: it follows from the displacement")
    if bench and v and not x:
        notes.append("no displacement: it follows from the velocity up to where it begins")
    return notes


# Names of runs, no two of which are alike: corrections, roles and faults go by them.

_PARTS = (" (", ", ")
"""How the name of a part of a run goes on behind that of the run: "run (1 of 2)", "run, first"."""


def names_of_files(files: Sequence[str], ends: Sequence[str] = ()) -> list[str]:
    """Return a name for each run in a file, the shortest that means no other run.

    Parameters
    ----------
    files : (n,) path of the file of each run. Its run is called by its stem; where another one has
        that too, as of run.csv and run.txt, by its whole name; else by its path
    ends : (n,) what tells the runs of one file apart, such as " run 2"; by default nothing

    Returns
    -------
    list of str
        (n,) names.
    """
    ends = ends or [""] * len(files)
    forms = [
        [f"{form}{end}" for form in (stem_of(file), Path(file).name, file)]
        for file, end in zip(files, ends, strict=True)
    ]
    longer = [0] * len(files)
    while True:
        names = [own[k] for own, k in zip(forms, longer, strict=True)]
        counts, wholes = Counter(names), {whole for name in names for whole in _wholes(name)}
        doubtful = [
            k
            for k, name in enumerate(names)
            if longer[k] < len(forms[k]) - 1 and (counts[name] > 1 or name in wholes)
        ]
        if not doubtful:
            return names
        for k in doubtful:
            longer[k] += 1


def is_part(name: str, whole: str) -> bool:
    """Return whether a name is that of a run or of a part of it."""
    return name == whole or name.startswith(tuple(f"{whole}{part}" for part in _PARTS))


def _wholes(name: str) -> list[str]:
    """Return of which runs' parts this could be the name."""
    return [name[:k] for part in _PARTS for k in range(len(name)) if name.startswith(part, k)]
