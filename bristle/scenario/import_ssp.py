"""An SSP package as a scenario with its FMUs beside it."""

from __future__ import annotations

import hashlib
import json
import math
import re
import shutil
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from .. import resources
from ..core.toml_write import toml_key, toml_value
from ..errors import FmuError, ScenarioError
from ..fmu.description import Description, Value, Variable, read_description, read_root
from ..ssp.conversion import SAME, convert
from ..ssp.flatten import FlatConnection, FlatSystem, flatten_system
from ..ssp.flatten import Path as Names
from ..ssp.package import Package, open_package
from ..ssp.structure import Structure, read_structure
from ..units import Measure
from .checks import NAME, RESERVED, STEP_TOLERANCE
from .parts import ALGORITHMS

FORM = 2
"""Version of what is written: another one unpacks packages anew."""
USUAL_STOP = 1.0
"""Stop [s] where neither the package nor its FMUs name one."""
USUAL_STEPS = 1000
"""Steps until then where none of them names a step."""
DIGITS = 24
"""Of a digest, in the name of a folder: 96 bits, no two packages share them."""
_NOTES = "notes.json"
"""Beside an unpacked scenario in the cache."""
_START: dict[str, Value] = {
    "Real": 0.0, "Integer": 0, "Enumeration": 0, "Boolean": False, "String": "",
}  # fmt: skip


class Note(NamedTuple):
    """What was taken to be or left aside; `key` is that of [run] which it is about, or ""."""

    text: str
    key: str = ""


@dataclass(frozen=True)
class ImportedPackage:
    """The scenario, its FMUs, and what was taken to be or left aside."""

    scenario: Path
    fmus: tuple[Path, ...]
    notes: tuple[Note, ...]


def import_ssp(package: Path, folder: Path) -> ImportedPackage:
    """Write the scenario that an SSP package is, and its FMUs beside it.

    Nothing is written unless all of it can be read, and nothing outside the folder.

    Parameters
    ----------
    package : Path
        FILE.ssp, of SSP 1.0 or 2.0.
    folder : Path
        Where NAME.toml and the FMUs go; made if it is not there.

    Raises
    ------
    ScenarioError
        If the package is wrong or holds what is not read, with file and element; if a file of the
        same name stands in the folder or it cannot be written.
    """
    with tempfile.TemporaryDirectory(prefix="bristle_ssp_") as temporary:
        made = _unpack(package, Path(temporary))
        files = [made.scenario, *made.fmus]
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for file in files:
                if (folder / file.name).exists():
                    raise ScenarioError(f"{folder / file.name}: is there already.")
            for file in files:
                shutil.copyfile(file, folder / file.name)
        except OSError as error:
            text = f"cannot be written ({error.strerror or error})."
            raise ScenarioError(f"{error.filename or folder}: {text}") from None
    fmus = tuple(folder / file.name for file in made.fmus)
    return ImportedPackage(folder / made.scenario.name, fmus, made.notes)


def unpacked(package: Path) -> ImportedPackage:
    """Return an SSP package as it is unpacked in the cache, which is done where it is not yet.

    Raises
    ------
    ScenarioError
        As `import_ssp`.
    """
    try:
        content = hashlib.sha256(f"{FORM} {package.stem}".encode() + package.read_bytes())
    except OSError as error:
        text = f"cannot be read: {error.strerror or error}."
        raise ScenarioError(f"{package}: {text}") from None
    folder = resources.cache_folder() / "ssp" / content.hexdigest()[:DIGITS]
    if not folder.is_dir():
        try:
            folder.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".new-") as temporary:
                inner = Path(temporary) / "package"
                inner.mkdir()
                made = _unpack(package, inner)
                (inner / _NOTES).write_text(json.dumps(made.notes), encoding="utf-8")
                if not folder.is_dir():  # another process may have been faster
                    inner.replace(folder)
        except OSError as error:
            text = f"cannot be written ({error.strerror or error})."
            raise ScenarioError(f"{folder}: {text}") from None
    notes = json.loads((folder / _NOTES).read_text(encoding="utf-8"))
    return ImportedPackage(
        next(folder.glob("*.toml")),
        tuple(folder.glob("*.fmu")),
        tuple(Note(text, key) for text, key in notes),
    )


def _unpack(path: Path, folder: Path) -> ImportedPackage:
    with open_package(path) as package:
        structure = read_structure(package)
        fmus = _Fmus(package, folder)
        flat = flatten_system(structure, package, fmus.describe)
        notes = [Note(text) for text in package.notes]
    stop, step = _times(structure, fmus.files.values(), notes)
    algorithm = structure.algorithm or ALGORITHMS[0]
    if algorithm not in ALGORITHMS:
        text = f'There is no algorithm "{algorithm}": {ALGORITHMS[0]} is taken.'
        notes.append(Note(text, "algorithm"))
        algorithm = ALGORITHMS[0]
    lines = [
        "schema = 1",
        f"title = {toml_value(structure.name or path.stem)}",
        "",
        "[run]",
        f"stop = {toml_value(stop)}",
        f"step = {toml_value(step)}",
        f"algorithm = {toml_value(algorithm)}",
    ]
    lines += _components(flat, fmus, notes)
    scenario = folder / f"{path.stem}.toml"
    heads = [f"# {note}" for note in (f"From {path.name}.", *(note.text for note in notes))]
    scenario.write_text("\n".join([*heads, "", *lines]) + "\n", encoding="utf-8")
    return ImportedPackage(scenario, tuple(dict.fromkeys(fmus.files.values())), tuple(notes))


