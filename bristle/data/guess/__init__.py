"""Which column is which channel, in which unit and with which sign: a guess, each with its reason.

Names and units say most; the data say the rest: which column is the derivative of which, which
force takes power out of the motion. Where the data contradict a stated unit the unit is kept and
the doubt is said, for either of the two columns could be wrong.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from ...core.arrays import Array
from ...core.text import plain
from ...units import parse as parse_unit
from ..channels import TEMPERATURE, ChannelSpec, device_channel, meaning, quantity_of_unit
from ..extra_channels import raw_signals, unit_as_written
from ..table import Table
from ..titles import Column
from .by_data import bench_guesses, fit_signs, fit_units
from .by_name import Search, candidate_of, joined, structure_guesses

_KELVIN = parse_unit("K").dimension
_AT_DAMPER = frozenset({"damper", "oil", "fluid", "mrf", "mr", "housing"})

_PLAIN_NAME = re.compile(r"[\W\d_]+")
_SAME_TIME = 0.02  # of a step, by which times that are the same may differ

_IN_DAYS = 2e-6
"""Spacing below which a time from 30,000 on is in days: in s, it would be above 500 kHz."""
_SURELY_DAYS = 2e-7
"""That below which a time of less than a day is in days as well."""

MIN_TIME_ROWS = 10
"""Rows of numbers below which no column is taken for the time."""


@dataclass(frozen=True)
class Guess:
    """A channel, the column it is in, its unit and sign, why, and what speaks against it.

    `unit` is "" where nothing tells it.
    """

    channel: str
    column: str
    unit: str
    sign: int
    reason: str
    doubt: str = ""

    def __str__(self) -> str:
        flipped = " turned in sign" if self.sign < 0 else ""
        text = f'{self.channel} is "{self.column}" [{self.unit or "?"}]{flipped}: {self.reason}'
        return text + (f"; doubtful: {self.doubt}" if self.doubt else "")


def guess_channels(
    table: Table, rig: str = "bench", levels: list[str] | None = None,
    devices: list[str] | None = None,
) -> list[Guess]:  # fmt: skip
    """Return the channels that a table seems to hold, each column at most once.

    Parameters
    ----------
    table : Table
    rig : {"bench", "structure"}
        On a structure, motions belong to levels of the building.
    levels : list of str
        Names of the building's levels, lowest first: ["base", "floor1", "floor2"]; numbers in
        names are counted along them.
    devices : list of str
        Names of the building's devices; columns such as brace_force are theirs.
    """
    time, step = _find_time(table)
    search = Search(table, step)
    taken = time.column if time else ""
    own = device_guesses(table, devices or [])
    theirs = {*(guess.column for guess in own), *raw_signals(table)}
    candidates = [
        one
        for column in table.columns
        if column.text not in theirs and (one := candidate_of(search, column, taken))
    ]
    if rig == "structure":
        chosen = structure_guesses(candidates, levels or ["base", "floor1", "floor2"])
    else:
        chosen = bench_guesses(search, candidates)
    found = fit_signs(search, fit_units(search, chosen), rig, at_base=not devices)
    guesses = [
        Guess(channel, one.column.text, one.unit, one.sign, one.reason, one.doubt)
        for channel, one in found.items()
    ] + own
    known = {taken, *(guess.column for guess in guesses)}
    every = ([time] if time else []) + guesses + _find_temperature(table, known)
    doubts = {column.text: column.doubt for column in table.columns}
    return [replace(one, doubt=joined(one.doubt, doubts[one.column])) for one in every]


def _find_temperature(table: Table, known: set[str]) -> list[Guess]:
    """Return the guess of the damper's temperature in a list, none where none or several may be."""
    able = [
        column
        for column in table.columns
        if column.text not in known and column.unit and column.unit.dimension == _KELVIN
    ]
    at_damper = [one for one in able if _AT_DAMPER & {*re.split(r"[^a-z]+", one.name.lower())}]
    chosen = at_damper if len(able) > 1 else able
    if len(chosen) != 1 or chosen[0].unit is None:
        return []
    return [Guess(TEMPERATURE, chosen[0].text, chosen[0].unit.name, 1, "its unit")]


def device_guesses(table: Table, devices: list[str]) -> list[Guess]:
    """Return the channels that columns are named by after a building's devices.

    Parameters
    ----------
    table : of a run
    devices : their names
    """
    found: dict[str, Guess] = {}
    for column in table.columns:
        name = column.name.rpartition(".")[2].lower()
        of_device = device_channel(name)
        if of_device and of_device[0] in devices and name not in found:
            unit = column.stated
            found[name] = Guess(name, column.text, unit, 1, "its name")
    return list(found.values())


def left_out(table: Table, guesses: list[Guess]) -> list[str]:
    """Return the titles of columns that no guess takes."""
    taken = {guess.column for guess in guesses}
    return [column.text for column in table.columns if column.text not in taken]


def specs(table: Table, guesses: list[Guess]) -> dict[str, ChannelSpec]:
    """Return guesses as `read_measurements` takes them."""
    return {guess.channel: ChannelSpec(guess.column, guess.unit, guess.sign) for guess in guesses}


