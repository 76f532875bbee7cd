"""Systems within systems as components side by side: connections followed, values resolved."""

from __future__ import annotations

import hashlib
import json
import math
import re
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from ..core import files
from ..core.finding import Finding
from ..core.text import listed
from ..core.toml_lines import toml_value
from ..errors import FmuError, ScenarioError, UnitError
from ..fmu.description import Description, Value, Variable, passes, read_description, read_root
from ..units import Measure
from .model import ALGORITHMS
from .ssp_read import (
    SAME,
    Block,
    BoundValue,
    Change,
    Joint,
    Package,
    SystemStructure,
    after,
    convert,
    open_package,
    read_structure,
)
from .toml import NAME, RESERVED, STEP_TOLERANCE, tables_text

Names = tuple[str, ...]
Port = tuple[Names, str]
"""An element by the names that lead to it, and a connector of it."""

_GIVES = ("output", "calculatedParameter")


@dataclass(frozen=True)
class FlatConnection:
    """Ports of two components: the target gets factor source + offset."""

    source: Port
    target: Port
    change: Change


@dataclass(frozen=True)
class FlatSystem:
    """Components by the names that lead to them, with their FMU, connections and values."""

    components: dict[Names, str]
    descriptions: dict[Names, Description]
    connections: tuple[FlatConnection, ...]
    values: dict[Port, Value]


