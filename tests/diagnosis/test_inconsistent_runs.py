"""Runs of two rigs are told apart from a rig that lacks an effect."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bristle.diagnosis.conclusion import VerdictContext, conclude
from bristle.diagnosis.decision import OTHER_FORM
from bristle.diagnosis.inconsistent_runs import contradicted, groups, inconsistent_runs, odd_run
from bristle.diagnosis.prepared import Prepared
from bristle.diagnosis.site_diagnosis import SiteDiagnosis
from bristle.diagnosis.trials import judge
from bristle.identification.fit import fit, fit_from_starts
from bristle.identification.rig_fit import joined
from bristle.model.model import Model
from tests.identification.truths import hidden_case, true_case


@pytest.mark.parametrize(
    ("law", "other"),
    # Compiled and fitted: another law and size.
    [("bingham", "bench_2kN"), pytest.param("lugre", "bench_10N", marks=pytest.mark.slow)],
)
def test_runs_of_two_rigs_are_named(law, other):
    first, _, truth = true_case(3, law)
    second, _, _ = true_case(4, law, other)
    train = first.of([*first.runs[:2], *second.runs[:1]])
    held_out = second.of(second.runs[1:3])
    told = groups(fit_from_starts(train, Model(law)).model, train, held_out)
    assert "these groups: " in told
    own, others = told.split("these groups: ")[1].split(". Were")[0].split("; ")
    assert own == ", ".join(run.name for run in first.runs[:2])
    assert others == ", ".join(run.name for run in second.runs[:3])
    assert groups(truth, first, first) == ""


def test_an_effect_outside_the_library_is_no_second_rig():
    train, truth = hidden_case(5, "force_ripple", None, 0.15, "bench_10N", "bingham")
    assert groups(truth, train, train) == ""


def test_one_odd_run_is_no_second_rig():
    first, _, truth = true_case(3, "bingham")
    second, _, _ = true_case(4, "bingham", "bench_2kN")
    assert groups(truth, first.of([*first.runs[:3], second.runs[0]]), second.of([])) == ""


def test_another_zero_of_the_force_in_one_run_is_told_with_its_value():
    first, _, truth = true_case(3, "bingham")
    one, *others = first.runs
    size = 0.05 * float(np.std(one.force))
    higher = replace(one, force=one.force + size)
    told = inconsistent_runs(truth, first.of([higher, *others]), first.of([]))
    assert f"In {one.name} the force shows {size:.3g}"[:-1] in told
    assert "N more throughout" in told


@pytest.mark.parametrize("gain", [0.8, 1.06])
def test_another_gain_of_the_force_in_one_run_is_told_with_its_value(gain):
    first, _, truth = true_case(3, "bingham")
    one, *others = first.runs
    scaled = replace(one, force=gain * one.force)
    told = inconsistent_runs(truth, first.of([scaled, *others]), first.of([]))
    assert f"largest in {one.name}" in told
    assert told.count("throughout") == 1
    value = float(told.split('fault = "gain", value = ')[1].split("}")[0])
    assert value == pytest.approx(gain, rel=0.01)


def test_a_run_in_which_more_is_wrong_has_neither_another_zero_nor_another_gain():
    first, _, truth = true_case(3, "bingham")
    one, *others = first.runs
    sprung = replace(one, force=one.force + 5.0 * float(np.std(one.force) / np.std(one.x)) * one.x)
    told = inconsistent_runs(truth, first.of([sprung, *others]), first.of([]))
    assert f"largest in {one.name}" in told
    assert "throughout" not in told


@pytest.mark.parametrize(
    ("place", "gain"),  # half a second each: by default a run for training and one held out
    [(0, 1.06), pytest.param(1, 0.93, marks=pytest.mark.slow), (3, 1.06)],
)
def test_the_one_run_with_another_gain_is_found_among_runs_of_either_role(place, gain):
    first, _, truth = true_case(5, "bingham")
    runs = list(first.runs)
    runs[place] = replace(runs[place], force=gain * runs[place].force)
    train, held_out = first.of(runs[:3]), first.of(runs[3:])
    told = odd_run(fit(train, truth, with_std=False).model, train, held_out)
    assert told.startswith(f"One model explains all runs but {runs[place].name}. ")
    value = float(told.split('fault = "gain", value = ')[1].split("}")[0])
    assert value == pytest.approx(gain, rel=0.01)


def test_no_run_is_odd_where_an_effect_is_missing_or_nothing_is():
    first, _, truth = true_case(3, "bingham")
    assert odd_run(truth, first, first.of([])) == ""
    train, bare = hidden_case(5, "force_ripple", None, 0.15, "bench_10N", "bingham")
    assert odd_run(bare, train, train.of([])) == ""


def test_a_run_beyond_all_others_is_not_called_odd():
    first, _, truth = true_case(3, "bingham")
    strongest, *others = sorted(first.runs, key=lambda run: -float(np.max(np.abs(run.V))))
    alone = replace(strongest, V=strongest.V + 20.0, force=1.3 * strongest.force)
    train = first.of([alone, *others])
    assert odd_run(fit(train, truth, with_std=False).model, train, first.of([])) == ""


@cache
def sprung_finding(place: int, gain: float) -> tuple[SiteDiagnosis, Prepared]:
    """Return what is found on a damper beside a spring, with one run whose force is scaled."""
    first, second, truth = true_case(5, "bingham")
    both = [*first.runs, *second.runs]
    stiffness = 0.5 * float(np.std(both[0].force) / np.std(both[0].x))
    runs = [replace(run, force=run.force + stiffness * run.x) for run in both]
    runs[place] = replace(runs[place], force=gain * runs[place].force)
    train, held_out = first.of(runs[:3]), first.of(runs[3:])
    before = judge(fit(train, truth, with_std=False).model, train, held_out)
    single = judge(joined("gas_spring", before.model, train), train, held_out)
    found = SiteDiagnosis(
        "damper", "effect", ("gas_spring",), before.z, single.z, 0.8, float("nan"),
        trials=(single,), before=before, after=single, reasons=("It gains.", OTHER_FORM),
    )  # fmt: skip
    return found, Prepared(before, train, held_out)


@pytest.mark.parametrize("place", [1, pytest.param(4, marks=pytest.mark.slow)])
def test_what_an_effect_leaves_in_one_odd_run_is_no_other_form_of_it(place):
    found, opened = sprung_finding(place, 1.1)
    told = contradicted(found, opened)
    assert (told.kind, told.effects) == ("effect", ("gas_spring",))
    name = [*opened.problem.runs, *opened.held_out.runs][place].name
    assert OTHER_FORM not in told.reasons
    assert told.reasons[-1].startswith(f"The model with gas_spring explains all runs but {name}. ")


def test_no_further_effect_is_named_for_one_odd_run():
    found, opened = sprung_finding(1, 1.1)
    single = found.after
    assert single is not None
    both = replace(single.model, effects=("gas_spring", "delay"))
    pair = replace(single, model=both, z=1.0)
    named = replace(found, effects=("gas_spring", "delay"), after=pair)
    told = contradicted(named, opened)
    assert (told.kind, told.effects) == ("insufficient", ())
    assert "gain" in told.reasons[0]


@pytest.mark.parametrize(("share", "kind"), [(0.008, "none"), (0.05, "insufficient")])
def test_a_zero_that_costs_nothing_takes_no_verdict_away(share, kind):
    first, _, truth = true_case(5, "bingham")
    runs = [replace(run, noise=run.noise / 3.0, force=run.force) for run in first.runs]
    clean = [first.predict(truth, run) for run in runs]
    runs = [
        replace(run, force=f + (run.force - f) / 3.0) for run, f in zip(runs, clean, strict=True)
    ]
    size = share * float(np.sqrt(np.mean(runs[1].force ** 2)))
    runs[1] = replace(runs[1], force=runs[1].force + size)
    train, held_out = first.of(runs[:2]), first.of(runs[2:])
    before = judge(truth, train, held_out)
    found = SiteDiagnosis(
        "damper", "none", (), before.z, before.z, 0.0, float("nan"), before=before, after=before,
    )  # fmt: skip
    told = contradicted(found, Prepared(before, train, held_out))
    assert told.kind == kind
    assert ("too little to count" in told.reasons[-1]) == (kind == "none")
    assert runs[1].name in told.reasons[-1]


def late(run, steps: float):
    """Return a run whose force was recorded so many steps late."""
    at = np.arange(len(run.force), dtype=float)
    return replace(run, force=np.interp(at - steps, at, run.force))


# Two seconds: where nothing was named.
@pytest.mark.parametrize("named", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_a_logger_that_began_apart_is_told_beside_a_missing_effect(named):
    """The late run alone leaves more than noise, and is no other form of the spring."""
    found, opened = sprung_finding(1, 1.0)
    runs = [*opened.problem.runs]
    runs[1] = late(runs[1], 3.0)
    train = opened.problem.of(runs)
    before = judge(fit(train, opened.before.model, with_std=False).model, train, opened.held_out)
    single = judge(joined("gas_spring", before.model, train), train, opened.held_out)
    after = single if named else before
    kind, effects = ("effect", ("gas_spring",)) if named else ("unknown", ())
    found = replace(found, kind=kind, effects=effects, trials=(single,), before=before, after=after)
    told = contradicted(found, Prepared(before, train, opened.held_out))
    assert told.kind == ("effect" if named else "insufficient")
    assert told.effects == effects
    assert told.reasons[-1].startswith(f"With gas_spring: In {runs[1].name} the force is on record")
    value = float(told.reasons[-1].split('fault = "delay", value = ')[1].split("}")[0])
    assert value == pytest.approx(3.0 * runs[1].dt, rel=0.1)


def test_a_verdict_stays_where_no_run_is_odd():
    found, opened = sprung_finding(1, 1.0)
    assert contradicted(found, opened) is found
    assert found.after is not None
    rough = replace(found, after=replace(found.after, z=2.0))
    assert contradicted(rough, opened) is rough


@pytest.mark.parametrize(
    ("force", "damper", "kind"),
    [
        ("measured", "insufficient", "insufficient"),
        ("measured", "none", "unknown"),
        ("reconstructed", "insufficient", "unknown"),
    ],
)
def test_the_layer_waits_for_a_measured_force_that_contradicts_itself(force, damper, kind):
    nan = float("nan")
    layer = SiteDiagnosis("layer", "unknown", (), 2.2, 2.2, 0.0, nan, reasons=("It errs.",))
    other = SiteDiagnosis("damper", damper, (), 4.0, 4.0, 0.0, nan, reasons=("One run is odd.",))
    told = conclude({"layer": layer, "damper": other}, VerdictContext(force=force))
    assert told.kind == kind
    assert ("set right first" in " ".join(told.reasons)) == (kind == "insufficient")
