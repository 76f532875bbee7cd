"""Tables from any file that a laboratory hands over.

CSV and other delimited text (also gzip-compressed), Parquet, MAT up to version 7, results of
bristle itself: see `formats`. Nothing is converted here; see `measurement`.
"""

from __future__ import annotations

import gzip
import zlib
from pathlib import Path

from ..errors import RecordError
from . import formats
from .table import Table
from .times import in_order

LARGEST = 256 * 1024**2
"""Largest content that is read, after decompression [bytes]: about 3 million rows of 8 columns."""


ENDINGS = (
    ".csv", ".txt", ".dat", ".asc", ".tsv", ".prn", ".lvm", ".mat", ".parquet", ".xlsx", ".tdms",
    ".h5", ".hdf5",
)  # fmt: skip
"""Endings of the files that a folder of measurements is taken to consist of."""


def read_table(path: Path | str, split: str = "") -> Table:
    """Return the table in a file, whatever its format.

    Parameters
    ----------
    path : of the file
    split : how files hold runs: "sheet NAME" and "sheets" tell what of a workbook is read, and with
        "restart" a time that goes back is no counter

    Raises
    ------
    RecordError
        If the file cannot be read, is too large, or is of a format that is not read: with the
        file, the line where there is one, and what would be right.
    """
    path = Path(path)
    kind, _, title = split.partition(" ")
    sheet = {"sheet": title.strip(), "sheets": "*"}.get(kind, "")
    table = formats.read(content_of(path), path.suffix.lower(), str(path), sheet)
    return table if kind == "restart" else in_order(table)


def files_in(folder: Path) -> list[Path]:
    """Return the measurement files in a folder, told by their endings, in order.

    Raises
    ------
    RecordError
        If there is none.
    """
    found = sorted(
        path
        for path in folder.iterdir()
        if path.is_file()
        and path.name[:1] not in ".~"
        and path.name.lower().removesuffix(".gz").endswith(ENDINGS)
    )
    if not found:
        raise RecordError(
            f"{folder}: this folder is no study, and holds no measurement: no file in it ends in "
            f"{', '.join(ENDINGS)}."
        )
    return found


def content_of(path: Path) -> bytes:
    """Return a file's bytes, decompressed.

    Raises
    ------
    RecordError
        If there is no such file, it cannot be read, is empty or too large.
    """
    name = str(path)
    try:
        if not path.is_file():
            what = "this is a folder" if path.is_dir() else "there is no such file"
            raise RecordError(f"{name}: {what}. A measurement is one file.")
        size = path.stat().st_size
        content = path.read_bytes() if size <= LARGEST else b""
        if content[:2] == b"\x1f\x8b":
            with gzip.open(path) as stream:
                content = stream.read(LARGEST + 1)
            size = len(content)
    except (OSError, EOFError, zlib.error, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise RecordError(f"{name}: the file cannot be read ({reason}).") from None
    if size > LARGEST:
        raise RecordError(
            f"{name}: {size / 1024**2:.0f} MB are more than the limit of {LARGEST // 1024**2} MB "
            "for one measurement. Cut it, or sample it more coarsely."
        )
    if not content.strip():
        raise RecordError(f"{name}: the file is empty. A measurement has titles and numbers.")
    return content
