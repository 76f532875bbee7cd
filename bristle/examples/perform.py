"""The true rig of an example performs a plan: the same instruments, fresh noise."""

from __future__ import annotations

import tempfile
from bisect import bisect_right
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from ..core.progress import Count
from ..core.text import plain
from ..data.corrections import jumps
from ..errors import StudyError
from ..planning.folder import NAME, PlanFolder, PlannedRun, read_plan
from ..study.extend import Extended, extend_study
from ..study.study import Study
from . import rigs
from .hidden import unseal
from .rigs import (
    RATE,
    STROKE,
    V_MAX,
    Damper,
    Motion,
    Programme,
    Signals,
    recorded,
    rig_of,
    scales_of,
    times,
    write_csv,
)

# Planned motions and commands as a rig performs them: smooth, and held before each jump.

Array = NDArray[np.float64]


def seconds_of(time: Array) -> float:
    """Return how long a run with samples at `time` (n,) s is recorded [s]."""
    return float(np.floor((time[-1] - time[0]) * RATE + 1e-6) / RATE)


def motion_of(time: Array, displacement: Array) -> Motion:
    """Return the motion through planned samples: a spline of order five."""
    spline = make_interp_spline(time - time[0], displacement, k=5)
    first, second = spline.derivative(1), spline.derivative(2)
    return Motion(
        times(seconds_of(time)), lambda q: (float(spline(q)), float(first(q)), float(second(q)))
    )


def ground_of(time: Array, acceleration: Array) -> Array:
    """Return a planned ground acceleration at the recorder's instants (n,), straight between."""
    return np.asarray(np.interp(times(seconds_of(time)), time - time[0], acceleration))


def programme_of(time: Array, command: Array) -> Programme:
    """Return the voltage through planned samples: straight between them, held before a jump.

    A jump comes at the recorder's instant that is nearest to its sample.
    """
    height = np.where(jumps(command), np.diff(command, prepend=command[:1]), 0.0)
    at = np.flatnonzero(height)
    moments = np.round((time[at] - time[0]) * RATE) / RATE
    smooth = (command - np.cumsum(height)).tolist()
    step = (time[-1] - time[0]) / (time.size - 1)
    levels = np.concatenate([[0.0], np.cumsum(height[at])]).tolist()
    edges = moments.tolist()

    def value(now: float) -> float:
        place = min(max(now / step, 0.0), len(smooth) - 1.0)
        k = min(int(place), len(smooth) - 2)
        level = levels[bisect_right(edges, now + 1e-9)]
        return float(smooth[k] + (smooth[k + 1] - smooth[k]) * (place - k) + level)

    return Programme(value, tuple(dict.fromkeys(edges)))


KINDS = {"bench": "bench", "building": "structure"}
"""Rigs of examples, and what a plan calls them."""
COMMAND = "voltage"
RESTS = 0.02
"""Share of the largest displacement, or speed, up to which a run begins at rest."""


def perform_plan(
    folder: Path | str, plan: Path | str, *, name: str = "", insist: bool = False
) -> Extended:
    """Let the rig of an example perform a plan; its runs join the study.

    Parameters
    ----------
    folder : path
        The example.
    plan : path
        The folder of the plan.
    name : str
        The runs are called NAME_1, NAME_2 ...; "" leaves them the names of the plan.
    insist : bool
        Perform it although it was made for another study.

    Raises
    ------
    StudyError
        If the folder is no example, or the plan is for another rig; if its runs are in the study
        already, or ask for what the rig cannot do. Nothing is written then.
    RecordError
        If a file of the plan cannot be read.
    """
    if name and not NAME.fullmatch(name):
        raise StudyError(f'"{name}": a name of letters and digits is right, as in second.')
    answer, study, planned = unseal(Path(folder)), Study(folder), read_plan(plan)
    _refuse_other_rig(study, planned, answer["rig"], insist)
    if "instruments" not in answer:
        raise StudyError(
            f"{folder}: an older version of bristle has made this example, and its instruments are "
            f"not known. Make it again with --seed {answer['seed']}."
        )
    names = [f"{name}_{k}" if name else run.name for k, run in enumerate(planned.runs, 1)]
    _refuse_performed(study, names)
    rig = rig_of(answer)
    for run in planned.runs:
        _refuse_beyond(run)
    with tempfile.TemporaryDirectory(prefix="bristle_example_") as scratch:
        files = {
            Path(scratch, f"{one}.csv"): run for one, run in zip(names, planned.runs, strict=True)
        }
        count = Count("run", len(files))
        for file, run in files.items():
            count.begins(run.name)
            rng = np.random.default_rng([int(answer["seed"]), *file.stem.encode()])
            shown = _performed(rig, run, answer)
            write_csv(file, recorded(shown, answer["instruments"], rng))
        roles = {file.name: run.role for file, run in files.items()}
        return extend_study(study, list(files), roles=roles)


