"""A study's present model as an FMU with its values baked in, and a scenario that uses it."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path
from shutil import copyfile
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.arrays import Array
from ..core.files import write_whole, writing
from ..core.text import command, quantity
from ..data.checks.channels import zero_of_load_cell
from ..data.measurement import Measurement
from ..errors import FmuError, RecordError, StudyError
from ..fmu.build import BuildPlan, build, plan
from ..fmu.catalogue import component_of_law
from ..fmu.damper import input_of
from ..identification.error import ForceError, error_on, pooled, reasons_of, zero_on
from ..identification.histories import before_jump
from ..identification.problem import (
    Fed,
    Moments,
    Problem,
    Run,
    following,
    has_offset,
    of_one_site,
    sensors,
    shown_force,
)
from ..identification.rig import DAMPER, Rig, at_site
from ..identification.search import in_threads
from ..model.model import Model
from ..physics.drive import VOLTAGE, Drive, drive_named
from ..physics.effect import EFFECTS
from ..study.rig import building_of, rig_of
from ..study.runs import Runs
from ..study.study import Study
from ..system.from_model import DamperTable, Parameters, source_of, values_of
from ..system.toml import save
from ..user_code.load import own_effects
from ..view import Viewable
from .model_system import (
    BuildingWithFile,
    Excitation,
    bench_system,
    building_system,
    loads,
    shaking_of,
    start_values,
)
from .reach import Ranges, ranges_of, reach_in_words, told_range, with_stroke
from .stepping import SteppingJob, step_through

Build = Callable[[BuildPlan, Path], Path]


@dataclass(frozen=True, repr=False)
class Exported(Viewable):
    """What was written: the FMU, the scenario, the files it reads; what was left out, and why.

    `proof` is what the FMU gives on the held-out runs, whose inputs are among the files; None where
    the study has no damper that a force is known of.
    """

    fmu: Path
    scenario: Path
    files: tuple[Path, ...]
    run: str
    notes: tuple[str, ...] = ()
    proof: Proof | None = None


class Editable(NamedTuple):
    """A scenario whose damper has its values in the file, and what was left out.

    `run` is the run that it plays, `numbers` the parameters that the model gives its damper, and
    `force` tells whether the signal `measured` holds the measured force.
    """

    scenario: Path
    run: str
    numbers: tuple[str, ...]
    force: bool
    notes: tuple[str, ...]


def export_study(study: Study, out: Path | None = None, build: Build = build) -> Exported:
    """Write a study's present model as an FMU and a scenario into a folder.

    Parameters
    ----------
    study : the folder, opened, with a model
    out : the folder, made if it is not there; None takes export/ in the study
    build : what builds a planned FMU into a folder and returns its path

    Raises
    ------
    StudyError
        If the model cannot be read, or the folder cannot be written.
    BuildError, RecordError
        If the FMU cannot be built, or no run can be read.
    """
    model = study.model()
    runs = study.runs()
    measurement = _one_run(study, runs)
    folder = study.folder / "export" if out is None else out
    notes: list[str] = []
    if not any(value.origin in ("identified", "measured") for value in model.facts.values()):
        then = command("identify", study.folder)
        notes.append(f"Warning: nothing was fitted: these are the law's own values. First:  {then}")
    held = _held_out(study, model, runs, notes)
    step = step_for(held, held.fed) if held else None
    with writing(folder, StudyError):
        folder.mkdir(parents=True, exist_ok=True)
        fmu = build(_damper(study, model, runs, notes, step), folder)

        def damper(parameters: Parameters) -> dict[str, Any]:
            return {"fmu": str(fmu.absolute()), "parameters": parameters}

        drive = drive_named(measurement.drive)
        scenario, files = _scenario(study, model, runs, measurement, drive, folder, damper, notes)
        proof = None
        if held and step:
            files += write_inputs(held, step, folder / FOLDER)
            proof = prove(held, fmu, step)
            files += write_proof(proof, held, fmu, folder / FOLDER)
    return Exported(fmu, scenario, tuple(files), measurement.name, tuple(notes), proof)


def _held_out(study: Study, model: Model, runs: Runs, notes: list[str]) -> HeldOut | None:
    """Return what the damper is held against; None, and a note, where the runs do not tell it."""
    try:
        rig = rig_of(study, model, runs)
        there = DAMPER in rig.sites(model)
    except RecordError as error:
        notes.append(f"the FMU was not held against the runs: {error}")
        return None
    if not there:
        notes.append("the FMU was not held against the runs: they do not tell the damper's force.")
        return None
    bare = model.at("damper", bench=not study.settings.has_building)
    known = [with_stroke(study, model, one) for one in runs.holdout or runs.train]
    return held_out(bare, model, rig, known)


def write_editable(study: Study, folder: Path) -> Editable:
    """Write the scenario of `export_study` with the model's values in it, in place of an FMU.

    Its damper is a built-in component, so every number of the model can be changed in the scenario.
    A current or a field drives it as a voltage of the same number: the law is the same.

    Parameters
    ----------
    study : the folder, opened, with a model
    folder : where to write, made if it is not there

    Raises
    ------
    StudyError, RecordError
        If the model or the run cannot be read, or the folder cannot be written.
    """
    model = study.model()
    runs = study.runs()
    measurement = _one_run(study, runs)
    notes: list[str] = []
    own = _bare(study, model, notes)
    values = _own_values(own)
    found = _range(study, model, runs, ranges_of(study, model, runs), notes)
    limit = drive_named(measurement.drive).limit
    values |= {VOLTAGE.limit if name == limit else name: value for name, value in found.items()}

    def damper(parameters: Parameters) -> dict[str, Any]:
        return {**source_of(own), "parameters": {**values, **parameters}}

    with writing(folder, StudyError):
        folder.mkdir(parents=True, exist_ok=True)
        scenario, _ = _scenario(study, model, runs, measurement, VOLTAGE, folder, damper, notes)
    numbers = tuple(name for name in values if name in own.values)
    return Editable(scenario, measurement.name, numbers, measurement.has("force"), tuple(notes))


def _scenario(
    study: Study, model: Model, runs: Runs, measurement: Measurement, drive: Drive, folder: Path,
    damper: DamperTable, notes: list[str],
) -> tuple[Path, list[Path]]:  # fmt: skip
    """Write the scenario of a study's damper, on the bench or in its building, and its files."""
    if not study.settings.has_building:
        zero = 0.0 if has_offset(model) else zero_of_load_cell(runs.train) or 0.0
        system, about = bench_system(study.name, model, measurement, drive, damper, zero)
        scenario, *files = save(system, folder / "bench.toml", about)
        return scenario, files
    shaking = replace(shaking_of(measurement), drive=drive)
    return _structure(study, model, shaking, folder, damper, notes)


