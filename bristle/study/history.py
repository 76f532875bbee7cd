"""The steps of a study's model, and how the error fell.

A change touches several files. What is about to happen is written down first (`history/.pending`),
so that a process that is killed on its way leaves a change that the next one completes.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import count, takewhile
from math import inf, sqrt
from pathlib import Path
from typing import Any

from ..core.config import other_schema, toml_content
from ..core.files import new_folder, read_json, write_json, write_whole
from ..errors import StudyError
from ..version import __version__

ANEW = "begin anew"
"""What the step does that takes back a model whose data are read in another way now."""

_STEP = re.compile(r"\d{3,}")


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


def building_in(model: Path) -> str:
    """Return the name of the building's file in a model.toml, "" for none.

    What is wrong with the model is told where it is asked for.
    """
    return str(toml_content(model).get("building", ""))


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

    def of_data(self) -> list[Step]:
        """Return the steps that are from data as they are read now; none where the model is not."""
        numbers = self.numbers()
        first = max((n for n in numbers if not _from_data(self.path(n))), default=0)
        return [self.step(number) for number in numbers if number > first]

    def begin_anew(self, what: str) -> Step | None:
        """Make the last model that is from no data the present one; return the step, None without.

        Parameters
        ----------
        what : is read in another way now
        """
        self.keep_edit()
        if not (gone := self.of_data()):
            self.set_verdict_aside()
            return None
        number = gone[0].number
        step = Step(gone[-1].number + 1, f"{ANEW}: {what}", "the steps before are of other data")
        self.add(step, self.model_file(number - 1).read_text(encoding="utf-8"))
        return step

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
