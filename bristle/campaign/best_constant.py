"""The best constant voltage of a damper, for each ground motion and for a set of them.

A coarse grid finds the valley, a bounded scalar minimisation (Brent 1973, Algorithms for
Minimization without Derivatives, ch. 5) its bottom. A peak over a long record has kinks and several
valleys, so the finer the grid, the surer the answer; the grid's best point is never given up for a
worse one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from pathlib import Path

import numpy as np

from ..core.arrays import Array
from ..core.progress import Progress
from ..core.text import plain, unknown
from ..data import read_ground_motion
from ..engine.coupled import Coupled
from ..engine.results import make_columns
from ..errors import ScenarioError
from ..system.model import Component, System, plain_target
from ..system.scenario import load_scenario
from ..view import Viewable
from .campaign import Campaign, Statistic, Variation

G = 9.81
"""Gravity that intensities are counted in [m/s2], as in Shirazi et al. (2012)."""
SCENARIO = "el_centro_0p6g_constant_voltage"
INTENSITIES = (0.2, 0.4, 0.6, 0.8)
OUTPUT = "structure.floor2_acceleration_absolute"
GRID = 17
TOLERANCE = 0.01
"""Voltage [V] to which a minimum is found."""
GOALS = {
    "worst": "least for the worst motion",
    "mean": "least mean of the motions",
    "regret": "least excess over each motion's own best",
}


@dataclass(frozen=True)
class ScaledMotion:
    """A ground motion: a record scaled to a peak of `intensity` [g] (0: as recorded)."""

    record: str
    intensity: float

    @property
    def name(self) -> str:
        """The motion in words."""
        record = Path(self.record).stem if Path(self.record).suffix else self.record
        return f"{record} {self.intensity:g} g" if self.intensity else record


@dataclass(frozen=True)
class Optimum:
    """A best voltage [V] and the value there; for a set, the value of its goal."""

    voltage: float
    value: float


@dataclass(frozen=True, repr=False)
class Passive(Viewable):
    """The best constant voltages.

    Attributes
    ----------
    motions : tuple of ScaledMotion
        (m,).
    output, statistic, unit : str
        The column that is judged, "peak" or "rms" of it, and its unit.
    grid : (k,) array
        Voltages [V].
    values : (m, k) array
        The output's statistic of each motion at each voltage of the grid.
    best : list of Optimum
        Of each motion (m,).
    goals : mapping
        For the set: "worst" (least largest value), "mean", "regret" (least largest excess over each
        motion's own best, as a ratio).
    runs : int
        How many runs it took.
    notes : tuple of str
        What a reader has to know: a record that the runs do not take to its end.
    """

    motions: tuple[ScaledMotion, ...]
    output: str
    statistic: str
    unit: str
    grid: Array
    values: Array
    best: list[Optimum]
    goals: dict[str, Optimum]
    runs: int
    notes: tuple[str, ...] = ()

    @property
    def what(self) -> str:
        """What is least, in words: "peak of structure.drift1"."""
        return f"{'RMS' if self.statistic == 'rms' else self.statistic} of {self.output}"

    def for_all(self) -> list[tuple[str, float, str]]:
        """Return each goal of the set in words, its best voltage [V], and the value there."""
        found = []
        for goal, text in GOALS.items():
            value = self.goals[goal].value
            excess = f"at most {100 * max(value - 1, 0.0):.1f} % above"
            said = excess if goal == "regret" else plain(value, 4)
            found.append((text, self.goals[goal].voltage, said))
        return found


def optimise_passive(
    motions: Iterable[ScaledMotion] | None = None,
    *,
    scenario: str | Path = SCENARIO,
    overrides: Mapping[str, object] | None = None,
    output: str = OUTPUT,
    statistic: str = "peak",
    grid: int = GRID,
    progress: bool = False,
) -> Passive:
    """Return the constant voltages at which an output is least.

    Parameters
    ----------
    motions : iterable of ScaledMotion, optional
        El Centro at 0.2, 0.4, 0.6, 0.8 g otherwise. The scenario's other values, such as a factor
        on the ground motion, stay.
    scenario : path
        With one GroundMotion and one ConstantVoltage.
    overrides : mapping, optional
        Values in place of the scenario's, as for `bristle.run`.
    output, statistic : str
        The column that is judged, by "peak" or "rms".
    grid : int
        Number of voltages between 0 and the damper's largest at which every motion is run first.
    progress : bool
        Show a progress bar, on a terminal only.

    Raises
    ------
    ScenarioError, RecordError
        If the scenario does not fit or a record is not there.
    RunError
        If a run fails.

    Examples
    --------
    >>> found = optimise_passive([Motion("el_centro_1940_ns", 0.4)])  # doctest: +SKIP
    >>> found.best[0].voltage  # doctest: +SKIP
    """
    chosen = tuple(motions or (ScaledMotion("el_centro_1940_ns", i) for i in INTENSITIES))
    if grid < 3:
        raise ScenarioError(f"a grid of {grid} voltages is too coarse; 3 or more are right.")
    if statistic not in ("peak", "rms"):
        raise ScenarioError(unknown("statistic", statistic, ("peak", "rms")))
    cases = [_Case(scenario, overrides or {}, motion, output, statistic) for motion in chosen]
    voltages = np.linspace(0.0, min(case.v_max for case in cases), grid)
    count = len(cases) * (grid + 12)
    with Progress("passive optimum", count, progress) as bar:

        def done() -> None:
            bar.show(min(sum(case.campaign.runs for case in cases), count))

        values = np.array([[case(v, done) for v in voltages.tolist()] for case in cases])
        best = [
            _least(lambda v, c=case: c(v, done), voltages, row)  # type: ignore[misc]
            for case, row in zip(cases, values, strict=True)
        ]
        goals = _goals(cases, voltages, values, best, done)
    runs = sum(case.campaign.runs for case in cases)
    return Passive(
        chosen, output, statistic, cases[0].output.unit, voltages, values, best, goals, runs,
        tuple(dict.fromkeys(case.cut_off for case in cases if case.cut_off)),
    )  # fmt: skip


class _Case:
    """One motion: the judged value as a function of the voltage, each voltage run once."""

    def __init__(
        self, file: str | Path, overrides: Mapping[str, object], motion: ScaledMotion, output: str,
        how: str,
    ) -> None:  # fmt: skip
        base = load_scenario(file, overrides)
        ground, source = _only(base, "GroundMotion"), _only(base, "ConstantVoltage")
        own: dict[str, object] = {f"{ground.name}.record": motion.record}
        _refuse_own(overrides, ground.name, source.name)
        if motion.intensity:
            own[f"{ground.name}.peak"] = motion.intensity * G
        elif "peak" in ground.values:
            own[f"{ground.name}.peak"] = 0.0
        system = load_scenario(file, {**overrides, **own})
        self.cut_off = _cut_off(system, ground.name)
        columns = {column.name: column for column in make_columns(base)}
        if output not in columns:
            raise ScenarioError(f"{base.where}: {unknown('output', output, columns)}")
        self.output = Statistic(output, how, columns[output].unit or "")
        self.level = f"{source.name}.level"
        self.v_max = _largest_voltage(base)
        self.campaign = Campaign(system, Coupled(), (self.output,))

    def __call__(self, voltage: float, done: Callable[[], None]) -> float:
        """Return the judged value at a voltage [V]."""
        found = self.campaign.run(Variation({self.level: voltage}))
        done()
        return found.numbers[0]


def _only(scenario: System, kind: str) -> Component:
    found = [c for c in scenario.components.values() if c.kind == kind and c.path is None]
    if len(found) != 1:
        raise ScenarioError(
            f"{scenario.where}: has {len(found)} components {kind}; a passive optimum needs one, "
            f"as in {SCENARIO}."
        )
    return found[0]


def _refuse_own(overrides: Mapping[str, object], ground: str, source: str) -> None:
    """Refuse values in place of those that the optimum itself sets: they would be ignored."""
    taken = {
        f"{ground}.record": "the motions of an optimum say it (--motions)",
        f"{ground}.peak": "the intensities of an optimum say it (--intensities)",
        f"{source}.level": "an optimum tries every voltage",
    }
    for name in overrides:
        if why := taken.get(plain_target(name)):
            raise ScenarioError(f'override "{name}" would have no effect: {why}.')


def _cut_off(scenario: System, ground: str) -> str:
    """Return in a sentence that the runs end before a record does; "" where they do not."""
    given = scenario.components[ground].values
    record = str(given["record"])
    time = read_ground_motion(record, Path()).time
    end = float(time[-1]) + float(given.get("start", 0.0))
    if end <= scenario.stop + scenario.step:
        return ""
    name = Path(record).stem if Path(record).suffix else record
    return (
        f"The runs end at {scenario.stop:g} s, the record {name} at {end:g} s: what comes later "
        f"does not count. --set run.stop={ceil(end):g} takes all of it."
    )


def _largest_voltage(scenario: System) -> float:
    """Return the least of the dampers' largest voltages [V]."""
    limits = [
        float(c.value("v_max") or 0.0)
        for c in scenario.components.values()
        if "v_max" in c.description.variables
    ]
    if not limits or min(limits) <= 0.0:
        raise ScenarioError(
            f"{scenario.where}: no damper that takes a voltage; a LuGreDamper or BinghamDamper "
            "with v_max above 0 is right."
        )
    return min(limits)


def _least(
    value: Callable[[float], float], grid: Array, on_grid: Sequence[float] | Array
) -> Optimum:
    """Return the least of a function: around the grid's best point, or that point itself."""
    from scipy.optimize import minimize_scalar

    k = int(np.argmin(on_grid))
    bounds = (float(grid[max(k - 1, 0)]), float(grid[min(k + 1, len(grid) - 1)]))
    found = minimize_scalar(value, bounds=bounds, method="bounded", options={"xatol": TOLERANCE})
    if found.fun < on_grid[k]:
        return Optimum(float(found.x), float(found.fun))
    return Optimum(float(grid[k]), float(on_grid[k]))


def _goals(
    cases: list[_Case], grid: Array, values: Array, best: list[Optimum], done: Callable[[], None]
) -> dict[str, Optimum]:
    """Return the best voltages for the set, by each goal."""
    own = np.array([optimum.value for optimum in best])
    judge: dict[str, Callable[[Array], float]] = {
        "worst": lambda column: float(column.max()),
        "mean": lambda column: float(column.mean()),
        "regret": lambda column: float((column / own).max()) if own.all() else float("nan"),
    }
    found = {}
    for goal in GOALS:
        on_grid = [judge[goal](column) for column in values.T]

        def value(voltage: float, goal: str = goal) -> float:
            return judge[goal](np.array([case(voltage, done) for case in cases]))

        found[goal] = _least(value, grid, on_grid)
    return found
