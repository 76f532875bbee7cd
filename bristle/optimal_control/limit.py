"""The least peak or RMS that any voltage of a scenario's damper reaches, and how sure that is."""

from __future__ import annotations

import time as clock
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..core.arrays import Array
from ..core.files import writing
from ..core.progress import Count, counted, tell
from ..core.text import unknown
from ..engine.coupled import Coupled
from ..engine.results import statistic_of
from ..engine.run import run
from ..errors import RunError, ScenarioError, not_usable
from ..system.model import System
from ..system.scenario import load_scenario
from ..system.toml import save
from ..view import Viewable
from .bound import FASTER, SOLVER, bound_of, largest_force
from .case import SCENARIO_FILE, Case, ControlProblem, case_of, refuse_folder, with_voltage
from .search import descended, foreseen, levelled

if TYPE_CHECKING:
    from ..engine.results import Results


OUTPUT = "structure.floor2_acceleration_absolute"
PREVIEWS = (0.0, 0.1, 0.5)
"""Times [s] for which a receding horizon sees the ground motion ahead."""
NODES_PER_PERIOD = 80
"""Nodes of the voltage in a period of the first mode, about."""
LEVELS = 9
"""Constant voltages that are compared."""
STATISTICS = ("peak", "rms")
QUIET = 0.35
"""Share of its peak under the best constant voltage that an output has fallen to for good where the
search's window ends, two periods later; it is the whole motion where the rest then counts."""


AGREE = 0.02
"""Share by which starts that agree differ at most."""
TRUST = 0.01
"""Share by which the coupled engine may find another value than the search."""


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


def limit(
    scenario: str | Path | System,
    overrides: Mapping[str, object] | None = None,
    *,
    output: str = OUTPUT,
    statistic: str = "peak",
    previews: Iterable[float] = PREVIEWS,
    starts: int = 3,
    out: str | Path | None = None,
) -> Limit:
    """Return the least peak or RMS of an output that any voltage of the damper reaches.

    The ground motion is known in advance, and the force is what the damper gives at its velocity
    with a voltage between 0 and its largest.

    Parameters
    ----------
    scenario : path or System
        With one structure without effects, one damper, and a ground motion. What commands the
        damper is left out of account.
    overrides : mapping, optional
        Values in place of the scenario's, as for `bristle.run`.
    output : str
        An output of the structure, "component.port".
    statistic : str
        "peak" (of its size) or "rms".
    previews : iterable of float
        Times [s], for each of which a receding horizon that sees so far ahead is run as well.
    starts : int
        How many voltages the search begins with.
    out : path, optional
        Folder for the voltage, a scenario that plays it, and its results.

    Raises
    ------
    ScenarioError
        If the scenario does not suit, or an argument is out of place.
    RunError
        If a run fails, or the folder cannot be written.

    Returns
    -------
    Limit

    Examples
    --------
    >>> from bristle.optimal_control import limit
    >>> found = limit("half_sine_pulse", {"run.stop": 1.0})  # doctest: +SKIP
    >>> found.bound < found.value <= min(found.constant.values())  # doctest: +SKIP
    True
    """
    began = clock.monotonic()
    seen = _checked(statistic, previews, starts)
    if out is not None:
        refuse_folder(Path(out))
    loaded = load_scenario(scenario, overrides)
    case = case_of(loaded, output)
    tell("compiling the laws, once")
    whole = ControlProblem(case)
    levels = np.linspace(0.0, case.v_max, LEVELS).tolist()
    constant = {V: statistic_of(whole.respond(whole.level(V)), statistic) for V in levels}
    if not np.isfinite([*constant.values()]).all():
        raise RunError(f"{loaded.where}: {output} is not finite at some constant {case.command}.")
    best = min(constant, key=lambda V: constant[V])
    last = _window(whole, best) if statistic == "peak" else whole.last
    problem, found = _searched_from_all(whole, last, statistic, best, starts)
    if int(np.abs(whole.respond(found[0][1])).argmax()) > problem.last:  # the peak comes later
        problem, found = _searched_from_all(whole, whole.last, statistic, best, starts)
    searched, voltage = found[0][0].value, found[0][1]
    ahead = {}
    for s in counted(seen, "receding horizon"):
        ahead[s] = _seen_ahead(problem, whole, s, best, searched, statistic)
    bound, most = _bound(problem, whole, voltage, statistic)
    results = _played(case, voltage, out)
    reached = statistic_of(results[output].to_numpy(), statistic)
    return Limit(
        loaded.title, output, statistic, case.unit, reached, searched,
        tuple(start for start, _ in found), bound, most, ahead, constant,
        statistic_of(Coupled().run(loaded)[output], statistic), case.time, voltage, case.command,
        case.command_unit, results, clock.monotonic() - began,
    )  # fmt: skip


