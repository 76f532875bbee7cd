"""A load cell's low-pass is told from a plain delay, with its corner."""

from __future__ import annotations

import numpy as np
import pytest

from bristle.diagnose.candidates import Trial
from bristle.diagnose.finding import Finding
from bristle.diagnose.low_pass import low_pass_text
from bristle.identify.fit import Model


def late(time: float, share: float, kind: str = "effect") -> Finding:
    values = {"delay.time": time, "delay.filtered": share}
    model = Model("bingham", ("delay",), values)
    trial = Trial(model, 1.0, 1.0, 1.0, np.ones(10), np.ones(10))
    return Finding(
        "damper", kind, ("delay",), 2.0, 1.0, 1.0, 0.01, "", model, (trial,), trial, trial
    )


def test_a_filter_is_told_with_its_corner():
    """Two lags of tau have 1/(1 + (w tau)^2) = 1/sqrt(2) at w = 0.6436/tau."""
    text = low_pass_text(late(0.010, 1.0))
    assert "10 ms" in text
    corner = 0.6436 / (2.0 * np.pi * 0.005)
    assert corner == pytest.approx(20.5, abs=0.1)
    assert f"{corner:.2g} Hz" in text


@pytest.mark.parametrize(
    "found", [late(0.010, 0.3), late(0.0, 1.0), late(0.010, 1.0, kind="unknown")]
)
def test_a_delay_is_no_filter(found):
    assert low_pass_text(found) == ""
