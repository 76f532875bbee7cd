"""The tables of peaks that runs are held against, with the column of a run for each entry."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

_FILE = Path(__file__).resolve().parents[1] / "tests" / "reference" / "model.toml"
MODEL: dict[str, Any] = tomllib.loads(_FILE.read_text(encoding="utf-8"))

SECOND_FLOOR = "structure.floor2_acceleration_absolute"
PEAKS = {
    "structure.base_displacement": "max |x_b| m",
    "structure.drift2": "max |x_2 - x_1| m",
    "structure.base_acceleration_absolute": "max |base acceleration| m/s2",
    SECOND_FLOOR: "max |y| m/s2",
    "structure.base_velocity": "max |v| m/s",
    "damper.force": "max |f| N",
}

_NO_DAMPER = {f"damper.{name}": 0.0 for name in ("sigma_a", "sigma_0", "sigma_1")}
_NO_DAMPER |= {"damper.sigma_2": 0.0, "damper.sigma_b": 0.0}


def half_sine() -> list[tuple[str, dict[str, float], dict[str, float], float]]:
    """Return the cases of the half-sine pulse.

    Each is its name, the overrides that make it of the stock scenario, the peak of each column,
    and x_b(10 s) [m]. A damper whose coefficients are all 0 stands for no damper.
    """
    table = MODEL["half_sine"]
    cases = []
    for row in table["rows"]:
        named = dict(zip(table["columns"], row, strict=True))
        voltage = row[0]
        overrides = {"voltage.level": voltage} if voltage >= 0.0 else _NO_DAMPER
        name = f"{voltage:g} V" if voltage >= 0.0 else "no damper"
        peaks = {column: named[entry] for column, entry in PEAKS.items() if named[entry]}
        cases.append((name, overrides, peaks, named["x_b(10 s) m"]))
    return cases


def passive() -> dict[tuple[float, float], float]:
    """Return the peak second-floor acceleration [m/s2] by intensity [g] and voltage [V]."""
    table = MODEL["passive"]
    return {
        (intensity, voltage): peak
        for intensity, row in zip(table["intensities"], table["y"], strict=True)
        for voltage, peak in zip(table["voltages"], row, strict=True)
    }
