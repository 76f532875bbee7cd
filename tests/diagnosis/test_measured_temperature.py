"""The temperature of each run, where it is measured, becomes a covariate of the law."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar
from xml.etree.ElementTree import tostring

import numpy as np
import pandas as pd
import pytest

from bristle.data.guess import guess_channels
from bristle.data.measurement import Known, measurements_of
from bristle.data.table import table_from_frame
from bristle.diagnosis.site_diagnosis import SiteDiagnosis
from bristle.diagnosis.trials import joinable, judge
from bristle.diagnosis.words import effect_words
from bristle.errors import PhysicsError
from bristle.fmu.model_description import unit_definitions
from bristle.identification.fit import fit, refine
from bristle.identification.histories import DamperForces
from bristle.identification.problem import Problem, Run
from bristle.identification.start_grid import initial_guesses
from bristle.model.model import Model
from bristle.physics.effect import EFFECTS, Effect
from bristle.physics.parameter import Parameter

NAME = "measured_temperature"
DT, N, NOISE = 0.002, 2000, 0.05
T = DT * np.arange(N)
LAW = {"f_c": 1.3, "f_v": 0.8, "c_0": 100.0, "c_v": 20.0, "v_n": 0.02}
VISCOUS, YIELD, MIDDLE = 0.015, 0.004, 27.0
WARM = (18.0, 24.0, 30.0, 36.0)


def made(seed, temperature, labels=None):
    """Return a run of a Bingham damper that is as warm as that."""
    random = np.random.default_rng(seed)
    w = 2.0 * np.pi * random.uniform(0.4, 4.0, 10)
    phase, size = random.uniform(0.0, 6.28, 10), 0.02 / w
    angle = w[:, None] * T + phase[:, None]
    x, v, a = size @ np.sin(angle), (size * w) @ np.cos(angle), -(size * w**2) @ np.sin(angle)
    V = np.repeat(random.choice([0.0, 2.0, 4.0, 6.0], 10), N // 10)
    left = {
        "c": np.exp(-VISCOUS * (temperature - MIDDLE)),
        "f": np.exp(-YIELD * (temperature - MIDDLE)),
    }
    values = {name: value * left.get(name[0], 1.0) for name, value in LAW.items()}
    force = DamperForces("bingham", []).force(
        x, v, a, V, DT, values
    ) + NOISE * random.standard_normal(N)
    known = {"temperature": temperature} if labels is None else labels
    return Run(f"run_{seed}", DT, x, v, a, V, force, NOISE, np.zeros((2, N, 4)), labels=known)


def problems(**how):
    return Problem([made(k, t, **how) for k, t in enumerate(WARM)]), Problem([made(9, 33.0, **how)])


def test_the_force_follows_the_temperature_of_each_run():
    train, held_out = problems()
    base = fit(train, Model("bingham", (), LAW), with_std=False).model
    before = judge(base, train, held_out)
    assert before.z > 1.5
    (start,) = initial_guesses(NAME, base, train)
    assert (start.value(f"{NAME}.T"), start.value(f"{NAME}.T_0")) == (MIDDLE, MIDDLE)
    trial = judge(refine(start, train), train, held_out)
    assert trial.z == pytest.approx(1.0, abs=0.05)
    assert trial.model.value(f"{NAME}.c_viscous") == pytest.approx(VISCOUS, rel=0.1)
    assert trial.model.value(f"{NAME}.c_yield") == pytest.approx(YIELD, rel=0.1)
    assert trial.model.value("c_0") == pytest.approx(LAW["c_0"], rel=0.03)
    assert trial.model.value(f"{NAME}.T_0") == MIDDLE
    found = SiteDiagnosis("damper", "effect", (NAME,), 2.0, 1.0, 1.0, 0.0, after=trial)
    (text,) = effect_words(found)
    assert text.startswith("With each kelvin above 27 °C the viscous force falls by 1.5 %")
    assert "the yield force falls by 0.4" in text
    # A run whose temperature nobody knows is taken at the mean of the others.
    unknown = replace(held_out.runs[0], labels={})
    bare = replace(trial.model, effects=())
    assert train.predict(trial.model, unknown) == pytest.approx(train.predict(bare, unknown))


def test_it_is_tried_only_where_all_runs_have_a_temperature_and_differ_in_it():
    train, _ = problems()
    model = Model("bingham", (), LAW)
    assert NAME in joinable(model, problem=train)
    assert NAME not in joinable(model)
    for labels in ({}, {"temperature": 20.0}, {"temperature": "warm"}):
        assert NAME not in joinable(model, problem=problems(labels=labels)[0])
    nearly = [
        replace(run, labels={"temperature": 20.0 + k / 4}) for k, run in enumerate(train.runs)
    ]
    assert NAME not in joinable(model, problem=Problem(nearly))
    one_lacks = [*train.runs[:3], replace(train.runs[3], labels={})]
    assert NAME not in joinable(model, problem=Problem(one_lacks))


def test_parts_that_fall_alike_are_told_as_one_force():
    effect = EFFECTS[NAME]
    alike = effect.in_words(effect.values_of({"c_viscous": 0.012, "c_yield": 0.012}))
    assert alike == "With each kelvin above 20 °C the force falls by 1.2 %."
    assert "rises by 1 %" in effect.in_words(effect.values_of({"c_viscous": -0.01, "c_yield": 0.0}))
    assert 'offset="273.15"' in tostring(unit_definitions(["degC"]), encoding="unicode")


def table(column, values):
    t = 0.002 * np.arange(len(values))
    frame = pd.DataFrame({
        "time [s]": t, "x [mm]": 10.0 * np.sin(9.0 * t), "F [N]": 50.0 * np.cos(9.0 * t),
        "U [V]": 2.0 + 0.0 * t, column: values,
    })  # fmt: skip
    return table_from_frame(frame, "run")


def test_a_channel_of_temperature_is_the_label_of_its_run():
    slow = np.where(np.arange(800) % 100 == 0, np.linspace(23.0, 25.0, 800), np.nan)
    warm = table("T_oil [°C]", slow)
    (guess,) = [one for one in guess_channels(warm) if one.channel == "temperature"]
    assert (guess.column, guess.unit) == ("T_oil [°C]", "degC")
    (run,) = measurements_of(warm)
    assert run.labels == {"temperature": 23.9}
    assert "temperature" not in run.channels
    assert any("from 23 to 24.8 °C" in note for note in run.notes)
    (run,) = measurements_of(warm, known=Known(labels={"temperature": 21.0}))
    assert run.labels == {"temperature": 21.0}
    (run,) = measurements_of(table("T_oil [K]", np.full(800, 300.0)))
    assert run.labels == {"temperature": pytest.approx(26.9)}
    (run,) = measurements_of(table("T_oil [°C]", np.full(800, np.nan)))
    assert run.labels == {}
    assert any("no value" in note for note in run.notes)


def test_a_label_that_a_fit_would_move_is_refused():
    with pytest.raises(PhysicsError, match="which assumed must name as well"):

        class Aged(Effect):
            """Age: the force falls as the oil ages."""

            name = "aged"
            source = expect = "-"
            passive = True
            parameters: ClassVar = {"age": Parameter(0.0, "s", (0.0, 1e9), "age of the oil")}
            labels: ClassVar = {"age": "age"}

            @staticmethod
            def viscous_factor(q, z, p):
                return 1.0 - p.age
