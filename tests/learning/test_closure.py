"""A closure carries what has no formula, fades beyond its runs, and creates no energy."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import cos, pi, sin

import numpy as np
import pytest
from bingham_runs import STEP, VALUES, runs

from bristle.diagnosis.prepared import Prepared
from bristle.diagnosis.trials import judge
from bristle.identification.histories import DamperForces, force_history
from bristle.identification.problem import Problem
from bristle.learning.closure import (
    LearnedClosure,
    held_by_springs,
    label_inputs,
    learn_closure,
    lowers,
    nearest_effect,
    one_amplitude,
    promised,
)
from bristle.learning.closure_file import Closure, closure_text
from bristle.model.model import Model
from bristle.physics.damper import DamperModel, functions_of, room, setup_of
from bristle.physics.generate import Link
from bristle.physics.tuples import Inputs
from bristle.user_code.load import defined, flaw_of

NAME = "closure_1"
ORIGIN = "made for a test, 2026"
SHORT = 1500
"""Samples of each run that a closure is trained on: half of them, for half of the time."""


def late(x, v, V, F):
    """A force that no curve along one signal is: it follows the motion and the command late."""
    keep = np.exp(-STEP / 0.05)
    out, now = np.empty(len(v)), 0.0
    for k, goal in enumerate(np.tanh(v / 0.05) * (1.0 + 0.2 * V) - 120.0 * x * (v > 0.0)):
        now = goal + (now - goal) * keep
        out[k] = now
    return F + 1.5 * out


def opened(problem: Problem) -> Prepared:
    train, held = (problem.of(part) for part in (problem.runs[:2], problem.runs[2:]))
    return Prepared(judge(Model("bingham", (), VALUES), train, held), train, held)


@cache
def learned() -> LearnedClosure:
    found = learn_closure(opened(runs(late, SHORT)), NAME, names=False)
    assert found.refused == ""
    return found


@cache
def network() -> Closure:
    closure = learned().closure
    assert closure is not None
    return closure


def forces(closure: Closure, motion, values=VALUES, beside=()) -> np.ndarray:
    """Return the force [N] of a Bingham damper with a closure for motions (x, v, a, V) at STEP."""
    with defined({NAME: closure_text(NAME, closure, ORIGIN)}):
        model = DamperModel("bingham", values, [NAME, *beside])
        energy, before, out = 0.0, (0.0, 0.0), []
        for x, v, a, V in motion:
            force = model.step(x, v, a, V, STEP, energy, 0.0, False)
            energy += 0.5 * STEP * (before[0] * before[1] + force * v)
            before = force, v
            out.append(force)
    return np.array(out)


def sine(amplitude: float, frequency: float, cycles: int, V: float = 3.0):
    w = 2.0 * pi * frequency
    times = STEP * np.arange(1, round(cycles / frequency / STEP) + 1)
    return [
        (amplitude * sin(w * t), amplitude * w * cos(w * t), -amplitude * w * w * sin(w * t), V)
        for t in times
    ]


def test_it_lowers_the_error_on_runs_that_it_has_not_seen() -> None:
    found = learned()
    assert found.after is not None
    assert found.after.rms < 0.75 * found.before.rms
    assert found.folds < 0.9
    text = " ".join(found.sentences())
    assert "It is no effect of physics, and the verdict stays unknown." in text
    assert "It is not supported beyond velocity" in text
    assert found.as_dict()["lives_on"]


def test_what_it_may_win_is_told_before_it_is_trained() -> None:
    told = opened(runs(late, SHORT))
    base, train = told.before.model, told.problem
    assert 0.9 * learned().folds <= promised(train, base) < 0.8
    assert promised(train.of([train.runs[0].of(slice(0, 60))]), base) == 1.0


def test_a_label_of_the_runs_is_an_input_held_at_what_they_had() -> None:
    closure, part = network(), runs().runs[2]
    oils = [replace(part, labels={"oil": oil, "batch": "A"}) for oil in (80.0, 100.0, 95.0)]
    (oil,) = label_inputs(oils)
    assert (oil.words, oil.low, oil.high) == ("oil", 80.0, 100.0)
    line = np.array([-1.0, 1.0]), np.array([-1.7, 1.7])
    more = replace(
        closure, inputs=(*closure.inputs, oil), middle=np.append(closure.middle, 90.0),
        spread=np.append(closure.spread, 10.0), linear=np.append(closure.linear, 0.5),
        knots=(*closure.knots, line), hidden=np.pad(closure.hidden, ((0, 0), (0, 1))),
    )  # fmt: skip
    motion = sine(0.008, 2.0, 2)
    force = [forces(more, motion, {**VALUES, f"{NAME}.oil": told}) for told in (70.0, 80.0, 100.0)]
    assert np.array_equal(force[0], force[1])
    assert np.abs(force[2] - force[1]).max() > 1.0


def alone() -> Prepared:
    problem = runs(late, SHORT)
    train, held = (problem.of([run]) for run in problem.runs[:2])
    return Prepared(judge(Model("bingham", (), VALUES), train, held), train, held)


def test_of_a_single_run_it_says_that_it_knows_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    trained = network(), Model("bingham", (), VALUES), learned().folds
    monkeypatch.setattr("bristle.learning.closure.trained_beside", lambda *_: trained)
    found = learn_closure(alone(), NAME, names=False)
    told = found.sentences()[-1]
    assert "parts of it chose the closure, which knows nothing that this run" in told


@pytest.mark.slow  # 20 s: one more closure is trained, as that of several runs is by default
def test_a_single_run_is_enough_for_a_closure() -> None:
    assert learn_closure(alone(), NAME, names=False).refused == ""


@pytest.mark.slow  # a closure is trained and effects fitted beside
def test_the_effect_that_it_stands_for_is_named_and_tried() -> None:
    def hidden(x, v, V, F):
        lag = {**VALUES, "coil_lag.tau": 0.08}
        return DamperForces("bingham", ["coil_lag"]).force(x, v, 0.0 * v, V, STEP, lag)

    told = opened(runs(hidden))
    base = told.before.model
    carried = [run.force - told.problem.predict(base, run) for run in told.problem.runs]
    found = nearest_effect(told, base, told.problem, carried)
    assert found is not None
    assert found.effect == "coil_lag"
    assert found.explains > 0.8
    assert found.trial.model.value("coil_lag.tau") == pytest.approx(0.08, rel=0.05)
    assert found.trial.z < 0.5 * told.before.z
    text = found.sentence("voltage")
    assert text.startswith("Nearest in the library: coil lag, which explains")


def test_a_true_model_keeps_none() -> None:
    found = learn_closure(opened(runs()), NAME)
    assert found.closure is None
    assert "nothing is missing" in found.refused


def test_a_gain_in_one_stretch_alone_is_scatter() -> None:
    before = [np.ones(800)]
    once = [np.where(np.arange(800) < 100, 0.0, 1.0)]
    assert not lowers(before, once, 0.02)
    assert lowers(before, [0.9 * np.ones(800)], 0.02)
    strong = np.exp(-np.arange(800) / 30.0)  # an earthquake: all is in the first seconds
    assert lowers([strong], [0.5 * strong], 0.02)
    assert not lowers([strong], [np.where(np.arange(800) < 2, 0.0, strong)], 0.02)


def test_its_file_is_an_effect_that_is_accepted() -> None:
    assert flaw_of(NAME, closure_text(NAME, network(), ORIGIN)) == ""


def test_compiled_code_gives_the_numbers_of_plain_python() -> None:
    run = runs(late, SHORT).runs[2]
    part = run.of(slice(0, 300))
    with defined({NAME: closure_text(NAME, network(), ORIGIN)}):
        compiled = Problem([part]).predict(Model("bingham", (NAME,), VALUES), part)
        functions = functions_of("bingham", [NAME])
        setup = setup_of("bingham", VALUES, [NAME])
        size = functions.slots.z_size
        z, z1, work = [0.0] * size, [0.0] * size, [0.0] * room(size)
        for state, signal in (("s", part.v), ("V", part.V)):
            for name, slot in functions.slots.states.items():
                k = name.rpartition(".s")[2]
                if k.isdigit() and network().inputs[int(k)].kind == {
                    "s": "recent_v", "V": "recent_V",
                }[state]:  # fmt: skip
                    z[slot] = float(signal[0])
        out = [0.0] * len(part.x)
        motion = Inputs(
            *(one.tolist() for one in (part.x, part.v, part.a, part.V)), STEP, 0.0, 0.0, False
        )
        tracks = type("None_", (), {"slots": (), "values": ()})()
        link: Link = functions.link
        link(force_history)(setup, motion, tracks, z, z1, work, out)
    assert np.abs(np.array(out) - compiled).max() <= 1e-12 * np.abs(compiled).max()


def test_it_fades_beyond_the_motion_of_its_runs() -> None:
    far = sine(0.5, 1.0, 2)
    bare = DamperModel("bingham", VALUES, [])
    alone = np.array([bare.step(x, v, a, V, STEP, 0.0, 0.0, False) for x, v, a, V in far])
    fastest = max(abs(v) for _, v, _, _ in far)
    quick = np.array([abs(v) > 0.5 * fastest for _, v, _, _ in far])
    assert np.abs(forces(network(), far) - alone)[quick].max() == 0.0


@pytest.mark.parametrize("times", [1.0, -30.0, 30.0])
@pytest.mark.parametrize(("amplitude", "frequency"), [(0.001, 5.0), (0.008, 1.0), (0.008, 3.0)])
def test_the_device_never_gives_energy_whatever_the_weights(
    times: float, amplitude: float, frequency: float
) -> None:
    closure = network()
    wild = replace(
        closure, out=times * closure.out, linear=times * closure.linear,
        constant=times * closure.constant, size=max(abs(times), 1.0) * closure.size,
    )  # fmt: skip
    motion = sine(amplitude, frequency, 4 + round(4.0 * frequency))
    v, force = np.array([one[1] for one in motion]), forces(wild, motion)
    power = force * v
    taken = STEP * np.cumsum(0.5 * (power + np.append(0.0, power[:-1])))
    # At first it may give back what is in its store; each cycle that repeats itself takes energy.
    cycle = round(1.0 / frequency / STEP)
    rounding = 1e-3 * amplitude * float(np.abs(force).max())
    assert taken.min() >= -wild.store.begin - rounding
    assert taken[-1] - taken[-1 - cycle] >= -rounding


@pytest.mark.parametrize("times", [1.0, -30.0, 30.0])
def test_what_a_spring_gives_back_is_not_given_twice(times: float) -> None:
    closure, k, far = network(), 80.0, 0.008
    kept = 0.5 * k * (1.2 * far) ** 2
    wild = replace(
        closure, out=times * closure.out, linear=times * closure.linear,
        constant=times * closure.constant, size=30.0 * closure.size,
        store=replace(closure.store, most=0.02, kept=kept),
    )  # fmt: skip
    # The spring is bent slowly, the rod shakes there, and the spring is let go: one closed cycle.
    shaken = far + 0.15 * far * np.sin(2.0 * pi * 6.0 * STEP * np.arange(round(2.0 / STEP)))
    way = np.linspace(0.0, far, round(1.0 / STEP))
    x = np.concatenate([way, shaken, way[::-1]])
    v = np.gradient(x, STEP)
    thin = {"f_c": 0.05, "f_v": 0.05, "c_0": 0.5, "c_v": 0.1, "gas_spring.k": k}
    motion = [(at, speed, 0.0, 2.0) for at, speed in zip(x, v, strict=True)]
    power = forces(wild, motion, {**VALUES, **thin}, ("gas_spring",)) * v
    taken = STEP * np.cumsum(0.5 * (power + np.append(0.0, power[:-1])))
    assert taken.min() >= -wild.store.begin - 1e-5


def test_the_energy_that_a_spring_holds_is_known() -> None:
    problem = runs()
    ends = [end(run.x) for run in problem.runs for end in (np.min, np.max)]
    spring = Model("bingham", ("gas_spring",), {**VALUES, "gas_spring.k": 80.0})
    most = 40.0 * max(abs(end) for end in ends) ** 2
    assert held_by_springs(problem, spring) == pytest.approx(most, rel=0.1)
    assert held_by_springs(problem, Model("bingham", (), VALUES)) == 0.0


def test_runs_of_one_amplitude_are_told() -> None:
    run = runs().runs[0]
    t = STEP * np.arange(len(run.x))
    alike = [replace(run, x=0.01 * np.sin(w * t)) for w in (6.0, 9.0)]
    assert one_amplitude(alike)
    assert not one_amplitude([alike[0], replace(run, x=0.02 * np.sin(6.0 * t))])
    assert not one_amplitude(runs().runs)
