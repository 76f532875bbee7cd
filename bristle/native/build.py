"""Builds components into FMUs with a library per platform, the same bytes for the same source."""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from uuid import UUID, uuid5

from ..errors import BuildError
from ..fmu.build import built_guid, planned
from ..fmu.plan import Plan
from . import zig
from .parts import functions_text, libraries, shim_digest
from .platforms import Platform, here
from .prepare import GUID, prepare
from .sources import described, source_members
from .universal import universal

_NAMESPACE = UUID("0d7a6c1c-5f0e-5f3b-8a54-6e6174697665")
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest time that a zip can hold


def build(
    what: Plan,
    folder: Path,
    platforms: Sequence[Platform],
    fmi: int = 2,
    sources: bool = False,
) -> Path:
    """Build a native FMU into a folder, unless the same one stands there; return its path.

    Parameters
    ----------
    what : Plan
        As for the FMU that runs in Python.
    folder : Path
    platforms : sequence of Platform
        What it holds libraries for.
    fmi : int
        2 or 3: the version of FMI that it follows.
    sources : bool
        Whether it also holds its C, for hosts that compile it.

    Raises
    ------
    BuildError
        If a compiler is missing or refuses something, or a folder cannot be written; no FMU is
        written then.
    """
    prepared, platforms = prepare(what, fmi), sorted(platforms, key=lambda one: one.name)
    members = {f"resources/{name}": path.read_bytes() for name, path in what.files.items()}
    content = hashlib.sha256("".join([*prepared, shim_digest(fmi)]).encode())
    for name, data in sorted(members.items()):
        content.update(name.encode() + data)
    guid = str(uuid5(_NAMESPACE, content.hexdigest()))
    target = folder / f"{what.name}.fmu"
    places = {one: one.place(what.name, fmi) for one in platforms}
    held = ", ".join(one.name for one in platforms)
    note = f"libraries for {held}{'; sources' if sources else ''}".encode()
    if built_guid(target) == guid and _note_in(target) == note:
        return target
    description = prepared.description.replace(GUID, guid)
    members["modelDescription.xml"] = description.encode()
    table = prepared.tables.replace(GUID, guid)
    try:
        text = functions_text(what, prepared.functions)
        if sources:
            own = source_members(text, table, fmi)
            members |= own | described(description, own, fmi)
        made = libraries(what.name, text, table, platforms, fmi)
        for place in set(places.values()):
            members[place] = universal([made[one] for one in platforms if places[one] == place])
        folder.mkdir(parents=True, exist_ok=True)
        _pack(members, target, note)
    except OSError as error:
        why = error.strerror or error
        raise BuildError(f"{error.filename or target}: cannot be written ({why}).") from error
    return target


def ensure(
    component: str,
    building: Path | None = None,
    controller: Path | None = None,
    effects: Iterable[Path] = (),
    fmi: int = 2,
) -> Path:
    """Return a built-in component's native FMU for this machine, built on first use.

    Parameters
    ----------
    component, building, controller, effects
        As in `fmu.build.ensure`.
    fmi : int
        2 or 3: the version of FMI that it follows.

    Raises
    ------
    BuildError, DesignError, PhysicsError
        If a name or a file is wrong, or the FMU cannot be built.
    """
    from filelock import FileLock

    what = planned(component, building, controller, effects)
    folder = zig.folder() / ("fmus_fmi3" if fmi == 3 else "fmus")
    try:
        folder.mkdir(exist_ok=True)
        with FileLock(folder / ".lock"):  # runs side by side that need it do not both write it
            return build(what, folder, [here()], fmi)
    except OSError as error:
        raise BuildError(f"{folder}: cannot be written ({error.strerror or error}).") from error


def _note_in(path: Path) -> bytes:
    """Return what an archive is noted to hold."""
    with zipfile.ZipFile(path) as archive:
        return archive.comment


def _pack(members: Mapping[str, bytes], target: Path, note: bytes) -> None:
    """Write the archive in order and without times, and rename it into place."""
    part = target.with_suffix(".part")
    try:
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.comment = note
            for name, data in sorted(members.items()):
                entry = zipfile.ZipInfo(name, _EPOCH)
                entry.compress_type = zipfile.ZIP_DEFLATED
                entry.external_attr = 0o644 << 16
                archive.writestr(entry, data)
        part.replace(target)
    except OSError:
        part.unlink(missing_ok=True)
        raise