def _one_run(study: Study, runs: Runs) -> Measurement:
    """Return the run that the scenario plays: the first that is held out.

    On a bench it is the first whose command reaches half of the largest: without one, a scenario
    shows nothing of what the damper is for.
    """
    able = runs.holdout or runs.train
    if study.settings.has_building or not able[0].drive:
        return able[0]
    tops = [float(np.max(np.abs(one[one.drive]))) if one.drive else 0.0 for one in able]
    return next(one for one, top in zip(able, tops, strict=True) if 2.0 * top >= max(tops))


def _bare(study: Study, model: Model, notes: list[str]) -> Model:
    """Return the damper's own law and effects; note what is an instrument's."""
    bench = not study.settings.has_building
    sensors = model.at("sensor", bench).effects
    if sensors:
        notes.append(
            f"{', '.join(sensors)} left out: an instrument's effect is not in the damper. The "
            "scenario's force is the one before the instrument."
        )
    return model.at("damper", bench)


def _own_values(damper: Model) -> Parameters:
    """Return the values of a damper but for those that follow a channel: these are its inputs."""
    inputs = following(damper.effects)
    return {name: value for name, value in values_of(damper).items() if name not in inputs}


def _damper(
    study: Study, model: Model, runs: Runs, notes: list[str], step: float | None
) -> BuildPlan:
    """Plan the damper with the model's values as its defaults."""
    own = _bare(study, model, notes)
    ranges = ranges_of(study, model, runs)
    starts = _own_values(own) | _range(study, model, runs, ranges, notes)
    files = own_effects()
    return plan(
        component_of_law(own.base_law),
        name=_model_name(study.name),
        starts=starts,
        effects=[files[name] for name in own.effects if EFFECTS[name].own],
        offers=own.effects,
        drive=drive_named(runs.all[0].drive).name,
        step=step,
        about=reach_in_words(study, runs, ranges),
        ranged=True,
    )


