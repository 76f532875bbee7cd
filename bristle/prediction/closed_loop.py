"""Building and identified damper under a ground motion alone: peaks and RMS, with their error.

A comparison of forces gives the model the measured motion. Here it gets the ground motion and the
command alone, so that an error of the force acts on the motion that causes the next force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..core.progress import tell
from ..core.text import command, percent, short_z
from ..data.measurement import Measurement
from ..errors import StudyError
from ..identification.problem import following
from ..identification.run_start import MOVING
from ..model.draws import OpenEffect, has_covariance, left_open
from ..model.model import Model
from ..study.history import history_steps
from ..study.rig import building_of
from ..study.steps import count_test_set_use, opened_text, runs_for_test, uses_of_test_set
from ..study.study import Study, behind_data
from ..study.study_file import TEST
from .closed_loop_result import ClosedLoop, Predicted
from .excitation import PredictedRun, begins_in_motion, trial_of
from .model_system import BuildingWithFile
from .monte_carlo import DRAWS, FEWEST, figures_of
from .reach import ranges_of, told_range


def closed_loop(
    study: Study, *, role: str = "holdout", draws: int = DRAWS, with_limits: bool = False
) -> ClosedLoop:
    """Simulate a study's building with its model, and compare the responses with those measured.

    Parameters
    ----------
    study : Study
        Of a building, with a model that was identified.
    role : {"holdout", "train", "test"}
        Whose ground motions; the study counts how often its test runs are opened.
    draws : int
        Draws of the parameters for the band; 0 for none.
    with_limits : bool
        Whether the band has what the limits of the study's verdict leave open, too.

    Raises
    ------
    StudyError
        If the study is of a bench, a run has no ground motion or does not begin at rest, or the
        model has no covariance.
    RunError
        If the model cannot be simulated.
    """
    model = study.model()
    building = building_of(study, model)
    if building is None:
        raise StudyError(
            f"{study.folder}: the damper was measured on a bench: a prediction needs a building, "
            f"as in  {command('predict', study.name, '--building', 'house.toml')}"
        )
    effects, more = _prepared(study, model, draws, with_limits)
    runs = study.runs()
    if role == TEST:
        runs = runs_for_test(study, runs)
    chosen = runs.train if role == "train" else runs.holdout
    trials, notes = _trials(study, chosen, split=role != TEST)
    house = BuildingWithFile(building, study.folder / model.building if model.building else None)
    found = _predicted(study, model, (house, False), trials, draws, effects)
    notes += more
    others = [device.name for device in building.devices if device.name != building.studied]
    if others:
        notes.append(
            f"the force of {', '.join(others)} is the measured one, for the model is that of "
            f"{building.studied} alone"
        )
    if role == TEST:
        count_test_set_use(study)
        notes.append(opened_text(len(uses_of_test_set(study))))
    return replace(found, role=role, notes=(*found.notes, *notes))


def closed_loop_in(
    study: Study,
    house: BuildingWithFile,
    trials: Sequence[PredictedRun],
    *,
    draws: int = DRAWS,
    with_limits: bool = False,
) -> ClosedLoop:
    """Predict the responses of a building with a damper that was identified on a bench.

    Parameters
    ----------
    study : Study
        Of a damper on a bench, with a model that was identified.
    house : BuildingWithFile
        The building, which may never have been measured.
    trials : sequence of PredictedRun
        Its ground motions, with responses where there are some; see `prediction.excitation`.
    draws : int
        Draws of the parameters for the band; 0 for none.
    with_limits : bool
        Whether the band has what the limits of the study's verdict leave open, too.

    Raises
    ------
    StudyError
        If the study has a building of its own, the command is another one than the model's, or the
        model has no covariance.
    RunError
        If the model cannot be simulated.
    """
    if study.settings.has_building:
        raise StudyError(
            f"{study.folder}: its damper was measured in a building of its own; --building goes "
            "with a damper on a bench."
        )
    model = study.model()
    effects, more = _prepared(study, model, draws, with_limits)
    _refuse_other_command(study, trials)
    found = _predicted(study, model, (house, True), trials, draws, effects)
    return replace(found, notes=(*found.notes, *more))


def _prepared(
    study: Study, model: Model, draws: int, with_limits: bool
) -> tuple[list[OpenEffect], list[str]]:
    """Return the effects that the band is to have, with notes; refuse what has no band."""
    if draws and not has_covariance(model):
        raise StudyError(
            f"{study.folder / 'model.toml'}: no covariance of the parameters, which the 95 % band "
            f"needs. Identify the model again:  {command('identify', study.folder)}"
        )
    changed = [note] if (note := behind_data(study)) else []
    if not with_limits:
        return [], changed
    if draws < FEWEST:
        raise StudyError(f"--with-limits widens a band, for which --draws {FEWEST} is the least.")
    verdict = study.verdict()
    effects, notes = left_open(verdict, model, study.folder)
    stale = [note] if (note := study.stale(verdict or {})) else []
    return effects, [*changed, *stale, *notes]


def _refuse_other_command(study: Study, trials: Sequence[PredictedRun]) -> None:
    """Refuse a command in another unit than the one that the damper was identified with."""
    for trial in trials:
        given = trial.shaking.drive.name
        if study.drive and trial.shaking.command is not None and given != study.drive:
            raise StudyError(
                f"{trial.shaking.name}: its command is a {given}, and the damper was identified "
                f"with a {study.drive}. Measurements with a {study.drive} are right."
            )


def _trials(
    study: Study, chosen: Sequence[Measurement], *, split: bool
) -> tuple[list[PredictedRun], list[str]]:
    """Return what can be simulated from rest, and why the rest is left out.

    A single run that is `split` in time is simulated from the start of its file, and judged on its
    own part.
    """
    single = split and sum(run.role != TEST for run in study.settings.runs) == 1
    whole = [*study.read("train"), *study.read("holdout")] if single else []
    trials, notes = [], []
    for run in chosen:
        begun = next((one for one in whole if one.time[0] <= run.time[0] <= one.time[-1]), run)
        seen = MOVING if run.time[0] > begun.time[0] else 0  # of the training part, see runs
        trial = trial_of(begun, run.name, (float(run.time[seen]), float(run.time[-1])))
        moving = begins_in_motion(trial)
        if moving:
            notes.append(
                f"{run.name} is left out: {moving} is not at rest when the run begins, and what "
                "was before is not known"
            )
        else:
            trials.append(trial)
    if not trials:
        raise StudyError(f"{study.folder}: no run can be simulated from rest. {'; '.join(notes)}.")
    return trials, notes


def _predicted(
    study: Study,
    model: Model,
    place: tuple[BuildingWithFile, bool],
    trials: Sequence[PredictedRun],
    draws: int,
    effects: Sequence[OpenEffect],
) -> ClosedLoop:
    """Return the prediction of the present model and of that before the last step."""
    if channels := dict.fromkeys(following(model.effects).values()):
        raise StudyError(
            f"{study.folder}: an effect of the model follows {', '.join(channels)}, which a "
            "simulated building does not have. Leave that effect out of the model."
        )
    before, step = _before(study)
    judged = history_steps(study.steps())
    rows: list[Predicted] = []
    known = told_range(ranges_of(study, model, study.runs()), study.drive)
    strokes, failed, outside = [], 0, []
    lost: dict[str, tuple[str, list[str]]] = {}
    for number, trial in enumerate(trials):
        tell(f"simulating {trial.shaking.name}")
        missed = judged[-1].missed
        now = figures_of(model, place, trial, draws, number, missed, effects, known)
        then = None
        if before is not None and not following(before.effects):
            then = figures_of(before, place, trial, 0, number)
        rows += now.rows(trial, then)
        strokes.append(now.stroke)
        outside += [f"in {trial.shaking.name} the damper has {now.outside}"] if now.outside else []
        failed += now.failed
        for label, why in now.lost.items():
            lost.setdefault(label, (why, []))[1].append(trial.shaking.name)
    notes = [f"{failed} of the draws could not be simulated"] if failed else []
    notes += [f"{one}: there neither the model nor the band is known" for one in outside]
    last = judged[-1]
    if draws and last.missed and last.z is not None:
        notes.append(
            f"on held-out runs the error of the model is {short_z(last.z)} times the noise; what "
            f"it misses, {percent(last.missed)} of the force, widens the band"
        )
    for label, (why, names) in lost.items():
        of = "" if len(names) == len(trials) else f" of {', '.join(names)}"
        notes.append(
            f"with {label} the building cannot be simulated at each of its sizes ({why}): no band"
            f"{of} has it"
        )
    said = ClosedLoop(tuple(rows), draws, step, tuple(notes), tuple(strokes))
    return replace(said, folder=str(study.folder))


def _before(study: Study) -> tuple[Model | None, str]:
    """Return the model before the last step, and what that step was.

    The model that a study begins with is nobody's guess of this damper: then there is none.
    """
    numbers = [step.number for step in study.steps()]
    if len(numbers) < 3:
        return None, ""
    return study.model_of(numbers[-2]), study.history.step(numbers[-1]).what
