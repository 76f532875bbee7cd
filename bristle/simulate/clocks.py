"""Lays controllers and sensors out in records of numbers for the time loop."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..component import sensors
from . import records
from .layout import lay_controller, lay_sampled, lay_sensors

Array = NDArray[Any]

MATRICES = ("A", "B", "W", "C")
"""What differs in length from controller to controller."""


class Clocks:
    """The sampled components of a run: their records, constants and memory.

    Parameters
    ----------
    slaves, wirings : sequences
        The configured components in the order of the scenario, and where their signals are.
    h : float
        Substep [s].
    """

    def __init__(self, slaves: Sequence[Any], wirings: Sequence[Sequence[float]], h: float) -> None:
        self._constants: list[float] = []
        self._memory: list[float] = []
        self.records = np.zeros(len(slaves), records.sampled_record())
        for record, slave, wiring in zip(self.records, slaves, wirings, strict=True):
            lay_sampled(record, slave.constants.period, wiring, h)
            if slave.functions is sensors:
                lay_sensors(record, slave.constants)
            else:
                lay_controller(record, slave.constants)
                for name in MATRICES:
                    record[name] = _put(self._constants, getattr(slave.constants, name))
                    record[f"{name}_end"] = len(self._constants)
            record["state"] = _put(self._memory, slave.state)
            record["work"] = _put(self._memory, slave._work)
            record["end"] = len(self._memory)
        self.constants, self.memory = np.array(self._constants), np.array(self._memory)


def _put(numbers: list[float], more: list[float]) -> int:
    """Append numbers; return where they begin."""
    begin = len(numbers)
    numbers.extend(more)
    return begin
