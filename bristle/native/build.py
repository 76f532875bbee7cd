"""Builds components into FMUs with a library per platform, the same bytes for the same source."""

from __future__ import annotations

import hashlib
import os
import struct
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Unpack
from uuid import UUID, uuid5
from xml.etree.ElementTree import Element, SubElement, fromstring

from ..core.files import writing
from ..core.progress import Count, tell
from ..core.text import plural
from ..errors import BuildError
from ..fmu import documentation
from ..fmu.archive import write_archive
from ..fmu.build import BuildPlan, built_guid, planned
from ..fmu.catalogue import Made
from . import zig
from .description import text_of
from .entrance import GUID, compile_functions, prepare
from .zig import Platform, here

SHIM = Path(__file__).resolve().parent / "shim"
"""Folder with the C that all native FMUs share."""


def shim_files(fmi: int = 2) -> list[Path]:
    """Return the files of the C that all native FMUs of FMI 2.0, or all of FMI 3.0, share."""
    others = tuple(f"fmi{one}" for one in (2, 3) if one != fmi)
    return [path for path in sorted(SHIM.iterdir()) if not path.name.startswith(others)]


def shim_sources(fmi: int = 2) -> list[Path]:
    """Return those of these files that are compiled, not included by others."""
    return [path for path in shim_files(fmi) if path.suffix == ".c"]


def shim_digest(fmi: int = 2) -> str:
    """Return the digest of the C that native FMUs of a version share, and of what compiles it."""
    content = hashlib.sha256(zig.tools().encode())
    for path in shim_files(fmi):
        content.update(path.name.encode() + path.read_bytes())
    return content.hexdigest()


def functions_text(what: BuildPlan, functions: str) -> Path:
    """Return the file with the C of a component's functions, compiled if need be.

    Parameters
    ----------
    what : BuildPlan
    functions : str
        Their digest.

    Raises
    ------
    BuildError
        If the compiler refuses a function; if the cache cannot be written.
    """

    def compile_text(path: Path) -> None:
        tell(f"compiling the functions of {what.name}, once")
        compile_functions(what, functions, path)

    return keep(zig.folder() / f"{functions}.c", compile_text)


def library(name: str, text: Path, table: str, platform: Platform, fmi: int = 2) -> bytes:
    """Return the bytes of a component's library for a platform.

    Parameters
    ----------
    name : str
        Of the FMU.
    text : Path
        The C of its functions.
    table : str
        C source of its tables.
    platform : Platform
    fmi : int
        2 or 3: the version of FMI whose functions it exports.

    Raises
    ------
    BuildError
        If it cannot be compiled; if the cache cannot be written.
    """
    content = hashlib.sha256()
    for part in (zig.tools(), platform.target, text.stem, name, table, shim_digest(fmi)):
        content.update(part.encode())
    kept = zig.folder() / f"{content.hexdigest()[:24]}{platform.suffix}"
    if kept.is_file():
        return kept.read_bytes()
    compiled = hashlib.sha256(f"{zig.tools()} {platform.target} {text.stem}".encode())
    functions = keep(
        zig.folder() / f"{compiled.hexdigest()[:24]}.o",
        lambda path: zig.compile_object(text, path, platform),
    )

    def link(path: Path) -> None:
        source = path.parent / "tables.c"
        source.write_text(table, encoding="utf-8")
        own = path.parent / f"{name}{platform.suffix}"
        sources = [*shim_sources(fmi), source, functions]
        zig.link(sources, SHIM, own, platform)
        own.replace(path)

    return keep(kept, link).read_bytes()


def keep(path: Path, make: Callable[[Path], None]) -> Path:
    """Return a file of the cache; if it is not there, `make` writes it into a folder of its own.

    Two processes that need it do not both make it: the second waits.
    """
    from filelock import FileLock

    if not path.is_file():
        with FileLock(f"{path}.lock"):
            if not path.is_file():
                with tempfile.TemporaryDirectory(dir=path.parent) as temporary:
                    part = Path(temporary) / path.name
                    make(part)
                    part.replace(path)
    return path


def libraries(
    name: str, text: Path, table: str, platforms: Sequence[Platform], fmi: int = 2
) -> dict[Platform, bytes]:
    """Return the libraries of a component for several platforms, compiled side by side.

    Parameters
    ----------
    name, text, table, fmi
        As in `library`.
    platforms : sequence of Platform

    Raises
    ------
    BuildError
        What is wrong with the first platform that fails, once all are done.
    """
    tell(f"compiling {name} for {plural(len(platforms), 'platform')}")
    count = Count(f"{name}: library", len(platforms))

    def counted(one: Platform) -> bytes:
        made = library(name, text, table, one, fmi)
        count.done(one.name)
        return made

    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        runs = [pool.submit(counted, one) for one in platforms]
    return {one: run.result() for one, run in zip(platforms, runs, strict=True)}


