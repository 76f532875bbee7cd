"""Lays controllers and sensors out in records of numbers for the time march."""

from __future__ import annotations

from collections.abc import Callable
from math import floor, pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..fmu.controller import MEASURED
from . import layout
from .sampled import CLIPPED, CLIPPED_LQG, INVERSE, KINDS, ROUNDING, SCHEDULED, SENSORS, SKYHOOK

Array = NDArray[Any]


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
    substeps : int
        Of the whole run: so long noise is drawn in advance.
    """

    def __init__(
        self, slaves: dict[str, Any], slot: Callable[[str, str], int], h: float, substeps: int
    ) -> None:
        self._constants: list[float] = []
        self._memory: list[float] = []
        self.records = np.zeros(len(slaves), layout.sampled_record())
        for record, (name, slave) in zip(self.records, slaves.items(), strict=True):
            period = slave["sample_period"]
            record["kind"] = KINDS[type(slave).__name__]
            record["period"], record["aligned"] = period, are_whole([period], h)
            record["inputs"] = [slot(name, port) for port in MEASURED]
            outputs = [slave.vars[index].name for index in slave._outputs]
            ports = [port for port in outputs if port != "fault"]
            record["outputs"][: len(ports)] = [slot(name, port) for port in ports]
            if record["kind"] == SENSORS:
                self._sensors(record, slave, floor(substeps * h / period + ROUNDING) + 1)
            else:
                self._controller(record, slave)
        self.constants, self.memory = np.array(self._constants), np.array(self._memory)

    def _controller(self, record: Any, slave: Any) -> None:
        record["v_max"] = slave["v_max"]
        record["filtered"] = slave["velocity"] == "filtered"
        record["velocity_corner"] = 2.0 * pi * slave["velocity_corner"]
        kind = record["kind"]
        if kind in (CLIPPED, CLIPPED_LQG):
            record["f_min"] = slave["f_min"]
        if kind in (INVERSE, SCHEDULED):
            record["anti_windup"] = slave["anti_windup"]
        if kind in (INVERSE, SKYHOOK):
            law = slave.inverted
            record["law"], record["p"][: len(law.p)] = law.law, law.p
            record["still"], record["least_slope"], _ = law.limits
        if kind == SKYHOOK:
            record["gain"], record["switches"] = slave["gain"], slave["kind"] == "switch"
            record["integral_corner"] = 2.0 * pi * slave["integral_corner"]
        else:
            c = slave.controller
            record["n"], record["rows"], record["v_top"] = c.n, c.rows, c.v_top
            for name in ("A", "B", "W", "C"):
                record[name] = _put(self._constants, getattr(c, name))
            record["state"] = _put(self._memory, [0.0] * (2 * c.n))  # and as much room to work

    def _sensors(self, record: Any, slave: Any, samples: int) -> None:
        record["noise"] = -1
        for j, channel in enumerate(slave.instruments):
            record["own_gain"][j], record["bias"][j] = channel.gain, channel.bias
            record["quantisation"][j], record["corner"][j] = channel.quantisation, channel.corner
            record["share"][j], record["length"][j] = channel.share, channel.length
            record["ring"][j] = _put(self._memory, [0.0] * channel.length)
            if channel.deviation > 0.0:
                drawn = [channel.noise(k) for k in range(samples)]
                record["noise"][j] = _put(self._constants, drawn)


def _put(numbers: list[float], more: list[float]) -> int:
    """Append numbers; return where they begin."""
    begin = len(numbers)
    numbers.extend(more)
    return begin
