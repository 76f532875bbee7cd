"""Which coordinate is named for what no effect explains."""

from __future__ import annotations

import numpy as np
import pytest

from bristle.compare.patterns import LEVEL, ResidualPattern
from bristle.diagnose import remaining_residual
from bristle.diagnose.conclusion import About, conclude
from bristle.diagnose.finding import Finding
from bristle.diagnose.remaining_residual import most_telling
from bristle.diagnose.rule import BENCH

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
        monkeypatch.setattr(remaining_residual, "ringing", lambda trial, held_out: share)

    answer(0.0)
    return answer


def test_a_significant_place_is_named_before_one_that_tells_little_more(rings):
    found = [pattern("rest", 0.20, sure=False), pattern("speed", 1.1 * BENCH.half * 0.20)]
    assert most_telling(found, None, None) == "speed"


def test_not_before_one_that_tells_far_more(rings):
    found = [pattern("rest", 0.26, sure=False), pattern("acceleration", 0.9 * BENCH.half * 0.26)]
    assert most_telling(found, None, None) == "rest"


def test_what_rings_and_follows_nothing_else_clearly_has_a_frequency(rings):
    found = [pattern("speed", 0.9 * BENCH.clear)]
    assert most_telling(found, None, None) == "speed"
    rings(1.1 * BENCH.rings)
    assert most_telling(found, None, None) == "frequency"
    assert most_telling([pattern("displacement", 1.1 * BENCH.clear)], None, None) == "displacement"


def test_what_rings_after_each_reversal_has_a_frequency(rings):
    found = [pattern("time_since_reversal", 1.1 * BENCH.clear)]
    assert most_telling(found, None, None) == "time_since_reversal"
    rings(1.1 * BENCH.rings)
    assert most_telling(found, None, None) == "frequency"


def test_nothing_is_named_where_there_is_no_place(rings):
    assert most_telling([], None, None) == ""


@pytest.mark.parametrize(
    ("driven", "kind", "doubted"),
    [(False, "unknown", True), (False, "none", False), (True, "unknown", False)],
)
def test_a_drive_that_nobody_recorded_leaves_a_doubt(driven, kind, doubted):
    shown = Finding("damper", kind, (), 2.0, 2.0, 0.0, 0.01, reasons=("Something.",))
    found = conclude({"damper": shown}, About(driven=driven))
    assert ("Neither voltage nor current" in found.words) is doubted
