"""View 7, Simulate: a scenario's sliders, and its run by the coupled engine."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ScenarioError
from ..findings import command
from ..fmu.catalogue import component_of_law
from ..physics.drive import VOLTAGE
from ..physics.effect import EFFECTS
from ..physics.laws import LAWS
from ..scenario.scenario import Component, Scenario, load_scenario, stock_scenarios
from ..simulate.coupled import simulate
from ..study.study import Study
from ..web.export import offered
from .commands import file_name

SLIDERS = 12
ROWS = 20_000
"""Rows of a run that are sent; of more every second, third ... is. Peaks are those of all rows."""


def answer(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return a scenario's run with some values, and at first what can be moved.

    Parameters
    ----------
    folder : that holds studies
    arguments : `scenario` the name of a stock one; `values` of parameters by name; `study` whose
        damper takes the place of the scenario's, "" for its own; `about` whether to tell sliders

    Raises
    ------
    ScenarioError
        If there is none, a value is not right, or it has parts that are not compiled.
    """
    name = str(arguments.get("scenario", ""))
    values = arguments.get("values", {})
    if not isinstance(values, Mapping):
        raise ScenarioError("values: NAME to number is right.")
    overrides: dict[str, Any] = {**damper_of(folder, name, arguments.get("study")), **values}
    scenario = load_scenario(_file(name), overrides)
    columns = simulate(scenario)
    every = -(-len(columns["time"]) // ROWS)
    outputs = [
        {
            "name": name, "unit": _unit(scenario, name), "values": column[::every],
            "peak": float(np.max(np.abs(column))), "rms": float(np.sqrt(np.mean(column**2))),
        }
        for name, column in columns.items()
        if name != "time" and column.dtype.kind == "f"
    ]  # fmt: skip
    words = [word for key, one in overrides.items() for word in ("--set", f"{key}={_text(one)}")]
    found = {
        "time": columns["time"][::every], "outputs": outputs, "every": every,
        "command": command("run", name, "--engine", "compiled", *words),
    }  # fmt: skip
    if arguments.get("about"):
        found |= {"title": scenario.title, "sliders": _sliders(scenario)}
    return found


def _file(name: str) -> Path:
    """Return the file of a stock scenario."""
    for file in stock_scenarios():
        if file.stem == name:
            return file
    raise ScenarioError(f'no stock scenario is named "{name}".')


def _text(value: object) -> str:
    """Return a value as --set takes it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:.6g}" if isinstance(value, int | float) else str(value)


def damper_of(folder: Path, scenario: str, study: object) -> dict[str, Any]:
    """Return what makes the damper of a scenario that of a study, as overrides.

    Parameters
    ----------
    folder : that holds studies
    scenario : the name of a stock one
    study : the name of the study, "" or None for the scenario's own damper

    Raises
    ------
    ScenarioError
        If the scenario has no damper, or the study's cannot act in it.
    """
    if not study:
        return {}
    opened = Study(folder / file_name(study, "the study"))
    model = opened.model()
    here = model.at("damper", not opened.settings.has_building)
    own = [name for name in here.effects if EFFECTS[name].own]
    if model.drive != VOLTAGE.name or own or LAWS[model.base_law].own:
        why = ", ".join(own) or (
            f"a {model.drive}" if model.drive != VOLTAGE.name else f"the law {model.law}"
        )
        raise ScenarioError(
            f"{study}: its damper has {why}, which the stock scenarios do not know. Export it:  "
            f"{command('export', str(study))}"
        )
    dampers = [one.name for one in load_scenario(_file(scenario)).components if is_damper(one)]
    if not dampers:
        raise ScenarioError(f"{scenario} has no damper whose place that of {study} could take.")
    place = dampers[0]
    values = {f"{place}.{name}": float(f"{value:.6g}") for name, value in here.values().items()}
    switches = {f"{place}.{name}.on": True for name in here.effects}
    return {f"{place}.fmu": component_of_law(model.base_law), **switches, **values}


def is_damper(component: Component) -> bool:
    """Return whether a component of a scenario is a damper."""
    return component.made_of().endswith("Damper")


def _unit(scenario: Scenario, name: str) -> str:
    component, _, port = name.partition(".")
    return scenario.component(component).description.variables[port].unit or ""


def _sliders(scenario: Scenario) -> list[dict[str, Any]]:
    """Return the numbers that a reader would move first, between half and one and a half."""
    rows = []
    for name in offered(scenario):
        component, _, own = name.partition(".")
        found = _slider(scenario.component(component), own)
        if found is not None:
            rows.append({"name": name, **found})
    return rows[:SLIDERS]


def _slider(component: Component, name: str) -> dict[str, Any] | None:
    variable = component.description.variables[name]
    value = float(component.parameters.get(name, variable.start or 0.0))
    least = -np.inf if variable.minimum is None else variable.minimum
    most = np.inf if variable.maximum is None else variable.maximum
    low, high = sorted((0.5 * value, 1.5 * value))
    if variable.unit == "V":
        low, high = 0.0, 10.0
    low, high = max(low, float(least)), min(high, float(most))
    if not low < high:
        return None
    return {
        "unit": variable.unit or "", "text": variable.description, "value": value, "low": low,
        "high": high,
    }  # fmt: skip
