"""How far a run is from one with ever smaller steps: the coupling error, output by output.

Where all components are our own the coupled engine gives the run without coupling error. Else it is
extrapolated from runs at h, h/2 and h/4, whose differences fall by 2^p where the order is p.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from math import isfinite, log2, nan
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import BristleError, RunError
from ..scenario.checks import STEP_TOLERANCE
from .summary import judged_by, reals

if TYPE_CHECKING:
    import pandas as pd

    from ..scenario.scenario import Scenario

LEAST_ORDER, MOST_ORDER = 0.5, 2.5
"""Orders between which the differences of runs tell the error; algorithms have 1 or 2."""

FEWEST_STEPS = 100
"""Steps of a run below which a search for a tolerance goes no further up."""

MOST_TRIALS = 12
"""Steps that a search for a tolerance tries."""

ROUNDING = 1e-9
"""Error along a run, as a share of the peak, below which an output has none worth telling."""

Array = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True)
class CouplingError:
    """The error of one output of a run, as shares [1] of its peak, and of its RMS for `rms`.

    `along` is the largest anywhere along the run, `peak` and `rms` those of peak and RMS, positive
    where the run's value is too large. `order` is by which power of the step the error along the
    run falls, nan where there is none. `worth` is whether that order lets the estimate be believed.
    """

    along: float
    peak: float
    rms: float
    order: float
    worth: bool

    @property
    def some(self) -> bool:
        """Whether there is an error beyond rounding."""
        return self.along > ROUNDING

    def __str__(self) -> str:
        shares = (f"{100 * share:.2g} %" for share in (self.along, self.peak, self.rms))
        return "{} along the run, peak {}, RMS {}, order {:.2g}".format(*shares, self.order)

    def doubt(self) -> str:
        """Return why the estimate is worth nothing, where it is."""
        if LEAST_ORDER <= self.order <= MOST_ORDER:
            return "the coupling error follows a controller that switches, or does not settle"
        said = "the coupling error does not fall with the step as an algorithm's does"
        return f"{said} (order {self.order:.2g})"


def estimate(
    scenario: Scenario, frame: pd.DataFrame, again: Callable[[Scenario, str], pd.DataFrame]
) -> tuple[str, dict[str, CouplingError]]:
    """Return how the errors of a run were found, and that of every Real output.

    Parameters
    ----------
    scenario : Scenario
        What was run with the engine "fmu".
    frame : DataFrame
        Its results.
    again : callable
        (scenario, engine) -> results of another run.

    Returns
    -------
    how : str
        "coupled engine" or "h, h/2, h/4".
    errors : dict
        Output to CouplingError.
    """
    rows = len(frame)
    half = again(finer(scenario, 2), "fmu").iloc[::2]
    exact = coupled_run(scenario, again)
    quarter = again(finer(scenario, 4), "fmu").iloc[::4] if exact is None else None
    found = {}
    for name in reals(frame):
        h, h2 = (one[name].to_numpy()[:rows] for one in (frame, half))
        if quarter is None:
            assert exact is not None
            found[name] = against(h, h2, exact[name].to_numpy()[:rows])
        else:
            found[name] = extrapolated(h, h2, quarter[name].to_numpy()[:rows])
    if exact is not None:
        return "coupled engine", found
    discrete = [name for name in discrete_outputs(scenario) if name in found]
    if any(not found[name].worth or switches(frame[name].to_numpy()) for name in discrete):
        # Where a switch falls otherwise the runs part for good, or agree on the wrong side of it.
        found = {name: replace(one, worth=not one.some) for name, one in found.items()}
    return "h, h/2, h/4", found


def switches(values: Array) -> bool:
    """Return whether a signal (rows,) goes through half of its range or more in one step."""
    return float(np.abs(np.diff(values)).max(initial=0.0)) >= 0.5 * float(np.ptp(values)) > 0.0


def discrete_outputs(scenario: Scenario) -> list[str]:
    """Return the Real outputs that stand between instants of their component's own."""
    return [
        f"{component.name}.{variable.name}"
        for component in scenario.components
        for variable in component.description.of("output")
        if variable.kind == "Real"
        and (variable.variability == "discrete" or variable.name in component.over_step)
    ]