def _range(
    study: Study, model: Model, runs: Runs, ranges: Ranges, notes: list[str]
) -> dict[str, float]:
    """Return the range of the data, and the command's limit and stroke [m] that hold all runs.

    Where the defaults do they are left out. The run that is played alone does not tell: another
    one, to which the model was fitted, may go further.
    """
    found = told_range(ranges, runs.all[0].drive)
    drive = drive_named(runs.all[0].drive)  # that of all runs
    if not runs.all[0].drive and study.settings.has_building:
        notes.append("neither voltage nor current was measured: the scenario holds 0 V.")
    tops = [float(one[drive.name].max()) for one in runs.all if one.has(drive.name)]
    if max(tops, default=0.0) > drive.largest:
        found[drive.limit] = float(ceil(1.05 * max(tops)))
    moved = [
        float(np.abs(one[channel]).max())
        for one in (with_stroke(study, model, run) for run in runs.all)
        for channel in ("displacement", "base_displacement") if one.has(channel)
    ]  # fmt: skip
    if max(moved, default=0.0) > 0.02:
        found["stroke"] = float(f"{1.05 * max(moved):.3g}")
    return found


def _model_name(name: str) -> str:
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return f"{plain if plain[:1].isalpha() else 'study_' + plain}_damper"


def _structure(
    study: Study, model: Model, shaking: Excitation, folder: Path, damper: DamperTable,
    notes: list[str],
) -> tuple[Path, list[Path]]:  # fmt: skip
    """Write the scenario of the study's building with the damper, under a run's ground motion."""
    file = study.folder / model.building if model.building else None
    building = building_of(study, model)
    assert building is not None  # `_scenario` asked
    copied = [] if file is None else [Path(copyfile(file, folder / "building.toml"))]
    house = BuildingWithFile(building, copied[0] if copied else None)
    own = loads(model, house.building)
    notes += own.notes
    if channels := dict.fromkeys(following(model.effects).values()):
        notes.append(
            f"{', '.join(channels)}: the damper's input keeps its mean in the scenario, for a "
            "building under a ground motion does not give it. Connect it to a signal."
        )
    title = f"{study.name}: the building with the model's damper, ground of {shaking.name}"
    effects = [Path(copyfile(one, folder / one.name)) for one in own.effects]
    system = building_system(title, house, shaking, own._replace(effects=tuple(effects)), damper)
    about = "# The model's damper in the study's building."
    scenario, *files = save(system, folder / "structure.toml", about)
    return scenario, [*copied, *files, *effects]


# An exported damper held against the runs that no fit has seen: its inputs, its step, its error.


OF_ERROR, OF_FORCE = 0.01, 0.002
"""By how much the error of an FMU may differ from the one that is told: of it, or of the force."""
FINEST = 2e-5
"""Shortest step [s] that is tried."""
MOST = (120_000, 700_000)
"""Steps of an FMU for its proof: where the runs need more, the start of each is taken. One sample
at which the motion reverses can part the two errors there; then as many as the second number."""
TIMEOUT = 600.0
"""Seconds that a run of it may take."""
FADED = 1e-6
"""Share of its largest value below which the response of an instrument has ended."""
FOLDER, CHECK = "held_out", "check.py"


