"""Measured runs against those planned: amplitude, clipped or late commands, duration.

A recording may begin before the run and end after it: the motions are brought on top of each other
before anything is compared.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.signal import correlate, correlation_lags

from ..core.arrays import Array
from ..core.text import plain, scale
from ..data.channels import channel_unit
from ..data.measurement import Measurement, measurements_of
from ..data.pieces import holds_several
from ..data.read import read_table
from ..errors import StudyError
from ..study.study import Study
from .folder import PlanFolder, PlannedRun

# How far a measured signal differs from the planned one at the same instants.


DIFFERS = 0.05
"""Share from which a difference is told."""
EDGE = 0.02
"""Share of a planned range that counts as its upper, or its lower, end."""
OFF = 0.1
"""Share of a command's range by which it may differ at any instant."""
LATEST = 0.5
"""Seconds up to which a command may come late, or early."""
AS_GOOD = 0.01
"""Correlation by which a nearer peak may be lower than the highest one."""


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


def command_differences(name: str, measured: Array, planned: Array, step: float) -> list[str]:
    """Return how a measured command differs from the planned one: its range, then its time.

    Parameters
    ----------
    name : the channel of the command
    measured, planned : (n,) in its unit
    step : sampling step [s]
    """
    late = _late(measured, planned, step)
    in_time, wanted = _shifted(measured, planned, late)
    share, reached, clipped = _reached(in_time, wanted)
    goal = np.minimum(planned, reached) if clipped else share * planned
    wrong = _off(measured, goal)
    if _off(*_shifted(measured, goal, late)) > DIFFERS:
        wrong = _off(measured, planned)
        return [f"the {name} was another one than planned for {percent_of(wrong)} of the run"]
    out = []
    if abs(share - 1.0) > DIFFERS:
        top = float(np.max(planned))
        factor, unit = scale(channel_unit(name), top)
        how = f"was clipped at {plain(factor * reached)} {unit}, " if clipped else "reached "
        told = percent_of(reached / top if clipped and top > 0.0 else share)
        out.append(f"the {name} {how}{told} of what was planned")
    if late and wrong > DIFFERS:
        way = "late" if late > 0 else "early"
        out.append(
            f"the {name} came {plain(1e3 * abs(late) * step)} ms {way}, and was another "
            f"one than planned for {percent_of(wrong)} of the run"
        )
    return out


def _reached(measured: Array, planned: Array) -> tuple[float, float, bool]:
    """Return the share of a command that was reached, its upper level, and whether it is cut."""
    share, top = share_reached(measured, planned), float(np.max(planned))
    reached = float(np.median(measured[planned >= top - EDGE * float(np.ptp(planned))]))
    if abs(share - 1.0) <= DIFFERS:
        return 1.0, reached, False
    clipped = _off(measured, np.minimum(planned, reached)) < _off(measured, share * planned)
    return share, reached, share < 1.0 and clipped


def _off(measured: Array, goal: Array) -> float:
    """Return the share of instants at which a command is another one [1]."""
    size = float(np.ptp(goal)) or abs(float(goal[0])) or 1.0
    return float(np.mean(np.abs(measured - goal) > OFF * size))


def _late(measured: Array, goal: Array, step: float) -> int:
    """Return by how many samples a command is late, less than 0 where it is early.

    By the correlation, which neither clipping nor a weaker command moves. Of peaks alike, as a
    periodic command has them, the nearest one.
    """
    most = min(round(LATEST / step), goal.size // 4)
    lags = np.arange(-most, most + 1)
    alike = np.array([_likeness(*_shifted(measured, goal, int(lag))) for lag in lags])
    beside = np.pad(alike, 1, constant_values=-np.inf)
    peaks = (alike >= beside[:-2]) & (alike >= beside[2:]) & (alike >= np.max(alike) - AS_GOOD)
    return int(min(lags[peaks], key=abs))


def _likeness(measured: Array, goal: Array) -> float:
    """Return the correlation of two signals, 0 where one is constant."""
    own, other = measured - np.mean(measured), goal - np.mean(goal)
    size = float(np.linalg.norm(own) * np.linalg.norm(other))
    return float(own @ other) / size if size > 0.0 else 0.0


def _shifted(measured: Array, goal: Array, late: int) -> tuple[Array, Array]:
    """Return a command that is late by some samples, and its goal, at the same instants."""
    size = goal.size
    own = slice(max(late, 0), size + min(late, 0))
    return measured[own], goal[slice(max(-late, 0), size - max(late, 0))]


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
    step: float
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

    Equal names decide; the others are paired so that motions are alike, without changing the order.

    Parameters
    ----------
    runs : measured, in order
    plan : the plan
    """
    found: list[PlannedRun | None] = []
    for run in runs:
        named = [one for one in plan.runs if _same_name(run.name, one.name)]
        found.append(named[0] if len(named) == 1 and named[0] not in found else None)
    open_runs = [k for k, one in enumerate(found) if one is None]
    left = [one for one in plan.runs if one not in found]
    for k, one in zip(open_runs, _paired([runs[k] for k in open_runs], left, plan), strict=True):
        found[k] = one
    return found


def shows(run: Measurement, planned: PlannedRun, motion: str) -> bool:
    """Return whether a measured run's motion is that of a planned one; see `compared`."""
    shown = _shown(run, motion)
    return run.has(shown) and _aligned(run, planned, motion, shown)[0] >= ALIKE


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
        pair = aligned.measured[command], aligned.planned[command]
        out += command_differences(command, *pair, aligned.step)
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


def _paired(
    runs: Sequence[Measurement], left: Sequence[PlannedRun], plan: PlanFolder
) -> list[PlannedRun | None]:
    """Return the planned run of each measured one: of all ways in order, the most alike."""
    if not runs or not left:
        return [None] * len(runs)
    alike = np.array(
        [[_aligned(run, one, plan.motion, _shown(run, plan.motion))[0] for one in left]
         for run in runs]
    )  # fmt: skip
    if len(runs) <= len(left):
        return [left[k] for k in _in_order(alike)]
    own = dict(zip(_in_order(alike.T), left, strict=True))
    return [own.get(k) for k in range(len(runs))]


def _in_order(alike: Array) -> list[int]:
    """Return a column for each row (n, m >= n) of likenesses: rising, and the most alike in sum."""
    rows, columns = alike.shape
    best = np.zeros((rows + 1, columns + 1))  # of the first rows within the first columns
    for i in range(1, rows + 1):
        best[i, :i] = -np.inf
        for j in range(i, columns + 1):
            best[i, j] = max(best[i, j - 1], best[i - 1, j - 1] + alike[i - 1, j - 1])
    found, j = [], columns
    for i in range(rows, 0, -1):
        while best[i, j] == best[i, j - 1]:
            j -= 1
        j -= 1
        found.append(j)
    return found[::-1]


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
        step,
        (end - begin) / even.size,
    )


def _words(channel: str) -> str:
    return channel.replace("_", " ")
