"""The next tests of a damper on a bench: from its study to a plan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ..core.progress import tell
from ..diagnosis.decision import refuse_unknown_noise
from ..diagnosis.prepared import Prepared, refuse_lacking
from ..diagnosis.rig_runs import BenchRuns
from ..identification.problem import Run
from ..identification.rig import DAMPER
from ..physics.effect import plain_name
from ..study.identified import is_identified
from ..study.study import Study
from .information import DRAWS, Question
from .limits import RigLimits, limits_of_runs, with_given
from .outcome import Outcome, outcomes
from .plan import Plan
from .questions import (
    PlanRequest,
    Purposes,
    RunsAtHand,
    SizedRival,
    Stated,
    cost_of,
    default_request,
    effects_beside,
    misfit_note,
    note_of_missing,
    open_parts,
    parameters_of,
    rivals,
    stated,
)
from .search import Planner
from .waveforms import Waveform


def plan_study(
    study: Study,
    request: PlanRequest | None = None,
    *,
    limits: Mapping[str, Any] | None = None,
    record: Waveform | None = None,
    seed: int = 1,
) -> Plan:
    """Return the next tests of a study of a damper on a bench.

    Parameters
    ----------
    study : Study
    request : what they shall be for; None for what the verdict leaves open, or else all
    limits : of the rig, as arguments of `RigLimits`; what is not given is what the runs have done
    record : a recorded motion that may be scaled
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
    request = request if request is not None and not request.nothing else default_request(study)
    purposes = _purposes(request, opened, rig, study.drive)
    measured = RunsAtHand(opened.problem.runs, opened.held_out.runs)
    found = stated(purposes, opened.searched, measured, max(opened.before.z, 1.0), seed)
    tell("looking at tests")
    planner = Planner(
        found.goal, rig, float(np.median([run.noise for run in runs])), _errors(runs[0]),
        1.0 / runs[0].dt, record, seed, runs[0].drive,
    )  # fmt: skip
    made = planned(study.name, found, planner, study.drive)
    return replace(made, notes=_notes(study, opened))


def _notes(study: Study, opened: Prepared) -> tuple[str, ...]:
    """Return what weakens a plan: an error that an effect would take away first."""
    missing = note_of_missing(study, [plain_name(name) for name in study.model().effects])
    if not missing and opened.before.z > opened.rule.clean:
        return (f"The model {misfit_note(opened.before.z)}",)
    return missing


def _errors(run: Run) -> Any:
    """Return draws (d, n, 4) of the motion's error, that of the command left out."""
    out = run.draws[:DRAWS].copy()
    out[:, :, 3] = 0.0
    return out


def _opened(study: Study) -> Prepared:
    """Return the model of a study with its runs."""
    study.usable_effects()
    model, runs = study.model(), study.runs()
    rig = BenchRuns(runs.train, runs.holdout, model, identified=is_identified(model), say=tell)
    refuse_lacking(study.folder, rig.lacking)
    opened = rig.prepare(DAMPER)
    assert opened is not None
    refuse_unknown_noise(study.folder, opened.held_out)
    return opened


def _purposes(request: PlanRequest, opened: Prepared, limits: RigLimits, drive: str) -> Purposes:
    """Return what a plan is for, with the models and effects that this takes."""
    model = opened.before.model
    effects: tuple[SizedRival, ...] = ()
    others: tuple[Question, ...] = ()
    parts = None
    if request.see is not None:
        tell("looking at effects")
        effects = tuple(effects_beside(opened, request.see))
    if request.separate is not None:
        others = tuple(rivals(opened, request.separate))
    if request.learn is not None:
        parts = open_parts(model, limits, request.learn, drive or "voltage")
    parameters = () if request.sharpen is None else parameters_of(model.free(), request.sharpen)
    return Purposes(model, effects, others, parameters, parts, drive=drive)


def planned(name: str, found: Stated, planner: Planner, drive: str) -> Plan:
    """Return the plan that serves a goal.

    Parameters
    ----------
    name : of the study, "" before the first measurement
    found : the goal, with what it is made of
    planner : finds the tests
    drive : the channel of the command, "" where there is none
    """
    goal, limits = found.goal, planner.limits
    tests = planner.plan()
    after = goal.with_tests(tests)[: goal.count]
    told = outcomes(found.purposes, found.asked, found.known, after)
    told = [one if one.settled else _or_beyond(one, found, planner) for one in told]
    costs = [cost_of(found.purposes.figures(one)) for one in (found.known, after)]
    gain = float(np.exp(costs[0] - costs[1]))
    return Plan(
        name, tuple(one.test for one in tests),
        tuple(one.test.signals(limits) for one in tests),
        tuple(told), limits, drive, gain, tuple(one.role for one in tests),
    )  # fmt: skip


def _or_beyond(left: Outcome, found: Stated, planner: Planner) -> Outcome:
    """Return what a plan leaves open, with whether a test of its own would settle it."""
    for one in planner.looked_at():
        after = found.goal.with_pair(one)[: found.goal.count]
        told = outcomes(found.purposes, found.asked, found.known, after)
        if any(other.name == left.name and other.settled for other in told):
            return left
    return replace(left, beyond=True)
