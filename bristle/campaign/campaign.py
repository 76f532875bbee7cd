"""An ensemble as data, and one run of it: values drawn and laid over the scenario."""

from __future__ import annotations

import copy
import hashlib
import json
import tempfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import lru_cache
from math import isfinite, nan, prod
from pathlib import Path
from typing import Any

import numpy as np

from ..core.config import toml_content
from ..core.toml_write import toml_table
from ..errors import BristleError, PhysicsError, ScenarioError
from ..model.draws import in_short
from ..physics.building import PAPER, from_data
from ..system.parameters import Wrong, typed
from ..system.scenario import Component, Scenario, load_scenario
from ..version import __version__
from .distributions import Value, Varied, share
from .identified import Identified

STATISTICS = ("peak", "rms", "max", "min", "mean", "last")


@dataclass(frozen=True)
class Output:
    """One number that is kept of each run: a statistic of a column; "peak" is of its size."""

    column: str
    statistic: str
    unit: str = ""

    @property
    def name(self) -> str:
        """The output's name in tables: "peak damper.force"."""
        return f"{self.statistic} {self.column}"


@dataclass(frozen=True)
class Plan:
    """A checked ensemble.

    Attributes
    ----------
    file : Path
        The ensemble file.
    scenario : Path
        The base scenario.
    fixed : mapping
        Values in place of the scenario's, the same for all runs.
    engine : str
        "compiled" or "fmu".
    runs, seed : int
    varied, outputs : tuple
    content : str
        Digest of the base scenario and of the files that it reads.
    identified : Identified, optional
        A component whose parameters are drawn together.
    fmus : str
        "python" or "native": which FMUs the engine "fmu" steps.
    """

    file: Path
    title: str
    scenario: Path
    engine: str
    runs: int
    seed: int
    varied: tuple[Varied, ...]
    outputs: tuple[Output, ...]
    fixed: dict[str, Value] = field(default_factory=dict)
    content: str = ""
    identified: Identified | None = None
    fmus: str = "python"

    @property
    def left(self) -> bool:
        """Whether each run is made twice, the second time with an effect that is left open."""
        return self.identified is not None and bool(self.identified.left)

    @property
    def columns(self) -> list[str]:
        """The names of the numbers that are kept of each run."""
        own = [output.name for output in self.outputs]
        return [*own, *(f"{name} with it" for name in own)] if self.left else own

    def effect(self, run: int) -> tuple[str, float]:
        """Return the effect that joins a run, and its size over the limit."""
        assert self.identified is not None
        effect, part = self.identified.open_at(self.seed, run)
        return effect.label, part

    def values(self, run: int) -> dict[str, Value]:
        """Return what the varied names are in a run; it depends on seed, run and name alone."""
        cycled = [v for v in self.varied if v.distribution.kind == "each"]
        turn, chosen = run, {}
        for varied in reversed(cycled):
            turn, place = divmod(turn, len(varied.distribution.values))
            chosen[varied.name] = varied.distribution.values[place]
        joint = self.identified.draw(self.seed, run) if self.identified is not None else {}
        known = {**joint, **chosen}
        return {
            varied.name: known[varied.name]
            if varied.name in known
            else varied.distribution.draw(share(self.seed, run, varied.name))
            for varied in self.varied
        }

    @property
    def combinations(self) -> int:
        """How many combinations of the values of "each" there are; the runs go through them."""
        return prod(
            len(v.distribution.values) for v in self.varied if v.distribution.kind == "each"
        )

    def digest(self) -> str:
        """Return 16 hexadecimal digits that stand for all that decides a run's numbers.

        The number of runs and the title are no part of it: more runs continue an ensemble.
        """
        decides: dict[str, Any] = {
            "version": __version__,
            "content": self.content,
            "engine": self.engine,
            "seed": self.seed,
            "varied": [asdict(v) for v in self.varied],
            "outputs": [o.name for o in self.outputs],
        }
        if self.fmus != "python":
            decides["fmus"] = self.fmus
        if self.identified is not None:
            decides["identified"] = asdict(self.identified)
        return hashlib.sha256(json.dumps(decides, sort_keys=True).encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Outcome:
    """What became of a run: the kept numbers in the order of `Plan.outputs`, or why there are none.

    `reason` is "" for a run that is done. `lost` says of such a run why it could not be simulated
    with the effect that joins it.
    """

    run: int
    numbers: tuple[float, ...] = ()
    reason: str = ""
    lost: str = ""


SCENARIOS_KEPT = 64
"""Scenarios that a process keeps loaded: one per combination of records, steps and the like."""


def _loaded(plan: Plan, overrides: Mapping[str, Value]) -> Scenario:
    """Return a plan's scenario with values in place of its own, kept for the runs that follow."""
    return _kept(plan.scenario, plan.content, tuple(overrides.items()))


@lru_cache(maxsize=SCENARIOS_KEPT)
def _kept(file: Path, _content: str, overrides: tuple[tuple[str, Value], ...]) -> Scenario:
    # The digest of the files is a part of the key: in a notebook they change between ensembles.
    return load_scenario(file, dict(overrides))


def prepare(plan: Plan) -> None:
    """Do once what all runs share: read the scenario, compile; best before processes are forked.

    Raises
    ------
    ScenarioError
        If the engine cannot run the scenario.
    """
    scenario = _loaded(plan, plan.fixed)
    if plan.engine == "compiled":
        from ..engine.coupled import simulate

        simulate(replace(scenario, stop=scenario.step))


def run_one(plan: Plan, run: int) -> Outcome:
    """Return what became of run number `run`; a failure is an outcome as well."""
    try:
        with tempfile.TemporaryDirectory(prefix="bristle_") as scratch:
            values = plan.values(run)
            numbers = _numbers(plan, scenario_of(plan, values, Path(scratch)))
            more, lost = _with_effect(plan, run, values, Path(scratch)) if plan.left else ((), "")
    except BristleError as error:
        return Outcome(run, reason=_one_line(error))
    except Exception as error:  # whatever a user's effect or a foreign FMU raises, runs go on
        return Outcome(run, reason=f"{type(error).__name__}: {_one_line(error)}")
    for output, number in zip(plan.outputs, numbers, strict=True):
        if not isfinite(number):
            return Outcome(run, reason=f"RunError: {output.name} is not finite.")
    return Outcome(run, (*numbers, *more), lost=lost)


def _with_effect(
    plan: Plan, run: int, values: Mapping[str, Value], scratch: Path
) -> tuple[tuple[float, ...], str]:
    """Return the numbers of a run with the effect that joins it, or NaN and why there are none."""
    assert plan.identified is not None
    joined = {**values, **plan.identified.with_effect(values, plan.seed, run)}
    try:
        found = _numbers(plan, scenario_of(plan, joined, scratch))
        wrong = [o.name for o, one in zip(plan.outputs, found, strict=True) if not isfinite(one)]
        lost = f"{wrong[0]} is not finite" if wrong else ""
    except BristleError as error:
        lost = in_short(error)
    except Exception as error:  # what a user's effect raises costs the second run, not the first
        lost = f"{type(error).__name__}: {_one_line(error)}"
    return (found, "") if not lost else ((nan,) * len(plan.outputs), lost)


def scenario_of(plan: Plan, values: Mapping[str, Value], scratch: Path) -> Scenario:
    """Return the scenario with the values of a run; a varied building is a file in `scratch`.

    Raises
    ------
    ScenarioError, PhysicsError, RecordError
        If a value is out of bounds or does not fit.
    """
    places = {varied.name: varied.place for varied in plan.varied}
    places = dict.fromkeys(values, "parameter") | places
    overrides = plan.fixed | {k: v for k, v in values.items() if places[k] == "scenario"}
    scenario = _loaded(plan, overrides)
    parameters: dict[str, dict[str, Any]] = {}
    numbers: dict[str, dict[str, Any]] = {}
    for name, value in values.items():
        if places[name] == "scenario":
            continue
        component, rest = split(name, scenario)
        if component is None:
            raise ScenarioError(f'"{name}": the scenario has no such component.')
        if places[name] == "building":
            numbers.setdefault(component.name, {})[rest.removeprefix("building.")] = value
            continue
        variable = component.description.variables.get(rest)
        if variable is None:
            raise ScenarioError(f'"{name}": {component.fmu} has no such parameter.')
        fits = typed(variable, value)
        if isinstance(fits, Wrong):
            raise ScenarioError(f"{name} {fits.words}")
        parameters.setdefault(component.name, {})[rest] = fits
    components = tuple(
        _changed(c, parameters.get(c.name, {}), numbers.get(c.name, {}), scratch)
        for c in scenario.components
    )
    return replace(scenario, components=components)


def _changed(
    component: Component, parameters: Mapping[str, Any], numbers: Mapping[str, Any], scratch: Path
) -> Component:
    if parameters:
        component = replace(component, parameters={**component.parameters, **parameters})
    if numbers:
        path = scratch / f"{component.name}.toml"
        write_building(changed_building(component, numbers), path)
        component = replace(component, building=path)
    return component


def _numbers(plan: Plan, scenario: Scenario) -> tuple[float, ...]:
    columns: Any
    if plan.engine == "compiled":
        from ..engine.coupled import simulate

        columns = simulate(scenario)
    else:
        from ..engine.run import Output as Files
        from ..engine.run import execute

        columns = execute(scenario, None, "fmu", Files(None), False, fmus=plan.fmus)
    return tuple(statistic(output, np.asarray(columns[output.column])) for output in plan.outputs)


def statistic(output: Output, values: np.ndarray[Any, Any]) -> float:
    """Return the statistic of a column (n,)."""
    how = output.statistic
    if how == "peak":
        return float(max(values.max(), -values.min()))
    if how == "rms":
        return float(np.sqrt(np.mean(np.square(values, dtype=np.float64))))
    if how == "last":
        return float(values[-1])
    return float(getattr(values, how)())


def _one_line(error: Exception) -> str:
    kind = f"{type(error).__name__}: " if isinstance(error, BristleError) else ""
    return kind + " ".join(str(error).split())


def split(name: str, base: Scenario) -> tuple[Component | None, str]:
    """Return the component that a name begins with, and the rest of the name."""
    first, _, rest = plain_target(name).partition(".")
    return next((c for c in base.components if c.name == first), None), rest


def plain_target(name: str) -> str:
    """Return a name in its short form: "damper.f_c" of "components.damper.parameters.f_c"."""
    first, _, rest = name.removeprefix("components.").partition(".")
    return f"{first}.{rest.removeprefix('parameters.')}" if rest else first


def changed_building(component: Component, values: Mapping[str, object]) -> dict[str, Any]:
    """Return a Structure's building data with numbers changed, checked.

    Parameters
    ----------
    component : Component
        A Structure.
    values : mapping
        "masses.2" (counted from 0, lowest level first), "rayleigh.alpha" ... to the number.

    Raises
    ------
    PhysicsError
        If there is no such number, or the building is none with it.
    """
    data = copy.deepcopy(toml_content(component.building) if component.building else PAPER)
    for path, value in values.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise PhysicsError(f"building {path} = {value!r} must be a number.")
        *way, last = path.split(".")
        place: Any = data
        for key in way:
            place = _within(place, key, path)
        if isinstance(_within(place, last, path), dict | list | str | bool):
            raise PhysicsError(f"building {path} is not a single number.")
        place[int(last) if isinstance(place, list) else last] = float(value)
    from_data(data, "building")
    return data


def _within(place: Any, key: str, path: str) -> Any:
    if isinstance(place, list) and key.isdigit() and int(key) < len(place):
        return place[int(key)]
    if isinstance(place, dict) and key in place:
        return place[key]
    there = f"0 to {len(place) - 1}" if isinstance(place, list) else ", ".join(place or ())
    raise PhysicsError(f"building {path}: {key!r} is not there; there is {there}.")


def write_building(data: Mapping[str, Any], path: Path) -> None:
    """Write building data as TOML: its values are numbers, texts, lists and one level of tables."""
    path.write_text("\n".join(toml_table(data)) + "\n", encoding="utf-8")
