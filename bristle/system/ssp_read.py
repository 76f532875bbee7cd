"""What an SSP package says: its structure, parameter files, units."""

from __future__ import annotations

import math
import posixpath
import re
import xml.etree.ElementTree as ElementTree
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from urllib.parse import unquote, urlsplit

from ..errors import FmuError, ScenarioError, UnitError
from ..fmu.archive import DESCRIPTION, MAX_TOTAL, member_names, open_archive, parse_xml, read_member
from ..fmu.description import KINDS, Value
from ..units import Measure, definitions

# An SSP package, opened with suspicion: its members, and where sources in its texts lead.

Element = ElementTree.Element

MAX_TEXT = 16 * 1024**2
"""Largest .ssd, .ssv or .ssm that is read [bytes]."""


@dataclass(frozen=True)
class Package:
    """An open package: its file, the archive, the names of its members.

    `notes` collects what was left aside while it is read, or taken otherwise than it stands there,
    `opened` the members of XML that were read.
    """

    path: Path
    archive: zipfile.ZipFile
    names: frozenset[str]
    notes: list[str] = field(default_factory=list)
    opened: set[str] = field(default_factory=set)

    def xml(self, name: str, root: str) -> Element:
        """Return the root element of a member, which must be of that name but for its prefix."""
        self.opened.add(name)
        data = read_member(self.path, self.archive, name, MAX_TEXT)
        found = parse_xml(data, f"{self.path}: {name}")
        if local(found) != root:
            raise ScenarioError(
                f"{self.path}: {name}: its root is <{local(found)}>; <{root}> is right."
            )
        return found

    def read(self, name: str) -> bytes:
        """Return the bytes of a member."""
        return read_member(self.path, self.archive, name, MAX_TOTAL)

    def error(self, where: str, text: str) -> ScenarioError:
        """Return an error with file and element before its text."""
        return ScenarioError(f"{self.path}: {where}: {text}")

    def note(self, where: str, text: str) -> None:
        """Keep what the user should know, with file and element before it."""
        self.notes.append(f"{where}: {text}")

    def member(self, source: str, base: str, where: str) -> str:
        """Return the member that a `source` names.

        Parameters
        ----------
        source : relative URI
        base : the member in which it stands
        where : file and element, for messages

        Raises
        ------
        ScenarioError
            If it leads elsewhere than into the package, or nothing is there.
        """
        parts = urlsplit(source)
        if parts.scheme or parts.netloc or parts.path.startswith("/"):
            raise self.error(where, f'source "{source}" is not inside the package; it must be.')
        name = posixpath.normpath(posixpath.join(posixpath.dirname(base), unquote(parts.path)))
        if name.startswith(".."):
            raise self.error(where, f'source "{source}" leaves the package: refused.')
        if name not in self.names:
            raise self.error(where, f'source "{source}" is not in the package.')
        return name


@contextmanager
def open_package(path: Path) -> Iterator[Package]:
    """Open an SSP package whose members are all sound.

    Raises
    ------
    ScenarioError
        If it cannot or must not be opened (see `fmu.archive.open_archive`), or one of its texts is
        no XML that may be read.
    """
    try:
        with open_archive(path, "SSP") as archive:
            yield Package(path, archive, frozenset(member_names(archive)))
    except FmuError as error:
        raise ScenarioError(str(error)) from None


def local(element: Element) -> str:
    """Return an element's name without its namespace: prefixes and versions differ."""
    return element.tag.rpartition("}")[2]


def children(element: Element | None, name: str) -> list[Element]:
    """Return the children of a name, whatever their prefix."""
    return [] if element is None else [child for child in element if local(child) == name]


def child(element: Element | None, name: str) -> Element | None:
    """Return the first child of a name, None where there is none."""
    return next(iter(children(element, name)), None)


# Units that a package declares, and the linear change from one to another.

Change = tuple[float, float]
"""Factor and offset: what a value v becomes is factor v + offset."""

SAME: Change = (1.0, 0.0)


def read_units(units: Element | None, package: Package, where: str) -> dict[str, Measure]:
    """Return the units that an element declares, by name."""
    told = []
    for entry in children(units, "Unit"):
        base = child(entry, "BaseUnit")
        told.append((entry.get("name", ""), None if base is None else base.attrib))
    try:
        return definitions(told)
    except UnitError as error:
        raise package.error(where, str(error)) from None


def measure(name: str | None, declared: dict[str, Measure]) -> Measure | None:
    """Return a unit by name, as declared where it is; None for no name."""
    return declared.get(name, Measure(name)) if name else None


