"""The tables of peaks that runs are held against, with the column of a run for each entry."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

_FILE = Path(__file__).resolve().parents[1] / "tests" / "reference" / "model.toml"
MODEL: dict[str, Any] = tomllib.loads(_FILE.read_text(encoding="utf-8"))

DRIFT = "structure.base_displacement"
SECOND_FLOOR = "structure.floor2_acceleration_absolute"
PEAKS = {
    DRIFT: "max |x_b| m",
    "structure.drift2": "max |x_2 - x_1| m",
    "structure.base_acceleration_absolute": "max |base acceleration| m/s2",
    SECOND_FLOOR: "max |y| m/s2",
    "structure.base_velocity": "max |v| m/s",
    "damper.force": "max |f| N",
}

_COEFFICIENTS = ("sigma_a", "sigma_0", "sigma_1", "sigma_2", "sigma_b")


@dataclass(frozen=True)
class Case:
    """One row of the half-sine table.

    `overrides` make the case of the stock scenario; a damper whose coefficients are all 0 stands
    for none. `peaks` by column, `times` [s] of the two peaks for which the table gives them, `end`
    the base displacement at the end [m].
    """

    name: str
    overrides: dict[str, Any]
    peaks: dict[str, float]
    times: dict[str, float]
    end: float


def half_sine() -> list[Case]:
    """Return the cases of the half-sine pulse."""
    table = MODEL["half_sine"]
    cases = []
    for row in table["rows"]:
        entries = dict(zip(table["columns"], row, strict=True))
        voltage = row[0]
        name, overrides = f"{voltage:g} V", {"voltage.level": voltage}
        if voltage < 0.0:
            name, overrides = "no damper", {f"damper.{c}": 0.0 for c in _COEFFICIENTS}
        peaks = {column: entries[entry] for column, entry in PEAKS.items() if entries[entry]}
        times = {c: row[table["columns"].index(PEAKS[c]) + 1] for c in (DRIFT, SECOND_FLOOR)}
        cases.append(Case(name, overrides, peaks, times, entries["x_b(10 s) m"]))
    return cases


def symbol(column: str) -> str:
    """Return the table's symbol of a column: "y" of "max |y| m/s2"."""
    return PEAKS[column].split("|")[1]


def peak_errors(case: Case, columns: Mapping[str, Any]) -> dict[str, float]:
    """Return how far the peak of each column lies from the table, as a share."""
    return {
        name: abs(float(np.abs(columns[name]).max()) / peak - 1.0)
        for name, peak in case.peaks.items()
    }


def passive() -> dict[tuple[float, float], float]:
    """Return the peak second-floor acceleration [m/s2] by intensity [g] and voltage [V]."""
    table = MODEL["passive"]
    return {
        (intensity, voltage): peak
        for intensity, row in zip(table["intensities"], table["y"], strict=True)
        for voltage, peak in zip(table["voltages"], row, strict=True)
    }
