"""How far a run is from one with ever smaller steps: the coupling error, output by output.

Where all components are our own the coupled engine gives the run without coupling error. Else it is
extrapolated from runs at h, h/2 and h/4, whose differences fall by 2^p where the order is p.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from math import log2, nan
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import BristleError
from ..scenario.over_step import told_over_step
from .summary import reals

if TYPE_CHECKING:
    import pandas as pd

    from ..scenario.scenario import Scenario

LEAST_ORDER, MOST_ORDER = 0.5, 2.5
"""Orders between which the differences of runs tell the error; algorithms have 1 or 2."""

MOST_ERROR = 1.0
"""Error along a run, as a share of the peak, beyond which no power of the step describes it."""

ROUNDING = 1e-9
"""Error along a run, as a share of the peak, below which an output has none worth telling."""

Array = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True)
class CouplingError:
    """The error of one output of a run, as shares [1] of its peak, and of its RMS for `rms`.

    `along` is the largest anywhere along the run, `peak` and `rms` those of peak and RMS, positive
    where the run's value is too large. `order` is by which power of the step the error along the
    run falls, nan where there is none. `worth` is whether that order lets the estimate be believed.
    `least` is what the error along the run is even if it does not: the difference to the run
    without error, or half of that to the run at half the step, which is the better of the two.
    """

    along: float
    peak: float
    rms: float
    order: float
    worth: bool
    least: float

    @property
    def some(self) -> bool:
        """Whether there is an error beyond rounding."""
        return self.along > ROUNDING

    @property
    def known(self) -> float:
        """What is known of the error along the run: all of it, or the least that it is."""
        return self.along if self.worth else self.least

    def __str__(self) -> str:
        shares = (f"{100 * share:.2g} %" for share in (self.along, self.peak, self.rms))
        return "{} along the run, peak {}, RMS {}, order {:.2g}".format(*shares, self.order)

    def doubt(self) -> str:
        """Return why the estimate is worth nothing, where it is."""
        if self.along > MOST_ERROR:
            return "the coupling error is larger than the peak"
        if LEAST_ORDER <= self.order <= MOST_ORDER:
            return "the coupling error follows a signal that switches or jumps, or does not settle"
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
    return "h, h/2, h/4", without_doubtful(scenario, frame, found)


def without_doubtful(
    scenario: Scenario, frame: pd.DataFrame, found: dict[str, CouplingError]
) -> dict[str, CouplingError]:
    """Return estimates from finer steps, worth nothing where a signal between components spoils it.

    Where a switch or a stick falls otherwise the runs part for good, or agree on the wrong side of
    it. So it is with a discrete signal that switches or does not settle, and with any signal whose
    error falls too slowly, as a friction's that jumps. The steps of a source fall on the same rows
    in all runs; but Jacobi shows what follows them at once one row late, however short its step.
    """
    discrete = set(discrete_outputs(scenario))
    fed = {wire.target for wire in scenario.connections}
    doubtful = set()
    for name in {f"{wire.source}.{wire.output}" for wire in scenario.connections} & found.keys():
        error, stands = found[name], name in discrete
        follows = name.partition(".")[0] in fed or scenario.algorithm == "jacobi"
        settles = error.worth or (error.order > MOST_ORDER and not stands)
        if not settles or (stands and follows and switches(frame[name].to_numpy())):
            doubtful.add(name)
    if not doubtful:
        return found
    wrong = {name for name in doubtful if name.partition(".")[0] in fed}  # even where runs agree
    return {
        name: replace(one, worth=not one.some and name not in wrong) for name, one in found.items()
    }


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
        and (variable.variability == "discrete" or variable.name in told_over_step(component))
    ]


def against(h: Array, half: Array, exact: Array) -> CouplingError:
    """Return the error of a run beside one that has none.

    Parameters
    ----------
    h, half, exact : (rows,) one output at the same times, at the step, at half of it, without error
    """
    scale = largest(exact) or 1.0
    wrong, better = largest(h - exact) / scale, largest(half - exact) / scale
    found = _judged(wrong, better, 1.0, h, exact, least=wrong)
    # Measured, not extrapolated: an error that falls faster than expected is as good as any.
    falls = found.worth or not found.order <= MOST_ORDER
    return replace(found, worth=falls and found.along <= MOST_ERROR)


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
    return _judged(first, second, factor, h, half, least=first / 2.0)


def _judged(
    wrong: float, better: float, factor: float, h: Array, other: Array, least: float
) -> CouplingError:
    """Return an error from the differences of two runs; `factor` makes them the whole error.

    Parameters
    ----------
    wrong, better : largest difference [1] at the step and at half of it, shares of the peak
    factor : 1 where the differences are those to the exact run
    h, other : (rows,) the run, and what it is held against
    least : as in `CouplingError`
    """
    if wrong <= ROUNDING:
        return CouplingError(0.0, 0.0, 0.0, nan, True, 0.0)
    order = log2(wrong / better) if better > 0.0 else nan
    along = factor * wrong
    peak, rms = largest(other), _rms(other)
    return CouplingError(
        along=along,
        peak=factor * (largest(h) / peak - 1.0) if peak > 0.0 else nan,
        rms=factor * (_rms(h) / rms - 1.0) if rms > 0.0 else nan,
        order=order,
        worth=along <= MOST_ERROR and LEAST_ORDER <= order <= MOST_ORDER,
        least=least,
    )


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
