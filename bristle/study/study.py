"""A study: a folder with measurements, the model held against them, and how it came to be."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from ..core.config import other_schema, toml_content
from ..core.files import read_json, write_json, write_whole
from ..core.text import command, listed, plural, shown, written
from ..data.channels import ChannelSpec
from ..data.corrections import Correction
from ..data.measurement import Measurement, names_of_files
from ..errors import StudyError
from ..model.model import Model
from ..model.model_file import model_text, read_model
from ..trust import can_do_without
from ..user_code.load import Loaded, load, waiting
from ..version import __version__
from ..view import Viewable
from .history import ANEW, History, Step, building_in
from .new import make_folder, parse_channel
from .run_facts import roles_by_place
from .runs import (
    Runs,
    joined_corrections,
    read_runs,
    refuse_twins,
    split_in_time,
    twins_within,
    usable,
)
from .study_file import (
    ROLES,
    TEST,
    Settings,
    channel_as_toml,
    draft_of,
    read_draft,
    read_settings,
    with_corrections,
    with_mask,
    with_roles,
)

PATIENCE = 10.0
"""Seconds to wait for another process that writes in the same study."""


_AGAIN = "Nothing is written; run this again (in Python, open the study again first)."


class Study(Viewable):
    """A study: a folder with measurements, a model, its history and verdict.

    Reading needs no lock. What is written is written whole, under a lock, and refused when another
    process has changed the model since this one has read it.

    Parameters
    ----------
    folder : path
        The folder that holds study.toml.
    trust : bool
        Whether to consent to the code in its effects/, which is remembered. Without it, what has
        not run here before does not run: data, history, verdict and report can be read all the
        same.

    Raises
    ------
    StudyError
        If there is no study, or its study.toml is wrong: with every mistake and its line.

    Examples
    --------
    >>> import bristle, numpy as np, pathlib, tempfile
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> t = np.arange(0.0, 8.0, 0.004)
    >>> v = 72e-3 * np.cos(9.0 * t)
    >>> columns = {"time [s]": t, "v [mm/s]": 1e3 * v, "F [N]": 5.0 * np.sign(v) + 90.0 * v}
    >>> np.savetxt(
    ...     folder / "run.csv", np.column_stack(list(columns.values())), delimiter=",",
    ...     header=",".join(columns), comments="",
    ... )
    >>> study = bristle.Study.create(folder / "my_rig", [folder / "run.csv"], law="bingham")
    >>> study.model().law, [step.what for step in study.steps()]
    ('bingham', ['begin with bingham'])
    >>> figure = study.plot()  # its first run
    """

    def __init__(self, folder: Path | str, *, trust: bool = False) -> None:
        if not isinstance(folder, str | Path):
            raise StudyError(f"a study is a folder, not {written(folder)}.")
        self.folder = Path(folder)
        if not (self.folder / "study.toml").is_file():
            new = self.folder if self.folder.name else "NAME"
            raise StudyError(
                f"{self.folder}: no study: there is no study.toml. Make one with  "
                f"{command('study', 'new', new, '--data', 'lab/*.csv')}"
            )
        self.history = History(self.folder)
        self._lock = FileLock(self.folder / ".lock")
        self._complete_unfinished()
        self.own_laws = load(self.laws_folder, "law", trust=trust)
        self.own_effects = load(self.effects_folder, trust=trust)
        self.settings: Settings = read_settings(self.folder / "study.toml")
        self._seen = self._state()
        self._seen_data = ""
        self._read: dict[str | None, tuple[Any, list[Measurement]]] = {}

    own_effects: list[Loaded]
    """The files of effects/, each with its effect or why it is left out."""

    own_laws: list[Loaded]
    """The files of laws/, each with its law or why it is left out."""

    @classmethod
    def create(cls, folder: Path | str, files: Sequence[Path | str], **choices: Any) -> Study:
        """Make a study's folder from files; see `bristle.study.create_study` for the choices."""
        make_folder(Path(folder), files, **choices)
        return cls(folder)

    @property
    def name(self) -> str:
        """The folder's name."""
        return self.folder.resolve().name

    @property
    def effects_folder(self) -> Path:
        """Where the user's own effects are."""
        return self.folder / "effects"

    @property
    def laws_folder(self) -> Path:
        """Where the user's own laws are."""
        return self.folder / "laws"

    def usable_effects(self) -> list[str]:
        """Register the user's own effects and laws that can be compiled; say why others cannot be.

        Call it before a fit or a diagnosis: an effect that cannot be compiled would take all others
        along. What waits for consent, and is not in the model, is left out like these.

        Raises
        ------
        TrustError
            If the model has one whose code must not run yet.
        """
        from ..user_code.conformance import usable

        laws, effects = load(self.laws_folder, "law"), load(self.effects_folder)
        for one in (*laws, *effects):
            if untrusted := waiting(one.path):
                read_model(self.folder / "model.toml")  # raises where the model has it
                can_do_without(untrusted)
        self.own_laws, self.own_effects = usable(laws), usable(effects)
        return self.left_out()

    def left_out(self) -> list[str]:
        """Return why own laws and effects were left out when they were last read."""
        return [one.error for one in (*self.own_laws, *self.own_effects) if one.error]

    @property
    def reports_folder(self) -> Path:
        """Where reports and pictures go."""
        return self.folder / "reports"

    def files(self, role: str | None = None) -> list[Path]:
        """Return the files of the runs, all or those of one role."""
        own = [run.file for run in self.settings.runs if role in (None, run.role)]
        return [self.folder / file for file in dict.fromkeys(own)]

    def read(self, role: str | None = None) -> list[Measurement]:
        """Return the measurements as they are in the files, without a look at what they are for.

        Files are read again where their content or the settings are others.

        Raises
        ------
        RecordError
            If a file cannot be read.
        """
        now = self.settings, [_of_file(file) for file in self.files(role)]
        if role not in self._read or self._read[role][0] != now:
            self._read[role] = now, read_runs(self.folder, self.settings, role)
        return [*self._read[role][1]]

    def runs(self) -> Runs:
        """Return the measurements for training and those held out; test runs are not read.

        A single run is split in time, 70 to 30 %.

        Raises
        ------
        StudyError
            If no run is held out, or a run held out is also one for training.
        RecordError
            If a file cannot be read.
        """
        (train, idle), (holdout, other) = (usable(self.read(role)) for role in ROLES[:2])
        idle = (*idle, *other)
        if self.settings.excluded:
            idle = (*idle, self.settings.excluded_text)
        if changed := behind_data(self):
            idle = (*idle, changed)
        if sum(run.role != TEST for run in self.settings.runs) == 1:
            split = split_in_time([*train, *holdout])
            return replace(split, notes=(*split.notes, *idle))
        if not train or not holdout:
            lacking = ROLES[0] if not train else ROLES[1]
            raise StudyError(
                f'{self.folder / "study.toml"}: no run has role = "{lacking}". Give it to some: a '
                "model is tested on runs that it was not fitted to. "
                f"{command('study', 'roles', self.folder, f'--{lacking}', 'RUN')}"
            )
        refuse_twins(train, holdout, self.folder)
        twins = twins_within(train) + twins_within(holdout)
        return Runs(train, holdout, (*idle, *twins))

    def model(self, *, to_show: bool = False) -> Model:
        """Return the present model.

        Parameters
        ----------
        to_show : bool
            Whether the model is only to be shown: then an effect whose code must not run yet is
            there with the values of the file.

        Raises
        ------
        StudyError
            With every mistake of model.toml.
        TrustError
            If the model has an effect whose code must not run yet.
        """
        # Another study that was opened since may have own ones of the same names.
        load(self.laws_folder, "law")
        load(self.effects_folder)
        try:
            model = read_model(self.folder / "model.toml", to_show=to_show)
        except StudyError as error:
            raise StudyError(f"{error}{self._other_version()}") from None
        self._seen = self._state()
        if not to_show:  # files change seldom, and are large
            self._seen_data = data_digest(self.folder, self.settings, model.building)
        return model.with_drive(self.drive or model.drive)

    def model_of(self, step: int, *, to_show: bool = False) -> Model:
        """Return the model of a step of the history; see `model` for what is raised."""
        model = read_model(self.history.model_file(step), self.folder, to_show=to_show)
        return model.with_drive(self.drive or model.drive)

    @property
    def data(self) -> str:
        """A digest of what a fit and its judge see, as they are now: see `data_digest`."""
        return data_digest(self.folder, self.settings, building_in(self.folder / "model.toml"))

    @property
    def drive(self) -> str:
        """The channel that commands the damper, "" where none was measured."""
        return self.settings.drive

    def _other_version(self) -> str:
        """Return that another version of bristle wrote the present model, "" where this one did."""
        numbers = self.history.numbers()
        made_by = self.history.noted(numbers[-1], "bristle") if numbers else ""
        if made_by in ("", __version__):
            return ""
        return f"\n  bristle {made_by} wrote this model, and this is bristle {__version__}."

    def steps(self) -> list[Step]:
        """Return the history since the data are read as they are, its first model included."""
        steps = self.history.steps()
        first = max((k for k, one in enumerate(steps) if one.what.startswith(ANEW)), default=0)
        return steps[first:]

    def add_step(
        self,
        what: str,
        why: str,
        model: Model,
        before: Mapping[str, Any] | None = None,
        after: Mapping[str, Any] | None = None,
    ) -> Step:
        """Make a model the present one, with a new step in the history; its verdict is gone.

        Parameters
        ----------
        what, why : str
            As in "add gas_spring", "verdict of the diagnosis: ...".
        model : Model
            The model that is written to model.toml.
        before, after : mapping
            Errors of the two models by name, on training and held-out runs.

        Raises
        ------
        StudyError
            If another process has changed the model or the data since they were read here, writes
            for longer than `PATIENCE`, or the folder cannot be written.
        """
        with self.writing():
            self.refuse_if_changed()
            self.history.keep_edit()
            numbers = self.history.numbers()
            step = Step(
                numbers[-1] + 1 if numbers else 0, what, why, {**(before or {})}, {**(after or {})}
            )
            text = model_text(model, self.folder / "model.toml")
            data = data_digest(self.folder, self.settings, model.building)
            self.history.add(step, text, data)
            self._seen, self._seen_data = self._state(), data
        return step

    def undo(self) -> Step:
        """Go back to the model before the last step; return that step.

        Raises
        ------
        StudyError
            If there is no step to undo, or as for `add_step`.
        """
        with self.writing():
            self.history.refuse_damaged()  # before an edit is kept
            added = additions(self)
            self.history.keep_edit()
            step = self.history.undo()
            note_undone(self, added, step.number)
            self._seen, self._seen_data = self._state(), ""
        return step

    def with_mask(self) -> Study:
        """Write `mask = true` into study.toml, and return the study as it is then."""
        return self._with_settings(with_mask)

    def with_corrections(self, found: Mapping[str, Sequence[Correction]]) -> Study:
        """Write corrections into study.toml, and return the study as it is then.

        Parameters
        ----------
        found : corrections by the name of the run, or of a part of it: a run has one of each
            channel and fault, the mean of those of its parts

        Raises
        ------
        StudyError
            If no run has such a name, or no single value is right for all parts of a run.
        """
        joined = joined_corrections(self.folder, self.settings, found)
        if apart := [text for run in joined for text in run.apart]:
            raise StudyError(f"{self.folder / 'study.toml'}: {' '.join(apart)}")
        places = {run.place: run.corrections for run in joined}
        return self._with_settings(lambda text: with_corrections(text, places))

    def with_roles(self, roles: Mapping[str, str]) -> Study:
        """Write what runs are for into study.toml, and return the study as it is then.

        Parameters
        ----------
        roles : role by the name or the file of a run: "train", "holdout", "test" or "exclude"

        Raises
        ------
        StudyError
            If there is no such run or role, or no run for training would be left.
        """
        places = roles_by_place(self.folder / "study.toml", self.settings, roles)
        return self._with_settings(lambda text: with_roles(text, places))

    def with_channels(
        self, channels: Mapping[str, str | ChannelSpec], *, without: Sequence[str] = ()
    ) -> Study:
        """Write where channels are into study.toml, and return the study as it is then.

        All runs are read by them first. Fits and verdict were of the channels as they were: they
        stay in the history alone, and the model is the last one that was from no data.

        Parameters
        ----------
        channels : where channels are from now on, `{"force": "-Ch3@kN"}`: column, unit, a minus to
            turn the sign
        without : channels that are no longer read

        Raises
        ------
        StudyError
            If there is no such channel, a unit is not that of its quantity, two channels claim one
            column, or a channel that the rig needs would be missing.
        RecordError
            If a file has no such column, or cannot be read by it.
        """
        from .read_again import correct_channels

        given = {
            name: where if isinstance(where, ChannelSpec) else parse_channel(f"{name}={where}")[1]
            for name, where in channels.items()
        }
        correct_channels(self, given, without=without)
        return Study(self.folder)

    def _with_settings(self, change: Callable[[str], str]) -> Study:
        """Write study.toml with its text changed, and return the study as it is then.

        A verdict on other data than there are then is set aside.
        """
        path = self.folder / "study.toml"
        with self.writing():
            with draft_of(path, change(path.read_text(encoding="utf-8-sig"))) as draft:
                now = read_draft(draft, path)
            if now.data != self.settings.data:
                self.history.set_verdict_aside()
        return Study(self.folder)

    def verdict(self) -> dict[str, Any] | None:
        """Return the verdict on the present model in the present schema, None if there is none.

        Where data or model are no longer those that it is on, its notes say so.

        Raises
        ------
        StudyError
            If the file is damaged, or of a schema that this version does not know.
        """
        from ..diagnosis.verdict import current

        path = self.folder / "verdict.json"
        if not path.is_file():
            return None
        verdict = current(read_json(path), str(path))
        if not (stale := self.stale(verdict)):
            return verdict
        return {**verdict, "notes": [stale, *(verdict.get("notes") or [])]}

    def stale(self, verdict: Mapping[str, Any]) -> str:
        """Return how data or model are others than a verdict's, and what to do; "" if not."""
        known = str(verdict.get("data", ""))
        other = other_than(known, self.data) if known else ""
        if other:
            text = f"{other[:1].upper()}{other[1:]} are no longer those of this verdict."
        elif self.history.is_edited():
            text = "model.toml has been edited since this verdict."
        else:
            return ""
        return f"{text} Diagnose again:  {command('diagnose', self.folder)}"

    def write_verdict(self, verdict: Mapping[str, Any]) -> None:
        """Write the verdict on the model that was read here; see `add_step` for what is raised."""
        with self.writing():
            self.refuse_if_changed()
            self.history.keep_edit()  # the verdict is on it
            self._seen = self._state()
            write_json(self.folder / "verdict.json", {**verdict, "data": self.data})

    def write_report(self, name: str, content: str | bytes) -> Path:
        """Write a file into reports/, whole; return its path."""
        path = self.reports_folder / name
        with self.writing():
            write_whole(path, content)
        return path

    def __repr__(self) -> str:
        steps = self.steps()
        last = f"; last step: {steps[-1].what}" if steps else ""
        return shown(self, f"{self.folder}, {len(self.settings.runs)} runs{last}")

    @contextmanager
    def writing(self, patience: float = PATIENCE) -> Iterator[None]:
        """Hold the study's lock; other processes that write wait `patience` s, then give up."""
        try:
            with self._lock.acquire(timeout=patience):
                self.history.recover()
                yield
        except Timeout:
            raise StudyError(
                f"{self.folder}: another process has been writing here for more than "
                f"{patience:g} s. Wait for it, or end it; then run this again."
            ) from None
        except OSError as error:
            raise StudyError(
                f"{error.filename or self.folder}: cannot be written ({error.strerror or error})."
            ) from None

    def _complete_unfinished(self) -> None:
        if not self.history.pending.is_file():
            return
        try:
            with self._lock.acquire(timeout=0.0):
                self.history.recover()
        except Timeout:
            return  # it is being completed by the process that began it

    def _state(self) -> tuple[tuple[int, ...], str]:
        """Return what tells whether the model has been changed."""
        path = self.folder / "model.toml"
        content = path.read_bytes() if path.is_file() else b""
        return tuple(self.history.numbers()), hashlib.sha256(content).hexdigest()

    def refuse_if_changed(self) -> None:
        """Refuse a result where model or data are others than were read here; hold the lock.

        Raises
        ------
        StudyError
            Saying what has been changed.
        """
        settings = read_settings(self.folder / "study.toml")
        if settings.channels != self.settings.channels:
            raise StudyError(
                f"{self.folder}: its channels have been corrected meanwhile, so that this result "
                f"is not of the present data. {_AGAIN}"
            )
        now = self._state()
        if now != self._seen:
            steps = len(now[0]) - len(self._seen[0])
            what = f"{plural(abs(steps), 'step')} " if steps else ""
            how = "added" if steps > 0 else "undone" if steps < 0 else "model.toml was edited"
            raise StudyError(
                f"{self.folder}: the model has been changed meanwhile ({what}{how}), so that this "
                "result is not of the present one. Nothing is written; run this again."
            )
        self._refuse_other_data(settings)

    def _refuse_other_data(self, settings: Settings) -> None:
        """Refuse a result where the data are others than were read, by the study.toml of now."""
        building = building_in(self.folder / "model.toml")
        now = data_digest(self.folder, settings, building)
        if other := other_than(self._seen_data or self.data, now):
            raise StudyError(
                f"{self.folder}: {other} have been changed meanwhile, so that this result is not "
                f"of the present data. {_AGAIN}"
            )


