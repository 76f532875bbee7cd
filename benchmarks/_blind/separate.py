"""The experiment that a class proposes, performed by the generator on the same specimen."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from tests.independent.experiments import RATE, proposed

from . import subject
from .cases import Recorded

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
    train, holdout = (subject.measurements(parts[role], case.channels) for role in ROLES)
    answer = subject.packed(subject.diagnosed(train, holdout, case.task.law).as_dict())
    return {name: answer[name] for name in ("kind", "effects", "z_after")}
