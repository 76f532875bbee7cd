"""The folder of a plan: plan.toml and one CSV file per run, as a rig's controller takes them.

plan.toml     kind of rig, name of the study, rate, channel of the command, [[runs]]
NAME.csv      time [s], displacement [mm] or ground_acceleration [m/s2], the command
"""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..core.arrays import Array
from ..core.config import Document, Key, Spec
from ..core.text import plain
from ..data.channels import DRIVE, PLAIN, ChannelSpec
from ..data.measurement import measurements_of
from ..data.read import read_table
from ..data.table import Table
from ..errors import RecordError, StudyError
from ..units import convert

FILE = "plan.toml"
MOTION = {"bench": "displacement", "structure": "ground_acceleration"}
"""What a run prescribes, by the kind of rig."""
ROLES = ("train", "holdout")
_SHOWN_IN = {"displacement": "mm"}
"""Units of the files where they are not those of the SI."""
_SPEC = Spec({
    "rig": Key(str, choices=MOTION),
    "study": Key(str, ""),
    "rate": Key(float, above=0.0, about="samples per second"),
    "command": Key(str, "", choices=DRIVE),
    "runs": Spec({
        "name": Key(str), "file": Key(str), "role": Key(str, ROLES[0], choices=ROLES),
        "about": Key(str, ""),
    }, many=True),
})  # fmt: skip
NAME = re.compile(r"[A-Za-z0-9][\w.+-]*")
"""Names that runs, and their files, can have."""
_OFF = 0.01
"""Share by which the rate of a file may differ from that of plan.toml."""


@dataclass(frozen=True, eq=False)
class PlannedRun:
    """One run of a plan.

    Attributes
    ----------
    name : str
        Of the run, of its file in the plan, and of its file once it is measured.
    role : {"train", "holdout"}
        What the run is for.
    about : str
        The run in words.
    time : (n,) array
        [s], evenly spaced.
    signals : dict of (n,) arrays
        By channel, in SI: `displacement` or `ground_acceleration`, and the command if there is one.
    """

    name: str
    role: str
    about: str
    time: Array
    signals: dict[str, Array] = field(repr=False)

    @property
    def purpose(self) -> str:
        """What the run is for, in words."""
        return "training" if self.role == "train" else "held out"

    @property
    def duration(self) -> float:
        """Time from the first sample to the last [s]."""
        return float(self.time[-1] - self.time[0])


@dataclass(frozen=True, eq=False)
class PlanFolder:
    """What the folder of a plan holds.

    `rig` "bench" or "structure"; `study` the name of the study, "" before the first measurement;
    `rate` samples per second of the files [Hz]; `runs` at least one.
    """

    rig: str
    study: str
    rate: float
    runs: tuple[PlannedRun, ...]

    @property
    def motion(self) -> str:
        """The channel that the rig's controller prescribes."""
        return MOTION[self.rig]

    @property
    def command(self) -> str:
        """The channel of the command, "" where there is none."""
        return next((name for name in DRIVE if name in self.runs[0].signals), "")


def read_plan(path: Path | str) -> PlanFolder:
    """Return the plan in a folder.

    Raises
    ------
    StudyError
        If there is no plan, or its plan.toml is wrong: with every mistake and its line.
    RecordError
        If a file of a run cannot be read, has other columns, values that are missing, or times that
        do not rise evenly.
    """
    folder = Path(path)
    if not (folder / FILE).is_file():
        raise StudyError(
            f"{folder}: no plan: there is no {FILE}. `bristle plan` writes a folder with it."
        )
    document = Document(folder / FILE, StudyError)
    found = document.read(_SPEC)
    _check_runs(document, folder, found["runs"])
    document.check()
    rig, command, rate = found["rig"], found["command"], found["rate"]
    channels = [MOTION[rig], *([command] if command else [])]
    runs = [
        PlannedRun(one["name"], one["role"], one["about"], *_read(folder / one["file"], channels))
        for one in found["runs"]
    ]
    for one, run in zip(found["runs"], runs, strict=True):
        _refuse_other_rate(folder / one["file"], run.time, rate)
    return PlanFolder(rig, found["study"], rate, tuple(runs))


def write_plan(
    folder: PlanFolder, path: Path | str, others: Mapping[str, str | bytes] | None = None
) -> None:
    """Write a plan into a new folder, which appears when it is whole.

    Parameters
    ----------
    folder : PlanFolder
        The plan.
    path : path
        The folder to make; it must not exist.
    others : mapping
        What else the folder holds, such as pictures: name of the file to its content.

    Raises
    ------
    StudyError
        If the folder exists or cannot be written, or the plan is none: no runs, names that no file
        can have, channels that differ.
    """
    path = Path(path)
    refuse_existing(path)
    _refuse_wrong(folder)
    files = {FILE: _toml_text(folder), **(others or {})}
    files |= {f"{run.name}.csv": _csv_text(run) for run in folder.runs}
    draft: Path | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(dir=path.parent, prefix=f".{path.name}-"))
        for name, content in files.items():
            data = content.encode() if isinstance(content, str) else content
            (draft / name).write_bytes(data)
        draft.chmod(0o755)
        draft.replace(path)
    except OSError as error:
        raise StudyError(f"{path}: cannot be written ({error.strerror or error}).") from None
    finally:
        if draft is not None:
            shutil.rmtree(draft, ignore_errors=True)


def refuse_existing(path: Path) -> None:
    """Refuse a folder that is there already: a plan is written into a new one.

    Raises
    ------
    StudyError
        If there is such a folder, or a file.
    """
    if path.exists():
        raise StudyError(f"{path}: is there already. Take another name, or remove it.")


