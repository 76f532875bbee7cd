"""Runs of two rigs are told apart from a rig that lacks an effect."""

from __future__ import annotations

import pytest

from bristle.diagnose.inconsistent_runs import groups
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
