"""The building of a TOML file; `physics.building.from_data` says what may stand in one."""

from __future__ import annotations

from pathlib import Path

from ..core.config import ANY, Document, Spec
from ..errors import PhysicsError
from ..physics.building import Building, from_data


def read_building(path: str | Path) -> Building:
    """Return the building of a TOML file (schema 1).

    Raises
    ------
    PhysicsError
        Naming the file, the line and what would be right.
    """
    document = Document(path, PhysicsError)
    document.read(Spec(each=ANY))
    document.check()
    try:
        return from_data(document.data, "")
    except PhysicsError as error:
        document.error_of((), str(error).lstrip(": "))
        document.check()
        raise
