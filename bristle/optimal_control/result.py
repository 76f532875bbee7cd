"""A limit: the value, how sure it is, and what stands beside it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..view import Viewable

if TYPE_CHECKING:
    from ..engine.results import Results

AGREE = 0.02
"""Share by which starts that agree differ at most."""
TRUST = 0.01
"""Share by which the coupled engine may find another value than the search."""
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Start:
    """A search: where it began, in words, the value there, and the one that it found."""

    name: str
    before: float
    value: float


@dataclass(frozen=True, repr=False)
class Limit(Viewable):
    """The least peak or RMS of an output that a damper's voltage reaches, the motion known.

    Attributes
    ----------
    title : str
        Of the scenario.
    output, statistic, unit : str
        What is judged: "component.port", "peak" or "rms", its unit.
    value : float
        What the scenario's run by the coupled engine under `voltage` has.
    searched : float
        What the search's own computation has under it.
    starts : tuple of Start
        The best one first.
    bound : float or None
        No force up to `most_force` gives less; None where none is known.
    most_force : float
        Largest force of the damper [N] up to twice the speed that it has here.
    previews : dict
        Time seen ahead [s] to the value that a receding horizon reaches.
    constant : dict
        Constant voltage [V] to value.
    as_it_is : float
        Value of the scenario with what commands its damper.
    time, voltage : (n,) arrays
        The history that reaches the limit [s, V], linear between.
    command, command_unit : str
        The damper's input that is free, and its unit.
    results : Results
        Of that run.
    seconds : float
    """

    title: str
    output: str
    statistic: str
    unit: str
    value: float
    searched: float
    starts: tuple[Start, ...]
    bound: float | None
    most_force: float
    previews: dict[float, float]
    constant: dict[float, float]
    as_it_is: float
    time: Array = field(repr=False)
    voltage: Array = field(repr=False)
    command: str
    command_unit: str
    results: Results = field(repr=False)
    seconds: float

    @property
    def agreeing(self) -> int:
        """How many starts found a value within 2 % of the least."""
        least = self.starts[0].value
        return sum(start.value <= (1.0 + AGREE) * least for start in self.starts)

    @property
    def sure(self) -> bool:
        """Whether two starts agree and the coupled engine confirms the value."""
        return self.agreeing > 1 and abs(self.value / self.searched - 1.0) <= TRUST

    @property
    def best_constant(self) -> tuple[float, float]:
        """The best of the constant voltages [V], and its value."""
        return min(self.constant.items(), key=lambda one: one[1])
