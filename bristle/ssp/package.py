"""An SSP package, opened with suspicion: its members, and where sources in its texts lead."""

from __future__ import annotations

import posixpath
import xml.etree.ElementTree as ElementTree
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import unquote, urlsplit

from ..errors import FmuError, ScenarioError
from ..fmu.archive import MAX_TOTAL, member_names, open_archive, read_member
from ..fmu.xml_text import parse_xml

Element = ElementTree.Element

MAX_TEXT = 16 * 1024**2
"""Largest .ssd, .ssv or .ssm that is read [bytes]."""


@dataclass(frozen=True)
class Package:
    """An open package: its file, the archive, the names of its members.

    `notes` collects what was left aside while it is read, or taken otherwise than it stands there.
    """

    path: Path
    archive: zipfile.ZipFile
    names: frozenset[str]
    notes: list[str] = field(default_factory=list)

    def xml(self, name: str, root: str) -> Element:
        """Return the root element of a member, which must be of that name but for its prefix."""
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
