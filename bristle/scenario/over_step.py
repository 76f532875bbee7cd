"""What a scenario says of the ports of a foreign FMU: how inputs are taken over a step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ..component import OVER_STEP, SAMPLED
from ..findings import Findings, unknown, written
from ..fmu.description import Variable
from ..physics.signals import KINDS, STEPS
from .parts import Part

if TYPE_CHECKING:
    from .scenario import Component


def choose_over_step(part: Part, settings: Mapping[str, Any], findings: Findings) -> None:
    """Read `over_step` of a component, port by port.

    Parameters
    ----------
    part : Part
        Its `over_step` is filled.
    settings : mapping
        The component's table in the scenario.
    findings : Findings
        Takes what is found.
    """
    if "over_step" not in settings:
        return
    path, said = (*part.path, "over_step"), settings["over_step"]
    where = f"[components.{part.name}] over_step"
    if not isinstance(said, dict):
        findings.error(path, f'{where} is {written(said)}; a table {{ input = "held" }} is right.')
        return
    if part.file is None:
        findings.error(
            path, f"{where}: built-in components say it themselves, foreign FMUs do not."
        )
        return
    ports = {name: v for name, v in part.variables.items() if v.causality in ("input", "output")}
    for name, word in said.items():
        if part.description and name not in ports:
            findings.error((*path, name), f"{where}: {unknown('port', name, ports)}")
        elif not isinstance(word, str) or word not in OVER_STEP:
            words = ", ".join(OVER_STEP)
            findings.error(
                (*path, name), f"{where}: {name} = {written(word)}; one of {words} is right."
            )
        elif name in ports and ports[name].causality == "output" and word != SAMPLED:
            findings.error(
                (*path, name),
                f'{where}: {name} is an output: "{SAMPLED}" is right, if it stands between '
                "instants of its own.",
            )
        else:
            part.over_step[name] = word


def told_over_step(component: Component) -> dict[str, str]:
    """Return what is known of a component's ports beside what its FMU says.

    That is what a scenario says of a foreign FMU. The outputs of a built-in signal of the kind
    "steps" stand between its steps: to go on from them would leave the range of the signal.
    """
    kind = str(component.parameters.get("kind", ""))
    if component.path is None and KINDS.get(kind) == STEPS:
        return {v.name: SAMPLED for v in component.description.of("output") if v.kind == "Real"}
    return component.over_step


def as_told(variable: Variable, told: Mapping[str, str]) -> Variable:
    """Return a variable with what a scenario says of it: an output that is sampled is discrete."""
    word = told.get(variable.name)
    if word is None:
        return variable
    if variable.causality == "output":
        return replace(variable, variability="discrete")
    return replace(variable, over_step=word)
