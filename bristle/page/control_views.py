"""Views 7 to 9: scenarios simulated, designs and what they weigh, comparisons of controllers."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache, lru_cache
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..campaign.best_constant import G
from ..core.config import toml_content
from ..core.files import read_json
from ..core.text import command, unknown, written
from ..data import list_ground_motions, read_ground_motion
from ..data.response_spectrum import DAMPING
from ..engine.coupled import Coupled
from ..engine.results import accelerations, spectra
from ..errors import BristleError, DesignError, ScenarioError
from ..export.web import offered
from ..fmu import catalogue
from ..fmu.catalogue import component_of_law
from ..physics.drive import VOLTAGE
from ..physics.effect import EFFECTS
from ..physics.laws import LAWS
from ..study.study import Study
from ..synthesis import implausible, read_task, task_from_data
from ..synthesis.analysis import task_curves
from ..system.model import Component, System
from ..system.scenario import load_scenario, stock_scenarios
from .orders import (
    COMPARED_MOTIONS,
    COMPARED_PEAK,
    COMPARISONS,
    FIELDS,
    FOLDER,
    KINDS,
    MEMBERS,
    content_of,
    names_of,
    numbers_of,
    values_of,
)
from .requests import UPLOADS, batch_name, file_name

# What may command a scenario's damper: a constant voltage, and every controller of the library.
#
# A scenario wires its controller. So another control is another stock scenario with the same
# ground, structure and damper, and where none has it, one whose own takes the same inputs.

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
    for control in (CONSTANT, *catalogue.controllers()):
        for candidate in sorted(_candidates(own, name, control), key=lambda one: len(one[1])):
            try:
                load_scenario(stock_file(candidate[0]), candidate[1])
            except BristleError:
                continue  # this one carries values or wires of its own controller
            found[control] = candidate
            break
    return found


def commanding(scenario: System) -> Component | None:
    """Return the component whose voltage goes to the first damper, None where there is none."""
    for wire in scenario.wires:
        if wire.input == "voltage" and wire.output == "voltage":
            return scenario.components[wire.source]
    return None


def _candidates(own: System, name: str, control: str) -> Iterator[Control]:
    """Yield scenarios that may have a control: itself, one that has it, one that can take it."""
    others = [file.stem for file in stock_scenarios() if file.stem != name]
    takes: list[Control] = []
    for stem in (name, *others):
        other = _stock(stem)
        place = commanding(other)
        carried = _carried(own, other)
        if place is None or carried is None:
            continue
        if place.kind == control:
            yield stem, carried
        elif CONSTANT not in (place.kind, control):
            takes.append((stem, {**carried, f"{place.name}.fmu": control}))
    yield from takes


def _carried(own: System, other: System) -> dict[str, Any] | None:
    """Return the values that make the rest of a scenario that of `own`; None if it is another."""
    if own is other:
        return {}
    mine, its = (_rest(one) for one in (own, other))
    if {n: _made(one) for n, one in mine.items()} != {n: _made(one) for n, one in its.items()}:
        return None
    found: dict[str, Any] = {}
    for name, component in mine.items():
        given, there = component.values, its[name].values
        if set(there) - set(given):
            return None
        found |= {f"{name}.{key}": v for key, v in given.items() if there.get(key) != v}
    if own.stop != other.stop:
        found["run.stop"] = own.stop
    return found


def _rest(scenario: System) -> dict[str, Component]:
    """Return the components of a scenario without the one that commands its damper."""
    place = commanding(scenario)
    return {name: one for name, one in scenario.components.items() if one is not place}


def _made(component: Component) -> tuple[Any, ...]:
    return component.kind, component.building, component.effects, component.law


@cache
def _stock(name: str) -> System:
    return load_scenario(stock_file(name))


# A run that the page asks for: a stock scenario with another damper, control or ground motion.

FILES = (".building", ".controller")
"""How overrides end that name files; a ground motion has a name, or is a dropped file."""
LONGEST = 120.0
"""Seconds of a run to which a longer ground motion stretches it at the most."""


@dataclass(frozen=True)
class RunRequest:
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

    def load(self) -> System:
        """Return the scenario, checked; ScenarioError if it is wrong."""
        return load_scenario(stock_file(self.scenario), self.given())

    def run(self, *options: str) -> str:
        """Return the command that makes the same run, with options, in the folder of studies."""
        sets = [word for one in self.sets() for word in ("--set", one)]
        return command("run", self.scenario, "--engine", "compiled", *options, *sets)

    def sets(self) -> list[str]:
        """Return the overrides as --set takes them."""
        return [f"{name}={_text(value)}" for name, value in self.overrides.items()]


def asked_for(folder: Path, arguments: Mapping[str, Any]) -> RunRequest:
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
    return RunRequest(folder, name, {**overrides, **values})


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
    dampers = [name for name, one in components.items() if is_damper(one)]
    if not dampers:
        raise ScenarioError(f"{scenario} has no damper whose place that of {study} could take.")
    place = dampers[0]
    values = {f"{place}.{name}": float(f"{value:.6g}") for name, value in here.values.items()}
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
    components = loaded.components.items()
    grounds = [name for name, one in components if one.made_of() == "GroundMotion"]
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


SLIDERS = 12
ROWS = 20_000
"""Rows of a run that are sent; of more every second, third ... is. Peaks are those of all rows."""


def simulate_view(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
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
            "name": name, "unit": scenario.unit(name), "values": column[::every],
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


def scenarios_view(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the stock scenarios by name, the studies with a damper for them, the ground motions.

    Parameters
    ----------
    folder : that holds studies
    arguments : none are taken
    """
    studies = [file.parent.name for file in sorted(folder.glob("*/study.toml"))]
    return {
        "scenarios": [file.stem for file in stock_scenarios()],
        "studies": [name for name in studies if not name.startswith(".")],
        "records": records(folder),
    }