class _Flattener:
    """Puts the components of a structure side by side.

    Parameters
    ----------
    structure : SystemStructure
    package : Package
        For messages; its notes take what is left aside.
    describe : callable
        (member, where) -> description of an FMU.

    Raises
    ------
    ScenarioError
        If nothing can be run, or a connection or value is wrong: with file and element.
    """

    def __init__(
        self,
        structure: SystemStructure,
        package: Package,
        describe: Callable[[str, str], Description],
    ) -> None:
        self.package = package
        # Everything of a system by where it stands.
        self.blocks = dict(_walk(structure.system, ()))
        self.feeding: dict[Port, list[tuple[Port, Joint]]] = {}
        self.given: dict[Port, BoundValue] = {}
        self.fmus = {path: b.source for path, b in self.blocks.items() if b.source}
        if not self.fmus:
            raise package.error(
                structure.system.where, "has no component with an FMU: there is nothing to run."
            )
        self.descriptions = {
            path: describe(source, self.blocks[path].where) for path, source in self.fmus.items()
        }
        self._check_connectors()

    def flat(self) -> FlatSystem:
        # Inner elements first: the values of outer ones win.
        for path, block in sorted(self.blocks.items(), key=lambda e: -len(e[0])):
            for joint in block.joints:
                self._join(path, joint)
            for given in block.values:
                self._give(path, given)
        self._note_unused()
        connections, values = [], {}
        for path, description in self.descriptions.items():
            for name, variable in description.variables.items():
                if variable.causality not in ("input", "parameter"):
                    continue
                target = path, name
                source, change = self._source(target)
                if source != target and source[0] in self.fmus:
                    self._check_types(source, target, change)
                    connections.append(FlatConnection(source, target, change))
                    continue
                value = self._value(source, change)
                if value is None and source != target:
                    value = self._value(target, SAME)
                if value is not None:
                    values[target] = self._item(variable, value, (source, target))
        return FlatSystem(self.fmus, self.descriptions, tuple(connections), values)

    def _note_unused(self) -> None:
        for (path, name), given in self.given.items():
            if path in self.fmus:
                causality = self.descriptions[path].variables[name].causality
                if causality not in ("input", "parameter"):
                    text = f'"{name}" is {causality}, which takes no value: left aside.'
                    self.package.note(given.where, text)

    def _check_connectors(self) -> None:
        for path in self.fmus:
            block, variables = self.blocks[path], self.descriptions[path].variables
            for name, connector in block.connectors.items():
                if name not in variables:
                    text = f'has the connector "{name}", which its FMU {block.source} lacks.'
                    raise self.package.error(block.where, text)
                own = variables[name]
                for told, right in ((connector.kind, own.causality), (connector.type, own.kind)):
                    if told not in ("", right) and {told, right} != {"inout", "input"}:
                        text = f'calls the connector "{name}" {told}; in its FMU it is {right}.'
                        self.package.note(block.where, text)
                if connector.unit is not None:
                    self._compare_units(block.where, name, connector.unit, own.measure)

    def _compare_units(self, where: str, name: str, told: Measure, own: Measure | None) -> None:
        """Say where the package names another unit than the FMU: by SSP the package decides."""
        told = _meant(told, own)
        if own is None or own.unit is None or told.unit is None:
            return
        try:
            same = own.change_to(told) == SAME
        except UnitError:
            same = False
        if not same:
            text = f'the connector "{name}" is in {told.shown}, in its FMU in {own.shown}: '
            self.package.note(where, f"{text}taken as {told.shown}.")

    def _check_types(self, source: Port, target: Port, change: Change) -> None:
        """Refuse a connection whose values cannot be passed on."""
        where = self.feeding[target][0][1].where
        given, wanted = (
            self.descriptions[path].variables[name].kind for path, name in (source, target)
        )
        ends = f'"{_shown(source)}" is {given} and "{_shown(target)}" is {wanted}'
        if given == wanted == "String":
            text = f"{ends}: texts are set as parameters, only numbers and Booleans are passed on."
            raise self.package.error(where, text)
        if not passes(given, wanted):
            raise self.package.error(where, f"{ends}; both must be alike.")
        if change != SAME and wanted != "Real":
            text = f'"{_shown(target)}" is {wanted}: only Real has a factor and an offset.'
            raise self.package.error(where, text)
        port = self.feeding[target][0][0]
        while port != source:
            kind = self.blocks[port[0]].connectors[port[1]].type
            if kind and not (passes(given, kind) and passes(kind, wanted)):
                text = f'{ends}, and "{_shown(port)}" between them is {kind}: '
                self.package.note(where, f"{text}values are passed on as they are.")
            port = self.feeding[port][0][0]

    def _kind(self, port: Port, where: str) -> str:
        """Return the kind of a connector: an FMU knows better than what is written of it."""
        path, name = port
        if path in self.fmus:
            variable = self.descriptions[path].variables.get(name)
            if variable is None:
                text = f'the FMU {self.fmus[path]} of "{".".join(path)}" has no variable "{name}".'
                raise self.package.error(where, text)
            return variable.causality
        connector = self.blocks[path].connectors.get(name)
        if connector is None:
            shown = f'the system "{".".join(path)}"' if path else "the system"
            raise self.package.error(where, f'{shown} has no connector "{name}".')
        return connector.kind

    def _join(self, path: Names, joint: Joint) -> None:
        """Note a connection by what it feeds; one that is written backwards is turned round."""
        ends = []
        for element, connector in (joint.start, joint.end):
            port = ((*path, element) if element else path), connector
            kind = self._kind(port, joint.where)
            if kind == "inout":
                text = f'"{connector}" is an inout connector, which is not read.'
                raise self.package.error(joint.where, text)
            # An input of the system gives to what is inside it.
            ends.append((port, (kind in _GIVES) == bool(element)))
        (start, gives), (end, also) = ends
        if gives == also:
            text = "connects two that give a value" if gives else "connects two that take a value"
            raise self.package.error(joint.where, f"{text}; one of each is right.")
        source, target = (start, end) if gives else (end, start)
        others = self.feeding.setdefault(target, [])
        others.append((source, joint))
        if len(others) > 1:
            first = others[0][1].where.rpartition(" <")[2]
            text = f'"{_shown(target)}" is fed twice, first by <{first}; one is right.'
            raise self.package.error(joint.where, text)

    def _give(self, path: Names, given: BoundValue) -> None:
        target = self._named(path, given.name)
        if target is None:
            self.package.note(given.where, f'nothing is called "{given.name}": left aside.')
        else:
            self.given[target] = given

    def _named(self, path: Names, name: str) -> Port | None:
        """Return what a hierarchical name means seen from an element, None where nothing has it."""
        block = self.blocks[path]
        if path in self.fmus:
            return (path, name) if name in self.descriptions[path].variables else None
        if name in block.connectors:
            return path, name
        for element in block.elements:
            if name.startswith(f"{element}."):
                found = self._named((*path, element), name.removeprefix(f"{element}."))
                if found is not None:
                    return found
        return None

    def _source(self, target: Port) -> tuple[Port, Change]:
        """Follow connections back to where a value comes from, and return how it changes."""
        port, change = target, SAME
        seen = {target}
        while port in self.feeding:
            source, joint = self.feeding[port][0]
            if source in seen:
                text = f'the connections of "{_shown(target)}" lead round in a circle.'
                raise self.package.error(joint.where, text)
            seen.add(source)
            step = joint.change
            if joint.converts:
                step = after(
                    self._converted(self._unit(source), self._unit(port), joint.where), step
                )
            port, change = source, after(step, change)
        return port, change

    def _converted(self, given: Measure | None, wanted: Measure | None, where: str) -> Change:
        try:
            return convert(given, wanted)
        except ScenarioError as error:
            raise self.package.error(where, str(error)) from None

    def _unit(self, port: Port) -> Measure | None:
        path, name = port
        block = self.blocks[path]
        own = None
        if path in self.fmus and name in self.descriptions[path].variables:
            own = self.descriptions[path].variables[name].measure
        connector = block.connectors.get(name)
        if connector is None or connector.unit is None:
            return own
        return _meant(connector.unit, own)

    def _value(self, port: Port, change: Change) -> Value | None:
        """Return the value given at a port as it arrives behind a change."""
        given = self.given.get(port)
        if given is None:
            return None
        value = given.value
        own = SAME
        if given.converts:
            wanted = self._unit(port)
            told = given.unit and _meant(given.unit, wanted)
            own = self._converted(told, wanted, given.where)
        factor, offset = after(after(own, given.change), change)
        if (factor, offset) == SAME:
            return value
        if isinstance(value, bool | str):
            raise self.package.error(given.where, "only a number has a unit or a transformation.")
        return factor * value + offset

    def _item(self, variable: Variable, value: Value, ports: tuple[Port, Port]) -> Value:
        """Return a value as an FMU takes it: the number of an item that is given by its name."""
        if variable.kind != "Enumeration" or not isinstance(value, str):
            return value
        if value not in variable.items:
            where = next(self.given[port].where for port in ports if port in self.given)
            right = listed(f"{name} = {number}" for name, number in variable.items.items())
            raise self.package.error(where, f'"{value}" is no item; {right} are right.')
        return variable.items[value]


