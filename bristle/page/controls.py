"""What may command a scenario's damper: a constant voltage, and every controller of the library.

A scenario wires its controller. So another control is another stock scenario with the same ground,
structure and damper, and where none has that controller, one whose own takes the same inputs.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from ..errors import BristleError, ScenarioError
from ..findings import unknown
from ..fmu import catalogue
from ..fmu.controller import ControllerSlave
from ..scenario.scenario import Component, Scenario, load_scenario, stock_scenarios

CONSTANT = "ConstantVoltage"

Control = tuple[str, dict[str, Any]]
"""A stock scenario, and the overrides that give it a control and the values of another one."""


def stock_file(name: str) -> Path:
    """Return the file of a stock scenario; ScenarioError if there is none of that name."""
    for file in stock_scenarios():
        if file.stem == name:
            return file
    raise ScenarioError(f'no stock scenario is named "{name}".')


def control_of(name: str, control: str) -> Control:
    """Return the scenario that has a control, and its overrides.

    Parameters
    ----------
    name : of a stock scenario
    control : one of `controls` of it, "" for its own

    Raises
    ------
    ScenarioError
        If there is none of a name.
    """
    stock_file(name)
    if not control:
        return name, {}
    known = controls(name)
    if control not in known:
        raise ScenarioError(unknown("control", control, known))
    scenario, overrides = known[control]
    return scenario, dict(overrides)


@cache
def controls(name: str) -> dict[str, Control]:
    """Return what may command the damper of a stock scenario, by the name of its component."""
    own = _stock(name)
    place = commanding(own)
    if place is None:
        return {}
    found: dict[str, Control] = {}
    for control in (CONSTANT, *library_controllers()):
        for candidate in sorted(_candidates(own, name, control), key=lambda one: len(one[1])):
            try:
                load_scenario(stock_file(candidate[0]), candidate[1])
            except BristleError:
                continue  # this one carries values or wires of its own controller
            found[control] = candidate
            break
    return found


def commanding(scenario: Scenario) -> Component | None:
    """Return the component whose voltage goes to the first damper, None where there is none."""
    for wire in scenario.connections:
        if wire.input == "voltage" and wire.output == "voltage":
            return scenario.component(wire.source)
    return None


def _candidates(own: Scenario, name: str, control: str) -> Iterator[Control]:
    """Yield scenarios that may have a control: itself, one that has it, one that can take it."""
    others = [file.stem for file in stock_scenarios() if file.stem != name]
    takes: list[Control] = []
    for stem in (name, *others):
        other = _stock(stem)
        place = commanding(other)
        carried = _carried(own, other)
        if place is None or carried is None:
            continue
        if place.fmu == control:
            yield stem, carried
        elif CONSTANT not in (place.fmu, control):
            takes.append((stem, {**carried, f"{place.name}.fmu": control}))
    yield from takes


def _carried(own: Scenario, other: Scenario) -> dict[str, Any] | None:
    """Return the values that make the rest of a scenario that of `own`; None if it is another."""
    if own is other:
        return {}
    mine, its = (_rest(one) for one in (own, other))
    if {n: _made(one) for n, one in mine.items()} != {n: _made(one) for n, one in its.items()}:
        return None
    found: dict[str, Any] = {}
    for name, component in mine.items():
        given, there = component.parameters, its[name].parameters
        if set(there) - set(given):
            return None
        found |= {f"{name}.{key}": v for key, v in given.items() if there.get(key) != v}
    if own.stop != other.stop:
        found["run.stop"] = own.stop
    return found


def _rest(scenario: Scenario) -> dict[str, Component]:
    """Return the components of a scenario without the one that commands its damper."""
    place = commanding(scenario)
    return {one.name: one for one in scenario.components if one is not place}


def _made(component: Component) -> tuple[Any, ...]:
    return component.fmu, component.building, component.effects, component.law


@cache
def _stock(name: str) -> Scenario:
    return load_scenario(stock_file(name))


@cache
def library_controllers() -> tuple[str, ...]:
    """Return the names of the library's controllers."""
    return tuple(
        name
        for name in catalogue.component_names()
        if issubclass(catalogue.component_class(catalogue.source(name)), ControllerSlave)
    )
