"""The steps of a study's model, results set aside, and how the error fell.

A change touches several files. What is about to happen is written down first (`history/.pending`),
so that a process that is killed on its way leaves a change that the next one completes.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from itertools import count, takewhile
from math import inf, sqrt
from pathlib import Path
from typing import Any

from ..core.config import other_schema, toml_content
from ..core.files import new_folder, read_json, write_json, write_whole
from ..errors import StudyError
from ..version import __version__

# What a study found from its data, set aside when the data are read in another way.
#
# Fits, verdicts, reports and learned curves of the channels as they were are no result on the
# channels as they are. They are kept together in `history/before_channels_1/`, with the study.toml
# that they belong to. The model is again the last one that no measurement had changed.

DRAFT = ".study.toml"
"""The study.toml that is about to take the place of the present one."""
KEPT = "before_channels_{}"
"""The folder in history/ where results are set aside; the first one has the number 1."""
LEARNED = "learned from the runs of"
"""What stands in the file of an effect that `bristle learn` wrote."""

BESIDE = ("plan*", "export", "design", "comparisons")
"""Folders of what was made from a model."""

_STEP = re.compile(r"\d{3,}")
_OF_A_STEP = ("model.toml", "step.json")


@dataclass(frozen=True)
class Results:
    """What a study found from its data.

    `first` is the number of the first step whose model or errors are from the data, None where no
    step is; `steps` what these steps did; `verdict` whether there is one, on whatever model;
    `reports` the files in reports/; `effects` the learned ones, by name; `beside` the folders that
    were made from the model and stay: a plan, an export, designs, comparisons.
    """

    first: int | None
    steps: tuple[str, ...]
    verdict: bool
    reports: tuple[str, ...]
    effects: tuple[str, ...]
    beside: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.steps or self.verdict or self.reports or self.effects)

    def sentences(self) -> list[str]:
        """Return what is no longer of the data, one thing a line."""
        out = []
        if self.steps:
            counted = "1 step" if len(self.steps) == 1 else f"{len(self.steps)} steps"
            out.append(f"{counted} of the history: {', '.join(self.steps)}")
        if self.verdict:
            out.append("the verdict")
        if self.reports:
            out.append(f"reports: {', '.join(self.reports)}")
        if self.effects:
            out.append(f"learned effects: {', '.join(self.effects)}")
        return out

    def beside_text(self) -> str:
        """Return the sentence about what stays and is of the model before, "" where nothing is."""
        names = ", ".join(f"{name}/" for name in self.beside)
        return f"Made of the model before, and left as it is: {names}." if names else ""


def results_of(study: Path) -> Results:
    """Return what a study found from its data.

    Parameters
    ----------
    study : its folder
    """
    folders = _steps(study)
    first = next((int(one.name) for one in folders[1:] if _from_data(one)), None)
    kept = [one for one in folders if first is None or int(one.name) < first]
    named = {name for one in kept for name in _effects_in(one / "model.toml")}
    moved = [one for one in folders if one not in kept]
    verdicts = [study / "verdict.json", *(one / "verdict.json" for one in folders)]
    reports = study / "reports"
    return Results(
        first, tuple(str(read_json(one / "step.json").get("what", "")) for one in moved),
        any(one.is_file() for one in verdicts),
        tuple(sorted(one.name for one in reports.iterdir() if one.is_file()))
        if reports.is_dir() else (),
        tuple(sorted(one.stem for one in _learned(study) if one.stem not in named)),
        tuple(sorted(
            one.name for name in BESIDE for one in study.glob(name)
            if one.is_dir() and any(one.iterdir())
        )),
    )  # fmt: skip


def free_number(study: Path) -> int:
    """Return the number of the next folder of results that are set aside."""
    number = 1
    while kept_folder(study, number).exists():
        number += 1
    return number


def kept_folder(study: Path, number: int) -> Path:
    """Return the folder of that number."""
    return study / "history" / KEPT.format(number)


def set_results_aside(study: Path, number: int, first: int) -> None:
    """Move all results into a folder of the history, and make the draft the study.toml.

    It may be called again where a process was killed in it: what is moved stays moved.

    Parameters
    ----------
    study : its folder
    number : of the folder
    first : the number of the first step whose model is from the data
    """
    kept = kept_folder(study, number)
    kept.mkdir(parents=True, exist_ok=True)
    if not (kept / "study.toml").is_file():
        write_whole(kept / "study.toml", (study / "study.toml").read_bytes())
    last = [one for one in _steps(study) if int(one.name) < first][-1]
    text = (last / "model.toml").read_bytes()
    named = {*_effects_in(last / "model.toml"), building_in(last / "model.toml")}
    for one in [*_learned(study)]:
        if one.stem not in named:
            _move(one, kept / "effects" / one.name)
    for one in _steps(study):
        if int(one.name) >= first:
            building = study / f"building_{int(one.name)}.toml"
            if building.name not in named:
                _move(building, kept / building.name)
            _move(one, kept / one.name)
            continue
        for file in [file for file in one.iterdir() if file.name not in _OF_A_STEP]:
            _move(file, kept / one.name / file.name)
    for file in [*(study / "reports").glob("*")]:
        _move(file, kept / "reports" / file.name)
    _move(study / "history" / "undone", kept / "undone")
    for name in ("verdict.json", "added_runs.json"):
        _move(study / name, kept / name)
    write_whole(study / "model.toml", text)
    draft = study / DRAFT
    if draft.is_file():
        draft.replace(study / "study.toml")


def _move(path: Path, place: Path) -> None:
    """Move a file or a folder; nothing where there is none."""
    if path.exists():
        place.parent.mkdir(parents=True, exist_ok=True)
        path.replace(place)


def _steps(study: Path) -> list[Path]:
    """Return the folders of the steps, the first one first."""
    history = History(study)
    return [history.path(number) for number in history.numbers()]


def _from_data(step: Path) -> bool:
    """Return whether a step holds errors of runs, or a model with an identified value."""
    about = read_json(step / "step.json")
    return bool(about.get("before") or about.get("after")) or _identified(
        toml_content(step / "model.toml")
    )


def _identified(part: Any) -> bool:
    """Return whether a table of a model.toml, or one within it, was identified."""
    if isinstance(part, list):
        return any(map(_identified, part))
    if not isinstance(part, dict):
        return False
    return part.get("origin") == "identified" or any(map(_identified, part.values()))


def _effects_in(model: Path) -> list[str]:
    found = toml_content(model).get("effects", {})
    return list(found) if isinstance(found, dict) else []


def building_in(model: Path) -> str:
    """Return the name of the building's file in a model.toml, "" for none.

    What is wrong with the model is told where it is asked for.
    """
    return str(toml_content(model).get("building", ""))


def _learned(study: Path) -> Iterator[Path]:
    """Yield the files of the effects that `bristle learn` wrote."""
    for file in sorted((study / "effects").glob("*.py")):
        with suppress(OSError, ValueError):
            if LEARNED in file.read_text(encoding="utf-8"):
                yield file


OF_MODEL = ("identify.png", "identify.json", "compare.png", "diagnose.png", "report.html")
"""Reports that show a model: its step keeps them when another becomes the present one."""

EARLIER = "verdict_before_runs.json"
"""Where a step keeps the verdict that was on other runs, or on the same with other corrections."""


@dataclass(frozen=True)
class Step:
    """One step: what was changed and why, with the errors on the runs before and after.

    `before`, `after` map names to numbers, `{"train": ..., "holdout": ...}`; step 0 is the model
    that the study began with.
    """

    number: int
    what: str
    why: str
    before: dict[str, Any] = field(default_factory=dict)
    after: dict[str, Any] = field(default_factory=dict)


class History:
    """The folder history/ of a study, and the model.toml and verdict.json that follow from it.

    Nothing here locks: `Study` does.
    """

    def __init__(self, study: Path) -> None:
        self.study = study
        self.folder = study / "history"
        self.pending = self.folder / ".pending"

    def numbers(self) -> list[int]:
        """Return the numbers of the steps, in order."""
        if not self.folder.is_dir():
            return []
        names = (path.name for path in self.folder.iterdir() if path.is_dir())
        return sorted(int(name) for name in names if _STEP.fullmatch(name))

    def steps(self) -> list[Step]:
        """Return the steps, the first model included."""
        return [self.step(number) for number in self.numbers()]

    def step(self, number: int) -> Step:
        """Return one step; StudyError if its file is damaged."""
        path = self.path(number) / "step.json"
        data = read_json(path)
        if data.get("schema", 1) != 1:
            raise StudyError(f"{path}: {other_schema(data['schema'])}")
        try:
            what, why, before, after = (data[key] for key in ("what", "why", "before", "after"))
            return Step(int(data["number"]), str(what), str(why), dict(before), dict(after))
        except (KeyError, TypeError, ValueError) as error:
            raise StudyError(
                f"{path}: no step of a study: {error!r} is missing or wrong."
            ) from None

    def noted(self, number: int, key: str) -> str:
        """Return what a step notes: "bristle", the version that made it, or "data", their digest.

        "" where it is not told.
        """
        path = self.path(number) / "step.json"
        return str(read_json(path).get(key, "")) if path.is_file() else ""

    def path(self, number: int) -> Path:
        """Return the folder of a step."""
        return self.folder / f"{number:03d}"

    def model_file(self, number: int) -> Path:
        """Return the model.toml of a step."""
        return self.path(number) / "model.toml"

    def add(self, step: Step, model: str, data: str = "", before: float = inf) -> None:
        """Add a step with its model, make that the present one, and drop the present verdict.

        Parameters
        ----------
        step, model : the step, and the text of its model.toml
        data : digest of the data that the model was fitted to, "" for none
        before : ns, from when on reports are of the new model
        """
        self._keep_results(step.number - 1, before)
        self._begin({"add": step.number})
        with new_folder(self.path(step.number)) as draft:
            write_whole(draft / "model.toml", model)
            made = {"schema": 1, "bristle": __version__, **({"data": data} if data else {})}
            write_json(draft / "step.json", {**made, **asdict(step)})
        self.recover()

    def keep_edit(self) -> None:
        """Make a step of a model.toml that was edited by hand, so that no step loses it."""
        if self.is_edited():
            last, file = self.numbers()[-1], self.study / "model.toml"
            step = Step(last + 1, "edited by hand", "model.toml was changed in an editor")
            text = file.read_bytes().decode("utf-8-sig")
            self.add(step, text, self.noted(last, "data"), file.stat().st_mtime_ns)

    def is_edited(self) -> bool:
        """Return whether model.toml is another one than that of the last step."""
        numbers, present = self.numbers(), self.study / "model.toml"
        if not numbers or not present.is_file():
            return False
        last = self.model_file(numbers[-1])
        return last.is_file() and present.read_bytes() != last.read_bytes()

    def undo(self) -> Step:
        """Take the last step back and return it; it is kept in history/undone/.

        Raises
        ------
        StudyError
            If there is no step but the first model, or a step cannot be read.
        """
        numbers = self.numbers()
        if len(numbers) < 2:
            raise StudyError(
                f"{self.study}: there is nothing to undo: the model is the one that the study "
                "began with."
            )
        self.refuse_damaged()
        last = self.step(numbers[-1])
        self._keep_results(last.number)
        self._begin({"undo": last.number})
        self.recover()
        return last

    def undone(self, number: int) -> Path:
        """Return the folder of the step of a number that was taken back last."""
        there = [*takewhile(Path.is_dir, self._places_undone(number))]
        return there[-1] if there else next(self._places_undone(number))

    def _places_undone(self, number: int) -> Iterator[Path]:
        """Yield where steps of a number that are taken back go: 001, then 001_2, 001_3 ..."""
        name = self.path(number).name
        for again in count(1):
            yield self.folder / "undone" / (name if again == 1 else f"{name}_{again}")

    def begin_anew(self, first: int | None) -> Path:
        """Set aside all that was found from the data, and put the draft of study.toml in place.

        Parameters
        ----------
        first : the number of the first step whose model is from the data, None where none is

        Returns
        -------
        Path
            The folder where it is kept.
        """
        number = free_number(self.study)
        after = max(self.numbers(), default=0) + 1
        self._begin({"channels": number, "first": after if first is None else first})
        self.recover()
        return kept_folder(self.study, number)

    def refuse_damaged(self) -> None:
        """Refuse to take a step back where that step, or the one before, cannot be read.

        Raises
        ------
        StudyError
            Naming the file.
        """
        for number in self.numbers()[-2:]:
            self.step(number)
            if not self.model_file(number).is_file():
                raise StudyError(f"{self.model_file(number)}: there is no such file.")

    def recover(self) -> None:
        """Complete what a process began and did not end; nothing where nothing is pending."""
        if not self.pending.is_file():
            return
        unfinished = read_json(self.pending)
        if "add" in unfinished and self.path(int(unfinished["add"])).is_dir():
            self._make_present(int(unfinished["add"]))
        if "undo" in unfinished:
            number = int(unfinished["undo"])
            self._make_present(max((n for n in self.numbers() if n < number), default=0))
            if self.path(number).is_dir():
                kept = next(one for one in self._places_undone(number) if not one.exists())
                kept.parent.mkdir(exist_ok=True)
                self.path(number).replace(kept)
        if "channels" in unfinished:
            set_results_aside(self.study, int(unfinished["channels"]), int(unfinished["first"]))
        for draft in self.folder.glob(".*-*"):
            shutil.rmtree(draft, ignore_errors=True)
        self.pending.unlink(missing_ok=True)

    def _begin(self, what: Mapping[str, int]) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        write_json(self.pending, what)

    def _make_present(self, number: int) -> None:
        write_whole(self.study / "model.toml", self.model_file(number).read_bytes())
        verdict = self.path(number) / "verdict.json"
        if verdict.is_file():
            write_whole(self.study / "verdict.json", verdict.read_bytes())
        else:
            (self.study / "verdict.json").unlink(missing_ok=True)

    def set_verdict_aside(self) -> None:
        """Keep the present verdict, which is on other data, with the step of its model."""
        verdict, numbers = self.study / "verdict.json", self.numbers()
        if not verdict.is_file():
            return
        if numbers:
            write_whole(self.path(numbers[-1]) / EARLIER, verdict.read_bytes())
        verdict.unlink()

    def _keep_results(self, number: int, before: float = inf) -> None:
        """Keep the present verdict, and reports, with the step whose model they are of."""
        verdict, kept = self.study / "verdict.json", self.path(number)
        if not kept.is_dir():
            return
        if verdict.is_file():
            write_whole(kept / "verdict.json", verdict.read_bytes())
        for report in (self.study / "reports" / name for name in OF_MODEL):
            if report.is_file() and report.stat().st_mtime_ns < before:
                report.replace(kept / report.name)


# The staircase of a study's history: the error of each model, step by step.

CLOSE = 1.1
"""z up to which an error is drawn as being on the noise floor."""


@dataclass(frozen=True)
class HistoryStep:
    """One step of the staircase: what was done, and z and error [N] of the model after it.

    `share` is the error on held-out runs over the force's RMS [1].
    """

    number: int
    what: str
    z: float | None
    z_train: float | None
    rms: float | None
    share: float | None = None

    @property
    def missed(self) -> float:
        """The share of the force that the model misses beyond noise; 0 where noise is all."""
        if self.z is None or self.share is None or self.z <= CLOSE:
            return 0.0
        return self.share * sqrt(1.0 - 1.0 / self.z**2)


def history_steps(steps: Sequence[Step]) -> list[HistoryStep]:
    """Return the steps of a history: what each step's `after` says, or the next one's `before`."""
    out = []
    for k, step in enumerate(steps):
        errors: dict[str, Any] = {**step.after}
        if not errors and k + 1 < len(steps):
            errors = {**steps[k + 1].before}
        keys = ("z_holdout", "z_train", "error_holdout", "error_share_holdout")
        numbers = (_staircase_number(errors.get(key)) for key in keys)
        out.append(HistoryStep(step.number, step.what, *numbers))
    return out


def _staircase_number(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) and value == value else None