def _meant(told: Measure, own: Measure | None) -> Measure:
    """Return a unit that a package names; where it does not define the name, the FMU's counts."""
    undefined = told.defined is None and own is not None and own.name == told.name
    return own if undefined and own is not None else told


def _walk(block: Block, path: Names) -> Iterator[tuple[Names, Block]]:
    yield path, block
    for name, inner in block.elements.items():
        yield from _walk(inner, (*path, name))


def _shown(port: Port) -> str:
    return ".".join((*port[0], port[1]))


# An SSP package as a scenario with its FMUs beside it.

FORM = 4
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


@dataclass(frozen=True)
class ImportedPackage:
    """The scenario, its FMUs, and what was taken to be or left aside.

    The kind of a note is the key of [run] that it is about, else "import".
    """

    scenario: Path
    fmus: tuple[Path, ...]
    notes: tuple[Finding, ...]


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
    made = unpacked(package)
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
        text = f"cannot be read: {(error.strerror or str(error)).lower()}."
        raise ScenarioError(f"{package}: {text}") from None
    folder = files.cache_folder() / "ssp" / content.hexdigest()[:DIGITS]
    if not folder.is_dir():
        try:
            folder.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".new-") as temporary:
                inner = Path(temporary) / "package"
                inner.mkdir()
                made = _unpack(package, inner)
                notes = [(note.text, note.kind) for note in made.notes]
                kept = {"fmus": [file.name for file in made.fmus], "notes": notes}
                (inner / _NOTES).write_text(json.dumps(kept), encoding="utf-8")
                if not folder.is_dir():  # another process may have been faster
                    inner.replace(folder)
        except OSError as error:
            text = f"cannot be written ({error.strerror or error})."
            raise ScenarioError(f"{folder}: {text}") from None
    kept = json.loads((folder / _NOTES).read_text(encoding="utf-8"))
    return ImportedPackage(
        next(folder.glob("*.toml")),
        tuple(folder / name for name in kept["fmus"]),
        tuple(Finding(kind, "note", text) for text, kind in kept["notes"]),
    )