def against(h: Array, half: Array, exact: Array) -> CouplingError:
    """Return the error of a run beside one that has none.

    Parameters
    ----------
    h, half, exact : (rows,) one output at the same times, at the step, at half of it, without error
    """
    scale = largest(exact) or 1.0
    wrong, better = largest(h - exact) / scale, largest(half - exact) / scale
    found = _judged(wrong, better, 1.0, h, exact)
    # Measured, not extrapolated: an error that falls faster than expected is as good as any.
    return replace(found, worth=found.worth or not found.order <= MOST_ORDER)


def extrapolated(h: Array, half: Array, quarter: Array) -> CouplingError:
    """Return the error of a run as its neighbours at finer steps tell it (Richardson 1911).

    The errors e, e/r, e/r^2 differ by e (1 - 1/r) and a r-th of that, and r = 2^p.

    Parameters
    ----------
    h, half, quarter : (rows,) one output at the same times, at the step, half and a quarter of it
    """
    scale = largest(quarter) or 1.0
    first, second = largest(h - half) / scale, largest(half - quarter) / scale
    ratio = first / second if second > 0.0 else nan
    factor = ratio / (ratio - 1.0) if ratio > 1.0 else 1.0
    return _judged(first, second, factor, h, half)


def _judged(wrong: float, better: float, factor: float, h: Array, other: Array) -> CouplingError:
    """Return an error from the differences of two runs; `factor` makes them the whole error.

    Parameters
    ----------
    wrong, better : largest difference [1] at the step and at half of it, shares of the peak
    factor : 1 where the differences are those to the exact run
    h, other : (rows,) the run, and what it is held against
    """
    if wrong <= ROUNDING:
        return CouplingError(0.0, 0.0, 0.0, nan, True)
    order = log2(wrong / better) if better > 0.0 else nan
    peak, rms = largest(other), _rms(other)
    return CouplingError(
        along=factor * wrong,
        peak=factor * (largest(h) / peak - 1.0) if peak > 0.0 else nan,
        rms=factor * (_rms(h) / rms - 1.0) if rms > 0.0 else nan,
        order=order,
        worth=isfinite(order) and LEAST_ORDER <= order <= MOST_ORDER,
    )


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
        if worst(estimate(tried, frame := kept(tried, "fmu"), kept)[1], frame) <= tolerance:
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


def worst(errors: Mapping[str, CouplingError], frame: pd.DataFrame) -> float:
    """Return the largest error along a run [1] of the outputs that it is judged by.

    Parameters
    ----------
    errors : output to its error, as `estimate` returns it
    frame : the results

    Raises
    ------
    RunError
        If none of them has an estimate that is worth something.
    """
    judged = [errors[name] for name in judged_by(frame)]
    worth = [error.along for error in judged if error.worth]
    if not worth:
        raise RunError(
            "no output's coupling error falls with the step: there is nothing to hold a tolerance "
            "against. Dry friction without holding_force and switches behave so."
        )
    return max(worth)


def _fits(scenario: Scenario) -> bool:
    count = scenario.stop / scenario.step
    return count >= FEWEST_STEPS and abs(count - round(count)) <= STEP_TOLERANCE


def finer(scenario: Scenario, parts: float) -> Scenario:
    """Return a scenario whose step, and those of its components, are divided by a number."""
    components = tuple(
        replace(c, step=c.step / parts if c.step else None) for c in scenario.components
    )
    return replace(scenario, step=scenario.step / parts, components=components)


def as_data(errors: dict[str, CouplingError]) -> dict[str, dict[str, Any]]:
    """Return errors as plain numbers, for attributes of frames and JSON."""
    return {name: asdict(error) for name, error in errors.items()}


def coupled_run(
    scenario: Scenario, again: Callable[[Scenario, str], pd.DataFrame]
) -> pd.DataFrame | None:
    """Return the run without coupling error, None where there is no such engine for it."""
    try:
        return again(scenario, "compiled")
    except BristleError:  # a foreign FMU, or a system that this engine does not solve
        return None


def largest(values: Array) -> float:
    """Return the largest absolute value, 0 where there is none."""
    return float(np.abs(values).max(initial=0.0))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
