"""The folder of a plan: plan.toml and one CSV file per run, as a rig's controller takes them.

plan.toml     kind of rig, name of the study, rate, channel of the command, [[runs]]
NAME.csv      time [s], displacement [mm] or ground_acceleration [m/s2], the command
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import correlate, correlation_lags

from ..core.arrays import Array
from ..core.config import Document, Key, Spec
from ..core.files import new_folder
from ..core.text import plain
from ..core.toml_lines import toml_text
from ..data.channels import DRIVE, PLAIN, ChannelSpec
from ..data.measurement import Measurement, measurements_of
from ..data.pieces import holds_several
from ..data.read import read_table
from ..data.table import Table
from ..errors import RecordError, StudyError
from ..study.study import Study
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
        If the folder exists or cannot be written.
    """
    path = Path(path)
    refuse_existing(path)
    files = {FILE: _toml_text(folder), **(others or {})}
    files |= {f"{run.name}.csv": _csv_text(run) for run in folder.runs}
    with new_folder(path) as draft:
        for name, content in files.items():
            data = content.encode() if isinstance(content, str) else content
            (draft / name).write_bytes(data)


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


def _toml_text(plan: PlanFolder) -> str:
    facts: dict[str, Any] = {
        "schema": 1, "rig": plan.rig, "study": plan.study, "rate": float(plan.rate),
        **({"command": plan.command} if plan.command else {}),
    }  # fmt: skip
    runs = [
        {"name": run.name, "file": f"{run.name}.csv", "role": run.role, "about": run.about}
        for run in plan.runs
    ]
    return "\n[[runs]]\n".join(map(toml_text, (facts, *runs)))


def _csv_text(run: PlannedRun) -> str:
    """Return a run as a controller takes it: titles with units, ten digits."""
    titles, columns = ["time [s]"], [run.time]
    for name, values in run.signals.items():
        unit = _SHOWN_IN.get(name, PLAIN[name])
        titles.append(f"{name} [{unit}]")
        columns.append(values * convert(1.0, PLAIN[name], unit))
    rows = (",".join(f"{value:.10g}" for value in row) for row in np.stack(columns, axis=1))
    return "\n".join([",".join(titles), *rows, ""])


# Measured runs against those planned: amplitude, command, duration.

# How far a measured signal differs from the planned one at the same instants.


DIFFERS = 0.05
"""Share from which a difference is told."""
EDGE = 0.02
"""Share of a planned range that counts as its upper, or its lower, end."""
OFF = 0.1
"""Share of a command's range by which it may differ at any instant."""


def share_reached(measured: Array, planned: Array) -> float:
    """Return which share of the planned range was reached, at the instants of its ends."""
    low, high = float(np.min(planned)), float(np.max(planned))
    edge = EDGE * (high - low)
    upper, lower = planned >= high - edge, planned <= low + edge
    if high == low:
        return float(np.mean(measured)) / high if high else 1.0
    # Medians: at the ends of a command that comes late, some samples show another level.
    reached = float(np.median(measured[upper]) - np.median(measured[lower]))
    return reached / float(np.median(planned[upper]) - np.median(planned[lower]))


def command_differences(name: str, measured: Array, planned: Array) -> list[str]:
    """Return how a measured command differs from the planned one: its range, else its course.

    Parameters
    ----------
    name : the channel of the command
    measured, planned : (n,) in its unit
    """
    share = share_reached(measured, planned)
    if share > 0.0 and abs(share - 1.0) > DIFFERS:
        return [f"the {name} reached {percent_of(share)} of what was planned"]
    wrong = _off(measured, planned)
    if wrong > DIFFERS:
        return [f"the {name} was another one than planned for {percent_of(wrong)} of the run"]
    return []


def _off(measured: Array, goal: Array) -> float:
    """Return the share of instants at which a command is another one [1]."""
    size = float(np.ptp(goal)) or abs(float(goal[0])) or 1.0
    return float(np.mean(np.abs(measured - goal) > OFF * size))


def percent_of(share: float) -> str:
    """Return a share as text, two digits below 100 %."""
    return f"{plain(100.0 * share, 2 if share < 1.0 else 3)} %"


ALIKE = 0.6
"""Correlation of the motions below which a run is not the one that was planned."""


@dataclass(frozen=True)
class Pair:
    """A measured run, the planned one that it stands for, and sentences on how they differ."""

    measured: str
    planned: str
    differences: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Aligned:
    """Planned and measured values (n,) at the same instants, `covered` of the planned time [1]."""

    planned: dict[str, Array]
    measured: dict[str, Array]
    covered: float


@dataclass(frozen=True)
class Performed:
    """Measured runs against a plan: the role of each file's run by its name, pairs, and notes."""

    roles: dict[str, str]
    pairs: tuple[Pair, ...]
    notes: tuple[str, ...]

    @property
    def differences(self) -> list[str]:
        """Sentences on all that differs from the plan."""
        return [text for pair in self.pairs for text in pair.differences]


