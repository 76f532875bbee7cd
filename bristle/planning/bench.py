"""The next tests of a damper on a bench: from its study to a plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core.config import Document
from ..core.progress import tell
from ..diagnosis.decision import refuse_unknown_noise
from ..diagnosis.effect_size import SizeSearch as Fitted
from ..diagnosis.prepared import Prepared, refuse_lacking
from ..diagnosis.rig_runs import BenchRuns
from ..errors import StudyError
from ..identification.fit import fit_from_starts
from ..identification.problem import REFERENCE, Problem, Run
from ..identification.rig import DAMPER
from ..identification.smoothing import posterior_draws
from ..model.model import Model
from ..physics.laws import LAWS
from ..study.identify import is_identified
from ..study.study import Study
from .information import DRAWS, Question
from .limits import RigLimits, Test, limits_given, limits_of_runs, read_sheet, with_given
from .plan import Plan, outcomes, searched
from .questions import (
    NONE,
    PlanRequest,
    Purposes,
    RunsAtHand,
    SizedRival,
    Stated,
    able_beside,
    law_rivals,
    notes_of_error,
    open_parts,
    parameters_of,
    purposes_at,
    refuse_no_rival,
    refuse_unable,
    requests_of,
    rivals_of,
    sized_rival,
    stated,
)
from .search import Planner
from .waveforms import Command, Waveform

NOISE = 0.01
"""Noise of each channel, over its RMS, where rig.toml says nothing."""

RMS = 0.5
"""RMS of a force over its largest value, about."""


@dataclass(frozen=True)
class NewRig:
    """What a rig.toml says of a rig that was not measured yet.

    `limits` of the rig; `force` the largest of the damper [N]; `law` of it; `noise` of the channels
    displacement [m], velocity [m/s] and force [N]; `drive` the channel of the command.
    """

    limits: RigLimits
    force: float
    law: str
    noise: Mapping[str, float]
    drive: str


def read_new_rig(path: Path, given: Mapping[str, Any] | None = None) -> NewRig:
    """Return what a rig.toml says.

    Parameters
    ----------
    path : the file
    given : limits that take the place of those in the file

    Raises
    ------
    StudyError
        With every mistake of the file and its line, or if it lacks what a plan needs.
    """
    document = Document(path, StudyError)
    damper = document.data.get("damper")
    drive = str(damper.get("command")) if isinstance(damper, dict) else ""
    found = read_sheet(document, drive)
    damper = found["damper"]
    if damper["max_force"] is None and not document.found:
        document.error(("damper",), '[damper] lacks max_force: expected max_force = "2 kN".')
    document.check()
    drive = damper["command"]
    of_file = {name: value for name, value in found["limits"].items() if value is not None}
    limits = {**of_file, **limits_given(given or {}, drive)}
    lacking = [name for name in ("stroke", "speed", "command") if name not in limits]
    if lacking == ["command"] and "levels" in limits:
        lacking = []
    if lacking:
        document.error(
            ("limits",),
            f"[limits] lacks {', '.join(lacking)}: before the first measurement nothing else says "
            "what the rig can do.",
        )
        document.check()
    noise = {name: value for name, value in found["noise"].items() if value is not None}
    try:
        rig = with_given(RigLimits(1.0, 1.0), limits)
    except StudyError as error:
        document.error_of(("limits",), str(error))
        document.check()
        raise
    return NewRig(rig, damper["max_force"], damper["law"], noise, drive)


def plan_new(
    path: Path,
    request: PlanRequest | None = None,
    *,
    limits: Mapping[str, Any] | None = None,
    seed: int = 1,
) -> Plan:
    """Return the first tests of a rig that a rig.toml describes.

    Parameters
    ----------
    path : rig.toml
    request : what the tests shall be for; None for the law's parameters and all effects
    limits : in place of those of the file
    seed : of what is drawn

    Raises
    ------
    StudyError
        If the file is wrong, or its limits allow no test.
    """
    rig = read_new_rig(path, limits)
    request = (
        request if request is not None and not request.nothing else PlanRequest(see=(), sharpen=())
    )
    stand_in = _stand_in(rig)
    problem = Problem([stand_in])
    model = _scaled(rig, problem)
    stand_in = replace(stand_in, force=problem.predict(model, stand_in))
    problem = Problem([stand_in])
    effects, others = _beside(request, model, problem)
    parameters = () if request.sharpen is None else parameters_of(model.free(), request.sharpen)
    parts = (
        None if request.learn is None else open_parts(model, rig.limits, request.learn, rig.drive)
    )
    purposes = Purposes(model, effects, others, parameters, parts, drive=rig.drive)
    found = stated(purposes, problem, RunsAtHand(), 1.0, seed)
    planner = Planner(
        found.goal, rig.limits, stand_in.noise, stand_in.draws, 1.0 / stand_in.dt, None, seed,
        rig.drive,
    )  # fmt: skip
    return planned("", found, planner, rig.drive)


def _beside(
    request: PlanRequest, model: Model, problem: Problem
) -> tuple[tuple[SizedRival, ...], tuple[Question, ...]]:
    """Return the effects to be seen and the rivals to be told apart, at typical sizes."""
    fitted = Fitted(problem, model, problem.expectation(model), 0)
    able = able_beside(model, problem, ("force",))
    for name in request.see or ():
        refuse_unable(name, able, model)
    effects = (
        () if request.see is None else tuple(sized_rival(n, fitted) for n in request.see or able)
    )
    if request.separate is None:
        return effects, ()
    names = sorted(request.separate, key=lambda name: name == NONE)  # the model as it is comes last
    return effects, tuple(rivals_of({name: _rival(name, able, fitted) for name in names}))


def _rival(name: str, able: Sequence[str], fitted: Fitted) -> Model:
    """Return the model with an effect of a typical size, or another law fitted to its force."""
    model = fitted.model
    if name in (NONE, model.law):
        return model
    if name in law_rivals():
        return fit_from_starts(fitted.problem, Model(name, model.effects)).model
    refuse_no_rival(name)
    refuse_unable(name, able, model)
    return sized_rival(name, fitted).rival().model


def _stand_in(rig: NewRig) -> Run:
    """Return a run that spans what the rig can do, and stands for its sizes."""
    low, high = rig.limits.usable_band
    test = Test(
        Waveform("multisine", low, high), Command("random", *rig.limits.command),
        seconds=rig.limits.duration,
    )  # fmt: skip
    one = test.signals(rig.limits)
    force = RMS * rig.force * np.sign(one.v)
    std = {
        "displacement": rig.noise.get("displacement", NOISE * float(np.std(one.x))),
        "velocity": rig.noise.get("velocity", NOISE * float(np.std(one.v))),
    }
    jerk = float(np.mean(np.gradient(one.a, one.dt) ** 2)) * one.dt
    draws = np.zeros((DRAWS, len(one.x), 4))
    draws[:, :, :3] = posterior_draws(
        len(one.x), one.dt, (std["displacement"], std["velocity"]), jerk, (True, True), DRAWS
    )
    noise = rig.noise.get("force", NOISE * RMS * rig.force)
    return Run(
        "rig", one.dt, one.x, one.v, one.a, one.V, force, noise, draws, drive=rig.drive
    )  # fmt: skip


def _scaled(rig: NewRig, problem: Problem) -> Model:
    """Return the law at the rig's size: its largest force is that of the data sheet."""
    declared = LAWS[rig.law].parameters
    values = {}
    for name, one in declared.items():
        per_command = one.unit.replace("(m.V)", "m").replace("/V", "")
        values[name] = problem.scaled(rig.law, name)
        if per_command != one.unit and per_command in REFERENCE:
            grown = problem.size(per_command) / REFERENCE[per_command]
            values[name] = one.value * grown * REFERENCE["V"] / problem.size("V")
    model = Model(rig.law, values=values)
    peak = float(np.max(np.abs(problem.predict(model, problem.runs[0]))))
    factor = rig.force / peak if peak > 0.0 else 1.0
    return replace(
        model,
        values={
            name: value * factor if declared[name].unit.startswith("N") else value
            for name, value in values.items()
        },
    )


