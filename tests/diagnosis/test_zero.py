"""A load cell off its zero beside an effect: the effect alone is named, and the zero is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_model_based_faults import problems

import bristle
from bristle.core.finding import Finding
from bristle.diagnosis import site as of_damper
from bristle.diagnosis.decision import Decision
from bristle.diagnosis.prepared import Prepared
from bristle.diagnosis.site import free_zero, zero_fault
from bristle.diagnosis.trials import judge
from bristle.identification.fit import fit_from_starts
from bristle.identification.problem import errors, has_offset, robust_z, zero_of
from bristle.model.model import Model

OFFSET = 0.6
HIDDEN = {"effects": ("stribeck",), "values": {"stribeck.rise": 0.5}}


def opened(**choices):
    """Return what a diagnosis of runs with a shifted force begins with, and the true model."""
    train, held_out = (
        problem.of([replace(run, force=run.force + OFFSET) for run in problem.runs])
        for problem in problems(**choices)
    )
    model = fit_from_starts(train, Model("bingham"), starts=2).model
    return Prepared(judge(model, train, held_out), train, held_out, (), {}, ("force",))


def test_the_zero_is_fitted_along_with_every_model():
    train, _ = problems()
    model = fit_from_starts(train, Model("bingham"), starts=2).model
    off = train.of([replace(run, force=run.force + OFFSET) for run in train.runs])
    zero, std = zero_of(off, model)
    assert zero == pytest.approx(OFFSET, abs=4.0 * std)
    assert 0.0 < std < 0.01
    assert robust_z(off, model) > 5.0
    free = off.with_free_zero()
    assert robust_z(free, model) == pytest.approx(robust_z(train, model), rel=0.01)
    assert free.of(free.runs[:1]).free_zero
    assert not off.free_zero
    left = np.concatenate(errors(free, model, free.expectation(model)))
    assert abs(np.mean(left)) < 4.0 * std
    fitted = fit_from_starts(free, Model("bingham"), starts=2).model
    for name in model.free():
        assert fitted.value(name) == pytest.approx(model.value(name), rel=1e-2)


def test_an_effect_with_a_constant_force_of_its_own_has_no_zero_besides():
    train, _ = problems()
    spring = Model("bingham", ("gas_spring",), {"gas_spring.preload": 0.0})
    assert has_offset(spring)
    assert not has_offset(replace(spring, fixed=("gas_spring.preload",)))
    free = train.with_free_zero()
    same = zip(
        errors(train, spring, train.expectation(spring)),
        errors(free, spring, free.expectation(spring)),
        strict=True,
    )
    assert all(np.array_equal(*pair) for pair in same)


def of(kind, opening, model=None):
    """Return a decision for a model on the runs of an opening."""
    trial = opening.before if model is None else judge(model, opening.problem, opening.held_out)
    return Decision(kind, trial.effects, trial, 0.9, ())


def fitted(opening, effects):
    """Return a model with effects fitted to the training runs."""
    return fit_from_starts(opening.problem, Model("bingham", effects), starts=4).model


def test_a_zero_is_freed_where_a_constant_is_left_or_a_second_effect_took_it_up():
    opening = opened(**HIDDEN)
    freed = free_zero(opening, of("unknown", opening))
    assert freed is not None
    assert freed.problem.free_zero
    assert freed.held_out.free_zero
    assert freed.before.z < opening.before.z
    alone = of("effect", freed, fitted(freed, ("stribeck",)))
    assert alone.best.z == pytest.approx(1.0, abs=0.1)
    fault = zero_fault(freed, alone)
    assert fault is not None
    assert (fault.channel, fault.kind) == ("force", "bias")
    assert fault.value == pytest.approx(OFFSET, abs=max(4.0 * fault.std, 0.01))
    assert "beside stribeck" in fault.text
    assert "static preload on the rod would look the same" in fault.text
    pair = of("effect", opening, fitted(opening, ("stribeck", "gas_spring")))
    assert free_zero(opening, pair) is not None
    assert free_zero(opening, of("none", opening)) is None
    assert zero_fault(opening, pair) is None, "the spring's preload is that constant"


def test_a_spring_that_says_more_than_a_zero_stays():
    train, held_out = problems(
        effects=("gas_spring",),
        values={"gas_spring.k": 150.0, "gas_spring.preload": OFFSET, "gas_spring.k_2": 0.0},
    )
    model = fit_from_starts(train, Model("bingham"), starts=2).model
    opening = Prepared(judge(model, train, held_out), train, held_out, (), {}, ("force",))
    assert free_zero(opening, of("effect", opening, fitted(opening, ("gas_spring",)))) is None


def test_without_an_offset_nothing_is_tried_again():
    train, held_out = problems(**HIDDEN)
    model = fit_from_starts(train, Model("bingham"), starts=2).model
    opening = Prepared(judge(model, train, held_out), train, held_out, (), {}, ("force",))
    assert free_zero(opening, of("unknown", opening)) is None


def test_a_zero_that_was_found_first_is_renewed_beside_an_effect():
    opening = opened(**HIDDEN)
    first = Finding(
        "bias", "warning", "Force shows 0.55 N.", channel="force", value=OFFSET - 0.05, std=0.001
    )
    train, held_out = (
        problem.of([replace(r, force=r.force - first.value) for r in problem.runs]).with_free_zero()
        for problem in (opening.problem, opening.held_out)
    )
    freed = replace(opening, problem=train, held_out=held_out, faults=(first,))
    assert free_zero(freed, of("unknown", freed)) is None, "it is free already"
    alone = of("effect", freed, fitted(freed, ("stribeck",)))
    fault = zero_fault(freed, alone)
    assert fault is not None
    assert fault.value == pytest.approx(OFFSET, abs=max(4.0 * fault.std, 0.01))
    assert zero_fault(opening, alone) is None
    assert zero_fault(freed, of("effect", freed, fitted(freed, ("gas_spring",)))) is None


@pytest.mark.slow  # a diagnosis beside a zero
def test_an_effect_is_named_alone_and_the_zero_told():
    found, _ = of_damper.diagnose_damper(opened(**HIDDEN))
    assert (found.kind, found.effects) == ("effect", ("stribeck",))
    (fault,) = found.sensors
    assert fault.value == pytest.approx(OFFSET, abs=0.02)


def runs_of(offsets, sizes=(1.0, 2.0, 4.0)):
    """Return runs of a friction damper whose load cell shows so much more [N]."""
    rng, t, found = np.random.default_rng(3), np.arange(0.0, 8.0, 0.004), []
    for offset, size in zip(offsets, sizes, strict=True):
        v = 0.02 * size * np.cos(9.0 * t)
        force = 5.0 * np.sign(v) + 90.0 * v + offset + rng.normal(0.0, 0.05, t.size)
        found.append({"time": t, "velocity": v, "force": force})
    return found


def test_identify_fits_a_zero_that_all_runs_show_alike_and_says_so():
    found = bristle.identify(runs_of((2.0, 2.0, 2.0)), "bingham_standard")
    assert found.model.value("f_c") == pytest.approx(5.0, rel=0.01)
    assert found.error.rms == pytest.approx(0.05, rel=0.1)
    (note,) = [note for note in found.notes if "zero of the load cell" in note]
    assert "show some 1.99 N" in note, "told before any law; the fit has it nearer"


def test_a_constant_part_that_differs_between_runs_is_no_zero():
    """That of an asymmetric damper grows with its force."""
    found = bristle.identify(runs_of((0.7, 1.3, 2.0)), "bingham_standard")
    assert found.error.rms > 1.0
    assert not [note for note in found.notes if "zero of the load cell" in note]


def test_a_law_with_a_constant_force_of_its_own_keeps_it():
    found = bristle.identify(runs_of((2.0, 2.0, 2.0)), "bouc_wen")
    assert found.model.value("f_0") == pytest.approx(2.0, abs=0.02)


def test_a_spring_in_series_is_not_loaded_by_the_zero_where_a_run_begins_at_rest():
    """A Maxwell element at rest, then a sine: in closed form, its load cell 30 N off."""
    rng, t, found, k, tau = np.random.default_rng(4), np.arange(0.0, 4.0, 0.004), [], 1e4, 0.02
    for size, f in ((0.01, 1.0), (0.02, 1.5), (0.01, 2.0)):
        w, s = 2.0 * np.pi * f, np.maximum(t - 0.4, 0.0)
        moves = (s > 0.0) * size
        lag = 1.0 / (1.0 + (w * tau) ** 2)
        force = k * w * tau * lag * (np.cos(w * s) + w * tau * np.sin(w * s) - np.exp(-s / tau))
        found.append({
            "time": t, "displacement": moves * np.sin(w * s) + rng.normal(0.0, 1e-6, t.size),
            "force": moves * force + 30.0 + rng.normal(0.0, 0.2, t.size),
        })  # fmt: skip
    fitted = bristle.identify(found, "fluid_viscous")
    assert fitted.model.value("alpha") == pytest.approx(1.0, abs=0.02)
    assert fitted.error.rms == pytest.approx(0.2, rel=0.25)
