"""Motions in time: the two-column file that an FMU reads, and what lies between its samples.

The file is CSV: `# ` lines, then the header `time [s],acceleration [m/s2]`, then one sample per
line, in order. Every other format is converted to this one before an FMU sees it.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator, Sequence
from math import isfinite

from ..errors import PhysicsError

HEADER = "time [s],acceleration [m/s2]"
ANY_HEADER = "time [s],NAME [UNIT]"
"""That of a signal, where NAME stands for any; so does UNIT, and a unit in its place for none else.
"""
LARGEST = 64 * 1024**2
"""Largest file that is read [bytes]: about two million samples."""
GAP = 1.5
"""A spacing above this many times the median is a gap."""


class Motion:
    """A quantity over time: linear between its samples, zero before and after them.

    Parameters
    ----------
    times : sequence of float
        (n,) s, increasing, n >= 2.
    values : sequence of float
        (n,) in any unit.
    """

    __slots__ = ("times", "values")

    def __init__(self, times: Sequence[float], values: Sequence[float]) -> None:
        self.times = list(times)
        self.values = list(values)

    def __call__(self, t: float) -> float:
        """Return the value at time t [s]."""
        return interpolate(t, self.times, self.values)

    @property
    def end(self) -> float:
        """Time of the last sample [s]."""
        return self.times[-1]

    @property
    def peak(self) -> float:
        """Largest absolute value."""
        return max(map(abs, self.values))


def interpolate(t: float, times: Sequence[float], values: Sequence[float]) -> float:
    """Return the value at time t: linear between samples, zero outside them.

    Takes lists and arrays, and compiles under numba as it is. Evenly spaced samples are found
    at once, others by bisection; a sample's own time gives its value to the last bit.

    Parameters
    ----------
    t : float
        s.
    times, values : sequence of float
        (n,) s, increasing, n >= 2; (n,) in any unit.
    """
    last = len(times) - 1
    if not times[0] <= t <= times[last]:  # not a number is outside, too
        return 0.0
    low = int((t - times[0]) / (times[last] - times[0]) * last)
    if low >= last:
        low = last - 1
    if not times[low] <= t < times[low + 1]:
        low, high = 0, last
        while high - low > 1:
            middle = (low + high) // 2
            if times[middle] <= t:
                low = middle
            else:
                high = middle
    if t == times[low + 1]:
        return values[low + 1]
    share = (t - times[low]) / (times[low + 1] - times[low])
    return values[low] + share * (values[low + 1] - values[low])


def read_two_column(
    path: str | os.PathLike[str], header: str = HEADER
) -> tuple[list[float], list[float]]:
    """Return times and values of a two-column CSV.

    Parameters
    ----------
    path : path
        The file.
    header : str
        What its header must be; see `ANY_HEADER`.

    Returns
    -------
    tuple of lists
        (n,) s, increasing from 0 or later, and (n,) in the unit of the header; n >= 2.

    Raises
    ------
    PhysicsError
        If the file cannot be read, or is not such a record: with file, line and remedy.
    """
    return parse_two_column(read_text(path), os.fspath(path), header)


def parse_two_column(text: str, name: str, header: str = HEADER) -> tuple[list[float], list[float]]:
    """Return times and values of the text of a two-column CSV, as `read_two_column` does."""
    lines, times, values = [], [], []
    found = ""
    for line, row in rows(text):
        if not found:
            found = row
            _check_header(name, line, row, header)
            continue
        fields = row.split(",")
        if len(fields) != 2:
            raise PhysicsError(
                f'{name}, line {line}: "{shortened(row)}" has {len(fields)} '
                f"column{'s' * (len(fields) != 1)}. Each line holds two numbers, time and value."
            )
        lines.append(line)
        times.append(number(fields[0], name, line))
        values.append(number(fields[1], name, line))
    if not found:
        raise PhysicsError(f'{name}: the file holds no samples. It begins with "{header}".')
    check_times(times, lines, name)
    return times, values


def read_text(path: str | os.PathLike[str], encoding: str = "utf-8-sig") -> str:
    """Return the text of a file, refusing what cannot be one before it is read.

    Raises
    ------
    PhysicsError
        If there is no such file, it is a folder or a device, is larger than `LARGEST`, may not be
        read, or is not text in that encoding.
    """
    name = os.fspath(path)
    try:
        status = os.stat(path)  # noqa: PTH116 (paths are plain text inside an FMU)
        if not stat.S_ISREG(status.st_mode):
            kind = "a folder" if stat.S_ISDIR(status.st_mode) else "no regular file"
            raise PhysicsError(f"{name}: this is {kind}. A record is one text file.")
        size = status.st_size
        content = b""
        if size <= LARGEST:
            with open(path, "rb") as file:  # noqa: PTH123
                content = file.read(LARGEST + 1)
            size = len(content)  # of a file that another process is writing, too
        if size > LARGEST:
            raise PhysicsError(
                f"{name}: {size / 1024**2:.0f} MB are more than the limit of "
                f"{LARGEST // 1024**2} MB for one record. Cut it, or sample it more coarsely."
            )
    except FileNotFoundError:
        raise PhysicsError(f"{name}: there is no such file.") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise PhysicsError(f"{name}: the file cannot be read ({reason}).") from None
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise PhysicsError(f"{name}: this is UTF-16. Save the file as UTF-8 text.")
    content = without_end_mark(content)
    if b"\0" in content:
        raise PhysicsError(f"{name}: this is binary data. A record is a text file, CSV or AT2.")
    try:
        return content.decode(encoding)
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise PhysicsError(
            f"{name}, line {line}: byte 0x{content[error.start]:02x} is not UTF-8. "
            "Save the file as UTF-8 text."
        ) from None


def without_end_mark(content: bytes) -> bytes:
    """Return a file's bytes without the byte 0x1A by which DOS ended a text, and what fills it."""
    text, mark, after = content.rpartition(b"\x1a")
    return text.rstrip(b"\x1a") if mark and not after.strip(b"\0 \t\r\n") else content


