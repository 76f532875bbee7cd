"""Lays controllers and sensors out in records of numbers for the time loop."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..component import sensors
from ..component.clock import ROUNDING
from ..fmu.controller import MEASURED
from . import records

Array = NDArray[Any]

MATRICES = ("A", "B", "W", "C")
"""What differs in length from controller to controller."""


def are_whole(periods: list[float], h: float) -> bool:
    """Return whether each period is a whole number of substeps of h [s]."""
    return all(abs(period / h - round(period / h)) <= ROUNDING for period in periods)


class Clocks:
    """The sampled components of a run: their records, constants and memory.

    Parameters
    ----------
    slaves : dict
        Name to the configured component, in the order of the scenario.
    slot : callable
        (component, port) -> slot of the signal.
    h : float
        Substep [s].
    """

    def __init__(self, slaves: dict[str, Any], slot: Callable[[str, str], int], h: float) -> None:
        self._constants: list[float] = []
        self._memory: list[float] = []
        self.records = np.zeros(len(slaves), records.sampled_record())
        for record, (name, slave) in zip(self.records, slaves.items(), strict=True):
            record["inputs"] = [slot(name, port) for port in MEASURED]
            record["first"] = slot(name, slave.vars[slave._outputs[0]].name)
            record["senses"] = slave.functions is sensors
            for field, value in slave.constants._asdict().items():
                self._fill(record, field, value)
            record["aligned"] = are_whole([record["period"]], h)
            record["state"] = _put(self._memory, slave.state)
            record["work"] = _put(self._memory, slave._work)
            record["end"] = len(self._memory)
        self.constants, self.memory = np.array(self._constants), np.array(self._memory)

    def _fill(self, record: Any, field: str, value: Any) -> None:
        """Write what a component computes with into its record, or into the run's constants."""
        if field in MATRICES:
            record[field] = _put(self._constants, value)
        elif isinstance(value, list):
            record[field][: len(value)] = value
        else:
            record[field] = value


def _put(numbers: list[float], more: list[float]) -> int:
    """Append numbers; return where they begin."""
    begin = len(numbers)
    numbers.extend(more)
    return begin
