"""Builds components into standalone FMUs, the same bytes for the same source.

What an FMU carries is a package whose name holds the digest of its content, and a script whose
name does too: Python modules are global to a process, so two builds must not share names.
"""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import sys
import tempfile
import zipfile
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from math import inf, isfinite
from pathlib import Path
from typing import Any, Unpack
from uuid import UUID, uuid5

from ..core.child import in_child
from ..core.files import fmus_folder, writing
from ..core.text import unknown
from ..errors import BuildError
from ..physics.drive import VOLTAGE
from ..physics.forms import split_form
from ..trust import require
from ..user_code.load import load_file, own_laws
from . import binary, catalogue, documentation
from .archive import DESCRIPTION, parse_xml, write_archive
from .component import SWITCH
from .description import Variable
from .slave import BAKED

PACKAGE = Path(__file__).resolve().parent.parent
_BUNDLED = (
    "errors.py", "units.py", "version.py", "physics/**/*.py", "component/**/*.py",
    "fmu/slave.py", "fmu/model_description.py", "fmu/binary.py", "fmu/component.py",
    "fmu/damper.py", "fmu/controller.py", "fmu/own_controller.py",
)  # fmt: skip
_EFFECTS = "physics/effects/"
CAPABILITIES = {
    "needsExecutionTool": True,  # a Python that the host brings
    "canHandleVariableCommunicationStepSize": True,
    "canGetAndSetFMUstate": True,
    "canSerializeFMUstate": True,
}
"""What an FMU that runs in Python says of itself, in pythonfmu's words."""
_NAMESPACE = UUID("7c0b8c8e-3d0f-5d0a-9b55-62726973746c")


@dataclass(frozen=True)
class BuildPlan:
    """Everything that decides an FMU's bytes.

    `name` is the model's name, `component` its source; `baked` goes into the FMU as JSON, `files`
    as resources; `effects` and `laws` are files of the user's own, bundled beside the library's.
    """

    name: str
    component: Path
    baked: Mapping[str, Any] = field(default_factory=dict)
    files: Mapping[str, Path] = field(default_factory=dict)
    effects: tuple[Path, ...] = ()
    laws: tuple[Path, ...] = ()

    def digest(self) -> str:
        """Return the digest of the content, 12 hexadecimal digits."""
        content = hashlib.sha256()
        for part in (_library_digest(), self.name, json.dumps(self.baked, sort_keys=True)):
            content.update(part.encode())
        named = [(self.component.name, self.component), *sorted(self.files.items())]
        own = (*sorted(self.effects), *sorted(self.laws))
        for name, path in [*named, *((path.name, path) for path in own)]:
            content.update(name.encode())
            content.update(path.read_bytes())
        return content.hexdigest()[:12]

    def guid(self) -> str:
        """Return the guid that follows from the content."""
        return str(uuid5(_NAMESPACE, self.digest()))

    def as_data(self) -> dict[str, Any]:
        """Return it as JSON has it, for another process."""
        return {
            "name": self.name, "component": str(self.component), "baked": dict(self.baked),
            "files": {name: str(path) for name, path in self.files.items()},
            "effects": [*map(str, self.effects)], "laws": [*map(str, self.laws)],
        }  # fmt: skip

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> BuildPlan:
        """Return the plan that `as_data` gave."""
        files = {name: Path(path) for name, path in data["files"].items()}
        effects, laws = (tuple(map(Path, data[key])) for key in ("effects", "laws"))
        return cls(data["name"], Path(data["component"]), data["baked"], files, effects, laws)


@cache
def library_files() -> tuple[tuple[str, Path], ...]:
    """Return name and path of each file of the library that an FMU carries."""
    paths = {path for pattern in _BUNDLED for path in PACKAGE.glob(pattern)}
    return tuple(sorted((path.relative_to(PACKAGE).as_posix(), path) for path in paths))


@cache
def _library_digest() -> str:
    import pythonfmu

    made_by = f"{pythonfmu.__version__} {sorted(CAPABILITIES.items())}"
    content = hashlib.sha256(made_by.encode())
    for name, path in library_files():
        content.update(name.encode())
        content.update(path.read_bytes())
    for path in documentation.sources():
        content.update(path.read_bytes())
    return content.hexdigest()


