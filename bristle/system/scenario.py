"""A scenario: a run as data, read from TOML and checked before the first step.

Every mistake of a file is found at once, with its line and what would be right.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ..core import files
from ..core.config import Document, raised
from ..core.text import Finding, nearest, worded
from ..errors import ScenarioError
from ..fmu.description import Description, Value
from .advice import advise
from .connections import check_connections
from .library import Library, changed_title, installed, needs_title
from .model import DamperLaw, Run
from .overrides import (
    FILE_PARAMETERS,
    SCENARIO,
    apply_overrides,
    exists,
    parse_override,
    parse_overrides,
    plain,
)
from .ssp_import import Note, unpacked
from .toml import check_components, check_steps

__all__ = [
    "Component",
    "Connection",
    "Finding",
    "Scenario",
    "check_scenario",
    "fmu_parameters",
    "load_scenario",
    "loaded_with",
    "parse_override",
    "parse_overrides",
    "resolve_scenario",
    "stock_scenarios",
]


@dataclass(frozen=True)
class Component:
    """One FMU of a scenario.

    `path` is the file of a foreign FMU, None for a built-in; `building` the data file that a
    Structure is made from, None for the default; `controller` the controller file of a designed
    controller, None for the one that it carries; `effects` the files of a user's own effects that a
    built-in one carries besides the library's; `parameters` the values that the scenario sets,
    inputs that are held constant included; `step` its own step [s], None for the run's; `law` that
    of a damper where the scenario names it; `over_step` what the scenario says of a foreign FMU's
    ports (see `over_step.choose_over_step`).
    """

    name: str
    fmu: str
    path: Path | None
    building: Path | None
    parameters: dict[str, Value]
    step: float | None
    description: Description
    effects: tuple[Path, ...] = ()
    controller: Path | None = None
    law: DamperLaw | None = None
    over_step: dict[str, str] = field(default_factory=dict)

    def made_of(self) -> str:
        """Return what the catalogue makes it from; a law of a user's own is registered then."""
        if self.law is None:
            return self.fmu
        if self.law.file is not None:  # this process may not have read it yet
            from ..trust import load_file

            load_file(self.law.file, "law")
        return self.law.component


@dataclass(frozen=True)
class Connection:
    """Component and port that take a value, component and port that give it.

    input = factor output + offset; `transformed` is whether the scenario says so, even if by 1 and
    0: units are its own matter then.
    """

    target: str
    input: str
    source: str
    output: str
    factor: float = 1.0
    offset: float = 0.0
    transformed: bool = False


@dataclass(frozen=True)
class Scenario:
    """A checked scenario; `stop` [s] is a whole number of steps of `step` [s].

    `title` is the file's unless overrides changed what runs (see `naming.changed_title`).

    `algorithm` is one of `parts.ALGORITHMS`; components step in their order. `findings` are the
    warnings and notes of its check; `overrides` what was laid over the file. `package` is the SSP
    package that it was read from, None without one.
    """

    file: Path
    title: str
    stop: float
    step: float
    algorithm: str
    components: tuple[Component, ...]
    connections: tuple[Connection, ...]
    findings: tuple[Finding, ...] = ()
    overrides: dict[str, object] = field(default_factory=dict)
    package: Path | None = None

    @property
    def steps(self) -> int:
        """Number of communication steps."""
        return round(self.stop / self.step)

    def remarks(self) -> list[str]:
        """Return the warnings and notes of the check, a line each with its place."""
        name = (self.package or self.file).name
        return [f"{found.level}: {worded(name, found)}" for found in self.findings]

    def component(self, name: str) -> Component:
        """Return the component of a name."""
        return next(component for component in self.components if component.name == name)


def load_scenario(
    file: str | Path,
    overrides: Mapping[str, object] | None = None,
    *,
    library: Library | None = None,
) -> Scenario:
    """Return a scenario that has been checked.

    Parameters
    ----------
    file : path
        The TOML file, or the name of a stock scenario, or an SSP package.
    overrides : mapping, optional
        Dotted names with values that take the place of the file's, e.g.
        `{"damper.f_c": 2.0, "run.step": 1e-3, "damper.fmu": "BinghamDamper"}`.
    library : Library, optional
        Where components, records and buildings are looked up; what is installed by default.

    Raises
    ------
    ScenarioError
        If anything is wrong: the text lists every mistake with its line.
    """
    path = resolve_scenario(file)
    scenario, findings = _read(path, overrides or {}, library)
    errors = [finding for finding in findings if finding.level == "error"]
    if errors or scenario is None:
        raise raised(ScenarioError, file, errors)
    return scenario


