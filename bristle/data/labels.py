"""What is known of a run as a whole: its temperature, frequency, amplitude, the batch of oil.

A label is a number or a word. Those with a name that is known have a unit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..quantity import plain, quantity

Label: TypeAlias = float | str
Labels: TypeAlias = Mapping[str, Label]

UNITS = {"temperature": "degC", "frequency": "Hz", "amplitude": "m"}
"""Labels that have a unit, in which study.toml gives them."""


TEMPERATURE = "temperature"
"""The label that is a channel's mean where a run has one of that name."""


def mean_temperature(values: NDArray[np.float64]) -> tuple[float | None, str]:
    """Return the mean of a temperature (n,) [degC] over a run, None without any, and a note of it.

    A slow logger leaves fields empty: they do not count. Tenths of a kelvin are what a sensor
    knows.
    """
    known = values[np.isfinite(values)]
    if not known.size:
        return None, "temperature: no value in the whole run"
    mean, low, high = (round(float(one), 1) for one in (known.mean(), known.min(), known.max()))
    return mean, f"temperature: {mean:g} °C, the mean of the run, from {low:g} to {high:g} °C"


def label_text(name: str, value: Label, unit: str = "") -> str:
    """Return a label's value as people write it: "40 °C", "10 mm", "batch B".

    Parameters
    ----------
    name : of the label
    value : its value
    unit : its unit, where it is none of `UNITS`: that of a command's level
    """
    if isinstance(value, str):
        return value
    unit = unit or UNITS.get(name, "")
    if unit == "degC":
        return f"{plain(value, 4)} °C"
    return quantity(value, unit or "1", 4)


def varying(labels: Sequence[Labels]) -> list[str]:
    """Return the labels that every one has, and that are not the same for all."""
    if not labels:
        return []
    shared = [name for name in labels[0] if all(name in one for one in labels)]
    return [name for name in shared if len({one[name] for one in labels}) > 1]