def spectrum_view(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the response spectra of a run's ground and floors.

    Parameters
    ----------
    folder, arguments : as for `simulate_view`

    Raises
    ------
    ScenarioError, RecordError
        As `simulate_view`.
    RunError
        If no output is an acceleration of ground or floor.
    """
    asked = asked_for(folder, arguments)
    found = spectra(_columns(asked), asked.load().step)
    return {
        "period": found.pop("period"), "of": found,
        "command": asked.run("--spectrum"),
    }  # fmt: skip


def _columns(asked: RunRequest) -> dict[str, NDArray[Any]]:
    """Return the columns of a run; those of the last ones are kept, for their spectra."""
    return _run(asked.folder, asked.scenario, json.dumps(dict(asked.overrides)))


@lru_cache(maxsize=2)
def _run(folder: Path, scenario: str, overrides: str) -> dict[str, NDArray[Any]]:
    table = Coupled().run(RunRequest(folder, scenario, json.loads(overrides)).load())
    return {"time": table.time, **table.values}


def _sliders(scenario: System) -> list[dict[str, Any]]:
    """Return the numbers that a reader would move first, between half and one and a half."""
    rows = []
    for name in offered(scenario):
        component, _, own = name.partition(".")
        found = _slider(scenario.components[component], own)
        if found is not None:
            rows.append({"name": name, **found})
    return rows[:SLIDERS]


def _slider(component: Component, name: str) -> dict[str, Any] | None:
    variable = component.description.variables[name]
    value = float(component.value(name) or 0.0)
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


def design_view(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return what view 8 shows of a study.

    Parameters
    ----------
    folder : of the study
    arguments : none are taken

    Raises
    ------
    StudyError
        If a file of the study is wrong.
    """
    study = Study(folder)
    solves = []
    for name in names_of(folder):
        solved = folder / FOLDER / f"{name}_answer.json"
        if solved.is_file():  # it is not where the solver found none, or was cancelled
            found = read_json(solved)
            values = values_of(toml_content(folder / FOLDER / f"{name}.toml"))
            older = _is_older(folder / FOLDER / f"{name}.toml", found)
            solves.append({"name": name, "values": values, "older": older, **_solve(found)})
    return {
        "law": study.model(to_show=True).law, "kinds": list(KINDS), "refused": refused(study),
        "fields": [{"name": name, **one._asdict()} for name, one in FIELDS.items()],
        "solves": solves,
    }  # fmt: skip


def weights_view(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a task weighs, before it is solved, and what looks unmeant in it.

    Parameters
    ----------
    folder : of the study
    arguments : `kind` and `values`, as for `content_of`

    Raises
    ------
    DesignError, RequestError
        If the task is wrong.
    """
    kind, values = arguments.get("kind"), arguments.get("values", {})
    task = task_from_data(content_of(kind, values, building_of(folder), ""), folder, "design")
    return {**task_curves(task), "warnings": implausible(task)}


def refused(study: Study) -> str:
    """Return why the page designs nothing for a study, "" where it does."""
    if study.settings.device:
        return (
            f"its damper is {study.settings.device}, not the one on the first level, which the "
            "stock scenarios command. Write a design file with `device`: bristle design takes it."
        )
    model = study.model(to_show=True)
    if model.drive != VOLTAGE.name:
        return f"its damper is driven by a {model.drive}; a controller commands a voltage."
    return ""


def building_of(folder: Path) -> str:
    """Return the file of a study's building relative to its folder, "" where it has none."""
    return Study(folder).model(to_show=True).building


def _is_older(file: Path, found: Mapping[str, Any]) -> bool:
    """Return whether a solve was of another task than its file is now: the model has changed."""
    try:
        return bool(read_task(file).digest() != found["facts"]["task"])
    except DesignError:
        return True


def _solve(found: Mapping[str, Any]) -> dict[str, Any]:
    """Return gamma, norms and margins of a solve, and its curves as arrays."""
    facts, curves = found["facts"], found["curves"]
    margins = {k: v for k, v in found["margins"].items() if k != "speeds"}
    return {
        "kind": found["kind"], "gamma": facts["gamma"],
        "norm": facts.get("norm", facts.get("largest_norm", facts.get("largest_row_norm"))),
        "states": found["states"], "proved": facts.get("share_proved"),
        "margins": margins, "frequency": np.array(curves["frequency"]),
        "speeds": [
            {
                key: np.array(one) if isinstance(one, list) else one
                for key, one in speed.items()
            }
            for speed in curves["speeds"]
        ],
    }  # fmt: skip


# View 9, Compare controllers: what can be compared, and what the comparisons found.


COMPARISON, REPORT = "answer.json", "report.html"
"""What `bristle controllers` leaves in its folder, beside tables."""
SHOWN = ("command", "verdict", "notes", "header", "tables", "footnotes", "seconds")


def controllers_view(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return what view 9 shows of a study.

    Parameters
    ----------
    folder : of the study
    arguments : none are taken

    Raises
    ------
    StudyError
        If a file of the study is wrong.
    """
    peaks = {one.name: one.peak / G for one in list_ground_motions()}
    numbers = numbers_of(folder)
    return {
        "records": [{"name": n, "peak": peaks.get(n)} for n in records(folder.parent)],
        "controllers": catalogue.controllers(),
        "designs": [n for n in names_of(folder) if (folder / FOLDER / f"{n}.json").is_file()],
        "buildings": _buildings(folder),
        "most": {"motions": COMPARED_MOTIONS, "members": MEMBERS, "peak": COMPARED_PEAK},
        "next": max(numbers, default=0) + 1,
        "comparisons": [found for number in numbers if (found := _comparison(folder, number))],
    }


def _comparison(folder: Path, number: int) -> dict[str, Any] | None:
    """Return a comparison with its files; None where it failed or was cancelled."""
    own = folder / COMPARISONS / str(number)
    file = own / COMPARISON
    if not file.is_file():
        return None
    found = read_json(file)
    older = file.stat().st_mtime_ns < (folder / "model.toml").stat().st_mtime_ns
    files = [own / REPORT, *sorted(own.glob("*.csv"))]
    return {
        "number": number, "older": older, **{key: found[key] for key in SHOWN},
        "files": [one.relative_to(folder).as_posix() for one in files if one.is_file()],
    }  # fmt: skip


def _buildings(folder: Path) -> list[dict[str, str]]:
    """Return the buildings of the studies, that of this study first, with the damper's device."""
    others = [file.parent for file in sorted(folder.parent.glob("*/study.toml"))]
    found = []
    for one in (folder, *(other for other in others if other != folder)):
        if one.name.startswith("."):
            continue
        try:
            study = Study(one)
            building = study.model(to_show=True).building
        except BristleError:
            if one == folder:
                raise
            continue  # a study that cannot be read has no building; its own views say why
        if building:
            about = {"study": one.name, "device": study.settings.device}
            found.append({"file": f"{one.name}/{building}", **about})
    return found