def loaded_with(
    scenario: Scenario | str | Path, overrides: Mapping[str, object] | None
) -> Scenario:
    """Return a scenario with overrides beside those that it has, where it is loaded already.

    Raises
    ------
    ScenarioError
        As `load_scenario`.
    """
    if not isinstance(scenario, Scenario):
        return load_scenario(scenario, overrides)
    if not overrides:
        return scenario
    return load_scenario(scenario.package or scenario.file, {**scenario.overrides, **overrides})


def check_scenario(
    file: str | Path,
    overrides: Mapping[str, object] | None = None,
    *,
    library: Library | None = None,
) -> list[Finding]:
    """Return everything that a check finds in a scenario, by line; nothing is run or written.

    Parameters are those of `load_scenario`. A file that cannot be read is a finding as well.
    """
    try:
        path = resolve_scenario(file)
    except ScenarioError as error:
        return [Finding(0, "error", str(error))]
    return _read(path, overrides or {}, library)[1]


def _read(
    path: Path, overrides: Mapping[str, object], library: Library | None
) -> tuple[Scenario | None, list[Finding]]:
    package, notes = None, tuple[Note, ...]()
    if path.suffix.lower() == ".ssp":
        package = path
        try:
            made = unpacked(package)
        except ScenarioError as error:
            return None, [Finding(0, "error", str(error))]
        path, notes = made.scenario, made.notes
    try:
        document = Document(path, ScenarioError)
        if package is not None:
            document.lines.clear()  # of a file that the user does not have
        changed = apply_overrides(document, overrides)
        read = document.read(SCENARIO)
    except ScenarioError as error:
        return None, list(error.findings)
    library = library or installed()
    for note in notes:
        if ("run", note.key) not in document.overridden:
            document.note((), note.text)
    run, title = Run(**read["run"]), read["title"]
    parts = check_components(document, read["components"], library)
    check_steps(run, parts.values(), document)
    wires = check_connections(document, read["connections"], parts)
    advise(run, parts, wires, library, document)
    found = document.in_order()
    if any(finding.level == "error" for finding in found):
        return None, found
    # Without an error every part has been read in full.
    assert run.stop is not None
    assert run.step is not None
    components = tuple(
        Component(
            part.name,
            part.fmu,
            part.file,
            part.building,
            part.parameters,
            part.step,
            description,
            part.effects,
            part.controller,
            part.law,
            part.over_step,
        )
        for part in parts.values()
        if (description := part.description) is not None
    )
    title = path.stem if title is None else title
    if ("title",) not in document.overridden and needs_title(changed):
        title = changed_title(components, changed)
    connections = tuple(
        Connection(w.target, w.input, w.source, w.output, w.factor, w.offset, w.transformed)
        for w in wires
    )
    laid_over = {str(name): plain(value) for name, value in overrides.items()}
    scenario = Scenario(
        path, title, run.stop, run.step, run.algorithm, components, connections, tuple(found),
        laid_over, package,
    )  # fmt: skip
    return scenario, found


def fmu_parameters(component: Component, folder: Path) -> dict[str, Value]:
    """Return the values that a component's FMU is given: files as absolute paths.

    Parameters
    ----------
    component : Component
    folder : Path
        The scenario's folder, `scenario.file.parent`: relative paths start there.

    Raises
    ------
    RecordError
        If a ground motion cannot be read. Other formats than a two-column CSV are rewritten as one
        in the user's cache.
    """
    values = dict(component.parameters)
    for name in FILE_PARAMETERS:
        value = values.get(name)
        if not isinstance(value, str) or not value:
            continue
        if component.path is None and component.fmu == "GroundMotion" and name == "record":
            from ..data import ground_motion_file

            values[name] = ground_motion_file(value, folder)
        elif exists(folder / value):
            values[name] = str((folder / value).absolute())
    return values


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
    listed = f" Stock scenarios: {', '.join(names)}." if names else ""
    raise ScenarioError(f'there is no scenario file "{name}".{hint}{listed}')