def convert(given: Measure | None, wanted: Measure | None) -> Change:
    """Return the change of a value in one unit to the other; none where one side has no unit.

    Raises
    ------
    ScenarioError
        If nothing says how, or they are units of different quantities.
    """
    if given is None or wanted is None:
        return SAME
    try:
        return given.change_to(wanted)
    except UnitError as error:
        cure = ""
        if given.unit is None or wanted.unit is None:
            cure = " Declare it in <Units> with its <BaseUnit>."
        raise ScenarioError(f"{error}{cure}") from None


def after(first: Change, second: Change) -> Change:
    """Return two changes, one after the other, as one."""
    return second[0] * first[0], second[0] * first[1] + second[1]


def linear(element: Element, package: Package, where: str) -> Change:
    """Return the linear transformation in a connection or a mapping.

    Raises
    ------
    ScenarioError
        If it has one of another kind.
    """
    for name in ("Boolean", "Integer", "Enumeration"):
        if child(element, f"{name}MappingTransformation") is not None:
            text = f"<{name}MappingTransformation> is not read; <LinearTransformation> is."
            raise package.error(where, text)
    found = child(element, "LinearTransformation")
    if found is None:
        return SAME
    return (
        number(found, "factor", 1.0, package, where),
        number(found, "offset", 0.0, package, where),
    )


def number(element: Element, key: str, usual: float, package: Package, where: str) -> float:
    """Return a finite number in an attribute.

    Parameters
    ----------
    element, key : the element, and the name of its attribute
    usual : the number where the attribute is not there
    package, where : what it is read from, and the place that an error names
    """
    text = element.get(key)
    if text is None:
        return usual
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise package.error(where, f'{key} = "{text}" is no finite number.')
    return value


def is_true(element: Element, key: str) -> bool:
    """Return whether a Boolean attribute is set."""
    return element.get(key, "false").strip() in ("true", "1")


# Names that SSP, OSP and OMSimulator give to things.

STRUCTURE = "SystemStructure.ssd"
FMU_TYPE = "application/x-fmu-sharedlibrary"
SSD_TYPE = "application/x-ssp-definition"

OSP = "com.opensimulationplatform"
"""Type of an annotation that libcosim and Ecos read."""
OMS = "org.openmodelica"
"""Type of an annotation that OMSimulator reads."""
OWN = "bristle"
OWN_TYPE = "bristle.run"
"""Type of the annotation that tells the algorithm of a run."""

_SSP = "http://ssp-standard.org/SSP1/SystemStructure"
NAMESPACES = (
    ("ssd", f"{_SSP}Description"),
    ("ssc", f"{_SSP}Common"),
    ("ssv", f"{_SSP}ParameterValues"),
    ("osp", "http://opensimulationplatform.com/SSP/OSPAnnotations"),
    ("oms", "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd"),
    (OWN, "urn:bristle"),
)
"""Prefixes and namespaces of what is written."""


# Parameter values of a package: sets inline and in .ssv, mappings inline and in .ssm.

_REAL = re.compile(r"Real|Float(32|64)")
_INTEGER = re.compile(r"Integer|U?Int(8|16|32|64)")


@dataclass(frozen=True)
class BoundValue:
    """A value that a package gives to what is called `name` where it is bound.

    `unit` is the value's own; `change` comes after the conversion of units, or in its place where
    `converts` is false. `where` is its file and element.
    """

    name: str
    value: Value
    unit: Measure | None
    where: str
    change: Change = SAME
    converts: bool = True


def read_bindings(
    element: Element, package: Package, file: str, where: str
) -> tuple[BoundValue, ...]:
    """Return the values bound to a system or component, those that win last.

    Parameters
    ----------
    element : the system or component
    package : the package
    file : the member in which it stands
    where : file and element, for messages
    """
    found: list[BoundValue] = []
    for binding in children(child(element, "ParameterBindings"), "ParameterBinding"):
        inside = f"{where} <ParameterBinding>"
        kind = binding.get("type", "application/x-ssp-parameter-set")
        if kind != "application/x-ssp-parameter-set":
            raise package.error(inside, f'type "{kind}" is not read; parameter sets are.')
        given = _set(binding, package, file, inside)
        prefix = binding.get("prefix", "")
        given = [replace(one, name=prefix + one.name) for one in given]
        mapping = child(binding, "ParameterMapping")
        found += given if mapping is None else _mapped(given, mapping, package, file, inside)
    return tuple(found)


