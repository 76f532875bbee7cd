"""More runs in a study: read as its others are, with a role each; model and history stay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from ..core.files import write_whole
from ..core.progress import counted
from ..core.text import listed
from ..data.channels import DRIVE
from ..data.guess import Guess
from ..data.measurement import measurements_of
from ..data.pieces import holds_several, pieces_of
from ..data.read import read_table
from ..data.table import Table
from ..data.tone import Tone, tone_of
from ..errors import StudyError
from .new import refuse_other_columns, remarks_on
from .run_facts import RunChoices, facts_of, of_columns, roles_by_name
from .runs import read_runs
from .study import FILE as ADDED
from .study import Study, note_addition
from .study_file import EXCLUDE, RunFile, draft_of, read_draft, with_runs


@dataclass(frozen=True)
class Extended:
    """A study with more runs: those that were added, and what to know of them."""

    study: Study
    runs: tuple[RunFile, ...]
    notes: tuple[str, ...]


def extend_study(
    study: Study,
    files: Sequence[Path | str],
    *,
    roles: Mapping[str, str] | None = None,
    holdout: Sequence[str] = (),
    choices: RunChoices | None = None,
) -> Extended:
    """Add runs to a study; where anything is wrong it stays as it was.

    Its model and its history stay. Its verdict was on fewer runs: it is kept with the step of its
    model, and is no longer the present one.

    Parameters
    ----------
    study : Study
        The folder, opened.
    files : paths
        One run each, or several as `split` in study.toml says, with the columns of the others.
    roles : mapping
        Name of a file to the role of its runs, where it is known.
    holdout : sequence of str
        Patterns of the names of files whose runs are held out; all others are then for training.
    choices : RunChoices
        Levels, labels and a table of the runs; how files are read is in study.toml.

    Raises
    ------
    StudyError
        If a file is in the study already, or its columns are others; if no run would be for
        training or none held out.
    RecordError
        If a file cannot be read.
    """
    paths, choices = [Path(file) for file in files], choices or RunChoices()
    _refuse_names(study, paths)
    tables = [read_table(path, study.settings.split) for path in counted(paths, "reading file")]
    first, columns = _columns(study)
    for table in tables:
        refuse_other_columns(table, columns, first)
    labels = {name for run in study.settings.runs for name in run.labels}
    told = of_columns(tables, {one.column for one in columns}, known=labels)[0]
    about, notes = facts_of(
        paths, choices, bool({*DRIVE} & {*study.settings.channels}), _tones(study, tables),
        [Path(run.file) for run in (*study.settings.runs, *study.settings.excluded)], told,
    )  # fmt: skip
    notes += remarks_on([path.name for path in paths], tables, columns, first)
    assigned, said = _roles(paths, roles or {}, holdout)
    split = study.settings.split
    runs = tuple(
        RunFile(f"data/{path.name}", one.role or role, one.levels, one.labels, number)
        for path, table, one, role in zip(paths, tables, about, assigned, strict=True)
        for number in _numbers(table, split, study)
    )
    if not any(one.role for one in about):
        notes += said
    _written(study, paths, runs)
    return Extended(Study(study.folder), runs, tuple(notes))


def _tones(study: Study, tables: Sequence[Table]) -> list[Tone | None]:
    """Return the tone of the motion in each file; None where files hold several runs."""
    if holds_several(study.settings.split):
        return [None] * len(tables)
    read = [measurements_of(table, study.settings.channels, estimate=False) for table in tables]
    return [tone_of(runs[0]) if len(runs) == 1 else None for runs in read]


def _refuse_names(study: Study, paths: Sequence[Path]) -> None:
    """Refuse files that are none, or whose names are taken."""
    if not paths:
        raise StudyError("no measurements are given: name their files.")
    names = [path.name.lower() for path in paths]
    twice = next((path.name for path in paths if names.count(path.name.lower()) > 1), "")
    if twice:
        raise StudyError(f"{names.count(twice.lower())} files are called {twice}. Rename them.")
    taken = {path.name.lower() for path in (study.folder / "data").glob("*")}
    there = [path.name for path in paths if path.name.lower() in taken]
    if there:
        raise StudyError(
            f"{study.folder / 'data'}: {listed(there)} {'is' if len(there) == 1 else 'are'} "
            "there already. Rename the new runs, if these are others."
        )


def _columns(study: Study) -> tuple[Table, list[Guess]]:
    """Return the table of the study's first run, and the columns that the study reads."""
    first = read_table(study.folder / study.settings.runs[0].file, study.settings.split)
    return first, [
        Guess(name, first.find(spec.column).text, spec.unit, spec.sign, "")
        for name, spec in study.settings.channels.items()
        if spec.step is None
    ]