def _check_runs(document: Document, folder: Path, runs: Sequence[dict[str, str]]) -> None:
    """Check what no spec says of `[[runs]]` of a plan.toml."""
    if not runs:
        document.error(("runs",), 'there are no runs: expected [[runs]] with file = "plan_1.csv".')
    names: list[str] = []
    for index, one in enumerate(runs):
        keys, name, file = ("runs", index), one["name"], one["file"]
        if name is not None and not NAME.fullmatch(name):
            right = "expected letters, digits, _ . + and -, as in plan_1"
            document.error((*keys, "name"), f'[[runs]] name = "{name}": {right}.')
        elif name in names:
            document.error((*keys, "name"), f"{name} is listed twice: one of the two must go.")
        names.append(name)
        if file is not None and Path(file).name != file:
            right = f"expected a file beside {FILE}, as in plan_1.csv"
            document.error((*keys, "file"), f'[[runs]] file = "{file}": {right}.')
        elif file is not None and not (folder / file).is_file():
            document.error((*keys, "file"), f"there is no file {folder / file}.")


def _read(path: Path, channels: Sequence[str]) -> tuple[Array, dict[str, Array]]:
    """Return times (n,) s and signals (n,) in SI of a run's file."""
    table = read_table(path)
    wanted = ("time", *channels)
    names = [column.name for column in table.columns]
    if sorted(names) != sorted(wanted):
        raise RecordError(
            f"{path}: the columns are {', '.join(names)}; {', '.join(wanted)} are right, by {FILE}."
        )
    bare = next((column.text for column in table.columns if column.unit is None), "")
    if bare:
        raise RecordError(f'{path}: "{bare}" has no unit; "time [s]" or "displacement [mm]" does.')
    specs = {name: ChannelSpec(table.find(name).text) for name in wanted}
    _refuse_gaps(table, specs["time"].column)
    found = measurements_of(table, specs, estimate=False)
    if len(found) != 1 or found[0].sampling.filled or found[0].sampling.resampled:
        raise RecordError(f"{path}: its times are not evenly spaced, as a controller needs them.")
    return found[0].time, found[0].channels


def _refuse_gaps(table: Table, time: str) -> None:
    """Refuse values that are missing, and times that do not rise."""
    for title, values in table.values.items():
        missing = np.flatnonzero(~np.isfinite(values))
        if title in table.not_numeric or missing.size:
            row = int(missing[0]) if missing.size else 0
            raise RecordError(
                f'{table.source}, {table.where(row)}: "{title}" is no finite number. A controller '
                "needs a value at every instant."
            )
    falls = np.flatnonzero(np.diff(table.values[time]) <= 0.0)
    if falls.size:
        raise RecordError(
            f"{table.source}, {table.where(int(falls[0]) + 1)}: the time does not rise. Times in "
            "order are right."
        )


def _refuse_other_rate(path: Path, time: Array, rate: float) -> None:
    own = (time.size - 1) / float(time[-1] - time[0])
    if abs(own / rate - 1.0) > _OFF:
        raise RecordError(
            f"{path}: {plain(own, 4)} samples per second, and {plain(rate, 4)} by {FILE}."
        )


def _refuse_wrong(plan: PlanFolder) -> None:
    """Refuse to write what could not be read back."""
    if plan.rig not in MOTION:
        raise StudyError(f'rig = "{plan.rig}"; "bench" or "structure" is right.')
    names = [run.name for run in plan.runs]
    if not names:
        raise StudyError("a plan has at least one run.")
    wanted = {plan.motion, *([plan.command] if plan.command else [])}
    for run in plan.runs:
        if not NAME.fullmatch(run.name) or names.count(run.name) > 1:
            raise StudyError(f'run "{run.name}": a name of its own, which a file can have, is due.')
        if run.role not in ROLES:
            raise StudyError(f'{run.name}: role "{run.role}"; "train" or "holdout" is right.')
        if {*run.signals} != wanted:
            raise StudyError(
                f"{run.name}: its channels are {', '.join(run.signals)}; "
                f"{', '.join(sorted(wanted))} are right."
            )
        for values in (run.time, *run.signals.values()):
            if values.shape != run.time.shape or not np.all(np.isfinite(values)):
                raise StudyError(
                    f"{run.name}: time and signals are finite numbers, as many of each."
                )


def _toml_text(plan: PlanFolder) -> str:
    import tomlkit

    document = tomlkit.document()
    facts: dict[str, Any] = {
        "schema": 1, "rig": plan.rig, "study": plan.study, "rate": float(plan.rate)
    }  # fmt: skip
    if plan.command:
        facts["command"] = plan.command
    for key, value in facts.items():
        document.add(key, tomlkit.item(value))
    document["rate"].comment("samples per second")
    runs = tomlkit.aot()
    for run in plan.runs:
        table = tomlkit.table()
        facts = {"name": run.name, "file": f"{run.name}.csv", "role": run.role, "about": run.about}
        table.update(facts)
        runs.append(table)
    document.add("runs", runs)
    return tomlkit.dumps(document)


def _csv_text(run: PlannedRun) -> str:
    """Return a run as a controller takes it: titles with units, ten digits."""
    titles, columns = ["time [s]"], [run.time]
    for name, values in run.signals.items():
        unit = _SHOWN_IN.get(name, PLAIN[name])
        titles.append(f"{name} [{unit}]")
        columns.append(values * convert(1.0, PLAIN[name], unit))
    rows = (",".join(f"{value:.10g}" for value in row) for row in np.stack(columns, axis=1))
    return "\n".join([",".join(titles), *rows, ""])
