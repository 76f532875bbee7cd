"""View 7, Simulate: a scenario's sliders, its run by the coupled engine, its numbers for a page."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..data.response_spectrum import DAMPING
from ..scenario.scenario import Component, Scenario
from ..simulate.coupled import simulate
from ..simulate.spectra import accelerations, spectra
from ..web.export import Shown, described, offered
from ..web.numbers import Numbers
from .asked import Asked, asked_for
from .controls import controls, stock_file

SLIDERS = 12
ROWS = 20_000
"""Rows of a run that are sent; of more every second, third ... is. Peaks are those of all rows."""


def answer(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return a scenario's run with some values, and at first what can be moved.

    Parameters
    ----------
    folder : that holds studies
    arguments : as for `asked_for`; `about` whether to tell sliders and controls

    Raises
    ------
    ScenarioError, RecordError
        If there is none of a name, a value is not right, or it has parts that are not compiled.
    """
    asked = asked_for(folder, arguments)
    scenario = asked.load()
    columns = _columns(asked)
    every = -(-len(columns["time"]) // ROWS)
    outputs = [
        {
            "name": name, "unit": _unit(scenario, name), "values": column[::every],
            "peak": float(np.max(np.abs(column))), "rms": float(np.sqrt(np.mean(column**2))),
        }
        for name, column in columns.items()
        if name != "time" and column.dtype.kind == "f"
    ]  # fmt: skip
    found: dict[str, Any] = {
        "time": columns["time"][::every], "outputs": outputs, "every": every,
        "command": asked.run(),
    }  # fmt: skip
    if arguments.get("about"):
        name = str(arguments.get("scenario", ""))
        found |= {
            "title": scenario.title, "sliders": _sliders(scenario),
            "controls": list(controls(name)), "accelerations": accelerations(columns),
            "rows": ROWS, "damping": DAMPING,
        }  # fmt: skip
    return found


def numbers(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a page needs to run a scenario itself, with the module that `web.module` makes.

    Parameters
    ----------
    folder, arguments : as for `answer`; sliders are those of `answer` that the module can move

    Raises
    ------
    ScenarioError, RecordError
        As `answer`.
    """
    asked = asked_for(folder, {**arguments, "values": {}})
    sliders = {one["name"]: (one["low"], one["high"]) for one in _sliders(asked.load())}
    return described(Numbers(stock_file(asked.scenario), asked.given()), shown=Shown(sliders))


def spectrum(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the response spectra of a run's ground and floors.

    Parameters
    ----------
    folder, arguments : as for `answer`

    Raises
    ------
    ScenarioError, RecordError
        As `answer`.
    RunError
        If no output is an acceleration of ground or floor.
    """
    asked = asked_for(folder, arguments)
    found = spectra(_columns(asked), asked.load().step)
    return {
        "period": found.pop("period"), "of": found,
        "command": asked.run("--spectrum"),
    }  # fmt: skip


def _columns(asked: Asked) -> dict[str, NDArray[Any]]:
    """Return the columns of a run; those of the last ones are kept, for their spectra."""
    return _run(asked.folder, asked.scenario, json.dumps(dict(asked.overrides)))


@lru_cache(maxsize=2)
def _run(folder: Path, scenario: str, overrides: str) -> dict[str, NDArray[Any]]:
    return simulate(Asked(folder, scenario, json.loads(overrides)).load())


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