def _roles(
    paths: Sequence[Path], roles: Mapping[str, str], holdout: Sequence[str]
) -> tuple[list[str], list[str]]:
    """Return the role of each file's runs, and why, in sentences."""
    for pattern in holdout:
        if not any(fnmatchcase(path.name, pattern) for path in paths):
            names = listed(path.name for path in paths)
            raise StudyError(f'--holdout "{pattern}": none of the new files is it: {names}.')
    known = dict(roles)
    if holdout:
        for path in paths:
            held_out = any(fnmatchcase(path.name, pattern) for pattern in holdout)
            known[path.name] = "holdout" if held_out else known.get(path.name, "train")
    left = [path.name for path in paths if path.name not in known]
    guessed, notes = roles_by_name(left, added=True) if left else ([], [])
    known |= dict(zip(left, guessed, strict=True))
    return [known[path.name] for path in paths], notes


def _numbers(table: Table, split: str, study: Study) -> list[int]:
    """Return the numbers of the runs in a file; 0 where it holds one."""
    if not holds_several(split):
        return [0]
    return list(range(1, 1 + len(list(pieces_of(table, split, study.settings.channels)))))


def _written(study: Study, paths: Sequence[Path], runs: tuple[RunFile, ...]) -> None:
    """Copy the files, check the study that they make, then write its study.toml."""
    placed: list[Path] = []
    folder, kept = study.folder, False
    file = folder / "study.toml"
    with study.writing():
        added = folder / ADDED
        before = added.read_bytes() if added.is_file() else None
        try:
            for path in paths:
                placed.append(folder / "data" / path.name)
                write_whole(placed[-1], path.read_bytes())
            text = file.read_text(encoding="utf-8-sig")
            with draft_of(file, with_runs(text, runs)) as draft:
                _refuse_wrong(folder, draft, runs)
                note_addition(study, [run.file for run in runs if run.role != EXCLUDE])
            kept = True
        finally:
            if not kept:
                for path in placed:
                    path.unlink(missing_ok=True)
                _restore(added, before)
        study.history.set_verdict_aside()


def _restore(file: Path, before: bytes | None) -> None:
    """Make a file what it was before."""
    if before is None:
        file.unlink(missing_ok=True)
    elif file.read_bytes() != before:
        write_whole(file, before)


def _refuse_wrong(folder: Path, draft: Path, runs: Sequence[RunFile]) -> None:
    """Refuse a study.toml with a mistake, too few roles, or a run that is one of the others."""
    settings = read_draft(draft, folder / "study.toml")
    roles = {run.role for run in settings.runs}
    lacking = [role for role in ("train", "holdout") if role not in roles]
    if lacking:
        what = "for training" if lacking[0] == "train" else "held out"
        raise StudyError(
            f"no run of the study would be {what}. Name some with --holdout, and leave others."
        )
    new = {str(folder / run.file) for run in runs}
    first: dict[str, str] = {}
    for one in sorted(read_runs(folder, settings), key=lambda run: run.source in new):
        other = first.setdefault(one.digest(), one.name)
        if other != one.name and one.source in new:
            raise StudyError(
                f"{one.name} is the same measurement as {other}: it tells nothing new. Leave it "
                "out."
            )
