"""Systems within systems as components side by side: connections followed, values resolved."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from ..errors import ScenarioError, UnitError
from ..findings import listed
from ..fmu.description import Description, Value, Variable
from ..fmu.variables import passes
from ..units import Measure
from .conversion import SAME, Change, after, convert
from .package import Package
from .structure import Block, Joint, Structure
from .values import Given

Path = tuple[str, ...]
Port = tuple[Path, str]
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

    components: dict[Path, str]
    descriptions: dict[Path, Description]
    connections: tuple[FlatConnection, ...]
    values: dict[Port, Value]


@dataclass
class _Network:
    """Everything of a system by where it stands."""

    blocks: dict[Path, Block] = field(default_factory=dict)
    feeding: dict[Port, list[tuple[Port, Joint]]] = field(default_factory=dict)
    given: dict[Port, Given] = field(default_factory=dict)


def flatten_system(
    structure: Structure, package: Package, describe: Callable[[str, str], Description]
) -> FlatSystem:
    """Return a structure as components side by side.

    Parameters
    ----------
    structure : Structure
    package : Package
        For messages; its notes take what is left aside.
    describe : callable
        (member, where) -> description of an FMU.

    Raises
    ------
    ScenarioError
        If nothing can be run, or a connection or value is wrong: with file and element.
    """
    return _Flattener(structure, package, describe).flat()


class _Flattener:
    def __init__(
        self,
        structure: Structure,
        package: Package,
        describe: Callable[[str, str], Description],
    ) -> None:
        self.package = package
        self.net = _Network()
        self.net.blocks.update(_walk(structure.system, ()))
        self.fmus = {path: b.source for path, b in self.net.blocks.items() if b.source}
        if not self.fmus:
            raise package.error(
                structure.system.where, "has no component with an FMU: there is nothing to run."
            )
        self.descriptions = {
            path: describe(source, self.net.blocks[path].where)
            for path, source in self.fmus.items()
        }
        self._check_connectors()

    def flat(self) -> FlatSystem:
        # Inner elements first: the values of outer ones win.
        for path, block in sorted(self.net.blocks.items(), key=lambda e: -len(e[0])):
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
        for (path, name), given in self.net.given.items():
            if path in self.fmus:
                causality = self.descriptions[path].variables[name].causality
                if causality not in ("input", "parameter"):
                    text = f'"{name}" is {causality}, which takes no value: left aside.'
                    self.package.note(given.where, text)

    def _check_connectors(self) -> None:
        for path in self.fmus:
            block, variables = self.net.blocks[path], self.descriptions[path].variables
            for name, connector in block.connectors.items():
                if name not in variables:
                    text = f'has the connector "{name}", which its FMU {block.source} lacks.'
                    raise self.package.error(block.where, text)
                if connector.unit is not None:
                    self._compare_units(block.where, name, connector.unit, variables[name].measure)

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
        where = self.net.feeding[target][0][1].where
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
        port = self.net.feeding[target][0][0]
        while port != source:
            kind = self.net.blocks[port[0]].connectors[port[1]].type
            if kind and not (passes(given, kind) and passes(kind, wanted)):
                text = f'{ends}, and "{_shown(port)}" between them is {kind}: '
                self.package.note(where, f"{text}values are passed on as they are.")
            port = self.net.feeding[port][0][0]

    def _kind(self, port: Port, where: str) -> str:
        """Return the kind of a connector: an FMU knows better than what is written of it."""
        path, name = port
        if path in self.fmus:
            variable = self.descriptions[path].variables.get(name)
            if variable is None:
                text = f'the FMU {self.fmus[path]} of "{".".join(path)}" has no variable "{name}".'
                raise self.package.error(where, text)
            return variable.causality
        connector = self.net.blocks[path].connectors.get(name)
        if connector is None:
            shown = f'the system "{".".join(path)}"' if path else "the system"
            raise self.package.error(where, f'{shown} has no connector "{name}".')
        return connector.kind

    def _join(self, path: Path, joint: Joint) -> None:
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
        others = self.net.feeding.setdefault(target, [])
        others.append((source, joint))
        if len(others) > 1:
            first = others[0][1].where.rpartition(" <")[2]
            text = f'"{_shown(target)}" is fed twice, first by <{first}; one is right.'
            raise self.package.error(joint.where, text)

    def _give(self, path: Path, given: Given) -> None:
        target = self._named(path, given.name)
        if target is None:
            self.package.note(given.where, f'nothing is called "{given.name}": left aside.')
        else:
            self.net.given[target] = given

    def _named(self, path: Path, name: str) -> Port | None:
        """Return what a hierarchical name means seen from an element, None where nothing has it."""
        block = self.net.blocks[path]
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
        while port in self.net.feeding:
            source, joint = self.net.feeding[port][0]
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
        block = self.net.blocks[path]
        own = None
        if path in self.fmus and name in self.descriptions[path].variables:
            own = self.descriptions[path].variables[name].measure
        connector = block.connectors.get(name)
        if connector is None or connector.unit is None:
            return own
        return _meant(connector.unit, own)

    def _value(self, port: Port, change: Change) -> Value | None:
        """Return the value given at a port as it arrives behind a change."""
        given = self.net.given.get(port)
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
            where = next(self.net.given[port].where for port in ports if port in self.net.given)
            right = listed(f"{name} = {number}" for name, number in variable.items.items())
            raise self.package.error(where, f'"{value}" is no item; {right} are right.')
        return variable.items[value]


def _meant(told: Measure, own: Measure | None) -> Measure:
    """Return a unit that a package names; where it does not define the name, the FMU's counts."""
    undefined = told.defined is None and own is not None and own.name == told.name
    return own if undefined and own is not None else told


def _walk(block: Block, path: Path) -> Iterator[tuple[Path, Block]]:
    yield path, block
    for name, inner in block.elements.items():
        yield from _walk(inner, (*path, name))


def _shown(port: Port) -> str:
    return ".".join((*port[0], port[1]))
