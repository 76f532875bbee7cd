"""View 8, Design: what is weighed, what the solves found, and their closed loops."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..campaign.best_constant import OUTPUT, G
from ..campaign.best_constant import SCENARIO as PASSIVE
from ..core.config import toml_content
from ..core.files import read_json
from ..data import list_ground_motions
from ..engine.coupled import Coupled
from ..errors import BristleError, DesignError, ScenarioError, StudyError
from ..fmu import catalogue
from ..physics.drive import VOLTAGE
from ..physics.law import base_and_variant
from ..study.study import Study
from ..synthesis import implausible, read_task, task_from_data
from ..synthesis.analysis import task_curves
from ..system.scenario import load_scenario
from .orders import (
    COMPARED_MOTIONS,
    COMPARED_PEAK,
    COMPARISONS,
    FIELDS,
    FOLDER,
    KINDS,
    MEMBERS,
    MOTIONS,
    PEAK,
    content_of,
    design_name,
    kind_of_design,
    names_of,
    numbers_of,
    peak_of,
    record_name,
    values_of,
)
from .requests import RequestError
from .simulate_views import (
    RunRequest,
    damper_of,
    record_of,
    records,
    stock_file,
)

ANSWER = "passive/passive.json"
"""What `bristle optimise passive` leaves in the folder of designs."""
ROWS = 3000
"""Rows of a response that are sent: a screen has fewer columns."""
JUDGED = (OUTPUT, "structure.base_displacement", "damper.force")


def design_view(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return what view 8 shows of a study before its closed loops.

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
        "solves": solves, "records": records(folder.parent), "motions": list(MOTIONS),
        "peak": PEAK,
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


def loops_view(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the closed loop of a design on ground motions, and the best constant voltage's.

    Parameters
    ----------
    folder : of the study
    arguments : `name` of the design; `motions`, ground motions by name or as dropped files; `peak`
        [g] to which each is scaled

    Raises
    ------
    RequestError
        If one of them is not right.
    ScenarioError, RecordError
        If the study's damper cannot act in the scenario, nothing is designed for it, or there is no
        such ground motion.
    DesignError
        If the controller does not belong to its building.
    """
    name = design_name(arguments.get("name"))
    motions = arguments.get("motions", list(MOTIONS))
    if not isinstance(motions, list) or not 1 <= len(motions) <= len(MOTIONS):
        raise RequestError(f"motions: a list of 1 to {len(MOTIONS)} ground motions is right.")
    peak = peak_of("motions", arguments.get("peak", PEAK))
    if why := refused(Study(folder)):
        raise ScenarioError(f"{folder.name}: {why}")
    shaken = _shaken(folder, [record_name(one) for one in motions], peak)
    best = _best(folder)
    found = []
    for record, ground in shaken.items():
        voltage = best.get((record, peak))
        runs = [("controlled", _controlled(folder, name, ground))]
        if voltage is not None:
            runs.append(("passive", _passive(folder, {**ground, "voltage.level": voltage})))
        responses = {key: _response(asked) for key, asked in runs}
        found.append({"record": record, "voltage": voltage, **responses})
    # `bristle optimise passive` gives record and peak itself.
    rest = {key: next(iter(shaken.values()))[key] for key in ("ground.factor", "run.stop")}
    return {"name": name, "peak": peak, "motions": found, "sets": _passive(folder, rest).sets()}


def _shaken(folder: Path, motions: list[str], peak: float) -> dict[str, dict[str, Any]]:
    """Return by ground motion what makes it that of a scenario, as overrides; ends are alike."""
    found = {record: record_of(folder.parent, PASSIVE, record) for record in motions}
    own = load_scenario(stock_file(PASSIVE)).stop
    stop = max(one.get("run.stop", own) for one in found.values())
    scale = {"ground.peak": round(peak * G, 9), "ground.factor": 1.0, "run.stop": stop}
    return {record: {**one, **scale} for record, one in found.items()}


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


def _house(folder: Path) -> dict[str, Any]:
    """Return what makes the structure of a scenario the study's building, as overrides."""
    building = building_of(folder)
    return {"structure.building": f"{folder.name}/{building}"} if building else {}


def _controlled(folder: Path, name: str, ground: Mapping[str, Any]) -> RunRequest:
    kind = kind_of_design(name)
    scenario = KINDS[kind]
    overrides = {
        **damper_of(folder.parent, scenario, folder.name), **_house(folder),
        "controller.controller": f"{folder.name}/{FOLDER}/{name}.json", **ground,
    }  # fmt: skip
    asked = RunRequest(folder.parent, scenario, overrides)
    if kind == "hinf":
        asked = RunRequest(folder.parent, scenario, {**overrides, **_inverse(folder, asked)})
    return asked


def _inverse(folder: Path, asked: RunRequest) -> dict[str, Any]:
    """Return what makes the inverse of a force controller that of the study's law, as overrides."""
    model = Study(folder).model()
    law = base_and_variant(model.law)[0].name
    known = asked.load().components["controller"].description.variables
    here = {
        f"{law}.{name}": float(f"{value:.6g}")
        for name, value in model.at("damper", not model.building).values.items()
    }
    own = {name: value for name, value in here.items() if name in known}
    if not own:
        raise ScenarioError(
            f"{folder.name}: the law {law} has no inverse, which a force controller needs; an LPV "
            "controller commands the voltage itself."
        )
    return {
        "controller.inverse": law, **{f"controller.{name}": value for name, value in own.items()}
    }  # fmt: skip


def _passive(folder: Path, ground: Mapping[str, Any]) -> RunRequest:
    damper = damper_of(folder.parent, PASSIVE, folder.name)
    return RunRequest(folder.parent, PASSIVE, {**damper, **_house(folder), **ground})


def _response(asked: RunRequest) -> dict[str, Any]:
    scenario = asked.load()
    columns = Coupled().run(scenario)
    every = -(-len(columns["time"]) // ROWS)
    return {
        "command": asked.run(), "time": columns["time"][::every],
        "values": columns[OUTPUT][::every], "unit": "m/s2",
        "peaks": {name: float(np.max(np.abs(columns[name]))) for name in JUDGED},
        "units": {name: scenario.unit(name) for name in JUDGED},
    }  # fmt: skip


def _best(folder: Path) -> dict[tuple[str, float], float]:
    """Return by ground motion and peak [g] the best constant voltage [V] that was found.

    Empty where none was, or the study's model has changed since.
    """
    path, model = folder / FOLDER / ANSWER, folder / "model.toml"
    if not path.is_file() or path.stat().st_mtime_ns < model.stat().st_mtime_ns:
        return {}
    try:
        motions = read_json(path)["motions"]
        return {(one["record"], one["intensity"]): float(one["voltage"]) for one in motions}
    except (KeyError, TypeError, ValueError) as error:
        raise StudyError(
            f"{path}: {type(error).__name__} {error}; `bristle optimise passive` writes it anew."
        ) from None


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
