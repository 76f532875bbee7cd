"""A scenario as TOML text: as it is run, with what was overridden."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ..core.toml_write import toml_key, toml_value
from ..physics.forms import split_form
from .document import FILE_PARAMETERS

if TYPE_CHECKING:
    from .parts import DamperLaw
    from .scenario import Component, Scenario


def scenario_text(scenario: Scenario) -> str:
    """Return the TOML text of a scenario; read again it gives the same run.

    Files are written as absolute paths, so that the text holds wherever it is put.
    """
    lines = [
        "schema = 1",
        f"title = {toml_value(scenario.title)}",
        "",
        "[run]",
        f"stop = {toml_value(scenario.stop)}",
        f"step = {toml_value(scenario.step)}",
        f"algorithm = {toml_value(scenario.algorithm)}",
    ]
    for component in scenario.components:
        lines += [
            "",
            f"[components.{toml_key(component.name)}]",
            *_component(component, scenario.file.parent),
        ]
    lines += ["", "[connections]"]
    for wire in scenario.connections:
        target, source = f"{wire.target}.{wire.input}", f"{wire.source}.{wire.output}"
        said = toml_value(source)
        if wire.transformed:
            numbers = f"factor = {toml_value(wire.factor)}, offset = {toml_value(wire.offset)}"
            said = f"{{ from = {said}, {numbers} }}"
        lines.append(f"{toml_value(target)} = {said}")
    return "\n".join(lines) + "\n"


def _component(component: Component, folder: Path) -> list[str]:
    fmu = component.fmu if component.path is None else component.path.absolute().as_posix()
    lines = [f"fmu = {toml_value(fmu)}"] if component.law is None else _law(component.law)
    if component.building is not None:
        lines.append(f"building = {toml_value(component.building.absolute().as_posix())}")
    if component.effects:
        files = ", ".join(toml_value(file.absolute().as_posix()) for file in component.effects)
        lines.append(f"effects = [{files}]")
    if component.controller is not None:
        lines.append(f"controller = {toml_value(component.controller.absolute().as_posix())}")
    if component.step is not None:
        lines.append(f"step = {toml_value(component.step)}")
    if component.over_step:
        told = [
            f"{toml_key(name)} = {toml_value(word)}" for name, word in component.over_step.items()
        ]
        lines.append(f"over_step = {{ {', '.join(told)} }}")
    if component.parameters:
        values = dict(component.parameters)
        for name in FILE_PARAMETERS:
            if (folder / str(values.get(name, ""))).is_file():
                values[name] = (folder / str(values[name])).absolute().as_posix()
        pairs = [f"{toml_key(name)} = {toml_value(value)}" for name, value in values.items()]
        lines.append(f"parameters = {{ {', '.join(pairs)} }}")
    return lines


def _law(law: DamperLaw) -> list[str]:
    name, form, knots = split_form(law.name)
    lines = [f"law = {toml_value(law.file.absolute().as_posix() if law.file else name)}"]
    if form:
        lines.append(f"command = {toml_value(form)}")
    if knots:
        lines.append(f"command_knots = {list(knots)}")
    return lines
