"""A scenario as an SSP package, or as a folder with OspSystemStructure.xml, for other tools.

What a component is made from (building, controller, record, own effects) is inside its FMU, and
so are its values: tools differ in what they make of a package's own.
"""

from __future__ import annotations

import os
import re
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from ..errors import ScenarioError
from ..fmu.build import Plan, build, plan
from ..fmu.description import Value
from ..ssp.names import STRUCTURE
from ..ssp.write import (
    WrittenComponent,
    WrittenConnection,
    WrittenSystem,
    osp_text,
    ssd_text,
)
from .document import FILE_PARAMETERS
from .scenario import Component, Scenario, fmu_parameters

RESOURCES = "resources"
Build = Callable[[Plan, Path], Path]
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest time that a zip can hold


@dataclass(frozen=True)
class ExportedPackage:
    """The files that were written, and what is otherwise in other tools, a text each."""

    files: tuple[Path, ...]
    notes: tuple[str, ...]


def export_ssp(
    scenario: Scenario, file: Path, osp: Path | None = None, build: Build = build
) -> ExportedPackage:
    """Write a scenario as an SSP package, and its parts into a folder for OSP.

    Parameters
    ----------
    scenario : Scenario
        A checked scenario.
    file : Path
        FILE.ssp, in place of an older one.
    osp : Path, optional
        Folder that takes OspSystemStructure.xml with the FMUs beside it.
    build : callable
        Builds a planned FMU into a folder and returns its path.

    Raises
    ------
    ScenarioError
        If a file cannot be written.
    BuildError, RecordError
        If an FMU cannot be built.
    """
    if file.suffix.lower() != ".ssp":
        raise ScenarioError(f"{file}: the name of an SSP package ends with .ssp.")
    with tempfile.TemporaryDirectory(prefix="bristle_ssp_") as temporary:
        fmus = _fmus(scenario, Path(temporary), build)
        system = _system(scenario, fmus)
        with _writing(file):
            _pack(file, ssd_text(system), list(fmus.values()))
        written = [file]
        if osp is not None:
            with _writing(osp):
                written += _lay_out(osp, system, list(fmus.values()))
    return ExportedPackage(tuple(written), tuple(_notes(scenario)))


def _fmus(scenario: Scenario, folder: Path, build: Build) -> dict[str, Path]:
    """Return the FMU of each component, built with its values or copied, each of a name its own."""
    found: dict[str, Path] = {}
    taken: set[str] = set()
    for component in scenario.components:
        stem = re.sub(r"[^A-Za-z0-9_]", "_", component.name)
        stem = stem if re.match(r"[A-Za-z_]", stem) else f"_{stem}"
        while stem.lower() in taken:
            stem += "_"
        taken.add(stem.lower())
        found[component.name] = _fmu(component, scenario.file.parent, folder, stem, build)
    return found


def _fmu(component: Component, home: Path, folder: Path, name: str, build: Build) -> Path:
    if component.path is not None:
        target = folder / f"{name}.fmu"
        target.write_bytes(component.path.read_bytes())
        return target
    values = fmu_parameters(component, home)
    files = {key: Path(str(values.pop(key))) for key in FILE_PARAMETERS if values.get(key)}
    what = plan(
        component.made_of(),
        name=name,
        building=component.building,
        controller=component.controller,
        effects=component.effects,
        record=files.get("record"),
        samples=files.get("file"),
        starts=values,
    )
    return build(what, folder)


def _system(scenario: Scenario, fmus: dict[str, Path]) -> WrittenSystem:
    ends = {(c.target, c.input) for c in scenario.connections}
    ends |= {(c.source, c.output) for c in scenario.connections}
    components = tuple(
        WrittenComponent(
            component.name,
            f"{RESOURCES}/{fmus[component.name].name}",
            tuple(
                variable
                for variable in component.description.variables.values()
                if (component.name, variable.name) in ends
            ),
            tuple(
                (component.description.variables[key], value)
                for key, value in _values(component, scenario.file.parent).items()
            ),
            component.step,
        )
        for component in scenario.components
    )
    connections = tuple(
        WrittenConnection(
            c.source, c.output, c.target, c.input, c.factor, c.offset, c.transformed
        )
        for c in scenario.connections
    )  # fmt: skip
    return WrittenSystem(
        scenario.title, scenario.stop, scenario.step, scenario.algorithm, components, connections
    )


def _values(component: Component, home: Path) -> dict[str, Value]:
    """Return the values that stand in the package; files are in the FMUs."""
    values = fmu_parameters(component, home)
    if component.path is None:
        values = {key: value for key, value in values.items() if key not in FILE_PARAMETERS}
    return values


def _notes(scenario: Scenario) -> Iterator[str]:
    for component in scenario.components:
        if component.step is not None and component.step != scenario.step:
            yield (
                f"{component.name} steps every {1e3 * component.step:g} ms here; SSP has no word "
                f"for that, and tools step it every {1e3 * scenario.step:g} ms."
            )
        if component.path is not None and component.parameters:
            yield (
                f"{component.name}: a foreign FMU is packed as it is. Its values stand in the "
                "package alone, which some tools leave aside."
            )
        names = [key for key in FILE_PARAMETERS if component.parameters.get(key)]
        if component.path is not None and names:
            yield f"{component.name} reads a file of this computer: {', '.join(names)}."


def _pack(file: Path, text: str, fmus: list[Path]) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    if file.is_dir():
        raise ScenarioError(f"{file}: is a folder; another name is right.")
    handle, name = tempfile.mkstemp(dir=file.parent, prefix=f".{file.name}-")
    draft = Path(name)
    try:
        with os.fdopen(handle, "wb") as stream, zipfile.ZipFile(stream, "w") as archive:
            _write(archive, STRUCTURE, text.encode())
            for fmu in fmus:
                _write(archive, f"{RESOURCES}/{fmu.name}", fmu.read_bytes())
        draft.chmod(0o644)
        draft.replace(file)
    finally:
        draft.unlink(missing_ok=True)


def _write(archive: zipfile.ZipFile, name: str, data: bytes) -> None:
    entry = zipfile.ZipInfo(name, _EPOCH)
    entry.compress_type = zipfile.ZIP_DEFLATED
    entry.external_attr = 0o644 << 16
    archive.writestr(entry, data)


def _lay_out(folder: Path, system: WrittenSystem, fmus: list[Path]) -> list[Path]:
    folder.mkdir(parents=True, exist_ok=True)
    beside = tuple(replace(c, source=Path(c.source).name) for c in system.components)
    structure = folder / "OspSystemStructure.xml"
    for fmu in fmus:
        (folder / fmu.name).write_bytes(fmu.read_bytes())
    structure.write_text(osp_text(replace(system, components=beside)), encoding="utf-8")
    return [structure]


@contextmanager
def _writing(target: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ScenarioError(f"{target}: cannot be written ({error.strerror or error}).") from None
