"""A new study from files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..data.channels import ChannelSpec
from ..data.guess import Guess
from .new import make_folder
from .run_facts import RunChoices
from .study import Study


@dataclass(frozen=True)
class Created:
    """A study that was made: what was guessed, what was left out, and what to know.

    `extra` are the channels besides those that bristle knows, by name.
    """

    study: Study
    guesses: tuple[Guess, ...]
    extra: Mapping[str, ChannelSpec]
    unused: tuple[str, ...]
    notes: tuple[str, ...]


def create_study(
    folder: Path | str,
    files: Sequence[Path | str],
    *,
    rig: str = "bench",
    building: Path | str | None = None,
    channels: Mapping[str, ChannelSpec] | None = None,
    title: str = "",
    law: str | None = None,
    runs: RunChoices | None = None,
    device: str | None = None,
    without: Sequence[str] = (),
) -> Created:
    """Make a study's folder from files; it appears when it is whole.

    Parameters
    ----------
    folder : path
        The folder to make; it must not exist.
    files : paths
        One run each, with the same columns.
    rig : {"bench", "structure"}
        Motion prescribed and force measured, or ground motion in and response out.
    building : path
        The data file of the structure.
    channels : mapping
        Channels that are known; the others are guessed from the first file.
    title : str
        Title of the study.
    law : str
        The law that its model begins with. None: "lugre", and on a test bench a diagnosis seeks the
        law together with its effects.
    runs : RunChoices
        What is known of whole runs, and how files hold them.
    device : str
        Of a building with several devices the one that the study is about. None: its only one, or
        the damper on the first level of a building without devices of its own.
    without : sequence of str
        Channels that are not read, though a column was guessed to hold them.

    Raises
    ------
    StudyError
        If the folder exists, a needed channel or its unit cannot be told, or files differ.
    PhysicsError
        If the building's file is wrong, or it is not clear which device is meant.
    RecordError
        If a file cannot be read.
    """
    made = make_folder(
        Path(folder), files, rig=rig, building=building, channels=channels, title=title, law=law,
        runs=runs, device=device, without=without,
    )  # fmt: skip
    return Created(Study(folder), made.guesses, made.extra, made.unused, made.notes)
