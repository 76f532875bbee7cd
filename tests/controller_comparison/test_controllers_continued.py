"""A comparison that was interrupted goes on: its ensembles keep the runs that were done."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from bristle.campaign import campaign
from bristle.campaign.campaign import RunOutcome
from bristle.controller_comparison import Spread, compare_controllers

MOTION = "el_centro_1940_ns,peak=0.4g,factor=0.45,stop=2,label=weak"
LEVELS, MEMBERS = 3, 2
RUNS = LEVELS + 4 * MEMBERS
"""Constant voltages, and members of these three and of the controller."""


def compared(out: Path) -> Any:
    return compare_controllers(
        [MOTION], ["Skyhook"], grid=LEVELS, spread=Spread(MEMBERS), workers=1, out=out
    )


@pytest.mark.slow  # two comparisons: the second goes on
def test_an_interrupted_comparison_makes_no_run_of_its_ensembles_twice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = [0]
    most = [6]
    own = campaign.run_local

    def counted(*given: Any) -> Iterator[RunOutcome]:
        for outcome in own(*given):
            if made[0] == most[0]:
                raise KeyboardInterrupt
            made[0] += 1
            yield outcome

    monkeypatch.setattr(campaign, "run_local", counted)
    with pytest.raises(KeyboardInterrupt):
        compared(tmp_path)
    assert made == [6]
    made[0], most[0] = 0, RUNS
    continued = compared(tmp_path)
    assert made == [RUNS - 6]
    made[0] = 0
    anew = compared(tmp_path)  # the last one came to its end: nothing is taken over
    assert made == [RUNS]
    pd.testing.assert_frame_equal(continued.worst, anew.worst)
    pd.testing.assert_frame_equal(continued.table, anew.table)
