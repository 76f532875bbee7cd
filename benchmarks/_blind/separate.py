"""The experiment that a class proposes, performed by the generator on the same specimen.

A verdict says it in numbers as `experiment`, all entries optional but `motion`:

    motion      "sine", "triangle", "chirp", "multisine", "random" or "swelling_sine"
    size        share of the rig's top speed (or of 0.8 of the stroke, the tighter one), default 1
    frequency   Hz, of sine and triangle;  low, high  Hz, of chirp, multisine and random
    voltage     "constant", "sine", "steps" or "random_steps"
    level       V, of a constant voltage;  stay  s, of a step;  duration  s, default 12
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.independent.experiments import bench_experiment

from . import subject
from .cases import Recorded

HOW = ("low", "high", "frequency", "rise", "stay")


def perform(case: Recorded, made: Any, experiment: dict[str, Any]) -> dict[str, Any]:
    """Return the verdict once two further runs of the proposed kind are there.

    One joins the training runs, the other the held-out ones.
    """
    rng = np.random.default_rng([case.task.seed, 31])
    how = {name: float(experiment[name]) for name in HOW if experiment.get(name) is not None}
    level = experiment.get("level")
    runs = []
    for role in ("train", "holdout"):
        run = bench_experiment(
            made.specimen.rig, rng, str(experiment["motion"]),
            str(experiment.get("voltage", "random_steps")), role,
            float(experiment.get("duration", 12.0)), float(experiment.get("size", 1.0)),
            None if level is None else float(level), **how,
        )  # fmt: skip
        runs.append(made.perform(run, case.task.seed + len(runs), f"{role}_extra"))
    parts = {
        role: case.part(role) + [r for r in runs if r["role"] == role]
        for role in ("train", "holdout")
    }
    train, holdout = (subject.measurements(parts[role], case.channels) for role in parts)
    answer = subject.diagnosed(train, holdout, case.task.law)
    return {name: answer[name] for name in ("kind", "effects", "z_after")}
