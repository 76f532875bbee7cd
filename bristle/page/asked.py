"""A run that the page asks for: a stock scenario with another damper, control or ground motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import ceil
from pathlib import Path
from typing import Any

from ..data import list_ground_motions, read_ground_motion
from ..errors import ScenarioError
from ..findings import command, written
from ..fmu.catalogue import component_of_law
from ..physics.drive import VOLTAGE
from ..physics.effect import EFFECTS
from ..physics.laws import LAWS
from ..scenario.scenario import Component, Scenario, load_scenario
from ..study.study import Study
from .controls import control_of, stock_file
from .names import UPLOADS, batch_name, file_name

FILES = (".building", ".controller")
"""How overrides end that name files; a ground motion has a name, or is a dropped file."""
LONGEST = 120.0
"""Seconds of a run to which a longer ground motion stretches it at the most."""


@dataclass(frozen=True)
class Asked:
    """A stock scenario and what takes the place of its values, files named from `folder`."""

    folder: Path
    scenario: str
    overrides: Mapping[str, Any] = field(default_factory=dict)

    def given(self) -> dict[str, Any]:
        """Return the overrides as `load_scenario` takes them, wherever this process works."""
        return {
            name: str(self.folder / value) if _is_file(name, value) else value
            for name, value in self.overrides.items()
        }

    def load(self) -> Scenario:
        """Return the scenario, checked; ScenarioError if it is wrong."""
        return load_scenario(stock_file(self.scenario), self.given())

    def run(self, *options: str) -> str:
        """Return the command that makes the same run, with options, in the folder of studies."""
        sets = [word for one in self.sets() for word in ("--set", one)]
        return command("run", self.scenario, "--engine", "compiled", *options, *sets)

    def sets(self) -> list[str]:
        """Return the overrides as --set takes them."""
        return [f"{name}={_text(value)}" for name, value in self.overrides.items()]


def asked_for(folder: Path, arguments: Mapping[str, Any]) -> Asked:
    """Return the run that a page asks for.

    Parameters
    ----------
    folder : that holds studies
    arguments : `scenario` the name of a stock one; `control` one of `controls`, "" for its own;
        `study` whose damper takes the place of its own; `record` the ground motion that does, a
        name or a dropped file; `values` of parameters by name

    Raises
    ------
    ScenarioError, RecordError
        If there is none of a name, or a value is not right.
    """
    name = str(arguments.get("scenario", ""))
    values = arguments.get("values", {})
    if not isinstance(values, Mapping):
        raise ScenarioError("values: NAME to number is right.")
    name, overrides = control_of(name, str(arguments.get("control") or ""))
    overrides |= damper_of(folder, name, arguments.get("study"))
    overrides |= record_of(folder, name, arguments.get("record"))
    return Asked(folder, name, {**overrides, **values})


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
    components = load_scenario(stock_file(scenario)).components
    dampers = [one.name for one in components if is_damper(one)]
    if not dampers:
        raise ScenarioError(f"{scenario} has no damper whose place that of {study} could take.")
    place = dampers[0]
    values = {f"{place}.{name}": float(f"{value:.6g}") for name, value in here.values().items()}
    switches = {f"{place}.{name}.on": True for name in here.effects}
    return {f"{place}.fmu": component_of_law(model.base_law), **switches, **values}


def record_of(folder: Path, scenario: str, record: object) -> dict[str, Any]:
    """Return what makes the ground motion of a scenario another one, as overrides.

    A run that is shorter than the motion is stretched to its end, up to `LONGEST`.

    Parameters
    ----------
    folder : that holds studies, and the dropped files
    scenario : the name of a stock one
    record : a name of `list_ground_motions`, or a dropped file as `records` names it; "" or None
        for the scenario's own motion

    Raises
    ------
    ScenarioError
        If the scenario has no ground motion, or there is no such file.
    RecordError
        If the motion cannot be read: what the command says of it.
    """
    if not record:
        return {}
    loaded = load_scenario(stock_file(scenario))
    grounds = [one.name for one in loaded.components if one.made_of() == "GroundMotion"]
    if not grounds:
        raise ScenarioError(f"{scenario} has no ground motion whose place another could take.")
    name = str(record)
    if name not in {one.name for one in list_ground_motions()}:
        name = _dropped(folder, name)
    motion = read_ground_motion(str(folder / name) if _is_upload(name) else name, folder)
    end = min(float(ceil(motion.time[-1])), LONGEST)
    longer = {"run.stop": end} if end > loaded.stop else {}
    return {**{f"{one}.record": name for one in grounds}, **longer}


def records(folder: Path) -> list[str]:
    """Return the ground motions that can be chosen: those of a name, then the dropped files."""
    named = [one.name for one in list_ground_motions() if not one.needs]
    dropped = sorted((folder / UPLOADS).glob(f"{RECORDS}-*/*"), reverse=True)
    return [*named, *(one.relative_to(folder).as_posix() for one in dropped if one.is_file())]


RECORDS = "record"
"""How batches of dropped files are called that are ground motions."""


def _dropped(folder: Path, name: str) -> str:
    """Return the name of a dropped file, checked to be one: UPLOADS/BATCH/FILE."""
    parts = name.split("/")
    if len(parts) != 3 or parts[0] != UPLOADS:
        raise ScenarioError(f"record: {written(name)} is neither a name nor a dropped file.")
    path = Path(UPLOADS, batch_name(parts[1]), file_name(parts[2], "the record"))
    if not (folder / path).is_file():
        raise ScenarioError(f"{path.as_posix()}: this file is no longer there; drop it again.")
    return path.as_posix()


def _is_file(name: str, value: object) -> bool:
    """Return whether an override names a file in the folder of studies."""
    return isinstance(value, str) and (_is_upload(value) or name.endswith(FILES))


def _is_upload(value: object) -> bool:
    return isinstance(value, str) and value.startswith(f"{UPLOADS}/")


def is_damper(component: Component) -> bool:
    """Return whether a component of a scenario is a damper."""
    return component.made_of().endswith("Damper")


def _text(value: object) -> str:
    """Return a value as --set takes it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:.12g}" if isinstance(value, int | float) else str(value)
