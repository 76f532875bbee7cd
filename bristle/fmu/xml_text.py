"""XML of unknown origin, parsed with suspicion: no entities, so no expansion and no other file."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from xml.parsers import expat

from ..errors import FmuError


def parse_xml(data: bytes, name: str) -> ElementTree.Element:
    """Return the root of an XML text.

    Parameters
    ----------
    data : bytes
        The text as it stands in a file.
    name : str
        What the file is called in messages.

    Raises
    ------
    FmuError
        If it has a document type declaration, or is not well-formed.
    """

    def refuse(kind: str, *_: object) -> None:
        raise FmuError(
            f"{name} has a document type declaration ({kind}): refused, "
            "since entities can expand without bound. FMI and SSP need none."
        )

    # ElementTree expands entities, so a first pass refuses every declaration of one.
    scout = expat.ParserCreate()
    scout.StartDoctypeDeclHandler = refuse
    try:
        scout.Parse(data, True)
        return ElementTree.fromstring(data)
    except (expat.ExpatError, ElementTree.ParseError, LookupError, ValueError) as error:
        raise FmuError(f"{name} is not well-formed XML: {error}.") from None
