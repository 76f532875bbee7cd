"""What a study found from its data, set aside when the data are read in another way.

Fits, verdicts, reports and learned curves of the channels as they were are no result on the
channels as they are. They are kept together in `history/before_channels_1/`, with the study.toml
that they belong to. The model is again the last one that no measurement had changed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.config import toml_content
from ..data.files import read_json, write_whole

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
    folders = list(_steps(study))
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


def set_aside(study: Path, number: int, first: int) -> None:
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
    last = max((one for one in _steps(study) if int(one.name) < first), key=_number)
    text = (last / "model.toml").read_bytes()
    named = {*_effects_in(last / "model.toml"), _building_in(last / "model.toml")}
    for one in [*_learned(study)]:
        if one.stem not in named:
            _move(one, kept / "effects" / one.name)
    for one in [*_steps(study)]:
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


def _number(step: Path) -> int:
    return int(step.name)


def _steps(study: Path) -> Iterator[Path]:
    """Yield the folders of the steps, the first one first."""
    history = study / "history"
    if history.is_dir():
        found = (one for one in history.iterdir() if one.is_dir() and _STEP.fullmatch(one.name))
        yield from sorted(found, key=_number)


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


def _building_in(model: Path) -> str:
    return str(toml_content(model).get("building", ""))


def _learned(study: Path) -> Iterator[Path]:
    """Yield the files of the effects that `bristle learn` wrote."""
    for file in sorted((study / "effects").glob("*.py")):
        with suppress(OSError, ValueError):
            if LEARNED in file.read_text(encoding="utf-8"):
                yield file
