"""The calls that a user makes of measurements: identify, compare, diagnose.

Each takes what a researcher has at hand, files, frames, arrays, or a study. Half of the file is
what the API's page shows: sections and examples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ..comparison.comparison import RigComparer
from ..comparison.result import Comparison
from ..core.text import written
from ..diagnosis import Diagnosis, diagnose_rig
from ..diagnosis.law_choice import simplest
from ..errors import StudyError
from ..identification.histories import compile_ahead
from ..identification.rig import Rig, bench_rig, building_rig
from ..identification.rig_fit import force_errors, site_models
from ..model.model import Model
from ..physics.building import Building
from ..physics.laws import DEFAULT
from .forms import all_laws, left_out_notes, refuse_in_building, with_law
from .identify import FitTask, Identified, identify_on_rig, identify_study, is_identified
from .inputs import (
    Channels,
    Data,
    Given,
    building_from,
    measurements,
    model_of,
    runs_of,
)
from .runs import Runs
from .steps import compare_study, diagnose_study
from .study import Study
from .study_file import ALL, CUT_OFF, ROLES, TEST


def identify(
    data: Data | Study,
    model: Given | None = None,
    *,
    effects: str | Sequence[str] = (),
    command: str | Sequence[str] | None = None,
    holdout: Data | None = None,
    channels: Channels | None = None,
    building: str | Path | Building | None = None,
    device: str | None = None,
    write: bool = True,
) -> Identified:
    """Identify a damper's parameters, with intervals, and judge them on runs held out.

    Parameters
    ----------
    data : Study, path, pattern, frame, mapping of arrays, Measurement, or several of these
        The runs; or a study, or its folder. Columns and keys are named by channel: `time`,
        `displacement`, `velocity`, `voltage` or `current`, `force`, with the unit in brackets,
        "force [kN]", or in SI. Other names are guessed, and `notes` of the result tell how.
    model : str, path, Model or Identified, optional
        The law, such as "bingham", or a model to begin with; else the study's, else "lugre". With
        "all", on a test bench, `laws` of the result tells how every law does, and the model has
        the study's, else the simplest that no other surpasses on held-out runs.
    effects : str or list of str
        Effects that the model has on top.
    command : str or list of str, optional
        How the command enters: "linear", "quadratic" or "table"; of several, or "all", the errors
        of each are in `forms` of the result. Else as the model has it.
    holdout : as data, optional
        Runs to judge on. Without them a third of the runs is held out, of one run the last 30 %. A
        study says itself which are.
    channels : mapping, optional
        Where channels are, `{"force": "-Ch3@kN"}`: column, unit, a minus to turn the sign. A study
        says it itself.
    building : path or Building, optional
        The building that the damper is in, if it was measured there and not on a test bench.
    device : str, optional
        Of a building with several devices the one that is identified; the forces of the others
        must be measured, as brace_force for one that is called brace.
    write : bool
        Of a study: whether the result becomes its model, as a step of the history.

    Returns
    -------
    Identified
        `parameters()` lists values, units and 95 % intervals; `unidentified` names those that the
        data do not identify; `after` holds the errors; `model.values` the values in SI.

    Raises
    ------
    StudyError
        If the law or an effect is not known, or the data cannot carry an identification.
    RecordError, PhysicsError
        If a file cannot be read, or a channel is missing; if the building's file is wrong.

    Examples
    --------
    >>> import bristle, numpy as np
    >>> t = np.arange(0.0, 8.0, 0.004)  # s
    >>> turn = 2.0 * np.pi * np.array([0.7, 1.9])[:, None]  # rad/s
    >>> size = np.array([[8e-3], [2e-3]])  # m
    >>> x, v = (size * np.sin(turn * t)).sum(0), (size * turn * np.cos(turn * t)).sum(0)
    >>> noise = np.random.default_rng(1).normal(0.0, 0.05, t.size)
    >>> run = {"time": t, "displacement": x, "velocity": v, "force": 5.0 * np.sign(v) + 90.0 * v}
    >>> run["force"] += noise  # N
    >>> found = bristle.identify(run, "bingham_standard")
    >>> row = next(row for row in found.parameters() if row["name"] == "c_0")
    >>> round(row["value"]), row["unit"], row["interval95"] < 2.0
    (90, 'N.s/m', True)
    >>> figure = found.plot()  # a notebook shows `found` itself: table and picture
    """
    given = _opened(data)
    free, model = _is_all(model), None if _is_all(model) else model
    if isinstance(given, Study):
        _refuse_of_study(holdout=holdout, channels=channels, building=building, device=device)
        begin = None if model is None and not effects else _present(given, model, effects)
        return identify_study(
            given, law=ALL if free else None, model=begin, command=command, write=write
        )
    chosen = model_of(model, effects, DEFAULT)
    house = building_from(building, device)
    refuse_in_building(ALL if free else None, house is not None)
    compile_ahead(chosen.law, chosen.effects)
    runs = _runs(given, holdout, channels, house)
    rig = _rig(runs, house)
    drives = [run.drive for run in runs.all if run.drive]
    chosen = chosen.with_drive(drives[0] if drives else chosen.drive)
    task = FitTask(CUT_OFF, command=command)
    if not free:
        return identify_on_rig(rig, runs, chosen, task)
    rows = all_laws(rig, runs, chosen)
    found = identify_on_rig(rig, runs, with_law(chosen, simplest(rows).law), task)
    left_out = left_out_notes(rig, chosen)
    return replace(found, laws=rows, notes=(*found.notes, *left_out))


def compare(
    data: Data | Study,
    model: Given | None = None,
    *,
    effects: str | Sequence[str] = (),
    train: Data | None = None,
    channels: Channels | None = None,
    building: str | Path | Building | None = None,
    device: str | None = None,
    role: str = "holdout",
) -> Comparison:
    """Compare a model's force with the measured one: how wrong, where, and where not.

    Parameters
    ----------
    data : Study, path, pattern, frame, mapping of arrays, Measurement, or several of these
        The runs to compare with, see `bristle.identify`; or a study, or its folder.
    model : str, path, Model or Identified, optional
        What `identify` returned, a model.toml, or a law at its defaults; of a study its own.
    effects : str or list of str
        Effects that the model has on top, at their defaults.
    train : as data, optional
        Of a building: the runs that stiffness and damping of the layer and the storeys are fitted
        to; else those of `data`.
    channels : mapping, optional
        As in `bristle.identify`.
    building : path or Building, optional
        As in `bristle.identify`.
    device : str, optional
        As in `bristle.identify`.
    role : {"holdout", "train", "test"}
        Which runs of a study. It counts how often its test runs are opened.

    Returns
    -------
    Comparison
        `z` is error / noise, 1 for a true model; `sentences` say what an engineer would; `patterns`
        on which coordinate the error depends.

    Raises
    ------
    StudyError
        If there is no model, a law or an effect is not known, or an effect acts at no site.
    RecordError, PhysicsError
        If a file cannot be read, a channel is missing, or a run is too short; if the building's
        file is wrong.

    Examples
    --------
    >>> import bristle, numpy as np
    >>> t = np.arange(0.0, 8.0, 0.004)  # s
    >>> x, v = 8e-3 * np.sin(9.0 * t), 72e-3 * np.cos(9.0 * t)  # m, m/s
    >>> noise = np.random.default_rng(1).normal(0.0, 0.05, t.size)
    >>> spring = 300.0 * x  # N, which no law here has
    >>> force = 5.0 * np.sign(v) + 90.0 * v + noise
    >>> run = {"time": t, "displacement": x, "velocity": v, "force": force}
    >>> found = bristle.identify(run, "bingham_standard")
    >>> bristle.compare({**run, "force": force + spring}, found).first.coordinate
    'displacement'
    """
    if role not in ROLES:
        raise StudyError(f"role is {written(role)}; {' or '.join(ROLES)} is right.")
    given = _opened(data)
    if isinstance(given, Study):
        _refuse_of_study(train=train, channels=channels, building=building, device=device)
        chosen = _present(given, model, effects)
        return compare_study(given, chosen, role=role)
    if role == TEST:
        raise StudyError(
            f"role is {written(role)}: a study alone has test runs; train or holdout is right."
        )
    if model is None:
        raise StudyError(
            "compare needs a model besides the runs: what identify returned, a model.toml, or a "
            "law's name."
        )
    chosen = model_of(model, effects, DEFAULT)
    house = building_from(building, device)
    runs = measurements(given, channels, building=house)
    fitted = runs if train is None else measurements(train, channels, building=house)
    rig = _rig(Runs(fitted, runs), house)
    return RigComparer(rig, "holdout", chosen, seen=None).compare(chosen)


def diagnose(
    data: Data | Study,
    model: Given | None = None,
    *,
    effects: str | Sequence[str] = (),
    holdout: Data | None = None,
    channels: Channels | None = None,
    building: str | Path | Building | None = None,
    device: str | None = None,
    write: bool = True,
) -> Diagnosis:
    """Find the effects that a model misses, how sure that is, and what else it could be.

    Parameters
    ----------
    data : Study, path, pattern, frame, mapping of arrays, Measurement, or several of these
        The runs, see `bristle.identify`; or a study, or its folder.
    model : str, path, Model or Identified, optional
        What `identify` returned, or a law, which is then identified on the way; else the study's.
        With "all", and on a test bench where none is chosen, the law is sought together with the
        effects: `law` of the result is the one that the verdict is about, `laws` tells how all do.
        In a building "lugre" stands in where none is chosen.
    effects : str or list of str
        Effects that the model has on top.
    holdout : as data, optional
        Runs that decide; else as in `bristle.identify`.
    channels : mapping, optional
        As in `bristle.identify`.
    building : path or Building, optional
        As in `bristle.identify`.
    device : str, optional
        As in `bristle.identify`.
    write : bool
        Of a study: whether verdict.json is written.

    Returns
    -------
    Diagnosis
        `kind` "none", "effect", "ambiguous", "unknown" or "insufficient"; `effects` those that are
        missing; `words` the verdict in sentences; `trials` each effect that was tried, with its z.

    Raises
    ------
    StudyError
        If a law or an effect is not known, or of a study nothing was identified before.
    RecordError, PhysicsError
        If a file cannot be read, a channel is missing, or a run is too short; if the building's
        file is wrong.

    Examples
    --------
    >>> import bristle, numpy as np
    >>> rng, t = np.random.default_rng(1), np.arange(0.0, 8.0, 0.004)  # s
    >>> turn = 2.0 * np.pi * np.array([0.7, 1.9, 3.1])[:, None]  # rad/s
    >>> def run(phase):
    ...     size = np.array([[8e-3], [2e-3], [1e-3]])  # m
    ...     x = (size * np.sin(turn * t + phase)).sum(0)
    ...     v = (size * turn * np.cos(turn * t + phase)).sum(0)
    ...     force = 5.0 * np.sign(v) + 90.0 * v + 400.0 * x  # N; the spring is hidden
    ...     force += rng.normal(0.0, 0.05, t.size)
    ...     return {"time": t, "displacement": x, "velocity": v, "force": force}
    >>> verdict = bristle.diagnose([run(0.0), run(1.0)], "bingham", holdout=run(2.0))
    >>> verdict.kind, verdict.effects
    ('effect', ('gas_spring',))
    >>> figure = verdict.plot()  # a notebook shows `verdict` itself: table and picture
    """
    given = _opened(data)
    if isinstance(given, Study):
        _refuse_of_study(holdout=holdout, channels=channels, building=building, device=device)
        if (model is None or _is_all(model)) and not effects:
            law = ALL if _is_all(model) else None
            return diagnose_study(given, law=law, write=write)
        raise StudyError(
            "diagnose uses the present model of a study: identify the other one first, with "
            "bristle.identification(study, ...)."
        )
    chosen = model_of(None if _is_all(model) else model, effects, DEFAULT)
    house = building_from(building, device)
    free = _is_all(model) or (model is None and not effects and house is None)
    compile_ahead()
    runs = _runs(given, holdout, channels, house)
    known = is_identified(chosen)
    found = diagnose_rig(runs.train, runs.holdout, chosen, house, identified=known, any_law=free)
    if free or not known:
        return found
    return replace(found, error=force_errors(site_models(_rig(runs, house), chosen)))


def _is_all(model: Given | None) -> bool:
    """Return whether all laws were asked for."""
    return isinstance(model, str) and model == ALL


def _opened(data: Data | Study) -> Data | Study:
    """Return the study in a folder that was given; anything else as it is."""
    if isinstance(data, str | Path) and (Path(data) / "study.toml").is_file():
        return Study(data)
    return data


def _refuse_of_study(**given: object) -> None:
    """Refuse what a study's own files say."""
    wrong = [name for name, value in given.items() if value is not None]
    if wrong:
        raise StudyError(
            f"{', '.join(wrong)}: study.toml and model.toml of a study set this; change it there, "
            "or give the runs instead of the study."
        )


def _present(study: Study, model: Given | None, effects: str | Sequence[str]) -> Model:
    """Return a study's model, or the one that was given, with the study's building."""
    own = study.model()
    chosen = model_of(own if model is None else model, effects, own.law)
    return replace(chosen.with_drive(own.drive), building=own.building)


def _runs(
    data: Data, holdout: Data | None, channels: Channels | None, building: Building | None
) -> Runs:
    held_out = []
    if holdout is not None:
        held_out = measurements(holdout, channels, "held-out run", building)
    return runs_of(measurements(data, channels, building=building), held_out)


def _rig(runs: Runs, building: Building | None) -> Rig:
    if building is None:
        return bench_rig(runs.train, runs.holdout)
    return building_rig(runs.train, runs.holdout, building)
