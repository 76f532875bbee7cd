"""What a column can be by its name and unit."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ...core.arrays import Array, Flags
from ..channels import (
    DRIVE,
    Meaning,
    channel_unit,
    is_channel,
    meaning,
    of_a_drive,
    of_a_sensor,
    quantity_of_unit,
)
from ..relation import differentiated
from ..table import Table
from ..titles import Column


@dataclass
class Candidate:
    """A column and what it can be: quantity, place and unit, and how well its name fits."""

    column: Column
    quantity: str
    unit: str
    rank: int
    reason: str
    place: str = ""
    number: int | None = None
    sign: int = 1
    doubt: str = ""


@dataclass
class Search:
    """A table with the time found, its step [s], and columns with short gaps bridged."""

    table: Table
    step: float
    data: dict[str, Array] = field(default_factory=dict)

    def column(self, text: str) -> Array:
        """Return a column with missing values bridged, for correlations alone."""
        if text not in self.data:
            values = self.table.values[text]
            good = usable(values)
            rows = np.arange(len(values))
            self.data[text] = np.interp(rows, rows[good], values[good])
        return self.data[text]


def candidate_of(search: Search, column: Column, time: str) -> Candidate | None:
    """Return what a column can be by name and unit, None where it can be nothing."""
    # A column of words is none; one word among numbers is told when the column is read.
    finite = usable(search.table.values[column.text])
    if column.text == time or np.mean(finite) < 0.5 * (column.text in search.table.not_numeric):
        return None
    if not finite.any():
        return None
    unit = column.stated
    exact = column.name.rpartition(".")[2].lower()
    if is_channel(exact) and exact != "time":
        fits = unit and quantity_of_unit(unit) == quantity_of_unit(channel_unit(exact))
        if fits or not unit:
            return Candidate(column, exact, unit, 5, "its name")
    meant = meaning(column.name, unit)
    by_unit = quantity_of_unit(unit)
    if meant is None:
        if by_unit in (None, "time", "duty"):  # a share in per cent can be one of anything
            return None
        if by_unit in DRIVE and of_a_sensor(column.name):  # a signal that is not yet calibrated
            return None
        return _by_unit(column, str(by_unit), unit)
    return _by_name(column, meant, unit, by_unit)


def _by_unit(column: Column, quantity: str, unit: str) -> Candidate:
    """Return what a column can be by its unit alone: volts may be those of any sensor."""
    doubt = ""
    if quantity in ("voltage", "current") and not of_a_drive(column.name):
        doubt = (
            f"its name tells no command, and {unit} may be of a raw signal: `study channels FOLDER "
            f"--without {quantity}` leaves it out"
        )
    return Candidate(column, quantity, unit, 1, f"its unit, {unit}", doubt=doubt)


def _by_name(column: Column, meant: Meaning, unit: str, by_unit: str | None) -> Candidate | None:
    quantity, doubt = meant.quantity, ""
    wanted = "displacement" if quantity == "drift" else quantity
    if unit and by_unit not in (wanted, None, "time", "duty") and len(column.name) == 1:
        return _by_unit(column, str(by_unit), unit)  # a letter says little
    if unit and by_unit != wanted:
        if "[" in column.text or "(" in column.text or by_unit is None:
            return None  # a force in V is a force not yet calibrated
        # The ending of a name need not be a unit: "voltage_in" is in no inches.
        doubt, unit = f'"{unit}" at the end of the name is not taken as a unit', ""
    reason = f"its name and its unit, {unit}" if unit else "its name"
    return Candidate(
        column, quantity, unit, meant.rank, reason, meant.place, meant.number, 1, doubt
    )


def usable(values: Array) -> Flags:
    """Return which values can be of a measurement; reading the column refuses the others."""
    return np.isfinite(values) & (np.abs(values) < 1e100)


def velocity_of(search: Search, chosen: dict[str, Candidate]) -> Array | None:
    """Return the velocity as recorded, else the derivative of the displacement, else None."""
    if "velocity" in chosen:
        return search.column(chosen["velocity"].column.text)
    if "displacement" in chosen and search.step > 0.0:
        x = search.column(chosen["displacement"].column.text)
        return differentiated(x, search.step, min(18.0, 0.2 / search.step))
    return None


def joined(*texts: str) -> str:
    """Return texts that are not empty, parted by semicolons."""
    return "; ".join(word for word in texts if word)


# Which column belongs to which level of a building.

_ENDINGS = {
    "displacement": "displacement",
    "velocity": "velocity",
    "acceleration": "acceleration_absolute",
}


def structure_guesses(candidates: list[Candidate], levels: list[str]) -> dict[str, Candidate]:
    """Return the channels of a structure: ports by name, levels by word or by number.

    A number alone counts the levels from the lowest: with a base, `acc1` is the base's and `acc2`
    that of floor 1, unless another column names the base.
    """
    chosen: dict[str, Candidate] = {}
    named_base = any(c.place == "base" for c in candidates)
    for candidate in sorted(candidates, key=lambda one: -one.rank):
        channel, text = _channel(candidate, levels, named_base)
        if channel is None or channel in chosen or (candidate.rank == 0):
            continue
        chosen[channel] = replace(candidate, reason=f"{candidate.reason}{text}")
    return chosen


def _channel(candidate: Candidate, levels: list[str], named_base: bool) -> tuple[str | None, str]:
    quantity = candidate.quantity
    if is_channel(quantity) and quantity not in _ENDINGS and quantity != "drift":
        return quantity, ""
    if quantity == "drift":
        return (f"drift{candidate.number}", "") if candidate.number else (None, "")
    if quantity in (*DRIVE, "force"):
        return quantity, ""
    if quantity not in _ENDINGS:
        return None, ""
    if candidate.place == "ground":
        return ("ground_acceleration", "") if quantity == "acceleration" else (None, "")
    level, text = candidate.place, ""
    if not level and candidate.number is not None:
        offset = candidate.number - (0 if named_base and levels[0] == "base" else 1)
        if not 0 <= offset < len(levels):
            return None, ""
        level = levels[offset]
        text = f"; number {candidate.number} of the levels, counted from the lowest, is {level}"
    if not level and quantity != "acceleration":
        level, text = levels[0], f"; without a number it is taken as that of {levels[0]}"
    if not level:
        return "ground_acceleration", "; without a number it is taken as that of the ground"
    return f"{level}_{_ENDINGS[quantity]}", text