def _unpack(path: Path, folder: Path) -> ImportedPackage:
    with open_package(path) as package:
        structure = read_structure(package)
        fmus = _Fmus(package, folder)
        flat = _Flattener(structure, package, fmus.describe).flat()
        notes = [Finding("import", "note", text) for text in package.notes]
    stop, step = _times(structure, fmus.files.values(), notes)
    algorithm = structure.algorithm or ALGORITHMS[0]
    if algorithm not in ALGORITHMS:
        text = f'There is no algorithm "{algorithm}": {ALGORITHMS[0]} is taken.'
        notes.append(Finding("algorithm", "note", text))
        algorithm = ALGORITHMS[0]
    run = {"stop": stop, "step": step, "algorithm": algorithm}
    names = _names(flat)
    parts = _components(flat, fmus, names, notes)
    wires = dict(_connection(one, flat, names) for one in flat.connections)
    text = tables_text(structure.name or path.stem, run, parts, wires)
    scenario = folder / f"{path.stem}.toml"
    heads = [f"# {note}" for note in (f"From {path.name}.", *(note.text for note in notes))]
    scenario.write_text("\n".join([*heads, "", text]), encoding="utf-8")
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


def _components(
    flat: FlatSystem, fmus: _Fmus, names: Mapping[Names, str], notes: list[Finding]
) -> dict[str, dict[str, Any]]:
    """Return the tables of the components."""
    fed = {connection.target for connection in flat.connections}
    parts: dict[str, dict[str, Any]] = {}
    for path, member in flat.components.items():
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
                    notes.append(Finding("import", "note", f"{text}{toml_value(start)} is taken."))
                values[variable.name] = start
        given = {"parameters": values} if values else {}
        parts[names[path]] = {"fmu": fmus.files[member].name, **given}
    return parts


def _connection(
    one: FlatConnection, flat: FlatSystem, names: Mapping[Names, str]
) -> tuple[str, Any]:
    """Return a connection as a key and its value."""
    ends = (one.target, one.source)
    target, source = (f"{names[path]}.{port}" for path, port in ends)
    wanted, given = (flat.descriptions[path].variables[port].measure for path, port in ends)
    if one.change == SAME and _are_one(given, wanted):
        return target, source
    factor, offset = map(float, one.change)
    return target, {"from": source, "factor": factor, "offset": offset}


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


def _times(
    structure: SystemStructure, fmus: Iterable[Path], notes: list[Finding]
) -> tuple[float, float]:
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
            notes.append(
                Finding("stop", "note", f"The package names no stop: {stop:g} s is taken.")
            )
        if step is None:
            able = (one for one in steps if one is not None and one <= stop)
            step = min(able, default=stop / USUAL_STEPS)
            notes.append(
                Finding("step", "note", f"The package names no step: {step:g} s is taken.")
            )
    if not 0.0 < step <= stop:
        raise ScenarioError(f"stop = {stop:g} s, step = {step:g} s: 0 < step <= stop is right.")
    count = stop / step
    if abs(count - round(count)) > STEP_TOLERANCE:
        step = stop / math.ceil(count)
        text = f"The stop is no whole number of steps: a step of {step:g} s is taken."
        notes.append(Finding("step", "note", text))
    return stop, step


def _positive(text: str | None) -> float | None:
    try:
        value = float(text or "")
    except ValueError:
        return None
    return value if math.isfinite(value) and value > 0.0 else None
