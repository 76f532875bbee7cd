"""Whether an FMU's output has the unit and the sign that it is taken to have, from the numbers."""

from __future__ import annotations

import numpy as np

from ..compare.comparison import Comparison
from ..errors import FmuError
from ..units import conversion, parse
from .ports import Port, PortMap

AGAINST = -0.5
"""Correlation with the measured output below which a sign is in doubt."""

ALIKE = 0.8
"""Correlation from which the sizes of two outputs say something of their units."""

NEAR = 0.35
"""Share by which a ratio of sizes may be off that of two units: the model errs besides."""

LEAST = 30.0
"""Ratio of sizes below which a model may as well be wrong."""

_SPELLED = ("N", "kN", "MN", "m", "mm", "um", "m/s", "mm/s", "V", "mV", "A", "mA", "Pa", "kPa",
            "MPa", "m/s2", "mm/s2", "s", "ms")  # fmt: skip


def doubts(outputs: tuple[Comparison, ...], ports: PortMap, fmu: str) -> list[str]:
    """Return what is to know of outputs that are turned or of another size, as the user wants them.

    Raises
    ------
    FmuError
        If the unit or the sign of an output is in doubt and the user has said nothing of it.
    """
    named = {port.name: port for port in ports.outputs}
    notes: list[str] = []
    for one in outputs:
        port = named[one.quantity]
        y = np.concatenate([run.measured for run in one.predictions])
        p = np.concatenate([run.predicted for run in one.predictions])
        if not (np.std(y) > 0.0 and np.std(p) > 0.0):
            continue
        correlation = float(np.corrcoef(y, p)[0, 1])
        text = _sign(port, correlation)
        if text and not port.sign_given:
            channel = f"{port.name}={{}}{port.signal}"
            raise FmuError(
                f"{fmu}: {text}: its sign is in doubt. --map {channel.format('-')} reverses it, "
                f"--map {channel.format('+')} keeps it."
            )
        notes += [text] if text else []
        text, unit = _unit(port, float(np.std(y) / np.std(p)), correlation)
        if text and not port.unit_given:
            raise FmuError(
                f"{fmu}: {text}: {unit}? --map {port.name}={port.signal}@{unit} says so, "
                f"@{port.unit} that it is in {port.unit} and the FMU is that wrong."
            )
        notes += [text] if text else []
    return notes


def _sign(port: Port, correlation: float) -> str:
    if correlation >= AGAINST:
        return ""
    return f"{port.name} has the opposite sign of {port.signal} (correlation {correlation:.2f})"


def _unit(port: Port, ratio: float, correlation: float) -> tuple[str, str]:
    """Return how far an output's size is off, and the unit that would explain it, else "" twice.

    Parameters
    ----------
    port : of the output
    ratio : size of what was measured over that of the output
    correlation : of the two
    """
    if abs(correlation) < ALIKE or 1.0 / LEAST < ratio < LEAST:
        return "", ""
    own = parse(port.unit)
    for spelled in _SPELLED:
        unit = parse(spelled)
        if unit.dimension != own.dimension or unit.name == own.name:
            continue
        factor = conversion(unit.name, own.name)[0]
        if abs(ratio / factor - 1.0) < NEAR:
            way = "small" if factor > 1.0 else "large"
            times = factor if factor > 1.0 else 1.0 / factor
            return f"{port.name} is {times:.0f} times too {way}", unit.name
    return "", ""