FOLDER = "sources"
FUNCTIONS, TABLES = "functions.c", "tables.c"


def source_members(text: Path, table: str, fmi: int) -> dict[str, bytes]:
    """Return what goes into the archive, by its path there.

    Parameters
    ----------
    text : Path
        The C of the component's functions.
    table : str
        That of its tables.
    fmi : int
        2 or 3: the version of FMI.
    """
    members = {path.name: path.read_bytes() for path in shim_files(fmi)}
    members |= {FUNCTIONS: text.read_bytes(), TABLES: table.encode()}
    return {f"{FOLDER}/{name}": data for name, data in members.items()}


def described(description: str, members: dict[str, bytes], fmi: int) -> dict[str, bytes]:
    """Return the files of an archive that tell a host what to compile, by their path.

    FMI 2.0 has the list in the model description, FMI 3.0 in a file of its own.

    Parameters
    ----------
    description : str
        The model description without the list.
    members : dict
        As `source_members` returns them.
    fmi : int
        2 or 3: the version of FMI.
    """
    names = sorted(Path(path).name for path in members if path.endswith(".c"))
    root = fromstring(description)
    simulation = root.find("CoSimulation")
    assert simulation is not None  # every component is for co-simulation
    if fmi == 2:
        files = Element("SourceFiles")
        for name in names:
            SubElement(files, "File", name=name)
        simulation.insert(0, files)
        return {"modelDescription.xml": text_of(root).encode()}
    about = Element("fmiBuildDescription", fmiVersion="3.0")
    model = simulation.get("modelIdentifier", "")
    configuration = SubElement(about, "BuildConfiguration", modelIdentifier=model)
    files = SubElement(configuration, "SourceFileSet", language="C11")
    for name in names:
        SubElement(files, "SourceFile", name=name)
    return {
        "modelDescription.xml": description.encode(),
        f"{FOLDER}/buildDescription.xml": text_of(about).encode(),
    }


_FAT, _THIN = 0xCAFEBABE, 0xFEEDFACF
_ALIGN = 14  # slices begin at pages of 16 KiB, the larger of both processors'


def universal(libraries: Sequence[bytes]) -> bytes:
    """Return libraries for several processors as one that each of them loads.

    Parameters
    ----------
    libraries : sequence of bytes
        Libraries of 64 bits for macOS, each for another processor; one alone stays as it is.
    """
    if len(libraries) == 1:
        return libraries[0]
    entries, body = [], b""
    size = 1 << _ALIGN
    at = size
    for library in libraries:
        magic, machine, kind = struct.unpack("<3I", library[:12])
        if magic != _THIN:
            raise ValueError("no library of 64 bits for macOS")
        entries.append(struct.pack(">5I", machine, kind, at, len(library), _ALIGN))
        body += library + bytes(-len(library) % size)
        at = size + len(body)
    head = struct.pack(">2I", _FAT, len(libraries)) + b"".join(entries)
    return head + bytes(size - len(head)) + body


_NAMESPACE = UUID("0d7a6c1c-5f0e-5f3b-8a54-6e6174697665")


def build(
    what: BuildPlan,
    folder: Path,
    platforms: Sequence[Platform],
    fmi: int = 2,
    sources: bool = False,
) -> Path:
    """Build a native FMU into a folder, unless the same one stands there; return its path.

    Parameters
    ----------
    what : BuildPlan
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
    members |= documentation.members(fromstring(prepared.description), what)
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
        write_archive(target, members, note)
    except OSError as error:
        why = error.strerror or error
        raise BuildError(f"{error.filename or target}: cannot be written ({why}).") from error
    return target


def ensure(component: str, *, fmi: int = 2, **made: Unpack[Made]) -> Path:
    """Return a built-in component's native FMU for this machine, built on first use.

    It follows FMI 2.0 or 3.0; what it is made with is as for `fmu.build.ensure`.

    Raises
    ------
    BuildError, DesignError, PhysicsError
        If a name or a file is wrong, or the FMU cannot be built.
    """
    from filelock import FileLock

    what = planned(component, **made)
    folder = zig.folder() / ("fmus_fmi3" if fmi == 3 else "fmus")
    with writing(folder, BuildError):
        folder.mkdir(exist_ok=True)
        with FileLock(folder / ".lock"):  # runs side by side that need it do not both write it
            return build(what, folder, [here()], fmi)


def _note_in(path: Path) -> bytes:
    """Return what an archive is noted to hold."""
    with zipfile.ZipFile(path) as archive:
        return archive.comment
