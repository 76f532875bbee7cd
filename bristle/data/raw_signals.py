"""Columns of raw volts or milliamperes that stand beside the same signal in its own unit."""

from __future__ import annotations

import numpy as np

from ..core.arrays import Array
from ..units import same_dimension
from .channels import DRIVE, PLAIN, meaning, of_a_sensor
from .columns import Column
from .table import Table

_FEWEST = 20  # values
_LOOKED = 2000  # values of a column that are compared with those of another
_SAME = 0.02  # share of its spread by which a raw signal may leave the line, by its rounding


def is_electric(column: Column) -> bool:
    """Return whether a column is in volts or amperes, or in mV/V as of a bridge."""
    unit = column.unit.name if column.unit else ""
    return unit.endswith("V/V") or any(
        same_dimension(unit, PLAIN[name]) for name in ("voltage", "current")
    )


def raw_signals(table: Table) -> dict[str, str]:
    """Return the columns that hold raw signals, each with that of the same signal in its unit.

    They have the name of the other column, where it is one of a sensor, or lie on a line with it.
    """
    there = [one for one in table.columns if one.text not in table.not_numeric and one.unit]
    raw = [one for one in there if is_electric(one)]
    others = [one for one in there if not is_electric(one) and not _is_command_or_time(one)]
    out: dict[str, str] = {}
    for one in raw:
        for other in others:
            same = one.name.strip().lower() == other.name.strip().lower()
            if (same and _is_sensed(one)) or _on_a_line(
                table.values[one.text], table.values[other.text]
            ):
                out[one.text] = other.text
                break
    return out


def _is_command_or_time(column: Column) -> bool:
    unit = column.unit.name if column.unit else ""
    return any(same_dimension(unit, PLAIN[name]) for name in (*DRIVE, "time"))


def _is_sensed(column: Column) -> bool:
    meant = meaning(column.name, None)
    return of_a_sensor(column.name) or (
        meant is not None and meant.quantity not in (*DRIVE, "time")
    )


def _on_a_line(values: Array, other: Array) -> bool:
    """Return whether a column goes as another one; one that is constant does not."""
    both = np.flatnonzero(np.isfinite(values) & np.isfinite(other))
    if len(both) < _FEWEST:
        return False
    both = both[:: -(-len(both) // _LOOKED)]
    y, x = (one[both] - one[both].mean() for one in (values, other))
    spread, power = float(np.std(y)), float(x @ x)
    if not spread > 1e-9 * float(np.max(np.abs(values[both]))) or not power > 0.0:
        return False
    return float(np.std(y - x * (x @ y) / power)) <= _SAME * spread