def performed(study: Study, files: Sequence[Path | str], plan: PlanFolder) -> Performed:
    """Return how files of new runs differ from the plan that they were measured by.

    Parameters
    ----------
    study : Study
        Whose columns the files have; they need not be in it.
    files : paths
        One run each.
    plan : PlanFolder
        What was to be measured.

    Raises
    ------
    StudyError
        If the plan is for another kind of rig, or files hold several runs.
    RecordError
        If a file cannot be read, or does not show the motion.
    """
    rig, channels = study.settings.rig, study.settings.channels
    if plan.rig != rig:
        raise StudyError(
            f'the plan is for a rig "{plan.rig}", and the study is of a "{rig}". A plan for this '
            "rig is right."
        )
    if holds_several(study.settings.split):
        raise StudyError(
            f"{study.folder}: its files hold several runs each (split in study.toml); a plan goes "
            "with files of one run. Leave --plan out."
        )
    runs = [
        max(
            measurements_of(read_table(file, study.settings.split), channels, estimate=False),
            key=lambda one: one.duration,
        )
        for file in files
    ]
    roles: dict[str, str] = {}
    pairs, notes = [], []
    found = planned_for(runs, plan)
    for file, run, planned in zip(files, runs, found, strict=True):
        if planned is None:
            notes.append(f"{run.name} stands for no run of the plan")
        else:
            roles[Path(file).name] = planned.role
            # A level that stands in study.toml is in no file.
            there = {plan.motion, *channels}
            kept = {name: x for name, x in planned.signals.items() if name in there}
            pairs.append(compared(run, replace(planned, signals=kept), plan.motion))
    if plan.study not in ("", study.name):
        notes.append(f"the plan was made for the study {plan.study}, and this one is {study.name}")
    missing = [one.name for one in plan.runs if one not in found]
    if missing:
        notes.append(f"planned, and not among the files: {', '.join(missing)}")
    return Performed(roles, tuple(pairs), tuple(notes))


def planned_for(runs: Sequence[Measurement], plan: PlanFolder) -> list[PlannedRun | None]:
    """Return the planned run that each measured one stands for, None where none is left.

    Equal names decide, then the likeness of the motions.

    Parameters
    ----------
    runs : measured, in order
    plan : the plan
    """
    found: list[PlannedRun | None] = []
    for run in runs:
        named = [one for one in plan.runs if _same_name(run.name, one.name)]
        found.append(named[0] if len(named) == 1 and named[0] not in found else None)
    for k, run in enumerate(runs):
        shown = _shown(run, plan.motion)
        left = [] if found[k] else [one for one in plan.runs if one not in found]
        alike = [_aligned(run, one, plan.motion, shown)[0] for one in left]
        if alike and max(alike) >= ALIKE:
            found[k] = left[int(np.argmax(alike))]
    return found


def compared(run: Measurement, planned: PlannedRun, motion: str) -> Pair:
    """Return how a measured run differs from the planned one.

    Parameters
    ----------
    run : measured
    planned : what was to be measured
    motion : channel that the rig's controller prescribes
    """
    shown = _shown(run, motion)
    likeness, aligned = _aligned(run, planned, motion, shown)
    if likeness < ALIKE:
        text = f"{run.name}: its {_words(shown)} is another one than that of {planned.name}"
        return Pair(run.name, planned.name, (f"{text} (correlation {plain(likeness, 2)})",))
    out = []
    share = share_reached(aligned.measured[shown], aligned.planned[shown])
    if abs(share - 1.0) > DIFFERS:
        out.append(f"the {_words(shown)} reached {percent_of(share)} of what was planned")
    command = next((name for name in planned.signals if name != motion), "")
    if command and not run.has(command):
        out.append(f"the {command} was not measured")
    elif command:
        out += command_differences(command, aligned.measured[command], aligned.planned[command])
    if aligned.covered < 1.0 - DIFFERS:
        out.append(
            f"the recording covers {percent_of(aligned.covered)} of the "
            f"{plain(planned.duration)} s that were planned"
        )
    return Pair(run.name, planned.name, tuple(f"{run.name}: {text}" for text in out))


def _same_name(measured: str, planned: str) -> bool:
    """Return whether a measured run's name is a planned one's, or contains it as words."""
    own, asked = measured.lower(), planned.lower()
    return re.search(rf"(?<![a-z0-9]){re.escape(asked)}(?![a-z0-9])", own) is not None


def _shown(run: Measurement, motion: str) -> str:
    """Return the channel that shows the motion: its velocity where nothing else was measured."""
    return "velocity" if motion == "displacement" and not run.has(motion) else motion


def _aligned(
    run: Measurement, planned: PlannedRun, motion: str, shown: str
) -> tuple[float, _Aligned]:
    """Return how alike the motions are, and both runs at the same instants."""
    step = run.step
    even = np.arange(0.0, planned.duration + 0.5 * step, step)
    since = planned.time - planned.time[0]
    wanted = {name: np.interp(even, since, x) for name, x in planned.signals.items()}
    if shown != motion:
        wanted[shown] = np.gradient(wanted[motion], step)
    own, goal = run[shown] - np.mean(run[shown]), wanted[shown] - np.mean(wanted[shown])
    products = correlate(own, goal, "full", "fft")
    lags = correlation_lags(own.size, goal.size, "full")
    best = int(np.argmax(products))
    start = int(lags[best])
    begin, end = max(start, 0), min(start + even.size, own.size)
    inside, of_plan = slice(begin, end), slice(begin - start, end - start)
    size = float(np.linalg.norm(own[inside]) * np.linalg.norm(goal[of_plan]))
    likeness = float(products[best]) / size if size > 0.0 else 0.0
    return likeness, _Aligned(
        {name: x[of_plan] for name, x in wanted.items()},
        {name: run[name][inside] for name in wanted if run.has(name)},
        (end - begin) / even.size,
    )


def _words(channel: str) -> str:
    return channel.replace("_", " ")
