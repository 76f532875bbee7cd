"""Files before they are a study: their columns as traces, and which channel each is guessed to be.

It is what `bristle study new` would read, without making anything.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..data.building_file import read_building
from ..data.channels import channel_unit
from ..data.guess import Guess, guess_channels, left_out
from ..data.read import files_in, read_table
from ..data.table import Table
from ..errors import BristleError, RecordError
from ..physics.building import with_damper
from ..units import same_dimension
from .data_view import thinned

SHOWN = 24
"""Columns that are drawn of a file."""
USUAL = (
    "s", "ms", "min", "m", "mm", "cm", "um", "in", "ft", "m/s", "mm/s", "cm/s", "in/s", "m/s2",
    "mm/s2", "cm/s2", "g", "N", "kN", "MN", "lbf", "kip", "V", "mV", "A", "mA", "%", "1", "T", "mT",
)  # fmt: skip
"""Units that a menu offers, each where it is one of the quantity; any other may be written."""


def answer(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is read of dropped files.

    Parameters
    ----------
    folder : of the files
    arguments : `building` the name of a building's file among them, "" on a bench

    Raises
    ------
    RecordError, PhysicsError
        If no file can be read, or the building cannot.
    """
    files = files_in(folder)
    levels: list[str] | None = None
    devices: list[str] = []
    if name := str(arguments.get("building", "")):
        house = with_damper(read_building(folder / "building" / Path(name).name), "")
        levels, devices = house.levels(), [one.name for one in house.devices]
    tables: list[Table] = []
    read: list[dict[str, Any]] = []
    for file in files:
        try:
            table = read_table(file)
        except BristleError as error:
            read.append({"name": file.name, "rows": 0, "error": _plainly(str(error), folder)})
            continue
        tables.append(table)
        read.append({"name": file.name, "rows": table.rows, "error": ""})
    if not tables:
        raise RecordError(read[0]["error"])
    first = tables[0]
    rig = "structure" if levels else "bench"
    guesses = guess_channels(first, rig, levels, devices)
    chosen = {guess.column: guess for guess in guesses}
    return {
        "files": read, "first": Path(first.source).name, "rig": rig,
        "columns": columns_of(first, chosen), "unused": left_out(first, guesses),
        "known": known_channels(levels or [], devices),
    }  # fmt: skip


def columns_of(table: Table, taken: Mapping[str, Guess]) -> list[dict[str, Any]]:
    """Return a row per column of a file: its trace, and what it is taken for and why.

    Parameters
    ----------
    table : what the file holds
    taken : by the title of the column, which channel it is
    """
    numeric = {
        column.text: np.asarray(table.values[column.text], dtype=float)
        for column in table.columns if column.text in table.values
    }  # fmt: skip
    rows = thinned(np.arange(table.rows, dtype=float), dict(list(numeric.items())[:SHOWN]))
    return [
        {
            "text": column.text, "unit": column.unit.name if column.unit else "",
            "values": numeric[column.text][rows] if column.text in numeric else None,
            "channel": guess.channel if (guess := taken.get(column.text)) else "",
            "guessed_unit": guess.unit if guess else "", "sign": guess.sign if guess else 1,
            "reason": guess.reason if guess else "", "doubt": guess.doubt if guess else "",
        }
        for column in table.columns
    ]  # fmt: skip


def _plainly(text: str, folder: Path) -> str:
    """Return a message without the folder that dropped files are kept in."""
    return text.replace(f"{folder}/", "")


def known_channels(levels: list[str], devices: list[str]) -> list[dict[str, Any]]:
    """Return the channels that a column may be: name, SI unit, and the units to choose from."""
    names = ["time", "displacement", "velocity", "acceleration", "force", "voltage", "current"]
    if levels:
        own = [f"{level}_{what}" for level in levels for what in
               ("displacement", "velocity", "acceleration_absolute")]  # fmt: skip
        of_devices = [f"{one}_{what}" for one in devices for what in ("force", "voltage")]
        names = ["time", "ground_acceleration", *own, "force", "voltage", "current", *of_devices]
    return [{"name": name, **_units(channel_unit(name))} for name in names]


def _units(unit: str) -> dict[str, Any]:
    """Return the SI unit of a channel, and the ones that its files are in now and then."""
    usual = [one for one in USUAL if same_dimension(one, unit)]
    return {"unit": unit, "units": list(dict.fromkeys((unit, *usual)))}
