"""Cases of the independent generator as problems."""

from __future__ import annotations

from functools import cache

import pandas as pd

from bristle.data.measurement import Measurement, measurements_of_frame
from bristle.identification.prepare import prepare
from bristle.identification.problem import Problem
from bristle.model.model import Model
from tests.independent.generate import UNITS, make_case


def frame_of(run):
    """Return a run of the generator as a frame with units in its titles."""
    names = [name for name in run if name in UNITS]
    return pd.DataFrame({f"{name} [{UNITS[name]}]": run[name] for name in names})


def measured(run) -> Measurement:
    """Return a run of the generator as a measurement."""
    return measurements_of_frame(frame_of(run), run["name"])[0]


@cache
def true_case(seed, law, rig="bench_10N", noise=0.01):
    """Return training problem, held-out problem and the true model of a case without an effect."""
    case = make_case(seed, "none", None, 0.15, noise, rig, law)
    train, held = (
        Problem([prepare(measured(run)) for run in case.runs if run["role"] == role])
        for role in ("train", "holdout")
    )
    return train, held, Model(law, (), dict(case.specimen.rig.values))


@cache
def hidden_case(seed, effect, form, strength, rig, law):
    """Return the training problem of a case with an effect, and the model without that effect."""
    case = make_case(seed, effect, form, strength, 0.01, rig, law)
    runs = [prepare(measured(run)) for run in case.runs if run["role"] == "train"]
    return Problem(runs), Model(law, (), dict(case.specimen.rig.values))