def _checked(statistic: str, previews: Iterable[float], starts: int) -> list[float]:
    if statistic not in STATISTICS:
        raise ScenarioError(unknown("statistic", statistic, STATISTICS))
    if starts < 1:
        raise ScenarioError(f"{starts} starts: 1 or more is right; 3 is usual.")
    seen = sorted(previews)
    for seconds in seen:
        if not 0.0 <= seconds <= 10.0:
            raise ScenarioError(f"a preview of {seconds:g} s: 0 to 10 s is right.")
    return seen


def _window(whole: ControlProblem, voltage: float) -> int:
    """Return the instant behind which nothing large happens under a constant voltage [V]."""
    case, size = whole.case, np.abs(whole.respond(whole.level(voltage)))
    large = np.flatnonzero(size > QUIET * size.max())
    end = int(large[-1]) if len(large) else 0
    return min(end + round(2.0 / (case.frequency * case.plant.h)), len(case.ground) - 1)


def _searched_from_all(
    whole: ControlProblem, last: int, statistic: str, rest: float, starts: int
) -> tuple[ControlProblem, list[tuple[Start, Array]]]:
    """Search up to an instant from all starts; return that problem, and what came out, best first.

    Parameters
    ----------
    whole : ControlProblem of the whole motion
    last : instant
    statistic : "peak" or "rms"
    rest : voltage behind that instant, and the first start [V]
    starts : how many
    """
    case = whole.case
    every = max(1, round(1.0 / (case.frequency * NODES_PER_PERIOD * case.plant.h)))
    problem = ControlProblem(case, every, last)
    begins = _begins(problem, rest, starts)
    count, found = Count("search", len(begins)), []
    for name, values in begins.items():
        count.begins(f"from {name}")
        found.append(_searched(problem, whole, name, values, statistic, rest))
    return problem, sorted(found, key=lambda one: one[0].value)


def _begins(problem: ControlProblem, best: float, count: int) -> dict[str, Array]:
    """Return where searches begin, by name: constant voltages, then random ones."""
    n, v_max = len(problem.nodes), problem.case.v_max
    known = {f"{V:g} {problem.case.command_unit}": V for V in (best, 0.125 * v_max, v_max)}
    begins = {f"constant {name}": np.full(n, V) for name, V in known.items()}
    for seed in range(1, count + 1):
        random = np.random.default_rng(seed).uniform(0.0, v_max, n)
        begins[f"random {seed}"] = random
    return dict([*begins.items()][:count])


def _searched(
    problem: ControlProblem,
    whole: ControlProblem,
    name: str,
    values: Array,
    statistic: str,
    rest: float,
) -> tuple[Start, Array]:
    """Search from voltages (n,) at the nodes; return what came out, and the voltage (N + 1,)."""
    begin = _continued(problem, problem.between(values), rest)
    before = statistic_of(whole.respond(begin), statistic)
    values = descended(problem, values, statistic)
    if statistic == "peak":
        values = levelled(problem, values)[0]
    voltage = _continued(problem, problem.between(values), rest)
    return Start(name, before, statistic_of(whole.respond(voltage), statistic)), voltage


def _continued(problem: ControlProblem, voltage: Array, rest: float) -> Array:
    """Return a voltage (n,) at all instants of a case: behind the window it is `rest` [V]."""
    tail = np.full(len(problem.case.ground) - 1 - problem.last, rest)
    return np.append(voltage, tail)


def _seen_ahead(
    problem: ControlProblem,
    whole: ControlProblem,
    seconds: float,
    rest: float,
    least: float,
    statistic: str,
) -> float:
    """Return what a receding horizon reaches; the cost is never told by less than 2 % of least."""
    voltage = foreseen(problem, seconds, rest, 0.02 * least, statistic)
    return statistic_of(whole.respond(_continued(problem, voltage, rest)), statistic)


def _bound(
    problem: ControlProblem, whole: ControlProblem, voltage: Array, statistic: str
) -> tuple[float | None, float]:
    """Return the lower bound, None where effects of the damper allow none or `SOLVER` is
    missing; the largest force."""
    tell("a lower bound")
    case, course = problem.case, whole.course
    whole.respond(voltage)
    if not (case.plain and find_spec(SOLVER)):
        return None, float(np.abs(course.force).max())
    speed = float(np.abs(course.x @ case.plant.velocity).max())
    most = max(largest_force(case, FASTER * speed), float(np.abs(course.force).max()))
    return bound_of(problem, statistic, most), most


def _played(case: Case, voltage: Array, out: str | Path | None) -> Results:
    """Return the results of the scenario under a voltage, run by the coupled engine."""
    system = with_voltage(case, voltage)
    if out is None:
        return run(system, engine="compiled")
    with writing(out, not_usable):
        save(system, Path(out) / SCENARIO_FILE)
    return run(Path(out) / SCENARIO_FILE, engine="compiled", out=out)