def rows(text: str) -> Iterator[tuple[int, str]]:
    """Yield the lines that are neither empty nor comments (`#`), each with its number from 1."""
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    for number, line in enumerate(lines, 1):
        stripped = line.strip()
        if stripped and not stripped.startswith("#"):
            yield number, stripped


def number(field: str, name: str, line: int, factor: float = 1.0) -> float:
    """Return factor times one number of a file, finite.

    Parameters
    ----------
    field : text of the number
    name, line : the file and the line from 1, for the message
    factor : into the unit wanted

    Raises
    ------
    PhysicsError
        If the field holds text, NaN or an infinity.
    """
    shown = shortened(field.strip())
    if not shown:
        raise PhysicsError(f"{name}, line {line}: a value is missing.")
    try:
        if "_" in field:  # float() reads 1_000
            raise ValueError
        value = factor * float(field)
    except ValueError:
        raise PhysicsError(f'{name}, line {line}: "{shown}" is not a number.') from None
    if not isfinite(value):
        raise PhysicsError(
            f"{name}, line {line}: {shown} is not finite. Every sample needs a value."
        )
    return value


def check_times(times: Sequence[float], lines: Sequence[int], name: str) -> None:
    """Refuse times that are too few, out of order, doubled, negative, or leave a gap.

    Parameters
    ----------
    times : sequence of float
        (n,) s.
    lines : sequence of int
        (n,) line of each sample, for the message.
    name : str
        The file, for the message.

    Raises
    ------
    PhysicsError
        With the line where the first fault is.
    """
    if len(times) < 2:
        raise PhysicsError(
            f"{name}: {len(times)} sample{'s' * (len(times) != 1)}. A record has two at least."
        )
    if times[0] < 0.0:
        raise PhysicsError(
            f"{name}, line {lines[0]}: the time begins at {times[0]:g} s, before a run does. "
            "Shift it to begin at 0 or later."
        )
    spacings = [after - before for before, after in zip(times, times[1:])]
    for k, spacing in enumerate(spacings, 1):
        if spacing <= 0.0:
            what = "appears twice" if spacing == 0.0 else f"follows {times[k - 1]!r} s"
            raise PhysicsError(
                f"{name}, line {lines[k]}: the time {times[k]!r} s {what}. "
                "Times increase from line to line; were they written with too few digits?"
            )
    usual = median(spacings)
    for k, spacing in enumerate(spacings, 1):
        if spacing > GAP * usual * (1.0 + 1e-6):  # times are rounded numbers
            raise PhysicsError(
                f"{name}, line {lines[k]}: a gap from {times[k - 1]:g} s to {times[k]:g} s, where "
                f"the usual spacing is {usual:g} s. Fill it, or cut the record there."
            )


def median(values: Sequence[float]) -> float:
    """Return the median, the mean of the middle two for an even count."""
    ordered = sorted(values)
    return 0.5 * (ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2])


def shortened(text: str) -> str:
    """Return at most 40 characters of a text, for a message; what cannot be seen as its code."""
    seen = text if len(text) <= 40 else text[:37] + "..."
    return "".join(c if c.isprintable() or c == "\t" else f"\\x{ord(c):02x}" for c in seen)


def is_two_column(text: str) -> bool:
    """Return whether a text has the header of the file that an FMU reads."""
    _, first = next(rows(text), (0, ""))
    return _columns(first) == _columns(HEADER)


def _columns(row: str) -> list[str]:
    return [column.strip() for column in row.split(",")]


def _check_header(name: str, line: int, row: str, header: str) -> None:
    found, wanted = _columns(row), _columns(header)
    if len(found) == 2 and wanted[1][:5] == "NAME ":
        unit = wanted[1][5:]
        if unit == "[UNIT]" or "[" not in found[1] or found[1].endswith(unit):
            wanted[1] = found[1]
    if found != wanted:
        raise PhysicsError(
            f'{name}, line {line}: the header is "{shortened(row)}". It must be "{header}".'
        )
