"""The package under test: asked as a user would, with the recorded channels and the law alone."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pandas as pd

from bristle.identify.fit import Fit, Model, Problem, huber
from bristle.identify.prepare import prepare
from bristle.physics.damper import LAWS
from bristle.physics.effect import EFFECTS
from bristle.records.measurement import ChannelSpec, Measurement, measurements_of_frame

from .cases import ROOT, Recorded, digest_of
from .forms import true_values

UNITS = {
    "displacement": "m", "velocity": "m/s", "acceleration": "m/s2", "voltage": "V", "force": "N",
    "ground_acceleration": "m/s2",
}  # fmt: skip
HUBER_AT_ONE = 0.494231
"""Mean Huber loss (k = 2) of a standard normal variable."""

KEPT = 8  # rows of the ranking that a record keeps


def digest() -> str:
    """Return the digest of all code that a verdict rests on."""
    folders = ("diagnose", "identify", "compare", "compiled", "physics", "records")
    package = ROOT / "bristle"
    files = [p for f in folders if (package / f).is_dir() for p in (package / f).rglob("*.py")]
    return digest_of(files)


def measurements(runs: list[dict[str, Any]], channels: tuple[str, ...]) -> list[Measurement]:
    """Return runs as measurements; the noise is not given, so it is estimated."""
    specs = {"time": ChannelSpec("time", "s")}
    specs |= {name: ChannelSpec(name, UNITS[name]) for name in channels}
    out = []
    for run in runs:
        frame = pd.DataFrame({name: run[name] for name in ("time", *channels)})
        out += measurements_of_frame(frame, run["name"], specs)
    return out


def ask(case: Recorded) -> dict[str, Any]:
    """Return what the diagnoser says of a case, and how the true model does on it."""
    train = measurements(case.part("train"), case.channels)
    holdout = measurements(case.part("holdout"), case.channels)
    before = time.perf_counter()
    answer = diagnosed(train, holdout, case.task.law)
    answer["seconds"] = time.perf_counter() - before
    answer["z_true"] = z_of_truth(case, holdout)
    return answer


def diagnosed(train: list[Measurement], holdout: list[Measurement], law: str) -> dict[str, Any]:
    import bristle.diagnose

    if not hasattr(bristle.diagnose, "diagnose"):
        return _first_form(train, holdout, law)
    found = bristle.diagnose.diagnose(train, holdout, law=law)
    said = found.verdict.as_dict()
    return {
        "kind": said["kind"],
        "effects": list(said["effects"]),
        "ranking": [dict(row) for row in said["ranking"][:KEPT]],
        "coordinate": said.get("coordinate", ""),
        "sensors": said.get("sensors", []),
        "untestable": list(said.get("untestable", [])),
        "detectable": said.get("detectable"),
        "separate_by": said.get("separate_by", ""),
        "experiment": _experiment(found.verdict),
        "words": said.get("words", ""),
        "z_before": float(found.z_before),
        "z_after": float(found.z_after),
        "base": intervals(found.base),
        "best": intervals(found.best),
    }


def _first_form(train: list[Measurement], holdout: list[Measurement], law: str) -> dict[str, Any]:
    """The same before the package's own entry point exists."""
    from bristle.diagnose.sensors import sensor_faults
    from bristle.diagnose.verdict import diagnose
    from bristle.identify.fit import identify

    first, second = (Problem([prepare(m) for m in runs]) for runs in (train, holdout))
    base = identify(first, law)
    said = diagnose(base, first, second)
    faults = sensor_faults([*train, *holdout])
    return {
        "kind": said.kind, "effects": list(said.effects), "ranking": said.ranking[:KEPT],
        "coordinate": said.coordinate, "sensors": [vars(one) for one in faults],
        "untestable": list(said.untestable), "detectable": None, "separate_by": "",
        "experiment": {}, "words": str(said.evidence)[:300], "z_before": said.z_before,
        "z_after": said.z_after, "base": intervals(base),
        "best": intervals(said.trial.fit if said.trial else base),
    }  # fmt: skip


def _experiment(verdict: Any) -> dict[str, Any]:
    """Return the experiment of `separate_by` in numbers, empty where a verdict has none."""
    return dict(getattr(verdict, "experiment", None) or {})


def intervals(fit: Fit | None) -> dict[str, Any]:
    """Return value and standard deviation by parameter, those that the data cannot tell left out."""
    if fit is None:
        return {}
    return {
        name: [float(fit.model.value(name)), float(fit.std[name])]
        for name in fit.model.free()
        if name in fit.std and name not in fit.unidentified
    }


def true_model(task_law: str, truth: dict[str, Any]) -> Model | None:
    """Return the hidden truth as a model; None for forms or effects that bristle lacks."""
    values = {
        name: value for name, value in truth["base"].items() if name in LAWS[task_law].parameters
    }
    names = []
    for found in truth["effects"]:
        own = true_values(found)
        if own is None or found["effect"] not in EFFECTS:
            return None
        if any(name.split(".")[1] not in EFFECTS[found["effect"]].parameters for name in own):
            return None
        names.append(found["effect"])
        values |= own
    return Model(task_law, tuple(names), values)


def z_of(model: Model, problem: Problem) -> float:
    """Return robust RMS(residual)/noise of a model on runs, 1 for the truth."""
    losses = []
    for run, (bias, sigma, _) in zip(problem.runs, problem.expectation(model), strict=True):
        error = (run.force - problem.predict(model, run) - bias) / sigma
        losses.append(huber(error[run.skip :]))
    return float(np.sqrt(np.mean(np.concatenate(losses)) / HUBER_AT_ONE))


def z_of_truth(case: Recorded, holdout: list[Measurement]) -> float | None:
    """Return z of the true model with its true parameters on held-out runs; None if not ours."""
    if case.truth["fault"] is not None:
        return None
    model = true_model(case.task.law, case.truth)
    return None if model is None else z_of(model, Problem([prepare(m) for m in holdout]))
