"""Blocks for the local page, and answers with many numbers: JSON, then arrays as 32-bit floats.

    bytes 0 to 3      length of the JSON in bytes, little-endian
    JSON              padded with spaces to a multiple of four
    arrays            float32, little-endian, one after the other

In the JSON an array is `{"array": [first, count]}`, counted in floats. A page reads them without
parsing a number: 40,000 samples of a dozen signals in a millisecond.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable
from typing import Any

import numpy as np

from ..core.files import as_json
from .blocks import Block, Table, Text

ALIGN = 4


def page_data(shown: Iterable[Block]) -> list[dict[str, Any]]:
    """Return the words and tables of blocks as JSON has them; the page draws its own figures."""
    out: list[dict[str, Any]] = []
    for block in shown:
        if isinstance(block, Table):
            out.append({**block._asdict(), "numbers": list(block.numbers)})
        elif isinstance(block, Text) and block.text:
            out.append(block._asdict())
    return out


def pack(content: Any) -> bytes:
    """Return plain data with numpy arrays in it as bytes; what is not finite in JSON is null.

    Parameters
    ----------
    content : dict, list, tuple, text, number, None, and arrays of any shape, which are made flat
    """
    arrays: list[bytes] = []
    count = 0

    def laid(value: Any) -> Any:
        nonlocal count
        flat = np.ascontiguousarray(value, dtype="<f4").ravel()
        arrays.append(flat.tobytes())
        count += len(flat)
        return {"array": [count - len(flat), len(flat)]}

    head = json.dumps(as_json(content, laid), ensure_ascii=False).encode()
    head += b" " * (-len(head) % ALIGN)
    return b"".join([struct.pack("<I", len(head)), head, *arrays])


def unpack(data: bytes) -> Any:
    """Return what `pack` was given; arrays are flat and of 32-bit floats."""
    (length,) = struct.unpack_from("<I", data)
    floats = np.frombuffer(data, dtype="<f4", offset=4 + length)

    def whole(value: Any) -> Any:
        if isinstance(value, dict):
            if set(value) == {"array"}:
                first, count = value["array"]
                return floats[first : first + count]
            return {key: whole(one) for key, one in value.items()}
        return [whole(one) for one in value] if isinstance(value, list) else value

    return whole(json.loads(data[4 : 4 + length]))
