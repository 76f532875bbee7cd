"""What the rows and columns of a run are, whichever engine fills them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..fmu.description import Description
from .results import Array, Column

if TYPE_CHECKING:
    from ..scenario.scenario import Scenario


def make_columns(scenario: Scenario, descriptions: Mapping[str, Description]) -> tuple[Column, ...]:
    """Return the columns of the results: every output but texts, in the order of the file."""
    return tuple(
        Column(f"{component.name}.{variable.name}", variable.kind, variable.unit)
        for component in scenario.components
        for variable in descriptions[component.name].of("output")
        if variable.kind != "String"
    )


def count_steps(stop: float, step: float) -> int:
    """Return the number of whole steps up to `stop`."""
    ratio = stop / step
    return round(ratio) if math.isclose(ratio, round(ratio), rel_tol=1e-9) else int(ratio)


def times(first: int, last: int, step: float) -> Array:
    """Return t_k for k = first ... last - 1, shape (last - first,).

    Where 1/step is whole, t_k = k / (1/step): 0.3 s is then 0.3 and not 0.30000000000000004.
    """
    rate = round(1 / step)
    numbers = np.arange(first, last)
    if math.isclose(rate * step, 1.0, rel_tol=1e-12):
        return np.divide(numbers, rate, dtype=np.float64)
    return np.multiply(numbers, step, dtype=np.float64)
