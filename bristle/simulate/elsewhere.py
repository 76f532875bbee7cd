"""The coupling error to be expected where other tools run a scenario that was exported.

They hold inputs over a step, as Jacobi (libcosim, Ecos, OMSimulator) or Gauss-Seidel does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import ceil, isfinite, log2
from typing import TYPE_CHECKING

from ..errors import RunError
from ..quantity import plain
from .coupling_error import CouplingError, coupled_run, estimate, finer, largest
from .summary import judged_by
from .tolerance import worst

if TYPE_CHECKING:
    import pandas as pd

    from ..scenario.scenario import Scenario

ALGORITHMS = ("jacobi", "gauss-seidel")
"""What tools do that hold inputs over a step."""
TOLERANCE = 0.005
"""Error along a run [1] that a step is named for."""
MOST_STEPS = 500_000
"""Steps that a run in the search for that step may have: half a minute, some 100 MB.

Without the coupled engine each has one of twice as many beside it.
"""

Again = Callable[["Scenario", str], "pd.DataFrame"]


@dataclass(frozen=True)
class Expected:
    """What to expect of an algorithm: `error` [1] along the run of the worst output, and a step.

    `output` is that output. `step` [s] is the scenario's divided by a power of two at which a run
    was within the tolerance. `tried` [s] is the shortest step that was run, and `tried_error` [1]
    the largest error there: where `step` is None it is not within. All are None where the error is
    not known, and `why` says what is.
    """

    algorithm: str
    error: float | None
    step: float | None
    tried: float | None = None
    tried_error: float | None = None
    why: str = ""
    output: str | None = None

    def __str__(self) -> str:
        if self.error is None or self.tried is None or self.tried_error is None:
            return f"{self.algorithm}: {self.why}"
        told = f"{self.algorithm}: {plain(100 * self.error, 2)} % along the run of {self.output}"
        if self.error <= TOLERANCE:
            return told
        there = f"{plain(100 * self.tried_error, 2)} %"
        if self.step is None:
            limit = (
                f"no step down to {1e3 * self.tried:.4g} ms keeps it below {100 * TOLERANCE:g} %"
            )
            return f"{told}; {limit}: it is {there} there"
        return f"{told}; {there} at a step of {1e3 * self.step:.4g} ms"


def expect(scenario: Scenario, again: Again) -> tuple[Expected, ...]:
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

    found = []
    for name in ALGORITHMS:
        try:
            found.append(_expected(replace(scenario, algorithm=name), kept, again))
        except RunError as failure:
            found.append(Expected(name, None, None, why=f"cannot be told: {failure}"))
    return tuple(found)


def _expected(scenario: Scenario, kept: Again, again: Again) -> Expected:
    frame = kept(scenario, "fmu")
    errors = estimate(scenario, frame, kept)[1]
    output, doubt = worst(errors, frame)
    if doubt:
        return Expected(scenario.algorithm, None, None, why=doubt, output=output)
    error = errors[output].along
    found = Expected(scenario.algorithm, error, scenario.step, scenario.step, error, output=output)
    judged = {n: errors[n] for n in judged_by(frame) if errors[n].some}
    if error <= TOLERANCE:
        return found
    halvings = max(_halvings(one) for one in judged.values())
    most = int(log2(max(1.0, MOST_STEPS / scenario.steps)))
    tried, there = scenario, error
    for parts in range(max(1, min(halvings, most)), most + 1):
        tried = finer(scenario, 2**parts)
        there = _error_at(tried, judged, again)
        if there <= TOLERANCE:
            return replace(found, step=tried.step, tried=tried.step, tried_error=there)
    return replace(found, step=None, tried=tried.step, tried_error=there)


def _halvings(error: CouplingError) -> int:
    """Return how often the step is halved until an error is small enough, if its order lasts."""
    if error.along <= TOLERANCE or not isfinite(error.order):
        return 0
    return ceil(log2(error.along / TOLERANCE) / error.order)


def _error_at(scenario: Scenario, judged: Mapping[str, CouplingError], again: Again) -> float:
    """Return the largest error [1] along a run of the outputs that it is judged by.

    It is measured against the coupled engine; without that, the run at half the step differs by the
    share of it that the order seen at coarser steps tells. Long runs are not kept.
    """
    frame = again(scenario, "fmu")
    exact = coupled_run(scenario, again)
    other = again(finer(scenario, 2), "fmu").iloc[::2] if exact is None else exact
    found = []
    for name, error in judged.items():
        wanted = other[name].to_numpy()[: len(frame)]
        wrong = largest(frame[name].to_numpy() - wanted) / (largest(wanted) or 1.0)
        found.append(wrong if exact is not None else wrong / (1.0 - 0.5**error.order))
    return max(found)