def plan_study(
    study: Study,
    request: PlanRequest | None = None,
    *,
    limits: Mapping[str, Any] | None = None,
    seed: int = 1,
) -> Plan:
    """Return the next tests of a study of a damper on a bench.

    Parameters
    ----------
    study : Study
    request : what they shall be for; None for what the verdict leaves open, or else all
    limits : of the rig, as arguments of `RigLimits`; what is not given is what the runs have done
    seed : of what is drawn

    Raises
    ------
    StudyError
        If the limits allow no test, or a purpose names what there is not.
    RecordError
        If a file cannot be read.
    """
    opened = _opened(study)
    runs = [*opened.problem.runs, *opened.held_out.runs]
    rig = with_given(limits_of_runs(runs), limits or {})
    requests = requests_of(request, study)
    purposes = purposes_at({DAMPER: opened}, requests, rig, study.drive)[DAMPER]
    measured = RunsAtHand(opened.problem.runs, opened.held_out.runs)
    found = stated(purposes, opened.searched, measured, max(opened.before.z, 1.0), seed)
    tell("looking at tests")
    planner = Planner(
        found.goal, rig, float(np.median([run.noise for run in runs])), _errors(runs[0]),
        1.0 / runs[0].dt, seed=seed, drive=runs[0].drive,
    )  # fmt: skip
    made = planned(study.name, found, planner, study.drive)
    return replace(made, notes=notes_of_error(study, {"": opened}))


def _errors(run: Run) -> Any:
    """Return draws (d, n, 4) of the motion's error, that of the command left out."""
    out = run.draws[:DRAWS].copy()
    out[:, :, 3] = 0.0
    return out


def _opened(study: Study) -> Prepared:
    """Return the model of a study with its runs."""
    study.usable_effects()
    model, runs = study.model(), study.runs()
    rig = BenchRuns(runs.train, runs.holdout, model, identified=is_identified(model))
    refuse_lacking(study.folder, rig.lacking)
    opened = rig.prepare(DAMPER)
    refuse_unknown_noise(study.folder, opened.held_out)
    return opened


def planned(name: str, found: Stated, planner: Planner, drive: str) -> Plan:
    """Return the plan that serves a goal.

    Parameters
    ----------
    name : of the study, "" before the first measurement
    found : the goal, with what it is made of
    planner : finds the tests
    drive : the channel of the command, "" where there is none
    """
    tests, rows, gain = searched(
        {DAMPER: found},
        planner,
        lambda then: outcomes(found.purposes, found.asked, found.known, then[DAMPER]),
    )
    return Plan(
        name, tuple(one.test for one in tests),
        tuple(one.test.signals(planner.limits) for one in tests),
        tuple(rows), planner.limits, drive, gain, tuple(one.role for one in tests),
    )  # fmt: skip