# What is new in the data of a study since its model was identified: runs, roles, corrections.

# A digest of what a fit and its judge see: by it a result on other data is known.
#
# It has three parts: what study.toml says, what the files of the runs hold, and the building.
# Content counts, and no date, so that a study that was copied or cloned stays as it is.

_KIND = "2"
"""How the digest begins."""

_OTHER = (
    "runs, their roles, labels, corrections or channels in study.toml",
    "the contents of files in data/",
    "the numbers of the building",
)
"""What differs, by the part of the digest."""


def data_digest(folder: Path, settings: Settings, building: str) -> str:
    """Return the digest of a study's data; titles, the order of runs and test runs do not count.

    Parameters
    ----------
    folder : of the study
    settings : the content of its study.toml
    building : name of the building's file, "" for none
    """
    runs = [run for run in settings.runs if run.role != TEST]
    files = [[file, _of_file(folder / file)] for file in sorted({run.file for run in runs})]
    parts = (_of_settings(settings), _digest(files), _of_building(folder, building))
    return "-".join((_KIND, *parts))


def other_than(known: str, now: str) -> str:
    """Return what is no longer as it was: "the numbers of the building"; "" where nothing is.

    Parameters
    ----------
    known : the digest that a result was made with, "" where it does not tell
    now : the present one
    """
    pairs = zip(known.split("-")[1:], now.split("-")[1:], _OTHER, strict=False)
    return next((text for one, other, text in pairs if one != other), "")