class _Fmus:
    """The FMUs of a package, each unpacked once when it is first asked for."""

    def __init__(self, package: Package, folder: Path) -> None:
        self.package, self.folder = package, folder
        self.files: dict[str, Path] = {}
        self._descriptions: dict[str, Description] = {}

    def describe(self, member: str, where: str) -> Description:
        """Return what an FMU says of itself; ScenarioError names the component that needs it."""
        if member not in self.files:
            file = self.folder / self._name(member)
            file.write_bytes(self.package.read(member))
            try:
                self._descriptions[member] = read_description(file)
            except FmuError as error:
                text = str(error).replace(str(file), member)
                raise self.package.error(where, text) from None
            self.files[member] = file
        return self._descriptions[member]

    def _name(self, member: str) -> str:
        stem = re.sub(r"[^\w.-]", "_", PurePosixPath(member).stem).strip(".") or "component"
        taken = {file.name.lower() for file in self.files.values()}
        return _unique(f"{stem}.fmu", taken, lambda n: f"{stem}_{n}.fmu")


def _unique(name: str, taken: Iterable[str], other: Callable[[int], str]) -> str:
    count = 1
    while name.lower() in taken:
        count += 1
        name = other(count)
    return name


def _components(flat: FlatSystem, fmus: _Fmus, notes: list[Note]) -> list[str]:
    """Return the lines of the components and of their connections."""
    names = _names(flat)
    fed = {connection.target for connection in flat.connections}
    lines = []
    for path, member in flat.components.items():
        lines += ["", f"[components.{toml_key(names[path])}]"]
        lines.append(f"fmu = {toml_value(fmus.files[member].name)}")
        variables = flat.descriptions[path].variables
        values = {
            name: _typed(variables[name], value)
            for (where, name), value in flat.values.items()
            if where == path
        }
        for variable in flat.descriptions[path].of("input"):
            bare = (path, variable.name) not in fed and variable.name not in values
            if bare and not variable.optional:
                start = variable.start
                if start is None:
                    start = next(iter(variable.items.values()), _START[variable.kind])
                    port = ".".join((*path, variable.name))
                    text = f'The input "{port}" has neither source nor start value: '
                    notes.append(Note(f"{text}{toml_value(start)} is taken."))
                values[variable.name] = start
        if values:
            pairs = [f"{toml_key(name)} = {toml_value(value)}" for name, value in values.items()]
            lines.append(f"parameters = {{ {', '.join(pairs)} }}")
    lines += ["", "[connections]"]
    return lines + [_connection(one, flat, names) for one in flat.connections]


def _connection(one: FlatConnection, flat: FlatSystem, names: dict[Names, str]) -> str:
    ends = (one.target, one.source)
    target, source = (toml_value(f"{names[path]}.{port}") for path, port in ends)
    wanted, given = (flat.descriptions[path].variables[port].measure for path, port in ends)
    if one.change == SAME and _are_one(given, wanted):
        return f"{target} = {source}"
    factor, offset = (toml_value(float(number)) for number in one.change)
    return f"{target} = {{ from = {source}, factor = {factor}, offset = {offset} }}"


def _are_one(given: Measure | None, wanted: Measure | None) -> bool:
    """Return whether the FMUs' own units call for no change, so that a check has nothing to say."""
    try:
        return convert(given, wanted) == SAME
    except ScenarioError:
        return False


def _names(flat: FlatSystem) -> dict[Names, str]:
    """Return a name that a scenario can have for each component: "SuT.motor" is SuT_motor."""
    found: dict[Names, str] = {}
    for path in flat.components:
        name = re.sub(r"[^\w-]", "_", "_".join(path))
        if not NAME.fullmatch(name) or name in RESERVED:
            name = f"c_{name}"
        base = name
        taken = {other.lower() for other in found.values()}
        found[path] = _unique(name, taken, lambda n, base=base: f"{base}_{n}")  # type: ignore[misc]
    return found


def _typed(variable: Variable, value: Value) -> Value:
    """Return a value in the type of its variable where that loses nothing."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if variable.kind == "Real" and number:
        return float(value)
    if variable.kind in ("Integer", "Enumeration") and number and float(value).is_integer():
        return int(value)
    return value


def _times(structure: Structure, fmus: Iterable[Path], notes: list[Note]) -> tuple[float, float]:
    """Return stop and step [s]: the package's, else what its FMUs say, else the usual ones."""
    stop, step = structure.stop, structure.step
    if stop is None or step is None:
        told = [read_root(file, any_platform=True).find("DefaultExperiment") for file in fmus]
        stops, steps = (
            [_positive(e.get(key)) for e in told if e is not None]
            for key in ("stopTime", "stepSize")
        )
        if stop is None:
            stop = max(filter(None, stops), default=USUAL_STOP)
            notes.append(Note(f"The package names no stop: {stop:g} s is taken.", "stop"))
        if step is None:
            step = min(filter(None, steps), default=stop / USUAL_STEPS)
            notes.append(Note(f"The package names no step: {step:g} s is taken.", "step"))
    if not 0.0 < step <= stop:
        raise ScenarioError(f"stop = {stop:g} s, step = {step:g} s: 0 < step <= stop is right.")
    count = stop / step
    if abs(count - round(count)) > STEP_TOLERANCE:
        step = stop / math.ceil(count)
        text = f"The stop is no whole number of steps: a step of {step:g} s is taken."
        notes.append(Note(text, "step"))
    return stop, step


def _positive(text: str | None) -> float | None:
    try:
        value = float(text or "")
    except ValueError:
        return None
    return value if math.isfinite(value) and value > 0.0 else None
