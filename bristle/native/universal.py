"""One library for the two processors of a Mac, as FMI 2.0 has one folder for both."""

from __future__ import annotations

import struct
from collections.abc import Sequence

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