def _performed(rig: Any, run: PlannedRun, answer: Mapping[str, Any]) -> Signals:
    """Return what ideal instruments show of a run."""
    volts = programme_of(run.time, run.signals.get(COMMAND, np.zeros(run.time.size)))
    if isinstance(rig, Damper):
        motion = motion_of(run.time, run.signals["displacement"])
        return rigs.perform(rig, motion, volts, scales_of("bench", answer["law"]))
    shown: Signals = rig.perform(ground_of(run.time, run.signals["ground_acceleration"]), volts)
    _refuse_stroke(run, shown["base_displacement"], "it moves the base by")
    return shown


def _refuse_other_rig(study: Study, plan: PlanFolder, rig: str, insist: bool) -> None:
    if plan.rig != KINDS[rig]:
        raise StudyError(
            f'the plan is for a rig "{plan.rig}", and {study.folder} is a "{KINDS[rig]}". A plan '
            "for this rig is right."
        )
    if plan.study not in ("", study.name) and not insist:
        raise StudyError(
            f"the plan was made for the study {plan.study}, and this one is {study.name}. With "
            "--insist it is performed all the same."
        )
    if plan.command not in ("", COMMAND):
        raise StudyError(f"the plan commands a {plan.command}, and this rig takes a {COMMAND}.")


def _refuse_performed(study: Study, names: list[str]) -> None:
    there = [one for one in names if (study.folder / "data" / f"{one}.csv").exists()]
    if there:
        raise StudyError(
            f"{study.folder}: {', '.join(there)} {'is' if len(there) == 1 else 'are'} performed "
            "already. --as-runs NAME gives the new runs another name."
        )


def _refuse_beyond(run: PlannedRun) -> None:
    """Refuse what the rig cannot do, as far as the plan alone tells."""
    volts = run.signals.get(COMMAND, np.zeros(1))
    low, high = float(np.min(volts)), float(np.max(volts))
    if low < -1e-9 or high > V_MAX * (1.0 + 1e-9):
        raise StudyError(
            f"{run.name}: the voltage goes from {plain(low)} to {plain(high)} V; this rig's "
            f"amplifier gives 0 to {V_MAX:g} V."
        )
    if "displacement" not in run.signals:
        return
    x = run.signals["displacement"]
    _refuse_stroke(run, x, "it asks for")
    v = np.gradient(x, run.time)
    for what, values in (("displacement", x), ("velocity", v)):
        if abs(values[0]) > RESTS * float(np.max(np.abs(values))):
            raise StudyError(
                f"{run.name}: its {what} does not begin at zero, and the rig rests before it. "
                "A motion with a ramp is right."
            )


def _refuse_stroke(run: PlannedRun, x: Any, what: str) -> None:
    most = float(np.max(np.abs(x)))
    if most > STROKE:
        raise StudyError(
            f"{run.name}: {what} {plain(1e3 * most)} mm to one side; this rig's stroke is "
            f"{plain(1e3 * STROKE)} mm to either side."
        )