@dataclass(frozen=True)
class Proof:
    """What an exported FMU gives in FMPy on the runs that its model was not fitted to.

    `told` is the error that `bristle compare` prints, `expected` the same over the part of the runs
    that the FMU was run on, `fmu` its own over that part, `raw` its own when it is fed with the
    measured columns as they are, None where they are not there; `step` [s] that of the FMU, `part`
    the share of the samples that it was run on; `training` whether these are the training runs,
    for there are no others; `why` says why the FMU was not run, "" where it was; `zero` [N] is what
    the load cell shows more, added to the FMU's force.
    """

    told: ForceError
    step: float
    expected: ForceError | None = None
    fmu: ForceError | None = None
    raw: ForceError | None = None
    part: float = 1.0
    training: bool = False
    why: str = ""
    zero: float = 0.0

    @property
    def agrees(self) -> bool:
        """Whether the FMU confirms the error."""
        if self.fmu is None or self.expected is None:
            return False
        return agree(self.fmu, self.expected)

    def lines(self, folder: Path) -> list[str]:
        """Return in words what the FMU, exported to a folder, was found to give."""
        runs = "training runs (there are no held-out ones)" if self.training else "held-out runs"
        step = quantity(self.step, "s", fine=True)
        out = [
            f"Force error on the {runs}, as bristle compare prints it: {self.told.text()}.",
            *self.told.beside(),
        ]
        if self.zero:
            out.append(
                f"The load cell shows {quantity(self.zero, 'N')} more than the FMU, its zero or a "
                "preload: that is added before the comparison."
            )
        if self.fmu is None:
            return [*out, f"The FMU was not run to confirm it: {self.why}"]
        over = "" if self.part == 1.0 else f", the first {100.0 * self.part:.2g} % of each run"
        confirmed = "confirms it" if self.agrees else "does NOT confirm it"
        out.append(f"The FMU in FMPy {confirmed}: {self.fmu.text()} at a step of {step}{over}.")
        if self.part < 1.0 and self.expected is not None:
            out[-1] += f" The model has {self.expected.text()} there; all of it would take long."
        out.append(
            f"Give FMPy output_interval={self.step:.10g}: by itself it takes longer steps, "
            "1,000 per run at most."
        )
        out.append(f"Again:  python {folder / FOLDER / CHECK}")
        if self.raw is None:
            return [*out, "It was not fed with measured columns: none is the motion of the damper."]
        there = "" if self.part == 1.0 else ", over the same part"
        out.append(f"Fed with the measured columns, noise and all{there}: {self.raw.text()}.")
        return out

    def as_dict(self) -> dict[str, Any]:
        """Return the proof as JSON has it."""
        errors = {name: getattr(self, name) for name in ("told", "expected", "fmu", "raw")}
        return {
            "step": self.step, "runs": "training" if self.training else "held out",
            "part": self.part, "agrees": self.agrees, "why_not_run": self.why,
            **{f"error_{name}": error and error.as_dict() for name, error in errors.items()},
        }  # fmt: skip


class HeldOut(NamedTuple):
    """The damper of a model and the runs that it is held against.

    `runs` have all their samples; `fed` is what the damper is given of each; `zero` [N] that of the
    load cell; `raw` is `fed` with the measured columns that a user would feed, but for inputs that
    were not measured; empty where the motion of the damper was not.
    """

    damper: Model
    problem: Problem
    model: Model
    runs: Sequence[Run]
    fed: Sequence[Fed]
    zero: float
    raw: Sequence[Fed]
    training: bool

    def force(self, moments: Moments, fed: Fed) -> Array:
        """Return the force (m,) [N] of the damper at the moments of a run."""
        return self.problem.bench(self.model).force(*moments, fed.values, fed.tracks)

    def shown(self, k: int, force: Array) -> Array:
        """Return a damper's force at the moments of run k as the load cell shows it (n,) [N]."""
        run = self.runs[k]
        return self.problem.shown(self.model, run, self.fed[k], force) + self.zero

    def error(
        self, fed: Sequence[Fed], step: float = 0.0, samples: Sequence[int] | None = None
    ) -> ForceError:
        """Return the error of the model on the runs, or on the first `samples` of each.

        Parameters
        ----------
        fed : what the damper is given, `fed` or `raw`
        step : s, of an FMU in FMPy, which shows the force of a step before; 0 for the model's own
        samples : how many of each run, None for all
        """
        found = []
        for k, (run, given) in enumerate(zip(self.runs, fed, strict=True)):
            force = self.force(*_dense(given, n := _steps_per_moment(given, step)))
            if step:
                force = np.concatenate([force[:1], force[:-1]])[::n]
            end = samples[k] if samples else len(run.force)
            found.append(error_on(*_first(run, self.shown(k, force), end)))
        return pooled(found)


def held_out(damper: Model, model: Model, rig: Rig, measured: Sequence[Measurement]) -> HeldOut:
    """Return what a study's damper is held against.

    Parameters
    ----------
    damper : the model's law with the effects of the damper alone
    model : with the effects of all sites
    rig : the sites with their runs
    measured : the held-out runs as measured, of a building with the motion across the device
    """
    sites = rig.sites(model)
    site, own = sites[DAMPER], at_site(model, DAMPER, sites)
    problem = site.problem_of("holdout")
    training = problem is None
    problem = site.train if problem is None else problem
    bench = rig.building is None  # there every effect is the damper's, or an instrument's
    inside = tuple(name for name in own.effects if bench or EFFECTS[name].site != "structure")
    runs = [run.entire() for run in problem.runs]
    zero = zero_on(problem, own)
    fitted = of_one_site(own, inside)
    fed = []
    for run in runs:
        values = {**fitted.values, **problem.carrying(fitted, run)}
        fed.append(problem.fed(replace(fitted, values=values), run))
    by_name = {one.name: one for one in measured}
    pairs = zip(runs, fed, strict=True)
    raw = [_raw(by_name.get(run.name), run, one) for run, one in pairs]
    known = [one for one in raw if one is not None]
    whole = known if len(known) == len(raw) else ()
    return HeldOut(damper, problem, fitted, runs, fed, zero, whole, training)


