"""The coupling error of a run, output by output; the step for a tolerance.

Where all components are our own the coupled engine gives the run without coupling error. Else it is
extrapolated from runs at h, h/2 and h/4, whose differences fall by 2^p where the order is p.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from math import ceil, isfinite, log2, nan
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.progress import tell
from ..core.text import plain
from ..errors import BristleError, RunError
from ..system.model import System
from ..system.parameters import told_over_step
from ..system.toml import STEP_TOLERANCE, scenario_text
from . import Engine
from .results import judged_by, reals, statistic_of, to_frame

if TYPE_CHECKING:
    import pandas as pd

LEAST_ORDER, MOST_ORDER = 0.5, 2.5
"""Orders between which the differences of runs tell the error; algorithms have 1 or 2."""

MOST_ERROR = 1.0
"""Error along a run, as a share of the peak, beyond which no power of the step describes it."""

ROUNDING = 1e-9
"""Error along a run, as a share of the peak, below which an output has none worth telling."""

Array = np.ndarray[Any, np.dtype[Any]]
Again = Callable[[System, str], "pd.DataFrame"]
"""(scenario, engine) -> the results of another run."""


def again_by(engine: Engine) -> Again:
    """Return what makes another run, for its numbers alone: by an engine, or the coupled one.

    That takes substeps short enough to tell the errors of other runs.
    """

    def again(system: System, name: str) -> pd.DataFrame:
        if name == engine.name:
            step = f"a step of {1e3 * system.step:.4g} ms"
            table = engine.run(replace(system, title=f"{system.title}, {step}"))
        else:
            from .coupled import REFERENCE_SUBSTEP, Coupled

            tell(f"{system.title}: the coupled engine")
            table = Coupled(REFERENCE_SUBSTEP).run(system)
        return to_frame(table, {"scenario": scenario_text(system)})

    return again


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
    scenario: System, frame: pd.DataFrame, again: Again
) -> tuple[str, dict[str, CouplingError]]:
    """Return how the errors of a run were found, and that of every Real output.

    Parameters
    ----------
    scenario : System
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
    scenario: System, frame: pd.DataFrame, found: dict[str, CouplingError]
) -> dict[str, CouplingError]:
    """Return estimates from finer steps, worth nothing where a signal between components spoils it.

    Where a switch or a stick falls otherwise the runs part for good, or agree on the wrong side of
    it. So it is with a discrete signal that switches or does not settle, and with any signal whose
    error falls too slowly, as a friction's that jumps. The steps of a source fall on the same rows
    in all runs; but Jacobi shows what follows them at once one row late, however short its step.
    """
    discrete = set(discrete_outputs(scenario))
    fed = {wire.target for wire in scenario.wires}
    doubtful = set()
    for name in {f"{wire.source}.{wire.output}" for wire in scenario.wires} & found.keys():
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


