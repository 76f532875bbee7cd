"""What a design hands back: the controller for the run, and what reports draw."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..component.controller_file import Controller, building_digest
from ..view import Viewable
from .lmi import Solution
from .plant import Plant
from .sampling import Bank
from .task import Task

Array = NDArray[np.float64]

_DIGITS = 12


@dataclass(frozen=True, repr=False)
class DesignResult(Viewable):
    """A verified controller.

    Attributes
    ----------
    task : Task
    controller : Controller
        For the run, discrete; `controller.save(path)` writes the controller file.
    speeds : (k,) array
        Speeds of the table's rows [m/s]; one zero without a table.
    plants : list of Plant
        The generalized plants at these speeds; empty for LQG.
    bank : Bank
        The controllers at these speeds, continuous.
    solution : Solution or None
        The matrices that prove gamma, in normalised, balanced states.

    Examples
    --------
    >>> import bristle
    >>> result = bristle.design({"kind": "lqg", "sample_period": 0.001})
    >>> result.controller.sample_period, result.task.kind
    (0.001, 'lqg')
    """

    task: Task
    controller: Controller
    speeds: Array
    plants: list[Plant]
    bank: Bank
    solution: Solution | None

    @property
    def facts(self) -> dict[str, Any]:
        """The design's numbers: gamma, norms, poles ..."""
        return self.controller.facts


def packed(task: Task, discrete: Bank, facts: dict[str, Any]) -> Controller:
    """Return the controller of a discrete bank, its numbers rounded to 12 digits."""
    rows, n, _ = discrete.A.shape
    return Controller(
        kind=task.kind,
        title=task.title,
        n=n,
        rows=rows,
        v_top=task.scheduling.grid[-1] if rows > 1 else 0.0,
        sample_period=float(task.sample_period),
        A=flat(discrete.A),
        B=flat(discrete.B),
        W=flat(discrete.W),
        C=flat(discrete.C),
        facts={"building": task.building.name, "task": task.digest(), **facts},
        design=task.data(),
        building=building_digest(task.building),
    )


def flat(values: Array) -> list[float]:
    """Return a matrix row by row, its numbers rounded to 12 digits."""
    return [float(f"{value:.{_DIGITS}g}") for value in values.ravel().tolist()]


def pole_list(poles: NDArray[np.complex128]) -> list[list[float]]:
    """Return poles as [real part, imaginary part], slowest first."""
    return [[float(p.real), float(p.imag)] for p in sorted(poles, key=lambda p: (abs(p), p.imag))]
