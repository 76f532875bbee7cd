"""The components of a scenario as the schedule sees them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from ..fmu.description import Description
from ..scenario.over_step import as_told, told_over_step
from .operations import Node, Port, is_continuous

if TYPE_CHECKING:
    from ..scenario.scenario import Scenario


def make_nodes(scenario: Scenario, descriptions: Mapping[str, Description]) -> list[Node]:
    """Return the components as the schedule sees them, in the order of the file."""
    numbers = {component.name: c for c, component in enumerate(scenario.components)}
    sources: list[dict[str, Port]] = [{} for _ in scenario.components]
    transformed: list[dict[str, tuple[float, float]]] = [{} for _ in scenario.components]
    for connection in scenario.connections:
        port = numbers[connection.source], connection.output
        sources[numbers[connection.target]][connection.input] = port
        how = connection.factor, connection.offset
        if how != (1.0, 0.0):
            transformed[numbers[connection.target]][connection.input] = how
    nodes = []
    for c, component in enumerate(scenario.components):
        description = descriptions[component.name]
        substeps = round(scenario.step / component.step) if component.step else 1
        told = told_over_step(component)
        outputs = {v.name: as_told(v, told) for v in description.of("output") if v.kind != "String"}
        inputs = {v.name: as_told(v, told) for v in description.of("input")}
        for name, (d, output) in sources[c].items():
            source = descriptions[scenario.components[d].name].variables[output]
            if inputs[name].kind == "Real" != source.kind:  # nothing lies between whole numbers
                inputs[name] = replace(inputs[name], variability="discrete", over_step=None)
        takes = _interpolates(description, told) if substeps == 1 else frozenset()
        nodes.append(
            Node(component.name, inputs, outputs, sources[c], substeps, transformed[c], takes)
        )
    return nodes


def _interpolates(description: Description, told: Mapping[str, str]) -> frozenset[str]:
    """Return the inputs whose derivative an FMU takes, but those of which the scenario says how.

    That is a matter of FMI 2.0; FMI 3.0 has no call for it.
    """
    if description.capabilities.get("canInterpolateInputs") not in ("true", "1"):
        return frozenset()
    inputs = (v for v in description.of("input") if is_continuous(v))
    return frozenset(v.name for v in inputs if description.version == "2.0" and v.name not in told)
