"""The coupling error to be expected where other tools run a scenario that was exported.

They hold inputs over a step, as Jacobi (libcosim, Ecos, OMSimulator) or Gauss-Seidel does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, isfinite, log2
from typing import TYPE_CHECKING

from ..errors import RunError
from .coupling_error import CouplingError, estimate, worst
from .summary import judged_by

if TYPE_CHECKING:
    import pandas as pd

    from ..scenario.scenario import Scenario

ALGORITHMS = ("jacobi", "gauss-seidel")
"""What tools do that hold inputs over a step."""
TOLERANCE = 0.005
"""Error along a run [1] that a step is named for."""


@dataclass(frozen=True)
class Expected:
    """What to expect of an algorithm: `error` [1] along the run of the worst output, and a step.

    `step` [s] is the scenario's divided by a power of two, small enough for the tolerance by the
    order seen; `error` and `step` are None where they cannot be told, and `why` says so.
    """

    algorithm: str
    error: float | None
    step: float | None
    why: str = ""

    def __str__(self) -> str:
        if self.error is None or self.step is None:
            return f"{self.algorithm}: the coupling error cannot be told: {self.why}"
        told = f"{self.algorithm}: {100 * self.error:.2g} % along the run"
        return f"{told}; a step of {1e3 * self.step:.4g} ms keeps it below {100 * TOLERANCE:g} %"


def expect(
    scenario: Scenario, again: Callable[[Scenario, str], pd.DataFrame]
) -> tuple[Expected, ...]:
    """Return the coupling error of a scenario with each algorithm of other tools.

    Parameters
    ----------
    scenario : Scenario
    again : callable
        (scenario, engine) -> its results.
    """
    runs: dict[tuple[str, float, str], pd.DataFrame] = {}

    def kept(one: Scenario, engine: str) -> pd.DataFrame:
        key = one.algorithm if engine == "fmu" else "", one.step, engine
        if key not in runs:
            runs[key] = again(one, engine)
        return runs[key]

    return tuple(_expected(replace(scenario, algorithm=name), kept) for name in ALGORITHMS)


def _expected(scenario: Scenario, again: Callable[[Scenario, str], pd.DataFrame]) -> Expected:
    try:
        frame = again(scenario, "fmu")
        errors = estimate(scenario, frame, again)[1]
        error = worst(errors, frame)
    except RunError as failure:
        return Expected(scenario.algorithm, None, None, str(failure))
    judged = [errors[name] for name in judged_by(frame) if errors[name].worth]
    halvings = max((_halvings(one) for one in judged), default=0)
    return Expected(scenario.algorithm, error, scenario.step / 2.0**halvings)


def _halvings(error: CouplingError) -> int:
    """Return how often the step is halved until an error is small enough; it falls by its order."""
    if error.along <= TOLERANCE or not isfinite(error.order):
        return 0
    return ceil(log2(error.along / TOLERANCE) / error.order)
