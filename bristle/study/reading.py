"""The runs of a study as measurements, each with what study.toml knows of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..data.measurement import Known, Measurement, measurements_of
from ..data.pieces import pieces_of
from ..data.read import read_table
from ..data.run_names import is_part, names_of_files
from ..data.table import Table
from ..errors import StudyError
from ..findings import listed
from ..progress import Count
from .run_file import RunFile
from .settings import Settings


def read_runs(folder: Path, settings: Settings, role: str | None = None) -> list[Measurement]:
    """Return the measurements of a study's runs; a file of several runs is read once.

    Parameters
    ----------
    folder : the study's
    settings : the content of its study.toml
    role : the role of the runs; None for all

    Raises
    ------
    RecordError
        If a file cannot be read.
    StudyError
        If a run is none of those in its file.
    """
    tables: dict[str, Sequence[Table]] = {}
    found: list[Measurement] = []
    names = names_of_runs(settings)
    chosen = [run for run in settings.runs if role in (None, run.role)]
    count = Count("reading file", len({run.file for run in chosen}))
    for run in chosen:
        if run.file not in tables:
            count.begins(run.file)
            table = read_table(folder / run.file)
            split = settings.split
            tables[run.file] = pieces_of(table, split, settings.channels) if split else [table]
        name = names[run.file, run.piece]
        found += _measured(folder, settings, run, name, tables[run.file])
    return found


def names_of_runs(settings: Settings) -> dict[tuple[str, int], str]:
    """Return what the measurement of each run is called, by file and piece; no two are alike.

    Runs that are left out count: the others keep their names when one is left out or comes back.
    """
    every = (*settings.runs, *settings.excluded)
    ends = [f" run {run.piece}" if run.piece else "" for run in every]
    names = names_of_files([run.file for run in every], ends)
    return {(run.file, run.piece): name for run, name in zip(every, names, strict=True)}


def place_of_run(folder: Path, settings: Settings, name: str) -> tuple[str, int]:
    """Return file and piece of the run with a name, or of that with a part of this name.

    Raises
    ------
    StudyError
        If no run has such a name.
    """
    known = names_of_runs(settings)
    places = {known[run.file, run.piece]: (run.file, run.piece) for run in settings.runs}
    own = [one for one in places if is_part(name, one)]
    if not own:
        raise StudyError(
            f'{folder / "study.toml"}: no run is called "{name}"; there are {listed(places)}.'
        )
    return places[max(own, key=len)]


def _measured(
    folder: Path, settings: Settings, run: RunFile, name: str, tables: Sequence[Table]
) -> list[Measurement]:
    """Return the measurements of a run, by its name, among those of its file."""
    if run.piece > len(tables):
        raise StudyError(
            f"{folder / 'study.toml'}: {run.file} holds {len(tables)} runs, and "
            f"piece = {run.piece} is none of them."
        )
    known = Known(
        name, run.levels, run.labels, settings.rate, settings.mask, run.corrections, settings.extra,
    )  # fmt: skip
    return measurements_of(tables[max(run.piece, 1) - 1], settings.channels, known=known)
