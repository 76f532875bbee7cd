"""FMU archives and their XML, opened with suspicion: bounded sizes, no path out of the folder.

An FMU comes from anywhere and is unpacked before anything else is known of it. So names, sizes
and kinds of all members are judged from the archive's directory first, and nothing is written
unless all of them are sound.
"""

from __future__ import annotations

import platform
import stat
import struct
import sys
import xml.etree.ElementTree as ElementTree
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from xml.parsers import expat

from ..errors import FmuError

DESCRIPTION = "modelDescription.xml"

# Far above any FMU we know of, far below what fills a disk.
MAX_MEMBERS = 50_000
MAX_TOTAL = 2 * 1024**3  # bytes, unpacked
MAX_DESCRIPTION = 64 * 1024**2  # bytes
_SUSPECT_RATIO = 500  # deflate reaches 1032 on zeros; real members stay below 50
_SUSPECT_SIZE = 64 * 1024**2  # bytes; below it, no ratio does harm

_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest time that a zip can hold
_CHUNK = 1024**2
_MACHINES = {"amd64": "x86_64", "arm64": "aarch64", "i386": "x86", "i686": "x86"}
"""Machines by another name than in FMI 3.0."""
_ELF_MACHINES = {"x86_64": 62, "amd64": 62, "aarch64": 183, "arm64": 183, "i686": 3, "i386": 3}


@contextmanager
def open_archive(path: Path, kind: str = "FMU") -> Iterator[zipfile.ZipFile]:
    """Open `path` as a zip whose members are all sound.

    Parameters
    ----------
    path : Path
    kind : what it should be, for messages: "FMU" or "SSP"

    Raises
    ------
    FmuError
        If the file is missing, a folder, unreadable or no zip, or if a member is encrypted, a
        link, there twice, too large, or named so that it would leave the folder of its own.
    """
    if path.is_dir():
        raise FmuError(
            f"{path}: this is a folder. An {kind} is one zip file named *.{kind.lower()}."
        )
    if not path.exists():
        raise FmuError(f"{path}: there is no such file.")
    if not path.is_file():  # a pipe would be waited for without end
        raise FmuError(
            f"{path}: this is a device or pipe. An {kind} is one zip file named *.{kind.lower()}."
        )
    try:
        archive = zipfile.ZipFile(path)
    except (zipfile.BadZipFile, EOFError, struct.error, NotImplementedError, ValueError) as error:
        raise FmuError(f"{path}: not a zip file, so not an {kind} ({error}).") from None
    except OSError as error:
        raise FmuError(f"{path}: cannot be read: {error.strerror or error}.") from None
    with archive:
        _check_members(path, archive)
        try:
            yield archive
        except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError) as error:
            raise FmuError(f"{path}: the zip file is damaged: {error}.") from None
        except RuntimeError as error:  # what zipfile raises for a password
            raise FmuError(f"{path}: the zip file cannot be unpacked: {error}.") from None


def member_names(archive: zipfile.ZipFile) -> list[str]:
    """Return the names of all members with forward slashes, folders left out."""
    return [_name(info) for info in archive.infolist() if not info.is_dir()]


def read_member(path: Path, archive: zipfile.ZipFile, name: str, limit: int) -> bytes:
    """Return one member's bytes.

    Parameters
    ----------
    path, archive : the .fmu file, for the message; the same, open
    name : of the member, with forward slashes
    limit : most bytes that it may hold

    Raises
    ------
    FmuError
        If there is no such member, or it is larger.
    """
    for info in archive.infolist():
        if _name(info) == name:
            with archive.open(info) as stream:
                data = stream.read(limit + 1)
            if len(data) > limit:
                raise FmuError(f"{path}: {name} is larger than {limit // 1024**2} MiB: refused.")
            return data
    raise FmuError(f"{path}: there is no {name} at its root, so it is not an FMU.")


def write_archive(target: Path, members: Mapping[str, bytes], note: bytes = b"") -> None:
    """Write an archive in order and without times, and rename it into place.

    Parameters
    ----------
    target : Path
    members : bytes by their name
    note : what is noted to the whole

    Raises
    ------
    OSError
        If it cannot be written; nothing is left of it then.
    """
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


def extract(path: Path | str, folder: Path | str) -> Path:
    """Unpack an FMU into `folder` (made if missing) and return that folder.

    Raises
    ------
    FmuError
        For what `open_archive` refuses, for a member that holds more than it declares, and if
        the folder cannot be written.
    """
    path, folder = Path(path), Path(folder)
    with open_archive(path) as archive:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for info in archive.infolist():
                target = folder / _name(info)
                if info.is_dir():
                    target.mkdir(parents=True, exist_ok=True)
                    continue
                target.parent.mkdir(parents=True, exist_ok=True)
                _unpack(path, archive, info, target)
        except OSError as error:
            raise FmuError(f"{path}: cannot be unpacked into {folder}: {error}.") from None
    return folder


def platform_folder(version: str = "2.0") -> str:
    """Return the name that a version of FMI gives this platform ("linux64", "x86_64-linux" ...)."""
    if version == "3.0":
        machine = platform.machine().lower()
        system = {"win32": "windows", "darwin": "darwin"}.get(sys.platform, "linux")
        return f"{_MACHINES.get(machine, machine)}-{system}"
    system = {"win32": "win", "darwin": "darwin"}.get(sys.platform, "linux")
    return f"{system}{64 if sys.maxsize > 2**32 else 32}"


