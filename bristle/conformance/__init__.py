"""Judge an FMU: every rule of FMI 2.0 or 3.0 co-simulation that can be tried from outside.

`conform(path)` tries each probe in a process of its own, so that an FMU that crashes, hangs or
leaves the process ends one row of the table and nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .report import Report

__all__ = ["conform"]


def conform(
    path: Path | str,
    timeout: float = 20.0,
    *,
    only: Collection[str] | None = None,
    beside: Path | str | None = None,
    progress: Callable[[str], None] | None = None,
) -> Report:
    """Try a co-simulation FMU of FMI 2.0 or 3.0 against the standard; return what was seen.

    Parameters
    ----------
    path : Path or str
        The .fmu file, anybody's.
    timeout : float
        Time limit of one call in s; an FMU that does not answer by then fails the probe.
    only : collection of str, optional
        Names of the probes to try; all of them otherwise.
    beside : Path or str, optional
        Another FMU to load into the same process; a trivial one of our own otherwise.
    progress : callable, optional
        Called with the name of each probe before it starts.

    Returns
    -------
    Report
        `rows` (probe, tried, seen, standard, verdict), `ok` (no verdict is "fail"), `to_json()`.

    Raises
    ------
    FmuError
        If the file cannot or must not be opened, a probe is unknown or the time limit is not
        positive.
    """
    from .runner import judge

    return judge(Path(path), timeout, only, None if beside is None else Path(beside), progress)