def step_for(held: HeldOut, fed: Sequence[Fed]) -> float:
    """Return the longest step [s] at which FMPy gives the error that the model has.

    It is that of the moments that are closest, as runs may have rates of their own, or a whole
    fraction of it, `FINEST` at the shortest.

    Parameters
    ----------
    held : the runs
    fed : what the damper is given of each
    """
    told, step = held.error(fed), min(one.moments.dt for one in fed)
    while step >= 2.0 * FINEST and not agree(held.error(fed, step), told, 0.5):
        step *= 0.5
    return step


def agree(one: ForceError, other: ForceError, share: float = 1.0) -> bool:
    """Return whether two errors over the same samples differ by no more than may be."""
    allowed = max(OF_ERROR * other.rms_all, OF_FORCE * other.signal_all)
    counted = max(OF_ERROR * other.rms, OF_FORCE * other.signal) if other.samples else allowed
    return bool(
        abs(one.rms_all - other.rms_all) <= share * allowed
        and not abs(one.rms - other.rms) > share * counted
    )


def write_inputs(held: HeldOut, step: float, folder: Path) -> list[Path]:
    """Write of each run the inputs as the fit saw them, and the force that they are held against.

    NAME_inputs.csv has a row per moment, linear in between, and two more where the command jumps;
    NAME_force.csv the measured force at the samples, that of the model, and 1 where a sample
    counts.

    Parameters
    ----------
    held : the runs
    step : s, of the FMU
    folder : made if need be
    """
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for k, (run, fed) in enumerate(zip(held.runs, held.fed, strict=True)):
        per = _steps_per_moment(fed, step)
        rows = _rows(fed.moments.V, per)
        dense = _dense_inputs(held.damper, run, fed, step)
        columns = {f"{name} [{unit}]": y[rows] for name, (unit, y) in dense.items()}
        time = fed.moments.dt * rows / per
        files.append(_table(folder / f"{run.name}_inputs.csv", {"time [s]": time, **columns}))
        out = np.any([np.zeros(len(run.force), bool), *reasons_of(run).values()], axis=0)
        predicted = held.shown(k, held.force(fed.moments, fed))
        force = {
            "time [s]": run.dt * np.arange(len(run.force)), "force [N]": run.force,
            "model_force [N]": predicted, "counts": (~out).astype(float),
        }  # fmt: skip
        files.append(_table(folder / f"{run.name}_force.csv", force))
    return files


def prove(held: HeldOut, fmu: Path, step: float) -> Proof:
    """Run an exported FMU as FMPy does, and return its error beside the one that is told.

    Parameters
    ----------
    held : the runs
    fmu : the exported file
    step : s, of the FMU

    Raises
    ------
    RunError
        If the FMU fails on its way.
    """
    few, many = MOST
    part = _part(held, step, few)
    if agree(held.error(held.fed, step, part), held.error(held.fed, samples=part), 0.5):
        proof = _proof(held, fmu, step, part)
        if proof.part == 1.0 or proof.agrees or proof.why:
            return proof
    return _proof(held, fmu, step, _part(held, step, many))


def _part(held: HeldOut, step: float, most: int) -> list[int]:
    """Return how many samples of each run an FMU passes in so many steps at the most."""
    pairs = list(zip(held.runs, held.fed, strict=True))
    steps = sum(len(run.force) * _steps_per_sample(run, fed, step) for run, fed in pairs)
    part = min(1.0, most / steps)
    return [max(2, int(part * len(run.force))) for run in held.runs]


