"""Which coordinate is named for what no effect explains."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bristle.comparison.patterns import LEVEL, ResidualPattern
from bristle.data.left_out import MISSING
from bristle.diagnosis import remaining
from bristle.diagnosis.conclusion import VerdictContext, conclude
from bristle.diagnosis.remaining import most_telling, patterns_of, ringing
from bristle.diagnosis.rule import BENCH
from bristle.diagnosis.site_diagnosis import SiteDiagnosis
from bristle.identification.problem import Problem, Run

NONE = np.zeros(0)


def pattern(coordinate: str, share: float, sure: bool = True) -> ResidualPattern:
    p = 0.1 * LEVEL if sure else 10.0 * LEVEL
    return ResidualPattern(
        coordinate, False, share, share, p, share, 0.0, NONE, NONE, NONE, NONE, NONE
    )


@pytest.fixture
def rings(monkeypatch: pytest.MonkeyPatch):
    """Return what sets the share of a residual's power in a narrow band."""

    def answer(share: float) -> None:
        monkeypatch.setattr(remaining, "ringing", lambda trial, held_out: share)

    answer(0.0)
    return answer


def test_a_significant_place_is_named_before_one_that_tells_little_more(rings):
    found = [pattern("rest", 0.20, sure=False), pattern("speed", 1.1 * BENCH.pattern_share * 0.20)]
    assert most_telling(found, None, None) == "speed"


def test_not_before_one_that_tells_far_more(rings):
    found = [
        pattern("rest", 0.26, sure=False),
        pattern("acceleration", 0.9 * BENCH.pattern_share * 0.26),
    ]
    assert most_telling(found, None, None) == "rest"


def test_what_rings_and_follows_nothing_else_clearly_has_a_frequency(rings):
    found = [pattern("speed", 0.9 * BENCH.clear)]
    assert most_telling(found, None, None) == "speed"
    rings(1.1 * BENCH.resonance_share)
    assert most_telling(found, None, None) == "frequency"
    assert most_telling([pattern("displacement", 1.1 * BENCH.clear)], None, None) == "displacement"


def test_what_rings_after_each_reversal_has_a_frequency(rings):
    found = [pattern("time_since_reversal", 1.1 * BENCH.clear)]
    assert most_telling(found, None, None) == "time_since_reversal"
    rings(1.1 * BENCH.resonance_share)
    assert most_telling(found, None, None) == "frequency"


@pytest.mark.parametrize("steps", [(0.002, 0.002), (0.002, 0.005), (0.005, 0.002)])
def test_a_residual_rings_at_the_rate_of_each_run(steps):
    runs, left = zip(*(_rung(dt) for dt in steps), strict=True)
    trial = SimpleNamespace(residual=np.concatenate(left))
    assert ringing(trial, Problem(list(runs))) == pytest.approx(0.86, abs=0.01)


def _rung(dt: float) -> tuple[Run, np.ndarray]:
    """Return a run of a sine of 2 Hz, and a residual that rings at 60 Hz with noise on it."""
    t = np.arange(0.0, 16.0, dt)
    v = np.cos(2.0 * np.pi * 2.0 * t)
    noise = 0.3 * np.random.default_rng(0).standard_normal(len(t))
    run = Run("r", dt, v, v, v, v, v, 1.0, np.zeros((0, len(t), 4)), skip=0)
    return run, np.sin(2.0 * np.pi * 60.0 * t) + noise


def test_samples_that_were_not_measured_make_no_pattern_smaller():
    t = np.arange(0.0, 16.0, 0.002)
    x, v = np.sin(2.0 * t), 2.0 * np.cos(2.0 * t)
    lost = np.abs(x) > 0.8
    noise = np.random.default_rng(0).standard_normal(len(t))
    left = np.where(lost, 0.0, 3.0 * x + noise)
    run = Run(
        "r", 0.002, x, v, x, v, v, 1.0, np.zeros((0, len(t), 4)), skip=0, left_out={MISSING: lost}
    )
    found = patterns_of(SimpleNamespace(residual=left), Problem([run]))
    along = next(one for one in found if one.coordinate == "displacement")
    assert np.abs(along.centre).max() < 0.8
    assert along.mean == pytest.approx(3.0 * along.centre, abs=0.3)


def test_nothing_is_named_where_there_is_no_place(rings):
    assert most_telling([], None, None) == ""


@pytest.mark.parametrize(
    ("driven", "kind", "doubted"),
    [(False, "unknown", True), (False, "none", False), (True, "unknown", False)],
)
def test_a_drive_that_nobody_recorded_leaves_a_doubt(driven, kind, doubted):
    shown = SiteDiagnosis("damper", kind, (), 2.0, 2.0, 0.0, 0.01, reasons=("Something.",))
    found = conclude({"damper": shown}, VerdictContext(driven=driven))
    assert ("changed during the runs, and was not recorded" in found.words) is doubted
