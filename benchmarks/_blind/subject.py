"""The package under test: asked as a user would, with the recorded channels and the law alone."""

from __future__ import annotations

import time
from dataclasses import asdict
from typing import Any

import numpy as np
import pandas as pd

from bristle.data.channels import ChannelSpec
from bristle.data.measurement import Measurement, measurements_of_frame
from bristle.diagnosis import Diagnosis, diagnose_rig
from bristle.diagnosis.prepared import Prepared
from bristle.diagnosis.rig_runs import BenchRuns
from bristle.identification.prepare import prepare
from bristle.identification.problem import Problem
from bristle.identification.rig import DAMPER
from bristle.identification.search import z_scale
from bristle.model.model import Model
from bristle.physics.effect import EFFECTS
from bristle.physics.laws import LAWS
from tests.independent.experiments import RATE, proposed

from .cases import ROOT, Recorded, digest_of
from .forms import true_values

UNITS = {
    "displacement": "m", "velocity": "m/s", "acceleration": "m/s2", "voltage": "V", "force": "N",
    "ground_acceleration": "m/s2", "absolute": "m/s2",
}  # fmt: skip
"""By channel, or by the last word of its name."""

KEPT = 8  # rows of the ranking that a record keeps


def digest() -> str:
    """Return the digest of all code that a verdict rests on."""
    folders = ("diagnosis", "identification", "comparison", "user_code", "data", "physics")
    package = ROOT / "bristle"
    files = [path for folder in folders for path in (package / folder).rglob("*.py")]
    return digest_of([*files, package / "core" / "jit.py"])


def unit_of(channel: str) -> str:
    """Return the unit of a recorded channel."""
    return UNITS.get(channel) or UNITS[channel.rsplit("_", 1)[1]]


def measurements(runs: list[dict[str, Any]], channels: tuple[str, ...]) -> list[Measurement]:
    """Return runs as measurements; the noise is not given, so it is estimated."""
    specs = {"time": ChannelSpec("time", "s")}
    specs |= {name: ChannelSpec(name, unit_of(name)) for name in channels}
    out = []
    for run in runs:
        frame = pd.DataFrame({name: run[name] for name in ("time", *channels)})
        out += measurements_of_frame(frame, run["name"], specs)
    return out


def halves(
    case: Recorded, channels: tuple[str, ...] = ()
) -> tuple[list[Measurement], list[Measurement]]:
    """Return the runs of a case to fit to and those held out, with these channels or all."""
    train, held = (
        measurements(case.part(role), channels or case.channels) for role in ("train", "holdout")
    )
    return train, held


def prepared(train: list[Measurement], held: list[Measurement], law: str) -> Prepared:
    """Return what the diagnosis of a bench's runs begins with.

    Raises
    ------
    RuntimeError
        If something is lacking: what.
    """
    runs = BenchRuns(train, held, Model(law))
    if runs.lacking is not None:
        raise RuntimeError(str(runs.lacking))
    return runs.prepare(DAMPER)


def diagnosed(train: list[Measurement], holdout: list[Measurement], law: str) -> Diagnosis:
    """Return the diagnosis that a user gets who knows the law and nothing else."""
    return diagnose_rig(train, holdout, Model(law))


def ask(case: Recorded) -> tuple[dict[str, Any], Diagnosis]:
    """Return what the diagnoser says of a case and how the true model does on it; the diagnosis."""
    train, holdout = halves(case)
    before = time.perf_counter()
    found = diagnosed(train, holdout, case.task.law)
    seconds = time.perf_counter() - before
    z_true = z_of_truth(case, holdout)
    answer = packed(found.as_dict()) | {"best": intervals(found)}
    return answer | {"seconds": seconds, "z_true": z_true}, found


def packed(said: dict[str, Any]) -> dict[str, Any]:
    """Return what scoring needs of a verdict, of a bench or of a building, as plain data."""
    return {
        "kind": said["kind"],
        "effects": list(said["effects"]),
        "ranking": said["ranking"][:KEPT],
        "coordinate": said.get("coordinate", ""),
        "organised": said.get("organised", [])[:3],
        "sensors": said["sensors"],
        "untestable": said["untestable"],
        "detectable": said.get("detectable"),
        "separate_by": said.get("separate_by", ""),
        "words": said["words"],
        "z_before": said.get("z_holdout_before"),
        "z_after": said.get("z_holdout_after"),
    }


def intervals(found: Diagnosis) -> dict[str, list[float]]:
    """Return value and standard deviation by parameter of the model that the verdict names."""
    trial = found.after or found.before
    if trial is None:
        return {}
    return {
        name: [float(trial.model.value(name)), float(std)]
        for name, std in found.std.items()
        if np.isfinite(std)
    }


def true_model(task_law: str, truth: dict[str, Any]) -> Model | None:
    """Return the hidden truth as a model; None for forms or effects that bristle lacks."""
    values = {
        name: value for name, value in truth["base"].items() if name in LAWS[task_law].parameters
    }
    names = []
    for found in truth["effects"]:
        own = true_values(found, truth["scales"]["force"])
        if own is None or found["effect"] not in EFFECTS:
            return None
        if any(name.split(".")[1] not in EFFECTS[found["effect"]].parameters for name in own):
            return None
        if EFFECTS[found["effect"]].site != "damper":
            return None  # the truth of an instrument is asked of the diagnosis alone
        names.append(found["effect"])
        values |= own
    return Model(task_law, tuple(names), values)


def z_of(model: Model, problem: Problem) -> float:
    """Return robust RMS(residual)/noise of a model on runs, 1 for the truth."""
    left = []
    for run, (bias, sigma, _) in zip(problem.runs, problem.expectation(model), strict=True):
        error = (run.force - problem.predict(model, run) - bias) / sigma
        left.append(error[run.skip :])
    return float(z_scale(np.concatenate(left)))


def z_of_truth(case: Recorded, holdout: list[Measurement]) -> float | None:
    """Return z of the true model with its true parameters on held-out runs; None if not ours."""
    if case.truth["fault"] is not None:
        return None
    model = true_model(case.task.law, case.truth)
    return None if model is None else z_of(model, Problem([prepare(m) for m in holdout]))


# The experiment that a class proposes, performed by the generator on the same specimen.

ROLES = ("train", "holdout")


def perform(case: Recorded, made: Any, experiment: Any) -> dict[str, Any]:
    """Return the verdict once two further runs of the proposed kind are there.

    `experiment` is a `bristle.diagnosis.experiments.Experiment`. One run joins the training runs,
    one the held-out ones, the latter with the motion turned round. The velocity and voltage are
    kept within what the rig can do, as a laboratory would.
    """
    x, _, _, volts = experiment.signals(1.0 / RATE)
    rig = made.specimen.rig
    x = x - x.mean()
    x = x * min(1.0, 0.9 * rig.stroke / float(np.max(np.abs(x - x[0]))))
    volts = np.clip(volts, 0.0, 8.0)  # a smoothed voltage strays from the range by its noise
    parts = {role: case.part(role) for role in ROLES}
    for sign, role in zip((1.0, -1.0), ROLES, strict=True):
        run = proposed(rig, (sign * x, volts), role, asdict(experiment))
        parts[role] = [*parts[role], made.perform(run, case.task.seed, f"{role}_extra")]
    train, holdout = (measurements(parts[role], case.channels) for role in ROLES)
    answer = packed(diagnosed(train, holdout, case.task.law).as_dict())
    return {name: answer[name] for name in ("kind", "effects", "z_after")}
