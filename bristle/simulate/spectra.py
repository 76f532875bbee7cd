"""Response spectra of a run: of the ground, and of the floors as equipment on them feels it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..data.response_spectrum import response_spectrum, usual_periods
from ..errors import not_usable
from .results import cannot_write

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

Array = NDArray[np.float64]

FILE = "spectrum.csv"
ENDS = ("ground_acceleration", "_acceleration_absolute")
"""How outputs end that have a spectrum: absolute accelerations."""


def accelerations(names: Mapping[str, object]) -> list[str]:
    """Return those names of outputs that are absolute accelerations, in their order."""
    return [name for name in names if name.endswith(ENDS)]


def spectra(columns: Mapping[str, Array], step: float) -> dict[str, Array]:
    """Return the 5 % damped spectra of absolute acceleration of a run's ground and floors.

    Parameters
    ----------
    columns : name of an output to its rows (n,), accelerations [m/s2]
    step : between two rows [s]

    Returns
    -------
    dict
        "period" (m,) s, then each acceleration's spectrum (m,) m/s2 by the name of the output.

    Raises
    ------
    RunError
        If no output is an absolute acceleration, one is not finite, or the rows are too far apart.
    """
    names = accelerations(columns)
    periods = usual_periods(step)
    if not names:
        raise not_usable(
            "no output is an acceleration of ground or floor, so that there is no response "
            "spectrum. A scenario with a Structure has them."
        )
    if not len(periods):
        raise not_usable(f"rows {step:g} s apart are too few for a response spectrum.")
    broken = [name for name in names if not np.isfinite(columns[name]).all()]
    if broken:
        raise not_usable(f"{', '.join(broken)}: not finite, so that there is no response spectrum.")
    found = {name: response_spectrum(columns[name], step, periods) for name in names}
    return {"period": periods, **found}


def write_spectra(frame: pd.DataFrame, path: Path) -> None:
    """Write a run's spectra as CSV: a row per period, a column per acceleration, with units.

    Raises
    ------
    RunError
        As `spectra`, or if the file cannot be written.
    """
    if len(frame) < 2:
        raise not_usable("the run has one row alone: there is no response spectrum.")
    columns = {str(name): frame[name].to_numpy() for name in frame}
    found = spectra(columns, float(frame.index[1] - frame.index[0]))
    head = ["period [s]", *(f"{name} [m/s2]" for name in list(found)[1:])]
    rows = [",".join(head)]
    rows += [",".join(f"{value:.9g}" for value in row) for row in zip(*found.values(), strict=True)]
    try:
        path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    except OSError as error:
        raise cannot_write(path, error, 0) from error
