"""What SystemStructure.ssd says: systems in systems, their components, connectors, connections."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..fmu.description_fmi3 import KINDS
from ..units import Measure
from .conversion import Change, is_true, linear, measure, number, read_units
from .names import FMU_TYPE, OMS, OSP, OWN_TYPE, SSD_TYPE, STRUCTURE
from .package import Element, Package, child, children, local
from .values import Given, read_bindings

DEEPEST = 50
"""Systems within systems that are read."""

_TYPES = (*KINDS, "Real", "Integer", "Binary", "Clock")

End = tuple[str, str]
"""An element of a system, "" for the system itself, and a connector of it."""


@dataclass(frozen=True)
class Connector:
    """A connector of a system or component: kind as in SSP, unit if it names one.

    `type` is that of its values in the words of FMI 2.0 ("Real"), "" where it names none.
    """

    kind: str
    unit: Measure | None
    type: str


@dataclass(frozen=True)
class Joint:
    """A connection of a system; `change` is told, `converts` is whether units are as well."""

    start: End
    end: End
    change: Change
    converts: bool
    where: str


@dataclass(frozen=True)
class Block:
    """A component with the member that is its FMU (`source`), or a system with what is in it.

    `values` are bound to it, `where` is its file and element. `units` are those of its file.
    """

    where: str
    connectors: dict[str, Connector]
    values: tuple[Given, ...]
    units: dict[str, Measure]
    source: str | None = None
    elements: dict[str, Block] = field(default_factory=dict)
    joints: tuple[Joint, ...] = ()


@dataclass(frozen=True)
class Structure:
    """A package as it stands: name, root system; stop, step [s], algorithm where they are told."""

    name: str
    system: Block
    stop: float | None
    step: float | None
    algorithm: str | None


def read_structure(package: Package) -> Structure:
    """Return what a package holds, of SSP 1.0 or 2.0.

    Raises
    ------
    ScenarioError
        For what is wrong or not read, with file and element.
    """
    if STRUCTURE not in package.names:
        raise package.error(STRUCTURE, "is not in the package, so it is no SSP.")
    root = package.xml(STRUCTURE, "SystemStructureDescription")
    experiment = child(root, "DefaultExperiment")
    stop = None
    if experiment is not None:
        where = f"{STRUCTURE}: <DefaultExperiment>"
        if number(experiment, "startTime", 0.0, package, where) != 0.0:
            raise package.error(where, "a run begins at 0 s; another startTime is not read.")
        stop = number(experiment, "stopTime", 0.0, package, where) or None
    step, algorithm = _told(root, package)
    system = _read_file(root, package, STRUCTURE, ())
    return Structure(root.get("name", ""), system, stop, step, algorithm)


def _told(root: Element, package: Package) -> tuple[float | None, str | None]:
    """Return step [s] and algorithm, where an annotation tells them."""
    step = algorithm = None
    for annotation in (e for e in root.iter() if local(e) == "Annotation"):
        kind = annotation.get("type")
        where = f'{STRUCTURE}: <Annotation "{kind}">'
        for entry in annotation.iter():
            if kind == OSP and local(entry) == "FixedStepAlgorithm":
                step = number(entry, "baseStepSize", 0.0, package, where) or step
            elif kind == OMS and local(entry) == "FixedStepMaster" and step is None:
                step = number(entry, "stepSize", 0.0, package, where) or None
            elif kind == OWN_TYPE and local(entry) == "Run":
                algorithm = entry.get("algorithm")
    return step, algorithm


def _read_file(root: Element, package: Package, file: str, above: tuple[str, ...]) -> Block:
    """Return the system of an .ssd; `above` are those in which it stands."""
    version = root.get("version", "")
    if version.partition(".")[0] not in ("1", "2"):
        text = f'is of SSP version "{version}"; 1.0 and 2.0 are read.'
        raise package.error(file, text)
    if file in above:
        circle = " -> ".join((*above[above.index(file) :], file))
        raise package.error(file, f"the system contains itself: {circle}.")
    system = child(root, "System")
    if system is None:
        raise package.error(file, "has no <System>.")
    units = read_units(child(root, "Units"), package, file)
    return _Reader(package, file, (*above, file), units).system(system, "", 0)


@dataclass(frozen=True)
class _Reader:
    """Reads the elements of one .ssd."""

    package: Package
    file: str
    above: tuple[str, ...]
    units: dict[str, Measure]

    def system(self, element: Element, before: str, depth: int) -> Block:
        name = element.get("name", "")
        where = f'{self.file}: <System "{before}{name}">'
        if depth > DEEPEST:
            text = f"systems are nested more than {DEEPEST} deep: refused."
            raise self.package.error(where, text)
        inside = f"{before}{name}." if depth else ""
        elements: dict[str, Block] = {}
        for entry in child(element, "Elements") or ():
            named = entry.get("name", "")
            if named in elements or not named:
                raise self.package.error(where, f'two elements are called "{named}".')
            elements[named] = self._element(entry, inside, where, depth)
        if child(element, "SignalDictionaries") is not None:
            raise self._dictionary(where)
        joints = tuple(
            self._joint(one, elements, where)
            for one in children(child(element, "Connections"), "Connection")
        )
        return self._block(element, where, elements=elements, joints=joints)

    def _element(self, entry: Element, before: str, where: str, depth: int) -> Block:
        kind = local(entry)
        if kind == "System":
            return self.system(entry, before, depth + 1)
        if kind == "Component":
            return self._component(entry, f"{before}{entry.get('name', '')}")
        if kind == "SignalDictionaryReference":
            raise self._dictionary(where)
        raise self.package.error(where, f"<{kind}> is no element that is read.")

    def _dictionary(self, where: str) -> Exception:
        text = "signal dictionaries are not read; connect the components themselves."
        return self.package.error(where, text)

    def _component(self, entry: Element, name: str) -> Block:
        where = f'{self.file}: <Component "{name}">'
        source, kind = entry.get("source"), entry.get("type", FMU_TYPE)
        if not source:
            raise self.package.error(where, "has no source: nothing can be run in its place.")
        if kind not in (FMU_TYPE, SSD_TYPE):
            text = f'type "{kind}" is not read; {FMU_TYPE} and {SSD_TYPE} are.'
            raise self.package.error(where, text)
        member = self.package.member(source, self.file, where)
        if kind == FMU_TYPE:
            return self._block(entry, where, source=member)
        root = self.package.xml(member, "SystemStructureDescription")
        inner = _read_file(root, self.package, member, self.above)
        own = self._block(entry, where)
        values = (*inner.values, *own.values)
        return Block(
            where, inner.connectors, values, inner.units, None, inner.elements, inner.joints
        )

    def _block(
        self,
        element: Element,
        where: str,
        *,
        source: str | None = None,
        elements: dict[str, Block] | None = None,
        joints: tuple[Joint, ...] = (),
    ) -> Block:
        connectors = {}
        for entry in children(child(element, "Connectors"), "Connector"):
            unit = next((e.get("unit") for e in entry if e.get("unit")), None)
            types = (KINDS.get(local(e), local(e)) for e in entry if local(e) in _TYPES)
            kind, of_values = entry.get("kind", ""), next(types, "")
            found = Connector(kind, measure(unit, self.units), of_values)
            connectors[entry.get("name", "")] = found
        values = read_bindings(element, self.package, self.file, where)
        return Block(where, connectors, values, self.units, source, elements or {}, joints)

    def _joint(self, entry: Element, elements: dict[str, Block], where: str) -> Joint:
        start, end = (
            (entry.get(f"{side}Element", ""), entry.get(f"{side}Connector", ""))
            for side in ("start", "end")
        )
        shown = " to ".join(f"{e}.{c}" if e else c for e, c in (start, end))
        inside = f"{where} <Connection {shown}>"
        for element, _ in (start, end):
            if element and element not in elements:
                raise self.package.error(inside, f'there is no element "{element}".')
        change = linear(entry, self.package, inside)
        return Joint(start, end, change, not is_true(entry, "suppressUnitConversion"), inside)
