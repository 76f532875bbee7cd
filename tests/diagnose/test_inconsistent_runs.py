"""Runs of two rigs are told apart from a rig that lacks an effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bristle.diagnose.inconsistent_runs import groups, inconsistent_runs
from bristle.identify.fit import identify
from tests.identify.truths import hidden_case, true_case


@pytest.mark.parametrize(
    ("law", "other"),
    [pytest.param("bingham", "bench_2kN", marks=pytest.mark.slow), ("lugre", "bench_10N")],
)
def test_runs_of_two_rigs_are_named(law, other):
    first, _, truth = true_case(3, law)
    second, _, _ = true_case(4, law, other)
    train = first.of([*first.runs[:2], *second.runs[:1]])
    held_out = second.of(second.runs[1:3])
    told = groups(identify(train, law).model, train, held_out)
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
    stronger = replace(one, force=1.2 * one.force)
    told = inconsistent_runs(truth, first.of([stronger, *others]), first.of([]))
    assert f"largest in {one.name}" in told
    assert "throughout" not in told
