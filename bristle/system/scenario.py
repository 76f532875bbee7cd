"""A scenario: a run as data, read from TOML and checked before the first step.

Every mistake of a file is found at once, with its line and what would be right.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..core import files
from ..core.config import SCHEMA, Document, raised, toml_content
from ..core.finding import Finding
from ..core.text import nearest, unknown
from ..data import list_ground_motions
from ..errors import ScenarioError
from ..fmu.description import Value
from .advice import advise
from .connections import check_connections
from .library import changed_title, needs_title
from .model import FILE_PARAMETERS, Component, Part, RunSettings, System, plain_target
from .overrides import (
    SCENARIO,
    apply_overrides,
    exists,
    plain,
)
from .toml import check_components, check_steps

_SCHEMA = re.compile(r"^#:schema .*\n", re.MULTILINE)


def load_scenario(
    scenario: str | Path | System,
    overrides: Mapping[str, object] | None = None,
) -> System:
    """Return a scenario that has been checked.

    Parameters
    ----------
    scenario : path or System
        The TOML file, or the name of a stock scenario, or an SSP package. One that is loaded
        already keeps the overrides that it has beside new ones.
    overrides : mapping, optional
        Dotted names with values that take the place of the file's, e.g.
        `{"damper.f_c": 2.0, "run.step": 1e-3, "damper.fmu": "BinghamDamper"}`.

    Raises
    ------
    ScenarioError
        If anything is wrong: the text lists every mistake with its line.
    """
    if isinstance(scenario, System):
        if not overrides:
            return scenario
        if scenario.origin is None:
            raise ScenarioError(f"{scenario.title}: was made, and no file takes overrides.")
        anew = {plain_target(str(name)) for name in overrides}
        changes = {name: v for name, v in scenario.changes.items() if name not in anew}
        overrides = {**scenario.overrides, **overrides}
        file = scenario.package or scenario.origin
        return load_scenario(file, overrides).with_values(changes)
    return _checked(scenario, *_read(resolve_scenario(scenario), overrides or {}))


def make_system(
    title: str,
    run: Mapping[str, Any],
    components: Mapping[str, Mapping[str, Any]],
    wires: Mapping[str, Any],
) -> System:
    """Return a system that is made of tables such as a scenario has, checked as one.

    Parameters
    ----------
    title : of figures and tables
    run : stop and step [s], algorithm
    components : their tables by name; a Signal may stand in place of a file that is played
    wires : input "component.port" to output, or to a table of `from`, `factor`, `offset`

    Raises
    ------
    ScenarioError
        If anything is wrong.
    """
    data = {
        "schema": SCHEMA, "title": title, "run": run, "components": components,
        "connections": wires,
    }  # fmt: skip
    return _checked(title, *_judged(Document(title, ScenarioError, data), {}))


def _checked(name: str | Path, system: System | None, found: Sequence[Finding]) -> System:
    errors = [finding for finding in found if finding.level == "error"]
    if errors or system is None:
        raise raised(ScenarioError, name, errors)
    return system


def check_scenario(
    file: str | Path,
    overrides: Mapping[str, object] | None = None,
) -> list[Finding]:
    """Return everything that a check finds in a scenario, by line; nothing is run or written.

    Parameters are those of `load_scenario`. A file that cannot be read is a finding as well.
    """
    try:
        path = resolve_scenario(file)
    except ScenarioError as error:
        return [Finding("file", "error", str(error))]
    return _read(path, overrides or {})[1]


def _read(path: Path, overrides: Mapping[str, object]) -> tuple[System | None, list[Finding]]:
    """Return the system of a file or package, None where it has a mistake, and the findings."""
    package, notes = None, tuple[Finding, ...]()
    if path.suffix.lower() == ".ssp":
        from .ssp_import import unpacked

        package = path
        try:
            made = unpacked(package)
        except ScenarioError as error:
            return None, [Finding("file", "error", str(error))]
        path, notes = made.scenario, made.notes
    try:
        document = Document(path, ScenarioError)
        if package is not None:
            document.lines.clear()  # of a file that the user does not have
        system, found = _judged(document, overrides, notes)
    except ScenarioError as error:
        return None, list(error.findings)
    return system and replace(system, origin=path, package=package), found


def _judged(
    document: Document, overrides: Mapping[str, object], notes: Sequence[Finding] = ()
) -> tuple[System | None, list[Finding]]:
    """Return the system that a document describes, None where it has a mistake, and findings."""
    changed = apply_overrides(document, overrides)
    read = document.read(SCENARIO)
    for note in notes:
        if ("run", note.kind) not in document.overridden:
            document.note((), note.text)
    run, title = RunSettings(**read["run"]), read["title"]
    parts = check_components(document, read["components"])
    check_steps(run, parts.values(), document)
    wires = check_connections(document, read["connections"], parts)
    advise(run, parts, wires, document)
    found = document.in_order()
    if any(finding.level == "error" for finding in found):
        return None, found
    # Without an error every part has been read in full.
    assert run.stop is not None
    assert run.step is not None
    folder = Path(document.path).parent
    components = {
        part.name: Component(
            part.name, part.kind, description, _absolute(part, folder), part.file,
            part.building, part.controller, part.effects, part.law, part.signal, part.step,
            part.over_step,
        )
        for part in parts.values()
        if (description := part.description) is not None
    }  # fmt: skip
    title = Path(document.path).stem if title is None else title
    if ("title",) not in document.overridden and needs_title(changed):
        title = changed_title(components.values(), changed)
    laid_over = {str(name): plain(value) for name, value in overrides.items()}
    system = System(
        title, run.stop, run.step, run.algorithm, components, tuple(wires), None, tuple(found),
        laid_over,
    )  # fmt: skip
    return system, found


def _absolute(part: Part, folder: Path) -> dict[str, Value]:
    """Return values with the absolute paths of files that are named from a folder.

    A ground motion of the library goes by its name, even where there is a file of that name.
    """
    found = dict(part.values)
    named = {one.name for one in list_ground_motions()} if part.kind == "GroundMotion" else set()
    for name in FILE_PARAMETERS:
        value = str(found.get(name, ""))
        if value and value not in named and exists(folder / value):
            found[name] = (folder / value).absolute().as_posix()
    return found


def stock_scenarios() -> list[Path]:
    """Return the files of the stock scenarios, by name."""
    return sorted(files.scenarios_folder().glob("*.toml"))


def resolve_scenario(name: str | Path) -> Path:
    """Return the absolute path of a scenario file, or of the stock scenario of that name.

    Raises
    ------
    ScenarioError
        If neither is there; the text names the nearest.
    """
    file = Path(name)
    if not str(name):
        raise ScenarioError("the name of the scenario file is empty.")
    if exists(file) and not file.is_dir():
        return file.absolute()
    stock = stock_scenarios()
    if len(file.parts) == 1:
        for found in stock:  # a folder of that name may hold its results
            if found.name in (file.name, f"{file.name}.toml"):
                return found.absolute()
    if exists(file):
        return file.absolute()
    beside = [str(entry) for entry in file.parent.glob("*.toml")] if exists(file.parent) else []
    names = [found.stem for found in stock]
    # Whole paths are alike by their folders alone, so files are compared by their own names.
    by_stem = {Path(entry).stem: entry for entry in beside} | {stem: stem for stem in names}
    close = nearest(file.stem, by_stem)
    hint = f' Did you mean "{by_stem[close[0]]}"?' if close else ""
    stock_ones = " bristle list scenarios names those of the library." if names else ""
    raise ScenarioError(f'there is no scenario file "{name}".{hint}{stock_ones}')


def copy_scenario(name: str, target: Path | None = None) -> Path:
    """Copy a stock scenario; return the file that was written.

    Parameters
    ----------
    name : str
        Of a stock scenario.
    target : Path, optional
        The file that is written; else NAME.toml in the current folder. The line that tells editors
        where the schema stands is left out: it holds beside the stock scenarios alone. A building
        of the scenario's own goes with it, to the same place beside it.

    Raises
    ------
    ScenarioError
        If there is no such scenario, or a file is there already or cannot be written.
    """
    stock = {file.stem: file for file in stock_scenarios()}
    source = stock.get(name.removesuffix(".toml"))
    if source is None:
        raise ScenarioError(unknown("stock scenario", name, list(stock)))
    file = target or Path(source.name)
    text = source.read_text(encoding="utf-8")
    components = toml_content(source)["components"].values()
    buildings = [component["building"] for component in components if "building" in component]
    files.write_new(file, _SCHEMA.sub("", text), ScenarioError)
    for building in buildings:
        copied = file.parent / building
        content = (source.parent / building).read_text(encoding="utf-8")
        if not copied.is_file() or copied.read_text(encoding="utf-8") != content:
            files.write_new(copied, content, ScenarioError, folder=True)
    return file
