"""Runs an ensemble: what is left of it, in processes, kept as it comes."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..core.progress import Progress
from ..core.text import written
from ..errors import EnsembleError, RunError
from ..view import Viewable
from .campaign import run_local
from .ensemble_file import EnsemblePlan, read_ensemble
from .table import NAME, Failure, RunsTable, failures, quantiles

if TYPE_CHECKING:
    import pandas as pd


class EnsembleInterrupted(KeyboardInterrupt):
    """An ensemble that Ctrl-C has stopped; what is done is in its folder."""


@dataclass(frozen=True, repr=False)
class Ensemble(Viewable):
    """What an ensemble has found.

    Attributes
    ----------
    runs : DataFrame
        Index run; status ("done", "failed"), reason, what varied, outputs. `attrs["units"]`.
    quantiles : DataFrame
        Index output; unit, "5 %" ... "95 %", how many runs are done and failed.
    failures : list of Failure
        By reason, most frequent first.
    continued : int
        How many runs were there already.
    wall_time : float
        [s], of this start.

    Examples
    --------
    >>> import bristle
    >>> found = bristle.ensemble("el_centro_damper_and_building", runs=2, workers=1)
    >>> len(found.runs), found.failures
    (2, [])
    """

    plan: EnsemblePlan
    runs: pd.DataFrame
    quantiles: pd.DataFrame
    failures: list[Failure]
    continued: int
    wall_time: float


def ensemble(
    file: str | Path,
    *,
    out: str | Path | None = None,
    runs: int | None = None,
    workers: int | None = None,
    fresh: bool = False,
    retry: bool = False,
    progress: bool = False,
) -> Ensemble:
    """Run an ensemble, or what is left of it, and return tables of runs and quantiles.

    Run i has the same values and numbers whatever the order and the number of processes.

    Parameters
    ----------
    file : path
        An ensemble file, or the name of a stock ensemble.
    out : path, optional
        Folder in which runs.csv grows; an ensemble that was stopped there is continued. Without it
        all is kept in memory.
    runs : int, optional
        In place of the file's number; more runs continue an ensemble.
    workers : int, optional
        Processes on this machine; else as many as it has cores.
    fresh : bool
        Start anew in a folder that holds runs.
    retry : bool
        Run again what failed.
    progress : bool
        Show a progress bar, on a terminal only.

    Returns
    -------
    Ensemble
        `runs`, `quantiles` and `failures`.

    Raises
    ------
    EnsembleError, ScenarioError
        The input is wrong, or the folder holds runs of another ensemble; nothing was run.
    RunError
        The disk is full; what is done is kept.
    KeyboardInterrupt
        Ctrl-C; what is done is kept.

    Examples
    --------
    >>> import bristle
    >>> found = bristle.ensemble("el_centro_damper_and_building", runs=3, workers=1)
    >>> peak = found.quantiles.loc["peak structure.floor2_acceleration_absolute"]
    >>> peak["unit"], int(peak["done"])
    ('m/s2', 3)
    >>> figure = found.plot()  # a notebook shows `found` itself: table and picture
    """
    began = time.perf_counter()
    _refuse_types(file, runs=runs, workers=workers)
    plan = read_ensemble(file, runs)
    if workers is not None and workers < 1:
        raise EnsembleError(f"--workers {workers}: 1 or more is right.")
    folder = None if out is None else Path(out)
    with _claimed(folder):
        table = RunsTable(plan, folder / NAME if folder else None, fresh)
        if retry:
            table.forget_failures()
        continued = sum(run < plan.runs for run in table.outcomes)
        try:
            with Progress(plan.title, plan.runs, progress and bool(table.left)) as bar:
                run_left(plan, table, workers or cores(), lambda: bar.show(len(table.outcomes)))
        except RunError as error:
            raise RunError(f"{error} {_what_is_kept(table)}") from error
        except KeyboardInterrupt:
            raise EnsembleInterrupted(f"interrupted. {_what_is_kept(table)}") from None
        finally:
            table.close(complete=len(table.outcomes) >= plan.runs)
    frame = table.frame()
    frame = frame[frame.index < plan.runs]
    seconds = time.perf_counter() - began
    outcomes = [o for run, o in table.outcomes.items() if run < plan.runs]
    return Ensemble(plan, frame, quantiles(plan, frame), failures(outcomes), continued, seconds)


def _refuse_types(file: object, **numbers: object) -> None:
    """Refuse arguments of ensemble of a type that it does not take."""
    if not isinstance(file, str | Path):
        raise EnsembleError(
            f"ensemble takes a file or the name of a stock ensemble, not {written(file)}."
        )
    for name, value in numbers.items():
        if value is not None and (isinstance(value, bool) or not isinstance(value, int)):
            raise EnsembleError(f"{name} is {written(value)}; a whole number from 1 is right.")


def run_left(plan: EnsemblePlan, table: RunsTable, workers: int, done: Callable[[], None]) -> None:
    """Make the runs that a table lacks, and keep each in it as it ends.

    Parameters
    ----------
    plan, table : what is run, and what there is
    workers : processes on this machine
    done : called after each run
    """
    if not table.left:
        return
    campaign = plan.campaign()
    campaign.prepare()
    with closing(run_local(campaign, table.left, min(workers, len(table.left)))) as outcomes:
        for outcome in outcomes:
            table.add(outcome)
            done()


def cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _what_is_kept(table: RunsTable) -> str:
    if table.path is None:
        return "Nothing was kept, because no folder was given."
    return (
        f"{len(table.outcomes)} of {table.plan.runs} runs are kept in {table.path}; the same "
        "command continues them."
    )


@contextmanager
def _claimed(folder: Path | None) -> Iterator[None]:
    """Hold a folder that nobody else writes an ensemble into; None is always free."""
    from filelock import FileLock, Timeout

    if folder is None:
        yield
        return
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = FileLock(folder / ".lock")
        lock.acquire(timeout=0)
    except Timeout:
        raise EnsembleError(f"{folder}: another process is running an ensemble there.") from None
    except FileExistsError:
        raise EnsembleError(f"{folder}: is a file; runs go into a folder.") from None
    except OSError as error:
        raise EnsembleError(f"{folder}: cannot be written ({error.strerror or error}).") from None
    try:
        yield
    finally:
        lock.release()
