"""One run of an ensemble: values drawn, laid over the scenario, run, and a few numbers kept."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from math import isfinite, nan
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BristleError, ScenarioError
from ..model.draws import in_short
from ..system.parameters import Wrong, typed
from ..system.scenario import Component, Scenario, load_scenario
from . import ensemble_file
from .distributions import Value
from .ensemble_file import split
from .plan import Outcome, Output, Plan

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
        _with(c, parameters.get(c.name, {}), numbers.get(c.name, {}), scratch)
        for c in scenario.components
    )
    return replace(scenario, components=components)


def _with(
    component: Component, parameters: Mapping[str, Any], numbers: Mapping[str, Any], scratch: Path
) -> Component:
    if parameters:
        component = replace(component, parameters={**component.parameters, **parameters})
    if numbers:
        path = scratch / f"{component.name}.toml"
        ensemble_file.write(ensemble_file.changed(component, numbers), path)
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