def plan(
    component: str,
    *,
    name: str | None = None,
    building: catalogue.BuildingData | None = None,
    record: Path | None = None,
    samples: Path | None = None,
    starts: Mapping[str, Any] | None = None,
    effects: Iterable[Path] = (),
    controller: Path | None = None,
    drive: str = VOLTAGE.name,
    step: float | None = None,
    offers: Iterable[str] | None = None,
    about: str = "",
    ranged: bool = False,
) -> BuildPlan:
    """Return what to build.

    Parameters
    ----------
    component : str
        A built-in component, or the Python file of one of the user's own, which is run.
    name : str, optional
        The model's name; else the component's.
    building : path, optional
        Building file, for a Structure.
    record : path, optional
        Ground motion in any format that `records` reads, for a GroundMotion.
    samples : path, optional
        Two-column CSV for a component that plays a signal: its parameter `file`.
    starts : mapping, optional
        Start values of parameters that differ from the component's.
    effects : iterable of path
        Files with effects of the user's own.
    controller : path, optional
        Controller file of a design, for a component that takes one of its kind.
    drive : str
        What commands a damper: one of `physics.drive.DRIVES`.
    step : float, optional
        Step [s] that the FMU asks for; else 2 ms.
    offers : iterable of str, optional
        Names of the effects that it offers besides those of `effects`; None: all of its site. A
        component without effects takes none.
    about : str
        What is known of how far a damper's model reaches, behind its description.
    ranged : bool
        Whether a damper has the output that tells whether it is within the range of its data; the
        range is among `starts`, else all is within.

    Raises
    ------
    BuildError, DesignError, PhysicsError, RecordError
        If a name or a file is wrong.
    """
    path = catalogue.source(component)
    kind = catalogue.component_class(path)
    chosen = kind.__name__ if name is None else name
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", chosen):
        raise BuildError(f'"{chosen}" is no model name: letters, digits and _ are right.')
    baked: dict[str, Any] = {"name": chosen}
    files = {Path(file).name: PACKAGE / file for file in getattr(kind, "files", ())}
    if building is not None:
        _only("Structure", component, "a building")
        baked["building"] = catalogue.read_building_data(building)
    if record is not None:
        _only("GroundMotion", component, "a record")
        from ..data import ground_motion_file

        found = ground_motion_file(str(record), Path.cwd())
        if f"{found}.csv" not in files:  # else it is in every GroundMotion
            stem = re.sub(r"[^A-Za-z0-9_]", "_", record.stem)
            files[f"{stem}.csv"] = Path(found)
            found = stem
        baked["record"] = found
    if samples is not None:
        baked["samples"] = re.sub(r"[^A-Za-z0-9_]", "_", samples.stem)
        files[f"{baked['samples']}.csv"] = samples
    if controller is not None:
        files[catalogue.design_file(component, kind, controller)] = controller
    effects = tuple(effects)
    if effects:
        catalogue.describe(component, building, effects=effects)  # refuses what is wrong with them
    if drive != VOLTAGE.name:
        baked["drive"] = drive
    if step is not None:
        baked["step"] = step
    if about:
        baked["about"] = about
    if ranged:
        baked["ranged"] = True
    if starts or offers is not None:
        described = catalogue.describe(
            component, building, effects=effects, drive=drive, ranged=ranged
        )
        known = described.variables
        if offers is not None:
            chosen_effects = _checked_offers(component, known, offers, effects)
            off = {key.removesuffix(SWITCH) for key in known if key.endswith(SWITCH)}
            if off:
                baked["effects"] = chosen_effects
            off -= {*chosen_effects}
            known = {key: one for key, one in known.items() if key.partition(".")[0] not in off}
        if starts:
            baked["starts"] = _checked_starts(component, known, starts)
    law = getattr(kind, "law", "")
    laws = tuple(file for name, file in own_laws().items() if name == split_form(law)[0])
    return BuildPlan(chosen, path, baked, files, effects, laws)


