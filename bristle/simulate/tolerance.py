"""The largest step of a scenario at which its coupling error stays below a tolerance."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from ..errors import RunError
from ..quantity import plain
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

MOST_UNKNOWN = 3
"""Steps in a row with an unknown error after which it goes no further down."""


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
        If no step does, or one of these outputs has no estimate that is worth something.
    """
    runs: dict[tuple[float, str], pd.DataFrame] = {}

    def kept(one: Scenario, engine: str) -> pd.DataFrame:
        if (one.step, engine) not in runs:
            runs[one.step, engine] = again(one, engine)
        return runs[one.step, engine]

    good: Scenario | None = None
    tried, unknown = scenario, 0
    for _ in range(MOST_TRIALS):
        errors = estimate(tried, frame := kept(tried, "fmu"), kept)[1]
        output, doubt = worst(errors, frame)
        unknown = unknown + 1 if doubt else 0
        if not doubt and errors[output].along <= tolerance:
            good, coarser = tried, finer(tried, 0.5)
            if tried.step < scenario.step or not _fits(coarser):
                return good
            tried = coarser
        elif good is not None:
            return good
        elif unknown == MOST_UNKNOWN:
            raise RunError(
                f"the coupling error at {1e3 * tried.step:.3g} ms is {doubt}.\n"
                "  So there is nothing to hold a tolerance against. Dry friction without "
                "holding_force and switches behave so."
            )
        else:
            tried = finer(tried, 2)
    raise RunError(
        f"no step down to {1e3 * tried.step:.3g} ms keeps the coupling error below "
        f"{100 * tolerance:.3g} %."
    )


def worst(errors: Mapping[str, CouplingError], frame: pd.DataFrame) -> tuple[str, str]:
    """Return the output that is furthest off, of those that a run is judged by, and a doubt.

    The doubt is "" where each of them has an estimate that is worth something. Else nobody knows
    the error of the run, and the doubt says what is known, and why no more.

    Parameters
    ----------
    errors : output to its error, as `estimate` returns it
    frame : the results

    Raises
    ------
    RunError
        If the run has no Real output.
    """
    judged = {name: errors[name] for name in judged_by(frame)}
    if not judged:
        raise RunError("no output is Real: there is nothing that has a coupling error.")
    output = max(judged, key=lambda name: judged[name].known)
    doubtful = {name: error for name, error in judged.items() if not error.worth}
    if not doubtful:
        return output, ""
    first = max(doubtful, key=lambda name: doubtful[name].known)
    others = f" and {len(doubtful) - 1} more" if len(doubtful) > 1 else ""
    known = judged[output].known
    least = f", at least {plain(100 * known, 2)} % along the run of {output}" if known > 0.0 else ""
    return output, f"unknown{least}; {first}{others}: {doubtful[first].doubt()}"


def _fits(scenario: Scenario) -> bool:
    count = scenario.stop / scenario.step
    return count >= FEWEST_STEPS and abs(count - round(count)) <= STEP_TOLERANCE
