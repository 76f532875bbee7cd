"""A single run is split where both parts are long enough for a fit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from made import bench_run, write

from bristle.identification.prepare import prepare
from bristle.study import Study


def study_of(folder: Path, samples: int, gaps: Sequence[tuple[int, int]] = ()) -> Study:
    """Return a study of one run in which some samples are lost."""
    there = np.ones(samples, dtype=bool)
    for begin, end in gaps:
        there[begin:end] = False
    columns = {name: values[:samples][there] for name, values in bench_run(1).items()}
    return Study.create(folder / "rig", [write(folder / "run.csv", columns)], law="bingham")


@pytest.mark.parametrize(
    ("samples", "gaps", "train", "holdout"),
    [
        (1446, [(1000, 1006)], [1000], [440]),  # 70 % is 8 samples behind the gap
        (1446, [(1015, 1021)], [1015], [425]),  # and here 7 before it
        (1000, [(300, 306)], [300, 396], [313]),
        (500, [], [300], [215]),
        (1000, [], [700], [315]),
    ],
)
def test_no_part_is_too_short_for_a_fit(tmp_path: Path, samples, gaps, train, holdout):
    runs = study_of(tmp_path, samples, gaps).runs()
    assert [len(run.time) for run in runs.train] == train
    assert [len(run.time) for run in runs.holdout] == holdout
    for run in runs.all:
        prepare(run)


def test_the_share_that_is_held_out_is_told(tmp_path: Path):
    runs = study_of(tmp_path, 500).runs()
    assert [run.name for run in runs.all] == ["run, first 60%", "run, last 40%"]
    assert "the last 40 % held out" in runs.notes[0]


def test_the_end_of_the_first_part_leads_into_what_is_held_out(tmp_path: Path):
    train, holdout = study_of(tmp_path, 1000).runs().all
    lead = prepare(holdout).skip
    np.testing.assert_array_equal(holdout["force"][:lead], train["force"][-lead:])
    assert holdout.time[lead] - train.time[-1] == pytest.approx(train.step)


def test_a_run_that_is_too_short_for_both_is_cut_at_70_percent(tmp_path: Path):
    assert [len(run.time) for run in study_of(tmp_path, 300).runs().all] == [210, 105]
