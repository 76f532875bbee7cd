"""A fit that is watched: errors never rise, the last is that of the result, no bit changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from known_runs import bench_run, truth_of

from bristle.core.progress import watched_by
from bristle.data.left_out import MISSING
from bristle.identification import error_table, watch
from bristle.identification.error_table import error_table as error_table_error_table
from bristle.identification.fit import Fit, fit, fit_from_starts
from bristle.identification.problem import Problem
from bristle.identification.search import z_of
from bristle.identification.watch import LAW, MODEL, series, watched
from bristle.model.model import Model

Seen = list[Mapping[str, Any]]


@pytest.fixture(scope="module")
def problem() -> Problem:
    part = slice(0, 1200)
    return Problem([bench_run("bingham", truth_of("bingham"), seed).of(part) for seed in (1, 2)])


@pytest.fixture
def every_step(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watch, "EVERY", 0.0)


def start() -> Model:
    truth = truth_of("bingham")
    return Model("bingham", (), {name: 1.6 * value for name, value in truth.items()})


def same(one: Fit, other: Fit) -> bool:
    return (
        one.model.values == other.model.values
        and one.std == other.std
        and one.cost == other.cost
        and np.array_equal(one.covariance, other.covariance)  # type: ignore[arg-type]
    )


@pytest.mark.usefixtures("every_step")
def test_errors_never_rise_and_the_last_is_that_of_the_result(problem: Problem) -> None:
    seen: Seen = []
    expected = problem.expectation(start())
    with watched_by(seen.append), series(MODEL):
        found = fit(problem, start(), expectation=expected, with_std=False)
    assert len(seen) > 3
    (errors,) = seen[-1]["errors"]
    assert errors == [one["z"] for one in seen]
    assert all(after < before for before, after in pairwise(errors))
    assert [one["step"] for one in seen] == list(range(len(seen)))
    last = seen[-1]
    assert last["z"] == z_of(found.cost)
    assert {name: value for name, value, _ in last["parameters"]} == {
        name: found.model.value(name) for name in found.model.free()
    }
    error = [(run.force - problem.predict(found.model, run))[run.skip :] for run in problem.runs]
    force = np.concatenate([run.force[run.skip :] for run in problem.runs])
    share = np.linalg.norm(np.concatenate(error)) / np.linalg.norm(force)
    assert last["share"] == pytest.approx(share, rel=1e-9)


@pytest.mark.usefixtures("every_step")
def test_loops_are_what_was_measured_and_what_the_model_predicts(problem: Problem) -> None:
    seen: Seen = []
    with watched_by(seen.append), series(MODEL, "damper"):
        found = fit(problem, start(), with_std=False)
    assert (seen[-1]["series"], seen[-1]["name"], seen[-1]["law"]) == (
        "model damper", "damper", "bingham"
    )  # fmt: skip
    forces = {run.name: (run.force, problem.predict(found.model, run)) for run in problem.runs}
    for loop in seen[-1]["loops"]:
        sizes = {len(loop[k]) for k in ("displacement", "velocity", "measured", "model")}
        assert len(sizes) == 1
        assert max(sizes) <= watch.POINTS
        measured, model = forces[loop["run"]]
        rows = [int(np.argmin(np.abs(measured - value))) for value in loop["measured"]]
        assert np.array(loop["model"]) == pytest.approx(model[rows], rel=1e-4)
        assert min(loop["velocity"]) < 0.0 < max(loop["velocity"])
    assert 1 <= len(seen[-1]["loops"]) <= watch.CYCLES


@pytest.mark.usefixtures("every_step")
def test_a_fit_is_the_same_to_the_last_bit_whether_it_is_watched_or_not(problem: Problem) -> None:
    alone = fit_from_starts(problem, Model("bingham"), starts=2)
    seen: Seen = []
    with watched_by(seen.append), series(MODEL):
        found = fit_from_starts(problem, Model("bingham"), starts=2)
    assert same(alone, found)
    assert {one["search"] for one in seen} == {1, 2, 3, 4}  # two starts, then the polish


@pytest.mark.usefixtures("every_step")
@pytest.mark.parametrize(
    "enough", [error_table.ENOUGH, 400]
)  # all samples, then a part of them first
def test_laws_side_by_side_are_each_told_of_and_end_with_their_best(
    problem: Problem, enough: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(error_table, "ENOUGH", enough)
    laws = ("bingham", "tanh", "bingham_standard")
    alone = error_table_error_table(problem, None, laws=laws, starts=2)
    seen: Seen = []
    with watched_by(seen.append):
        found = error_table_error_table(problem, None, laws=laws, starts=2)
    assert [row.as_dict() | {"holdout": 0} for row in found] == [
        row.as_dict() | {"holdout": 0} for row in alone
    ]
    for row in found:
        own = [one for one in seen if one["name"] == row.law]
        assert {one["kind"] for one in own} == {LAW}
        assert own[-1]["z"] is None
        assert own[-1]["share"] == row.error_train.share
        for errors in own[-1]["errors"]:
            assert all(after < before for before, after in pairwise(errors))


def test_few_steps_are_told_a_second_but_each_end_is(
    problem: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(watch.time, "monotonic", lambda: 100.0)  # no time passes
    seen: Seen = []
    with watched_by(seen.append), series(MODEL):
        for _ in range(2):
            found = fit(problem, start(), with_std=False)
    assert [(one["search"], one["step"] > 0) for one in seen] == [(1, False), (1, True), (2, True)]
    assert seen[-1]["z"] == z_of(found.cost)


def test_without_a_watcher_or_outside_of_a_series_a_fit_is_told_nothing_to(
    problem: Problem,
) -> None:
    seen: Seen = []
    with series(MODEL), watched(problem, lambda _: start(), lambda _: 0.0) as accepted:
        assert accepted is None
    with (
        watched_by(seen.append),
        watched(problem, lambda _: start(), lambda _: 0.0) as accepted,
    ):
        assert accepted is None
    assert not seen


@pytest.mark.usefixtures("every_step")
def test_samples_that_were_not_measured_are_neither_drawn_nor_counted(problem: Problem) -> None:
    lost = np.ones(1200, dtype=bool)
    lost[400:] = False
    runs = [
        replace(run, left_out={MISSING: ~lost}, force=np.where(lost, run.force, 1e6))
        for run in problem.runs
    ]
    holed = Problem(runs)
    seen: Seen = []
    with watched_by(seen.append), series(MODEL):
        fit(holed, start(), with_std=False)
    assert all(np.max(np.abs(loop["measured"])) < 1e6 for loop in seen[-1]["loops"])
    told = {name: value for name, value, _ in seen[-1]["parameters"]}
    model = Model("bingham", (), {**start().values, **told})
    part = [slice(run.skip, 400) for run in runs]
    off = np.concatenate(
        [(run.force - holed.predict(model, run))[one] for run, one in zip(runs, part, strict=True)]
    )
    force = np.concatenate([run.force[one] for run, one in zip(runs, part, strict=True)])
    share = np.linalg.norm(off) / np.linalg.norm(force)
    assert seen[-1]["share"] == pytest.approx(share, rel=1e-9)