def _set(binding: Element, package: Package, file: str, where: str) -> list[BoundValue]:
    source = binding.get("source")
    values = child(binding, "ParameterValues")
    if source:
        _refuse_base(binding, package, where)
        file = package.member(source, file, where)
        found: Element | None = package.xml(file, "ParameterSet")
    else:
        found = child(values, "ParameterSet")
    if found is None:
        return []
    units = read_units(child(found, "Units"), package, file)
    items = {
        (kind.get("name", ""), item.get("name", "")): item.get("value", "")
        for kind in children(child(found, "Enumerations"), "Enumeration")
        for item in children(kind, "Item")
    }
    given: list[BoundValue] = []
    for parameter in children(child(found, "Parameters"), "Parameter"):
        inside = f'{file}: <Parameter "{parameter.get("name", "")}">'
        if any(one.name == parameter.get("name", "") for one in given):
            raise package.error(inside, "stands twice in its set; one value is right.")
        given += [
            BoundValue(
                parameter.get("name", ""),
                _value(entry, items, package, inside),
                measure(entry.get("unit"), units),
                inside,
            )
            for entry in parameter
            if local(entry) not in ("Annotations", "Dimension")
        ]
    return given


def _refuse_base(element: Element, package: Package, where: str) -> None:
    if element.get("sourceBase", "SSD") != "SSD":
        raise package.error(where, "a source inside a component is not read; one beside it is.")


def _value(
    entry: Element, items: dict[tuple[str, str], str], package: Package, where: str
) -> Value:
    kind, text = local(entry), entry.get("value")
    if text is None:
        raise package.error(where, f"<{kind}> has no value.")
    if _REAL.fullmatch(kind):
        return number(entry, "value", 0.0, package, where)
    if kind == "String":
        return text
    if kind == "Boolean" and text.strip() in ("true", "1", "false", "0"):
        return text.strip() in ("true", "1")
    if kind == "Enumeration":
        text = items.get((entry.get("name", ""), text), text)
    if kind == "Enumeration" or _INTEGER.fullmatch(kind):
        try:
            return int(text)
        except ValueError:
            if kind == "Enumeration":
                return text  # an item of the FMU's own type
            raise package.error(where, f'"{text}" is no whole number.') from None
    raise package.error(where, f'<{kind} value="{text}"> is not read.')


def _mapped(
    given: list[BoundValue], mapping: Element, package: Package, file: str, where: str
) -> list[BoundValue]:
    """Return values under the names that a mapping gives them; others are left aside."""
    source = mapping.get("source")
    found: Element | None = child(mapping, "ParameterMapping")
    if source:
        _refuse_base(mapping, package, where)
        file = package.member(source, file, where)
        found = package.xml(file, "ParameterMapping")
    by_name = {one.name: one for one in given}
    left = dict(by_name)
    mapped = []
    for entry in children(mapping if found is None else found, "MappingEntry"):
        name, target = entry.get("source", ""), entry.get("target", "")
        inside = f'{file}: <MappingEntry "{name}" to "{target}">'
        if name not in by_name:
            package.note(inside, f'no parameter is called "{name}": left aside.')
        else:
            left.pop(name, None)
            change = linear(entry, package, inside)
            converts = not is_true(entry, "suppressUnitConversion")
            one = by_name[name]
            mapped.append(replace(one, name=target, change=change, converts=converts, where=inside))
    for one in left.values():
        package.note(one.where, "the mapping does not name it: left aside.")
    return mapped


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
    values: tuple[BoundValue, ...]
    units: dict[str, Measure]
    source: str | None = None
    elements: dict[str, Block] = field(default_factory=dict)
    joints: tuple[Joint, ...] = ()


@dataclass(frozen=True)
class SystemStructure:
    """A package as it stands: name, root system; stop, step [s], algorithm where they are told."""

    name: str
    system: Block
    stop: float | None
    step: float | None
    algorithm: str | None


def read_structure(package: Package) -> SystemStructure:
    """Return what a package holds, of SSP 1.0 or 2.0.

    Raises
    ------
    ScenarioError
        For what is wrong or not read, with file and element.
    """
    if STRUCTURE not in package.names:
        own = (one for one in sorted(package.names) if one.lower().endswith(STRUCTURE.lower()))
        there = next(own, DESCRIPTION if DESCRIPTION in package.names else "")
        why = f', where "{there}" is' if there else ""
        raise package.error(STRUCTURE, f"is not at the root of the package{why}, so it is no SSP.")
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
    for one in sorted(package.names - package.opened):
        if one.lower().endswith(".ssd") and "/" not in one:  # where variants stand
            package.note(one, f"is another variant and not read; {STRUCTURE} is.")
    return SystemStructure(root.get("name", ""), system, stop, step, algorithm)


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
        if (form := entry.get("implementation", "any")) not in ("any", "CoSimulation"):
            self.package.note(where, f'asks for "{form}", and is run as co-simulation.')
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
