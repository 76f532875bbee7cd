"""The largest step of a scenario at which its coupling error stays below a tolerance."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from ..errors import RunError
from ..scenario.checks import STEP_TOLERANCE
from .coupling_error import CouplingError, estimate, finer
from .summary import judged_by

if TYPE_CHECKING:
    import pandas as pd

    from ..scenario.scenario import Scenario

FEWEST_STEPS = 100
"""Steps of a run below which a search for a tolerance goes no further up."""

MOST_TRIALS = 12
"""Steps that a search for a tolerance tries."""


def find_step(
    scenario: Scenario, tolerance: float, again: Callable[[Scenario, str], pd.DataFrame]
) -> Scenario:
    """Return the scenario with the largest step, 2^k times its own, whose error is small enough.

    Parameters
    ----------
    scenario : Scenario
    tolerance : largest error [1] along the run of any output that a run is judged by
    again : as in `estimate`

    Raises
    ------
    RunError
        If no step does, or no output has an estimate that is worth something.
    """
    runs: dict[tuple[float, str], pd.DataFrame] = {}

    def kept(one: Scenario, engine: str) -> pd.DataFrame:
        if (one.step, engine) not in runs:
            runs[one.step, engine] = again(one, engine)
        return runs[one.step, engine]

    good: Scenario | None = None
    tried = scenario
    for _ in range(MOST_TRIALS):
        errors = estimate(tried, frame := kept(tried, "fmu"), kept)[1]
        if errors[worst(errors, frame)].along <= tolerance:
            good, coarser = tried, finer(tried, 0.5)
            if tried.step < scenario.step or not _fits(coarser):
                return good
            tried = coarser
        elif good is not None:
            return good
        else:
            tried = finer(tried, 2)
    raise RunError(
        f"no step down to {1e3 * tried.step:.3g} ms keeps the coupling error below "
        f"{100 * tolerance:.3g} %."
    )


def worst(errors: Mapping[str, CouplingError], frame: pd.DataFrame) -> str:
    """Return which of the outputs that a run is judged by has the largest error along it.

    Parameters
    ----------
    errors : output to its error, as `estimate` returns it
    frame : the results

    Raises
    ------
    RunError
        If none of them has an estimate that is worth something.
    """
    worth = {name: errors[name].along for name in judged_by(frame) if errors[name].worth}
    if not worth:
        raise RunError(
            "no output's coupling error falls with the step: there is nothing to hold a tolerance "
            "against. Dry friction without holding_force and switches behave so."
        )
    return max(worth, key=worth.__getitem__)


def _fits(scenario: Scenario) -> bool:
    count = scenario.stop / scenario.step
    return count >= FEWEST_STEPS and abs(count - round(count)) <= STEP_TOLERANCE
