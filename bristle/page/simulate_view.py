"""View 7, Simulate: a scenario's sliders, and its run by the coupled engine."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ScenarioError
from ..findings import command
from ..scenario.scenario import Component, Scenario, load_scenario, stock_scenarios
from ..simulate.coupled import simulate
from ..web.export import offered

SLIDERS = 12
ROWS = 20_000
"""Rows of a run that are sent; of more every second, third ... is. Peaks are those of all rows."""


def answer(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return a scenario's run with some values, and at first what can be moved.

    Parameters
    ----------
    folder : that holds studies
    arguments : `scenario` the name of a stock one, or a file below the folder; `values` of
        parameters by name; `about` whether to tell sliders and levels

    Raises
    ------
    ScenarioError
        If there is none, a value is not right, or it has parts that are not compiled.
    """
    file = _file(folder, str(arguments.get("scenario", "")))
    values = arguments.get("values", {})
    if not isinstance(values, Mapping):
        raise ScenarioError("values: NAME to number is right.")
    scenario = load_scenario(file, dict(values))
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
    name = str(arguments["scenario"])
    words = [word for key, value in values.items() for word in ("--set", f"{key}={value:.6g}")]
    found = {
        "time": columns["time"][::every], "outputs": outputs, "every": every,
        "command": command("run", name, "--engine", "compiled", *words),
    }  # fmt: skip
    if arguments.get("about"):
        found |= {"title": scenario.title, "sliders": _sliders(scenario)}
    return found


def _file(folder: Path, name: str) -> Path:
    """Return the file of a scenario that the page offered."""
    for file in (*stock_scenarios(), *folder.glob("*/export/*.toml")):
        below = file.relative_to(folder).as_posix() if file.is_relative_to(folder) else ""
        if name and name == (below or file.stem):
            return file
    raise ScenarioError(f'"{name}": there is no such scenario here.')


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
