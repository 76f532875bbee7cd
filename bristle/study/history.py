"""The steps of a study's model: each a folder with the model and why it came to be.

A change touches several files. What is about to happen is written down first (`history/.pending`),
so that a process that is killed on its way leaves a change that the next one completes.
"""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from itertools import count, takewhile
from pathlib import Path
from typing import Any

from ..core.config import other_schema
from ..data.files import read_json, write_json, write_whole
from ..errors import StudyError
from ..version import __version__
from .set_aside import free_number, kept_folder, set_aside

_NUMBER = re.compile(r"\d{3,}")

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
        return sorted(int(name) for name in names if _NUMBER.fullmatch(name))

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
            return Step(
                int(data["number"]),
                str(data["what"]),
                str(data["why"]),
                dict(data["before"]),
                dict(data["after"]),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise StudyError(
                f"{path}: no step of a study: {error!r} is missing or wrong."
            ) from None

    def made_by(self, number: int) -> str:
        """Return the version of bristle that made a step, "" where it is not told."""
        path = self.path(number) / "step.json"
        return str(read_json(path).get("bristle", "")) if path.is_file() else ""

    def data_of(self, number: int) -> str:
        """Return the digest of the data that a step's model was fitted to, "" where not told."""
        path = self.path(number) / "step.json"
        return str(read_json(path).get("data", "")) if path.is_file() else ""

    def path(self, number: int) -> Path:
        """Return the folder of a step."""
        return self.folder / f"{number:03d}"

    def model_file(self, number: int) -> Path:
        """Return the model.toml of a step."""
        return self.path(number) / "model.toml"

    def add(self, step: Step, model: str, data: str = "") -> None:
        """Add a step with its model, make that the present one, and drop the present verdict.

        Parameters
        ----------
        step, model : the step, and the text of its model.toml
        data : digest of the data that the model was fitted to, "" for none
        """
        self._keep_verdict(step.number - 1)
        self._begin({"add": step.number})
        draft = Path(tempfile.mkdtemp(dir=self.folder, prefix=".draft-"))
        try:
            write_whole(draft / "model.toml", model)
            made = {"schema": 1, "bristle": __version__, **({"data": data} if data else {})}
            write_json(draft / "step.json", {**made, **asdict(step)})
            draft.chmod(0o755)
            draft.replace(self.path(step.number))
        except OSError as error:
            raise StudyError(
                f"{self.path(step.number)}: cannot be written ({error.strerror or error})."
            ) from None
        finally:
            shutil.rmtree(draft, ignore_errors=True)
        self.recover()

    def keep_edit(self) -> None:
        """Make a step of a model.toml that was edited by hand, so that no step loses it."""
        if self.is_edited():
            last, text = self.numbers()[-1], (self.study / "model.toml").read_bytes()
            step = Step(last + 1, "edited by hand", "model.toml was changed in an editor")
            self.add(step, text.decode("utf-8-sig"), self.data_of(last))

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
        self._keep_verdict(last.number)
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
            set_aside(self.study, int(unfinished["channels"]), int(unfinished["first"]))
        for draft in self.folder.glob(".draft-*"):
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

    def _keep_verdict(self, number: int) -> None:
        """Keep the present verdict with the step whose model it judges."""
        verdict = self.study / "verdict.json"
        if verdict.is_file() and self.path(number).is_dir():
            write_whole(self.path(number) / "verdict.json", verdict.read_bytes())