def library_member(identifier: str, version: str = "2.0") -> str:
    """Return where an FMU of a version of FMI keeps its shared library for this platform."""
    suffix = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
    return f"binaries/{platform_folder(version)}/{identifier}{suffix}"


def check_library(
    path: Path, archive: zipfile.ZipFile, identifier: str, version: str = "2.0"
) -> None:
    """Refuse an archive without a binary that this platform can load.

    Parameters
    ----------
    path : the FMU, as messages name it
    archive : its content
    identifier : the model's, which the binary is named by
    version : of FMI: it decides the binary's folder

    Raises
    ------
    FmuError
        Saying which binaries there are.
    """
    names = member_names(archive)
    wanted = library_member(identifier, version)
    if wanted not in names:
        raise FmuError(
            f"{path}: no binary for this platform: {wanted} is missing. "
            f"There are: {', '.join(_binaries(names)) or 'none'}."
        )
    with archive.open(next(i for i in archive.infolist() if _name(i) == wanted)) as stream:
        found = _kind_of_library(stream.read(20))
    expected = _kind_of_this_platform()
    if found != expected:
        raise FmuError(f"{path}: {wanted} is {found}; this platform loads {expected}.")


def _binaries(names: list[str]) -> list[str]:
    """Return the platforms that an FMU has binaries or sources for."""
    parts = [PurePosixPath(n).parts for n in names]
    found = {p[1] for p in parts if len(p) == 3 and p[0] == "binaries"}
    sources = any(p[0] == "sources" and p[-1].endswith((".c", ".cpp")) for p in parts if p)
    return sorted(found) + (["C sources (not compiled here)"] if sources else [])


def _kind_of_library(head: bytes) -> str:
    if head[:4] == b"\x7fELF" and len(head) >= 20:
        order = "<" if head[5] == 1 else ">"
        (machine,) = struct.unpack(f"{order}H", head[18:20])
        bits = 64 if head[4] == 2 else 32
        names = {62: "x86-64", 183: "ARM", 3: "x86"}
        return f"a {bits}-bit Linux library for {names.get(machine, f'machine {machine}')}"
    if head[:2] == b"MZ":
        return "a Windows library"
    if head[:4] in (b"\xcf\xfa\xed\xfe", b"\xca\xfe\xba\xbe", b"\xca\xfe\xba\xbf"):
        return "a macOS library"
    return "no shared library"


def _kind_of_this_platform() -> str:
    if sys.platform == "win32":
        return "a Windows library"
    if sys.platform == "darwin":
        return "a macOS library"
    machine = _ELF_MACHINES.get(platform.machine().lower(), 0)
    bits = 2 if sys.maxsize > 2**32 else 1
    order = 1 if sys.byteorder == "little" else 2
    head = b"\x7fELF" + bytes([bits, order]) + bytes(12)
    return _kind_of_library(head + struct.pack("<H" if order == 1 else ">H", machine))


def _name(info: zipfile.ZipInfo) -> str:
    # Some Windows tools write backslashes; everybody reads them as separators.
    return info.filename.replace("\\", "/")


def _check_members(path: Path, archive: zipfile.ZipFile) -> None:
    members = archive.infolist()
    if len(members) > MAX_MEMBERS:
        raise FmuError(f"{path}: {len(members)} members (at most {MAX_MEMBERS}): refused.")
    total = sum(info.file_size for info in members)
    if total > MAX_TOTAL:
        raise FmuError(
            f"{path}: unpacks to {total / 1024**3:.1f} GiB "
            f"(at most {MAX_TOTAL // 1024**3} GiB): refused."
        )
    met: dict[str, int] = {}
    for info in members:
        _check_member(path, info)
        if not info.is_dir() and met.setdefault(_name(info), info.CRC) != info.CRC:
            raise FmuError(
                f"{path}: it holds two members {_name(info)!r} that differ: refused, for nothing "
                "says which one counts."
            )


def _check_member(path: Path, info: zipfile.ZipInfo) -> None:
    name = _name(info)
    parts = PurePosixPath(name).parts
    if not parts or ".." in parts or name.startswith("/") or ":" in name or "\0" in name:
        raise FmuError(
            f"{path}: the member {info.filename!r} leaves the archive's folder: refused. "
            "Member paths are relative and stay inside."
        )
    mode = info.external_attr >> 16
    if stat.S_IFMT(mode) not in (0, stat.S_IFREG, stat.S_IFDIR):
        raise FmuError(f"{path}: the member {name!r} is a link or device: refused.")
    if info.flag_bits & 0x1:
        raise FmuError(f"{path}: the member {name!r} is encrypted: refused.")
    if (
        info.file_size > _SUSPECT_SIZE
        and info.file_size > _SUSPECT_RATIO * max(info.compress_size, 1)
    ):  # fmt: skip
        raise FmuError(
            f"{path}: the member {name!r} unpacks {info.compress_size} bytes "
            f"to {info.file_size}: refused as a zip bomb."
        )


def _unpack(path: Path, archive: zipfile.ZipFile, info: zipfile.ZipInfo, target: Path) -> None:
    written = 0
    with archive.open(info) as source, target.open("wb") as sink:
        while chunk := source.read(_CHUNK):
            written += len(chunk)
            if written > info.file_size:
                raise FmuError(f"{path}: the member {info.filename!r} holds more than it declares.")
            sink.write(chunk)


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
