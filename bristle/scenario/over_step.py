"""What a scenario says of the ports of a foreign FMU: how inputs are taken over a step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ..component import SAMPLED
from ..core.config import Document
from ..findings import unknown
from ..fmu.description import Variable
from ..physics.signals import KINDS, STEPS
from .parts import Part

if TYPE_CHECKING:
    from .scenario import Component


def choose_over_step(
    part: Part, settings: Mapping[str, Any], told: Mapping[str, str | None], document: Document
) -> None:
    """Read `over_step` of a component, port by port.

    Parameters
    ----------
    part : Part
        Its `over_step` is filled.
    settings, told : mapping
        The component's table in the scenario; the words by port, None for one that is none.
    document : Document
        Takes what is found.
    """
    path, where = (*part.path, "over_step"), f"[components.{part.name}] over_step"
    if not isinstance(settings.get("over_step"), dict):
        return
    if part.file is None:
        document.error(
            path, f"{where}: built-in components say it themselves, foreign FMUs do not."
        )
        return
    ports = {name: v for name, v in part.variables.items() if v.causality in ("input", "output")}
    for name, word in told.items():
        if part.description and name not in ports:
            document.error((*path, name), f"{where}: {unknown('port', name, ports)}")
        elif word is None:
            continue  # which is said already
        elif name in ports and ports[name].causality == "output" and word != SAMPLED:
            document.error(
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
