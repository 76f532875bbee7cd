"""What the titles of a table of runs tell: `I [A]` is the current, `T (°C)` the temperature."""

from __future__ import annotations

from collections.abc import Sequence

from ..data.channels import DRIVE, PLAIN, meaning
from ..data.columns import Column
from ..data.labels import TEMPERATURE, UNITS
from ..data.titles import title
from ..units import same_dimension


def counted_names(header: Sequence[str], commanded: bool) -> list[str]:
    """Return the name under which each column of a table of runs counts.

    A title in other words counts where its unit says what it is, no other column has that name, and
    no other one could have it too.

    Parameters
    ----------
    header : the titles
    commanded : whether the files hold a channel of the command: then a level must be called so
    """
    columns = [title(k, text) for k, text in enumerate(header)]
    names = [column.name.strip().lower().replace(" ", "_") for column in columns]
    commands = [_command(column) for column in columns]
    if not commanded and not any(name in DRIVE for name in names):
        _take(names, commands)
    if TEMPERATURE not in names:
        _take(names, [TEMPERATURE if _in(column, UNITS[TEMPERATURE]) else "" for column in columns])
    return names


def _take(names: list[str], found: Sequence[str]) -> None:
    """Give the one column that tells a quantity its name; nothing where several do."""
    at = [k for k, name in enumerate(found) if name]
    if len(at) == 1:
        names[at[0]] = found[at[0]]


def _command(column: Column) -> str:
    """Return the command that words and unit of a title tell, "" for none."""
    told = meaning(column.name, column.unit.name) if column.unit else None
    if told is None or told.quantity not in DRIVE or not _in(column, PLAIN[told.quantity]):
        return ""
    return told.quantity


def _in(column: Column, unit: str) -> bool:
    return column.unit is not None and same_dimension(column.unit.name, unit)
