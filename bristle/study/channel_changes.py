"""Channels of a study that exists are read in another way: columns, units and signs corrected."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..data.channels import ChannelSpec
from ..data.files import write_whole
from ..data.guess import Guess
from ..data.read import read_table
from ..errors import StudyError
from ..progress import tell
from .channel_proposal import ChannelChange, Proposal, first_table, proposed
from .new import refuse_other_columns
from .reading import read_runs
from .set_aside import DRAFT, Results, results_of
from .settings import read_settings

if TYPE_CHECKING:
    from .study import Study


@dataclass(frozen=True)
class CorrectedChannels:
    """Channels that are read in another way now, and what is no longer of the data.

    `kept` is the folder where it is kept; None where there was nothing, or nothing was written.
    """

    changes: tuple[ChannelChange, ...]
    notes: tuple[str, ...]
    results: Results
    kept: Path | None = None


def correct_channels(
    study: Study,
    channels: Mapping[str, ChannelSpec],
    *,
    without: Sequence[str] = (),
    write: bool = True,
) -> CorrectedChannels:
    """Read channels of a study in another way; where anything is wrong it stays as it was.

    Fits, verdict and reports were of the data as they were read: they are set aside, and the model
    is the last one that was from no data.

    Parameters
    ----------
    study : Study
        The folder, opened.
    channels : mapping
        Where channels are from now on: column, unit, sign. A unit that is not given is that of the
        column's title, or stays where the column does.
    without : sequence of str
        Channels that are no longer read.
    write : bool
        Whether study.toml is written; else it is told what would change.

    Raises
    ------
    StudyError
        If there is no such channel, a unit is not that of its quantity, two channels claim one
        column, or a channel that the rig needs would be missing.
    RecordError
        If a file has no such column, or cannot be read by it.
    """
    with study.writing():
        file, draft = study.folder / "study.toml", study.folder / DRAFT
        made = proposed(study.folder, read_settings(file), channels, without)
        results = results_of(study.folder)
        if not made.changes:
            return CorrectedChannels((), (), results)
        _refuse_unreadable(study.folder, made)
        if not write:
            return CorrectedChannels(made.changes, made.notes, results)
        begun, kept = False, None
        try:
            write_whole(draft, made.text)
            _refuse_other(draft, made)
            study.history.keep_edit()
            results = results_of(study.folder)
            begun = True
            if results:
                kept = study.history.begin_anew(results.first)
            else:
                draft.replace(file)
        finally:
            if not begun:
                draft.unlink(missing_ok=True)
    return CorrectedChannels(made.changes, made.notes, results, kept)


def _refuse_unreadable(folder: Path, made: Proposal) -> None:
    """Refuse channels by which a run of the study cannot be read."""
    tell("reading all runs")
    settings = made.settings
    first = first_table(folder, settings)
    columns = [
        Guess(one.channel, one.after.column, one.after.unit, one.after.sign, "")
        for one in made.changes
        if one.after is not None and one.after.step is None
    ]
    for file in dict.fromkeys(run.file for run in settings.runs):
        refuse_other_columns(read_table(folder / file), columns, first)
    read_runs(folder, settings)


def _refuse_other(draft: Path, made: Proposal) -> None:
    """Refuse a study.toml that says anything else than what was checked."""
    there, right = read_settings(draft), made.settings
    same = (
        there.channels == right.channels and there.extra == right.extra
        and there.runs == right.runs and there.excluded == right.excluded
    )  # fmt: skip
    if not same:
        raise StudyError(
            f"{draft.with_name('study.toml')}: its tables stand in an order in which the channels "
            "cannot be changed by a command. Change [channels] by hand."
        )
