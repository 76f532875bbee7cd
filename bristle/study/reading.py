"""The runs of a study as measurements, each with what study.toml knows of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..data.measurement import Known, Measurement, measurements_of, stem_of
from ..data.pieces import pieces_of
from ..data.read import read_table
from ..data.table import Table
from ..errors import StudyError
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
    chosen = [run for run in settings.runs if role in (None, run.role)]
    count = Count("reading file", len({run.file for run in chosen}))
    for run in chosen:
        if run.file not in tables:
            count.begins(run.file)
            table = read_table(folder / run.file)
            split = settings.split
            tables[run.file] = pieces_of(table, split, settings.channels) if split else [table]
        found += _measured(folder, settings, run, tables[run.file])
    return found


def name_of_run(run: RunFile) -> str:
    """Return what a run's measurement is called."""
    stem = stem_of(run.file)
    return f"{stem} run {run.piece}" if run.piece else stem


def place_of_run(folder: Path, settings: Settings, name: str) -> tuple[str, int]:
    """Return file and piece of the run with a name, or of that with a part of this name.

    Raises
    ------
    StudyError
        If no run has such a name.
    """
    names = {name_of_run(run): (run.file, run.piece) for run in settings.runs}
    own = [one for one in names if name == one or name.startswith((f"{one} (", f"{one}, "))]
    if not own:
        raise StudyError(
            f'{folder / "study.toml"}: no run is called "{name}"; there are {", ".join(names)}.'
        )
    return names[max(own, key=len)]


def _measured(
    folder: Path, settings: Settings, run: RunFile, tables: Sequence[Table]
) -> list[Measurement]:
    """Return the measurements of a run among those of its file."""
    if run.piece > len(tables):
        raise StudyError(
            f"{folder / 'study.toml'}: {run.file} holds {len(tables)} runs, and "
            f"piece = {run.piece} is none of them."
        )
    known = Known(
        name_of_run(run), run.levels, run.labels, settings.rate, settings.mask, run.corrections,
        settings.extra,
    )  # fmt: skip
    return measurements_of(tables[max(run.piece, 1) - 1], settings.channels, known=known)