def _checked_offers(
    component: str, known: Iterable[str], offers: Iterable[str], own: Iterable[Path]
) -> list[str]:
    """Return the names of the effects that an FMU is to offer; BuildError for what none is."""
    there = [key.removesuffix(SWITCH) for key in known if key.endswith(SWITCH)]
    asked = {*offers, *(load_file(path).name for path in own)}
    for name in sorted(asked - {*there}):
        raise BuildError(f"{component}: {unknown('effect', name, there)}")
    return sorted(asked)


def _checked_starts(
    component: str, known: Mapping[str, Variable], starts: Mapping[str, Any]
) -> dict[str, Any]:
    """Return start values in the types of their variables; BuildError for what cannot be."""
    kinds = {"Real": (float, int), "Integer": (int,), "Boolean": (bool,), "String": (str,)}
    checked: dict[str, Any] = {}
    for key, value in starts.items():
        variable = known.get(key)
        if variable is None or variable.causality not in ("parameter", "input"):
            raise BuildError(f'{component} has no parameter "{key}".')
        where = f"{component}.{key} = {value!r}"
        if type(value) not in kinds[variable.kind]:
            raise BuildError(f"{where}: a value of the type {variable.kind} is right.")
        if variable.kind == "Real":
            value = float(value)
            low = -inf if variable.minimum is None else variable.minimum
            high = inf if variable.maximum is None else variable.maximum
            if not (isfinite(value) and low <= value <= high):
                raise BuildError(f"{where}: a finite number in [{low!r}, {high!r}] is right.")
        checked[key] = value
    return checked


def _only(right: str, component: str, what: str) -> None:
    if component != right:
        raise BuildError(f"{what} goes into {right}, not into {component}.")


def build(what: BuildPlan, folder: Path) -> Path:
    """Build an FMU into a folder, unless the same one stands there; return its path.

    Raises
    ------
    BuildError
        If the folder cannot be written or pythonfmu fails.
    """
    from filelock import FileLock

    target = folder / f"{what.name}.fmu"
    guid = what.guid()
    if built_guid(target) == guid:
        return target
    with writing(target, BuildError):
        folder.mkdir(parents=True, exist_ok=True)
        with FileLock(folder / ".lock"):
            if built_guid(target) != guid:
                make = _build_here if _pythonfmu_is_whole() else _build_elsewhere
                make(what, guid, target)
    return target


def _pythonfmu_is_whole() -> bool:
    """Return whether pythonfmu is the installed one, with binaries.

    An FMU that this process loaded before may have put its own copy, without them, in its place.
    """
    import pythonfmu

    return (Path(pythonfmu.__file__).parent / "resources" / "binaries").is_dir()


def _build_elsewhere(what: BuildPlan, guid: str, target: Path) -> None:
    """Build in a fresh interpreter, where no FMU was loaded."""
    order = {"plan": what.as_data(), "guid": guid, "target": str(target)}
    child = in_child("from bristle.fmu.build import _serve; _serve()", order)
    if child.returncode != 0:
        raise BuildError(f"{what.component}: cannot be built: {child.stderr.strip()[-500:]}")


def _serve() -> None:
    """Build what stands on the standard input; the other end of `_build_elsewhere`."""
    order = json.load(sys.stdin)
    _build_here(BuildPlan.from_data(order["plan"]), order["guid"], Path(order["target"]))


def _build_here(what: BuildPlan, guid: str, target: Path) -> None:
    with tempfile.TemporaryDirectory(prefix="bristle_build_") as temporary:
        _pack(_build_loose(what, guid, Path(temporary)), target, what)


def built_guid(path: Path) -> str | None:
    """Return the guid of an FMU file, FMI 3.0's token; None where there is no readable one."""
    try:
        with zipfile.ZipFile(path) as archive, archive.open("modelDescription.xml") as file:
            found = re.search(rb'(?:guid|instantiationToken)="([^"]*)"', file.read(4096))
    except (OSError, KeyError, zipfile.BadZipFile, zlib.error):
        return None
    return found.group(1).decode() if found else None