def _proof(held: HeldOut, fmu: Path, step: float, samples: Sequence[int]) -> Proof:
    """Return the proof by an FMU that passes so many samples of each run."""
    told = held.error(held.fed)
    jobs = [(held.fed, step, k) for k in range(len(held.runs))]
    if held.raw:
        # Where noise is most of the error, longer steps give the same one.
        jobs += [(held.raw, step_for(held, held.raw), k) for k in range(len(held.runs))]

    def run_fmu(job: tuple[Sequence[Fed], float, int]) -> ForceError:
        feds, longest, k = job
        run, fed = held.runs[k], feds[k]
        end = (samples[k] - 1) * _steps_per_sample(run, fed, longest) + 1
        dense = _dense_inputs(held.damper, run, fed, longest)
        inputs = {name: _begin(y[:end]) for name, (_, y) in dense.items()}
        values = start_values(held.damper, held.fed[k], run, held.problem)
        n = _steps_per_moment(fed, longest)
        whole = (fed.moments.dt / n,)
        stepping = SteppingJob(str(fmu.resolve()), values, tuple(inputs), ("force",), whole)
        force = step_through(stepping, [inputs], TIMEOUT)[0]["force"][::n]
        missing = len(fed.moments.x) - len(force)  # which the last one stands in for
        shown = held.shown(k, np.append(force, np.full(missing, force[-1])))
        return error_on(*_first(run, shown, samples[k]))

    try:
        errors = in_threads(run_fmu, jobs)
    except FmuError as error:  # such as a library for another platform
        return Proof(told, step, training=held.training, why=str(error), zero=held.zero)
    own, raw = errors[: len(held.runs)], errors[len(held.runs) :]
    lengths = [len(run.force) for run in held.runs]
    part = 1.0 if [*samples] == lengths else sum(samples) / sum(lengths)
    return Proof(
        told, step, held.error(held.fed, samples=samples) if part < 1.0 else told, pooled(own),
        pooled(raw) if raw else None, part, held.training,
        zero=held.zero,
    )  # fmt: skip


def write_proof(proof: Proof, held: HeldOut, fmu: Path, folder: Path) -> list[Path]:
    """Write what the FMU gives, what its host has to set and to apply, and a check in FMPy.

    Parameters
    ----------
    proof : what the FMU gives
    held : the runs
    fmu : the exported file
    folder : where the inputs are
    """
    pulses = [_pulse_response(held, fed) for fed in held.fed]
    linear = all(one is not None for one in pulses)
    instruments = [effect.name for effect in sensors(held.model.effects, "force")]
    data = {
        "fmu": fmu.name, **proof.as_dict(),
        "load_cell_zero": held.zero,
        "not_applied": [] if linear else instruments,
        "pulse_response": {
            run.name: one.tolist() if linear and one is not None else [1.0]
            for run, one in zip(held.runs, pulses, strict=True)
        },
        "moments_per_sample": {
            run.name: run.finer.parts if run.finer else 1 for run in held.runs
        },
        "filter": {run.name: run.finer.taps.tolist() if run.finer else [1.0] for run in held.runs},
        "start_values": {
            run.name: start_values(held.damper, fed, run, held.problem)
            for run, fed in zip(held.runs, held.fed, strict=True)
        },
    }  # fmt: skip
    path = folder / "proof.json"
    write_whole(path, json.dumps(data, indent=1) + "\n")
    return [
        path,
        Path(copyfile(Path(__file__).with_name("check_held_out.py"), folder / "check.py")),
    ]


def _pulse_response(held: HeldOut, fed: Fed) -> Array | None:
    """Return what the instruments of the force show of a pulse of 1 N, moment by moment (k,) [N].

    None where that does not tell what they show of a force, as of one that saturates.
    """
    effects, dt = held.model.effects, fed.moments.dt
    pulse = np.zeros(1 + len(fed.moments.x))
    pulse[1] = 1.0  # not at the first moment, with which some states start
    response = shown_force(effects, fed.values, pulse, dt)[1:]
    there = np.flatnonzero(np.abs(response) > FADED * np.max(np.abs(response), initial=0.0))
    response = response[: 1 + int(there[-1])] if len(there) else response[:1]
    force = held.force(fed.moments, fed)
    begun = np.concatenate([np.full(len(response) - 1, force[0]), force])
    off = np.convolve(begun, response, "valid") - shown_force(effects, fed.values, force, dt)
    return response if np.max(np.abs(off)) <= OF_FORCE * np.std(force) else None


