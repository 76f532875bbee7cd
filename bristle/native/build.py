"""Builds components into FMUs with a library per platform, the same bytes for the same source."""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from uuid import UUID, uuid5

from ..errors import BuildError
from ..fmu import catalogue
from ..fmu.plan import Plan, plan
from .description import description
from .parts import component_of, functions_digest, functions_text, libraries, shim_digest
from .platforms import Platform
from .tables import tables

_NAMESPACE = UUID("0d7a6c1c-5f0e-5f3b-8a54-6e6174697665")
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest time that a zip can hold


def build(what: Plan, folder: Path, platforms: Sequence[Platform]) -> Path:
    """Build a native FMU into a folder, in place of an older one; return its path.

    Parameters
    ----------
    what : Plan
        As for the FMU that runs in Python.
    folder : Path
    platforms : sequence of Platform
        What it holds libraries for.

    Raises
    ------
    BuildError
        If a compiler is missing or refuses something, or a folder cannot be written; nothing is
        left then.
    """
    slave = component_of(what)
    content = hashlib.sha256()
    for part in (tables(slave, ""), functions_digest(slave), shim_digest()):
        content.update(part.encode())
    members = {f"resources/{name}": path.read_bytes() for name, path in what.files.items()}
    for part in (description(slave, ""), *(b for one in sorted(members.items()) for b in
                 (one[0].encode(), one[1]))):
        content.update(part)
    guid = str(uuid5(_NAMESPACE, content.hexdigest()))
    members["modelDescription.xml"] = description(slave, guid)
    text = functions_text(what, slave)
    for one, data in libraries(what.name, text, tables(slave, guid), platforms).items():
        members[f"binaries/{one.folder}/{what.name}{one.suffix}"] = data
    target = folder / f"{what.name}.fmu"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _pack(members, target)
    except OSError as error:
        raise BuildError(f"{target}: cannot be written ({error.strerror or error}).") from error
    return target


def _pack(members: Mapping[str, bytes], target: Path) -> None:
    """Write the archive in order and without times, and rename it into place."""
    part = target.with_suffix(".part")
    try:
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, data in sorted(members.items()):
                entry = zipfile.ZipInfo(name, _EPOCH)
                entry.compress_type = zipfile.ZIP_DEFLATED
                entry.external_attr = 0o644 << 16
                archive.writestr(entry, data)
        part.replace(target)
    except OSError:
        part.unlink(missing_ok=True)
        raise


def build_all(
    folder: Path, platforms: Sequence[Platform], only: Iterable[str] = ()
) -> list[Path]:
    """Build the built-in components, or those of `only`, into a folder; return their paths."""
    names = list(only) or catalogue.component_names()
    return [build(plan(name), folder, platforms) for name in names]