def too_few_rows(table: Table) -> str:
    """Return that no column is taken for the time in so few rows, "" where there are enough."""
    if table.rows >= MIN_TIME_ROWS:
        return ""
    rows = "one row" if table.rows == 1 else f"{table.rows} rows"
    return (
        f"{rows} of numbers: no column can be recognised as the time in fewer than {MIN_TIME_ROWS}"
    )


def may_be_time(table: Table, columns: Iterable[str]) -> list[str]:
    """Return which columns rise in nearly even steps, and do not only count the rows."""
    steps = {text: np.diff(table.values[text]) for text in columns}
    return [
        text
        for text, step in steps.items()
        if step.min() > 0.0 and step.max() <= 3.0 * float(np.median(step)) and (step != 1.0).any()
    ]


def _find_time(table: Table) -> tuple[Guess | None, float]:
    """Return the guess of the time and the usual spacing [s], 0 where there is no time."""
    best: tuple[int, Guess, float] | None = None
    for column in table.columns:
        values = table.values[column.text]
        good = values[np.isfinite(values)]
        if len(good) < max(MIN_TIME_ROWS, 0.5 * table.rows):
            continue
        spacing = np.diff(good)
        if not spacing.any():  # it stands still
            continue
        rising = float(np.mean(spacing > 0.0)) > 0.98
        unit = column.stated
        timed = quantity_of_unit(unit) == "time"
        meant = meaning(column.name, unit)
        named = meant is not None and meant.quantity == "time"
        if not (named or (timed and rising) or (rising and column.index == 0 and not unit)):
            continue
        if not named and not unit and float(np.mean(spacing == 1.0)) > 0.98:
            continue  # it counts the samples
        if unit and not timed:
            continue
        reason = "its name" if named else "its unit" if timed else "the first column, and it rises"
        assumed, doubt = _assumed_unit(column, _usual(spacing), float(good[0]))
        score = 4 * named + 2 * timed + rising
        guess = Guess("time", column.text, unit or assumed, 1, reason, doubt)
        if best is None or score > best[0]:
            best = score, guess, _usual(spacing) * parse_unit(guess.unit or "s").factor
    if best is None:
        return None, 0.0
    doubt = joined(best[1].doubt, _other_times(table, best[1].column))
    return replace(best[1], doubt=doubt), best[2]


def _other_times(table: Table, chosen: str) -> str:
    """Return that columns have a time of their own, "" where the time of all is the same.

    Some loggers write a time beside every group of channels, by one name but for a number.
    """
    own = table.find(chosen)
    for column in table.columns:
        meant = meaning(column.name, "s")
        alike = _PLAIN_NAME.sub("", column.name) == _PLAIN_NAME.sub("", own.name) or (
            meant is not None and meant.quantity == "time"
        )
        if column.text == chosen or not alike or column.unit != own.unit:
            continue
        if float(np.mean(np.diff(table.values[column.text]) > 0.0)) <= 0.98:
            continue
        apart = table.values[column.text] - table.values[chosen]
        step = float(np.nanmedian(np.diff(table.values[chosen])))
        good = apart[np.isfinite(apart)]
        most = float(np.max(np.abs(good))) if good.size else 0.0
        if most > _SAME_TIME * abs(step):
            unit = own.unit.name if own.unit else "s"
            return (
                f'"{column.text}" is up to {plain(most)} {unit} apart: channels beside it were '
                "sampled at other times"
            )
    return ""


def _usual(spacing: Array) -> float:
    """Return the usual spacing of times, which may be written with few digits; of (n,)."""
    usual = float(np.median(spacing))
    if usual == 0.0:  # most times are written twice
        return float(spacing.mean())
    near = spacing[np.abs(spacing) <= 2.0 * abs(usual)]
    return float(near.mean()) if near.size else usual


def _assumed_unit(column: Column, spacing: float, first: float) -> tuple[str, str]:
    """Return the unit of a time that tells none, and the doubt; "" where it tells an unknown one.

    What stands in round brackets may be a word, as in "time (from start)". Days of a calendar, as
    spreadsheets and datenum have them, and small parts of a second since 1970 tell their unit.
    """
    if column.unit is not None:
        return column.unit.name, ""
    told = unit_as_written(column)
    if told and "(" not in column.text:
        return "", f'its unit, "{told}", is not known'
    told = f'"{told}" is no unit that is known' if told else "no unit is given"
    for word, unit in (("micros", "us"), ("millis", "ms")):
        if word in re.split(r"[^a-z]+", column.name.lower()):
            return unit, f"{told}, {unit} is assumed by its name"
    if 0.0 <= first < 1.0 and 0.0 < spacing < _IN_DAYS and spacing > _SURELY_DAYS:
        return "", f"{told}, and {spacing:.3g} may be of a day or of a second"
    what = "days of a calendar" if 3e4 < first < 1e6 else "parts of a day"
    if (3e4 < first < 1e6 or 0.0 <= first < 1.0) and 0.0 < spacing < _IN_DAYS:
        return (
            "day",
            f"{told}, and its values are {what}: {1.0 / 86400 / spacing:.4g} Hz",
        )
    for unit, size in (("ms", 1e3), ("us", 1e6), ("ns", 1e9)):
        if 1e9 * size < first < 4e9 * size:
            since = f"{told}, and its values are {unit} since 1970"
            return unit, f"{since}: {size / spacing:.4g} Hz"
    return "s", f"{told}, s is assumed: {1.0 / spacing:.4g} Hz"