def _write_own(path: Path, folder: Path, package: str) -> None:
    """Copy a user's file into a package, if it may run: pythonfmu runs it."""
    text = path.read_text(encoding="utf-8-sig")
    require(path, text)
    _write_renamed(text, folder / path.name, package)


def _build_loose(what: BuildPlan, guid: str, folder: Path) -> Path:
    """Lay the sources out, let pythonfmu build; return its FMU, still with times in it."""
    from pythonfmu.builder import FmuBuilder

    digest = what.digest()
    package = folder / f"bristle_{digest}"
    offered = what.baked.get("effects")
    for name, path in library_files():
        left_out = offered is not None and path.stem not in (*offered, "__init__")
        if left_out and name.startswith(_EFFECTS):
            continue
        target = package / name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, target)
    for inner in (package, package / "fmu"):
        (inner / "__init__.py").write_text("", encoding="utf-8")
    for path in what.effects:
        _write_own(path, package / "physics" / "effects", package.name)
    for path in what.laws:
        _write_own(path, package / "physics" / "laws", package.name)
    script = folder / f"{what.component.stem}_{digest}.py"
    _write_renamed(what.component.read_text(encoding="utf-8"), script, package.name)
    baked = json.dumps({**what.baked, "guid": guid}, sort_keys=True)
    (folder / BAKED).write_text(baked, encoding="utf-8")
    extra = [folder / BAKED]
    for name, path in what.files.items():
        extra.append(Path(shutil.copyfile(path, folder / name)))
    carried, out = {package, *extra}, folder / "out"
    binary.LOCK.acquire()  # building imports the component
    before = list(sys.path)
    try:
        return Path(FmuBuilder.build_FMU(script, dest=out, project_files=carried, **CAPABILITIES))
    except OSError:
        raise
    except Exception as error:  # whatever a component or an effect of the user's raises at import
        raise BuildError(
            f"{what.component}: cannot be built: {type(error).__name__}: {error}"
        ) from error
    finally:
        sys.path[:] = before
        binary.forget(lambda name, _: digest in name)
        binary.LOCK.release()


def _write_renamed(text: str, target: Path, package: str) -> None:
    """Write a Python file; what it imports from bristle it imports from the bundled package."""
    text = re.sub(r"^(\s*)from bristle\.", rf"\1from {package}.", text, flags=re.MULTILINE)
    target.write_text(text, encoding="utf-8")


def _pack(loose: Path, target: Path, what: BuildPlan) -> None:
    """Write the FMU again with what people see, in order, without times; rename it into place."""
    with zipfile.ZipFile(loose) as old:
        members = {name: old.read(name) for name in old.namelist()}
    if not any(name.startswith("binaries/") for name in members):
        raise BuildError(f"{target}: the installed pythonfmu holds no binaries.")
    root = parse_xml(members[DESCRIPTION], str(target))
    write_archive(target, {**members, **documentation.members(root, what)})


def ensure(component: str, **made: Unpack[catalogue.Made]) -> Path:
    """Return a built-in component's FMU, built on first use and reused while its digest holds.

    One that is made from a building, a controller file or effects is named by their content.

    Raises
    ------
    BuildError, DesignError, PhysicsError
        If a name or a file is wrong, or the FMU cannot be built.
    """
    return build(planned(component, **made), fmus_folder())


def planned(component: str, **made: Unpack[catalogue.Made]) -> BuildPlan:
    """Return the plan of what `ensure` builds; what is raised is the same too."""
    what = plan(component, **made)
    building, controller = made.get("building"), made.get("controller")
    own = (*made.get("effects", ()), *what.laws)
    ranged = made.get("ranged", False)
    if building is None and controller is None and not own and not ranged:
        return what
    named = hashlib.sha256(b"ranged" if ranged else b"")
    if building is not None:
        named.update(json.dumps(catalogue.read_building_data(building), sort_keys=True).encode())
    if controller is not None:
        named.update(controller.read_bytes())
    for path in own:
        named.update(path.name.encode() + path.read_bytes())
    name = f"{what.name}_{named.hexdigest()[:8]}"
    return replace(what, name=name, baked={**what.baked, "name": name})