def discrete_outputs(scenario: System) -> list[str]:
    """Return the Real outputs that stand between instants of their component's own."""
    return [
        f"{component.name}.{variable.name}"
        for component in scenario.components.values()
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
    peak, rms = largest(other), statistic_of(other, "rms")
    return CouplingError(
        along=along,
        peak=factor * (largest(h) / peak - 1.0) if peak > 0.0 else nan,
        rms=factor * (statistic_of(h, "rms") / rms - 1.0) if rms > 0.0 else nan,
        order=order,
        worth=along <= MOST_ERROR and LEAST_ORDER <= order <= MOST_ORDER,
        least=least,
    )


def finer(scenario: System, parts: float) -> System:
    """Return a scenario whose step, and those of its components, are divided by a number."""
    components = {
        name: replace(c, step=c.step / parts if c.step else None)
        for name, c in scenario.components.items()
    }
    return replace(scenario, step=scenario.step / parts, components=components)


def as_data(errors: dict[str, CouplingError]) -> dict[str, dict[str, Any]]:
    """Return errors as plain numbers, for attributes of frames and JSON."""
    return {name: asdict(error) for name, error in errors.items()}


def coupled_run(scenario: System, again: Again) -> pd.DataFrame | None:
    """Return the run without coupling error, None where there is no such engine for it."""
    try:
        return again(scenario, "compiled")
    except BristleError:  # a foreign FMU, or a system that this engine does not solve
        return None


def largest(values: Array) -> float:
    """Return the largest absolute value, 0 where there is none."""
    return float(np.abs(values).max(initial=0.0))


# The largest step of a scenario at which its coupling error stays below a tolerance.

FEWEST_STEPS = 100
"""Steps of a run below which a search for a tolerance goes no further up."""

MOST_TRIALS = 12
"""Steps that a search for a tolerance tries."""

MOST_UNKNOWN = 3
"""Steps in a row with an unknown error after which it goes no further down."""


def find_step(scenario: System, tolerance: float, again: Again) -> System:
    """Return the scenario with the largest step, 2^k times its own, whose error is small enough.

    Parameters
    ----------
    scenario : System
    tolerance : largest error [1] along the run of any output that a run is judged by
    again : as in `estimate`

    Raises
    ------
    RunError
        If no step does, or one of these outputs has no estimate that is worth something.
    """
    kept = _remembered(again)
    good: System | None = None
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


def _remembered(again: Again) -> Again:
    """Return `again` with every run made once."""
    runs: dict[tuple[str, float, str], pd.DataFrame] = {}

    def kept(one: System, engine: str) -> pd.DataFrame:
        key = one.algorithm if engine == "fmu" else "", one.step, engine
        if key not in runs:
            runs[key] = again(one, engine)
        return runs[key]

    return kept


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
    least = f", at least {plain(100 * known, 2)} % of the peak of {output}" if known > 0.0 else ""
    return output, f"unknown{least}; {first}{others}: {doubtful[first].doubt()}"


def _fits(scenario: System) -> bool:
    count = scenario.stop / scenario.step
    return count >= FEWEST_STEPS and abs(count - round(count)) <= STEP_TOLERANCE


# The coupling error to be expected where other tools run a scenario that was exported.
#
# They hold inputs over a step, as Jacobi (libcosim, Ecos, OMSimulator) or Gauss-Seidel does.

ALGORITHMS = ("jacobi", "gauss-seidel")
"""What tools do that hold inputs over a step."""
TOLERANCE = 0.005
"""Error along a run [1] that a step is named for."""
MOST_STEPS = 40_000
"""Steps that a run in the search for that step may have: a few seconds.

Without the coupled engine each has one of twice as many beside it.
"""


@dataclass(frozen=True)
class Expected:
    """What to expect of an algorithm: `error` [1] along the run of the worst output, and a step.

    `output` is that output. `step` [s] is the scenario's divided by a power of two at which a run
    was within the tolerance. `tried` [s] is the shortest step that was run, and `tried_error` [1]
    the largest error there: where `step` is None it is not within, and `wanted` [s] would be by the
    order of the error. All are None where the error is not known, and `why` says what is.
    """

    algorithm: str
    error: float | None
    step: float | None
    tried: float | None = None
    tried_error: float | None = None
    why: str = ""
    output: str | None = None
    wanted: float | None = None

    def __str__(self) -> str:
        if self.error is None or self.tried is None or self.tried_error is None:
            return f"{self.algorithm}: {self.why}"
        told = f"{self.algorithm}: {plain(100 * self.error, 2)} % of the peak of {self.output}"
        if self.error <= TOLERANCE:
            return told
        there = f"{plain(100 * self.tried_error, 2)} %"
        if self.step is None:
            more = ", the shortest that was tried"
            if self.wanted:
                more = f", {100 * TOLERANCE:g} % at about {1e3 * self.wanted:.2g} ms (not tried)"
            return f"{told}; {there} at a step of {1e3 * self.tried:.4g} ms{more}"
        return f"{told}; {there} at a step of {1e3 * self.step:.4g} ms"


def expect(scenario: System, again: Again) -> tuple[Expected, ...]:
    """Return the coupling error of a scenario with each algorithm of other tools.

    Parameters
    ----------
    scenario : System
    again : callable
        (scenario, engine) -> its results.
    """
    kept, found = _remembered(again), []
    for name in ALGORITHMS:
        try:
            found.append(_expected(replace(scenario, algorithm=name), kept))
        except RunError as failure:
            found.append(Expected(name, None, None, why=f"cannot be told: {failure}"))
    return tuple(found)


def _expected(scenario: System, again: Again) -> Expected:
    frame = again(scenario, "fmu")
    errors = estimate(scenario, frame, again)[1]
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
    wanted = scenario.step / 2**halvings if halvings > most else None
    return replace(found, step=None, tried=tried.step, tried_error=there, wanted=wanted)


def _halvings(error: CouplingError) -> int:
    """Return how often the step is halved until an error is small enough, if its order lasts."""
    if error.along <= TOLERANCE or not isfinite(error.order):
        return 0
    return ceil(log2(error.along / TOLERANCE) / error.order)


def _error_at(scenario: System, judged: Mapping[str, CouplingError], again: Again) -> float:
    """Return the largest error [1] along a run of the outputs that it is judged by.

    It is measured against the coupled engine; without that, the run at half the step differs by the
    share of it that the order seen at coarser steps tells.
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