def _inputs(damper: Model, run: Run, fed: Fed) -> dict[str, tuple[str, Array]]:
    """Return unit and values (m,) of what an FMU is fed, by its inputs' names."""
    x, v, a, V, _ = fed.moments
    drive = drive_named(run.drive)
    out = {"displacement": ("m", x), "velocity": ("m/s", v), drive.name: (drive.unit, V)}
    if any("a" in EFFECTS[name].needs for name in damper.effects):
        out["acceleration"] = ("m/s2", a)
    for parameter, channel in following(damper.effects).items():
        name = input_of(channel, damper.base_law, drive)
        out[name] = (run.extra[channel].known_unit, fed.tracks[parameter])
    return out


def _steps_per_moment(fed: Fed, step: float) -> int:
    """Return in how many steps an FMU passes from one moment of a run to the next: none longer."""
    return math.ceil(fed.moments.dt / step - 1e-6) if step else 1


def _steps_per_sample(run: Run, fed: Fed, step: float) -> int:
    return _steps_per_moment(fed, step) * (run.finer.parts if run.finer else 1)


def _dense_inputs(damper: Model, run: Run, fed: Fed, step: float) -> dict[str, tuple[str, Array]]:
    moments, dense = _dense(fed, _steps_per_moment(fed, step))
    return _inputs(damper, run, dense._replace(moments=moments))


def _dense(fed: Fed, n: int) -> tuple[Moments, Fed]:
    """Return motion and command at n times as many moments, as a prediction has them between.

    The motion is linear, and so is the command but where it jumps; a channel has its newest value.
    A jump falls on the last of these moments before its sample, which then shows it in FMPy too.
    """
    x, v, a, V, dt = fed.moments
    if n == 1:
        return fed.moments, fed
    places, known = np.arange((len(x) - 1) * n + 1) / n, np.arange(len(x))
    x1, v1, a1, V1 = (np.interp(places, known, y) for y in (x, v, a, V))
    for k in range(1, len(V)):
        if V[k] != V[k - 1] and before_jump(V, k) != V[k]:
            V1[(k - 1) * n : k * n - 1], V1[k * n - 1] = V[k - 1], V[k]
    tracks = {name: np.append(y[0], np.repeat(y[1:], n)) for name, y in fed.tracks.items()}
    moments = Moments(x1, v1, a1, V1, dt / n)
    return moments, Fed(moments, fed.values, tracks)


def _rows(V: Array, per: int) -> NDArray[np.int64]:
    """Return which of `per` times as many moments tell all inputs, with the command's jumps."""
    jumps = [k for k in range(1, len(V)) if V[k] != V[k - 1] and before_jump(V, k) != V[k]]
    beside = [k * per - late for k in jumps for late in (2, 1)] if per > 2 else []
    return np.union1d(np.arange(len(V)) * per, np.array(beside, dtype=np.int64))


def _begin(values: Array) -> Array:
    """Return what is set before each step where a host sets the inputs of its begin."""
    return np.concatenate([values[:1], values[:-1]])


def _first(run: Run, force: Array, samples: int) -> tuple[Run, Array]:
    """Return the first samples of a run and of a force."""
    return (
        (run, force) if samples == len(run.force) else (run.of(slice(0, samples)), force[:samples])
    )


def _raw(measured: Measurement | None, run: Run, fed: Fed) -> Fed | None:
    """Return what a damper is given with the columns as measured: what a host has without a fit."""
    if measured is None or not (measured.has("displacement") or measured.has("velocity")):
        return None
    columns = {"x": "displacement", "v": "velocity", "V": run.drive}
    found = {name: measured[one] for name, one in columns.items() if measured.has(one)}
    if "v" not in found:
        found["v"] = np.gradient(found["x"], measured.step)
    known, at = fed.moments, np.arange(len(run.x))
    places = np.arange(len(known.x)) / (run.finer.parts if run.finer else 1)
    x, v, V = (
        np.interp(places, at, found[name]) if name in found else getattr(known, name)
        for name in columns
    )
    return fed._replace(moments=known._replace(x=x, v=v, V=V))


def _table(path: Path, columns: Mapping[str, NDArray[np.floating[Any]]]) -> Path:
    """Write columns as CSV at full digits."""
    rows = [",".join(columns)]
    rows += [",".join(f"{y:.15g}" for y in row) for row in zip(*columns.values(), strict=True)]
    write_whole(path, "\n".join(rows) + "\n")
    return path
