"""One measurement as an FMU is fed: channels and other columns, motion smoothed, errors drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..data.channels import DRIVE, PLAIN, ChannelSpec, channel_unit
from ..data.guess import guess_channels, specs
from ..data.noise import estimate_noise
from ..data.sampling import evenly
from ..data.table import Table
from ..errors import RecordError
from ..identify.drive import smooth_drive
from ..identify.smooth import posterior_draws, smooth
from ..units import conversion

Array = NDArray[np.float64]

DRAWS = 6
"""Draws of the inputs' error."""
_KINEMATIC = ("displacement", "velocity", "acceleration")


@dataclass(frozen=True, eq=False)
class Signals:
    """One piece of a measurement as an FMU is fed: values (n,) in SI, smoothed where they can be.

    `errors` name to (d, n): draws of what is left uncertain; `raw` the channels as measured, with
    their noise, which is not known of those `untold`; `rates` name to that of the signal whose
    derivative is known; `measured` (n,) where nothing was filled in.
    """

    name: str
    dt: float
    values: dict[str, Array]
    units: dict[str, str]
    errors: dict[str, Array]
    raw: dict[str, Array]
    noise: dict[str, float]
    rates: dict[str, str] = field(default_factory=dict)
    derived: tuple[str, ...] = ()
    untold: tuple[str, ...] = ()
    measured: NDArray[np.bool_] = field(default_factory=lambda: np.ones(0, dtype=np.bool_))


def signals_of(
    table: Table, channels: Mapping[str, ChannelSpec], rig: str, seed: int = 0
) -> tuple[list[Signals], list[str]]:
    """Return the pieces of a table as an FMU is fed, and what was guessed and done.

    Columns that are no known channel are there under their own names, if they have a unit.

    Parameters
    ----------
    table : the measurement, not converted yet
    channels : channels that are known, by name; the others are guessed
    rig : {"bench", "structure"}, which decides the channels that are looked for
    seed : of the draws of the inputs' error; piece k takes seed + k

    Raises
    ------
    RecordError
        If there is no time, no column with a unit, or a given channel cannot be read.
    """
    guesses = guess_channels(table, rig)
    notes = [f"guessed: {one}" for one in guesses if one.channel not in channels and one.doubt]
    chosen = {**specs(table, guesses), **channels}
    time, columns = _time(table, chosen.pop("time", None)), {}
    for name, spec in chosen.items():
        column = table.find(spec.column)
        unit = spec.unit or (column.unit.name if column.unit else "")
        if not unit or column.text in table.not_numeric:
            if name in channels:
                raise RecordError(f'{table.source}: "{column.text}" has no numbers or no unit.')
            continue
        factor, offset = conversion(unit, channel_unit(name))
        si = spec.sign * (factor * table.values[column.text] + offset)
        columns[name] = si, channel_unit(name)
    taken = {table.find(spec.column).text for spec in chosen.values()}
    for column in table.columns:
        if column.text in taken or column.text in table.not_numeric or column.name in columns:
            continue
        if column.unit is not None and column.unit.name != "s":
            columns[column.name] = table.values[column.text], column.unit.name
        elif column.unit is None:
            notes.append(f'not used: "{column.text}", which has no unit')
    if not columns:
        raise RecordError(f"{table.source}: no column besides the time has a unit that is known.")
    values = {name: y for name, (y, _) in columns.items()}
    even = evenly(time, values, table.lines, table.source, table.place)
    units = {name: unit for name, (_, unit) in columns.items()}
    stem = Path(table.source).stem
    many = len(even.pieces) > 1
    found = [
        replace(
            _signals(
                f"{stem} ({k})" if many else stem, even.sampling.step, piece, units, channels,
                seed + k,
            ),
            measured=measured,
        )
        for k, (_, piece, measured) in enumerate(even.pieces, 1)
    ]  # fmt: skip
    return found, notes + even.notes


def _time(table: Table, spec: ChannelSpec | None) -> Array:
    """Return the time of a table [s]."""
    if spec is not None and spec.step is not None:
        return np.arange(table.rows, dtype=float) * spec.step
    if spec is None:
        raise RecordError(
            f"{table.source}: no column is the time. --channel time=COLUMN@s names one."
        )
    column = table.find(spec.column)
    factor, _ = conversion(spec.unit or (column.unit.name if column.unit else "s"), "s")
    return np.asarray(factor * table.values[column.text], dtype=float)


def _signals(
    name: str, dt: float, raw: dict[str, Array], unit: dict[str, str],
    channels: Mapping[str, ChannelSpec], seed: int,
) -> Signals:  # fmt: skip
    """Return one piece: its motion smoothed, its drive without noise, draws of what is left."""
    n, unit = len(next(iter(raw.values()))), dict(unit)
    generator = np.random.default_rng(seed)
    given = {k: s.noise for k, s in channels.items() if s.noise is not None}
    facts = {k: estimate_noise(y) for k, y in raw.items() if k not in given}
    noise = {**given, **{k: one.std for k, one in facts.items()}}
    untold = tuple(k for k, one in facts.items() if not one.known)
    values, errors, derived = dict(raw), {}, []
    rates: dict[str, str] = {}
    for prefix in ("", "base_"):
        x, v = raw.get(f"{prefix}displacement"), raw.get(f"{prefix}velocity")
        if x is None and v is None:
            continue
        sizes = (noise.get(f"{prefix}displacement", 0.0), noise.get(f"{prefix}velocity", 0.0))
        motion = smooth(x, v, dt, sizes)
        have = (x is not None, v is not None)
        drawn = posterior_draws(n, dt, sizes, motion.jerk, have, DRAWS, seed, motion)
        names = [f"{prefix}{kind}" for kind in _KINEMATIC]
        for i, (one, y) in enumerate(zip(names, (motion.x, motion.v, motion.a), strict=True)):
            if prefix and kind_of(one) == "acceleration":
                continue  # of a structure it is the absolute one that is meant
            if one not in raw:
                derived.append(one)
            values[one], errors[one] = y, drawn[:, :, i]
            unit[one] = PLAIN[kind_of(one)]
        rates |= {names[0]: names[1], names[1]: names[2]}
    for one in DRIVE:
        if one in raw:
            values[one], errors[one] = smooth_drive(raw[one], noise[one], dt, DRAWS, seed + 1)
    for one in values:
        if one not in errors:
            errors[one] = generator.standard_normal((DRAWS, n)) * noise.get(one, 0.0)
    kept = {a: b for a, b in rates.items() if a in values and b in values}
    return Signals(name, dt, values, unit, errors, raw, noise, kept, tuple(derived), untold)


def kind_of(name: str) -> str:
    """Return "velocity" of "base_velocity"."""
    return name.removeprefix("base_")