def _of_settings(settings: Settings) -> str:
    """Return the part of the digest that follows from study.toml alone."""
    labels = sorted(
        [run.name, sorted(run.labels.items())] for run in settings.runs if run.role != TEST
    )
    extra = {name: channel_as_toml(spec) for name, spec in settings.extra.items()}
    return _digest([settings.data, labels, extra])


def _of_building(folder: Path, name: str) -> str:
    """Return the digest of a building's numbers: its comments and its spaces do not count."""
    found = toml_content(folder / name) if name else {}
    return _digest(found) if found else ""


def _of_file(path: Path) -> str:
    try:
        about = path.stat()
        return _of_content(path, about.st_mtime_ns, about.st_size)
    except OSError:
        return ""


@lru_cache(maxsize=4096)
def _of_content(path: Path, _changed: int, _size: int) -> str:
    """Return the digest of a file's content; it is read again where its date or size is another."""
    whole = sha256()
    with path.open("rb") as file:
        while part := file.read(1 << 20):
            # git may write other ends of lines into a clone.
            whole.update(part.replace(b"\r", b""))
    return whole.hexdigest()[:16]


def _digest(seen: dict[str, Any] | Sequence[Any]) -> str:
    text = json.dumps(seen, sort_keys=True, default=str)
    return sha256(text.encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Note:
    """What was done with runs of a study: when (UTC), the step of the model then, their files."""

    date: str
    step: int
    files: tuple[str, ...] = ()


def noted(path: Path, key: str, damaged: str) -> tuple[Note, ...]:
    """Return the notes in a file, the first one first; none where there is no file.

    Parameters
    ----------
    path, key : the file; where its notes are
    damaged : what is said of a file that cannot be read so
    """
    if not path.is_file():
        return ()
    data = read_json(path)
    if data.get("schema") != 1:
        raise StudyError(f"{path}: {other_schema(data.get('schema'))}")
    try:
        return tuple(
            Note(str(one["date"]), int(one["step"]), tuple(map(str, one.get("files", ()))))
            for one in data[key]
        )
    except (AttributeError, KeyError, TypeError, ValueError):
        raise StudyError(f"{path}: {damaged}") from None


def note(study: Study, path: Path, key: str, before: Sequence[Note], files: Sequence[str]) -> None:
    """Write a note of now, on the present model, behind others; the caller holds the lock.

    Parameters
    ----------
    study, path, key : the folder, opened; the file; where its notes are
    before, files : the notes that it has; the files that the new one is about
    """
    numbers = study.history.numbers()
    now = datetime.now(UTC).isoformat(timespec="seconds")
    made = Note(now, numbers[-1] if numbers else 0, tuple(files))
    write_json(path, {"schema": 1, key: [asdict(one) for one in (*before, made)]})


FILE = "added_runs.json"
"""Where a study notes it."""


def additions(study: Study) -> tuple[Note, ...]:
    """Return which runs were added, the first time first.

    Raises
    ------
    StudyError
        If the file that says so is damaged.
    """
    damaged = "it lists runs that were added, and is damaged. Remove it."
    return noted(study.folder / FILE, "additions", damaged)


def note_addition(study: Study, files: Sequence[str]) -> None:
    """Write down that runs are added now, to the present model; the caller holds the lock."""
    note(study, study.folder / FILE, "additions", additions(study), files)


def note_undone(study: Study, listed: Sequence[Note], number: int) -> None:
    """Write down that a step is undone: the model before it does not know its later runs either.

    Parameters
    ----------
    study : the folder, opened; the caller holds the lock
    listed : the runs that were added
    number : of the step; another one may get it, which knows these runs
    """
    if any(one.step == number for one in listed):
        moved = [replace(one, step=min(one.step, number - 1)) for one in listed]
        every = [asdict(one) for one in moved]
        write_json(study.folder / FILE, {"schema": 1, "additions": every})


def unknown_to_model(study: Study) -> list[str]:
    """Return the files of the runs that were added since the present model was identified.

    None before the first identification.
    """
    numbers = study.history.numbers()
    last = numbers[-1] if numbers else 0
    there = {run.file for run in study.settings.runs}
    found = [file for one in additions(study) if one.step == last > 0 for file in one.files]
    return [file for file in dict.fromkeys(found) if file in there]


def behind_data(study: Study) -> str:
    """Return how the data are others than the present model knows, and what to do; "" if not."""
    other = other_data(study)
    return f"{other} Identify it again:  {command('identify', study.folder)}" if other else ""


def other_data(study: Study) -> str:
    """Return the sentence that tells how the data are others than the model knows, "" if not."""
    if files := unknown_to_model(study):
        every = list(dict.fromkeys(run.file for run in study.settings.runs))
        names = dict(zip(every, names_of_files(every), strict=True))
        what = "run was" if len(files) == 1 else "runs were"
        new = listed(names[file] for file in files)
        return f"{len(files)} {what} added after the present model was identified: {new}."
    numbers = study.history.numbers()
    known = study.history.noted(numbers[-1], "data") if len(numbers) > 1 else ""
    other = other_than(known, study.data) if known else ""
    if not other:
        return ""
    return (
        f"{other[:1].upper()}{other[1:]} are no longer those that the present model was "
        "identified with."
    )
