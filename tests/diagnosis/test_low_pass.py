"""A load cell's low-pass is told from a plain delay, with its corner."""

from __future__ import annotations

from collections import namedtuple
from math import sqrt
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import cont2discrete

from bristle.diagnosis.load_cell import low_pass_text
from bristle.diagnosis.site_diagnosis import SiteDiagnosis
from bristle.diagnosis.trials import Trial
from bristle.model.model import Model
from bristle.physics.effects.delay import Delay


def late(time: float, share: float, kind: str = "effect", damping: float = 1.0) -> SiteDiagnosis:
    values = {"delay.time": time, "delay.filtered": share, "delay.damping": damping}
    model = Model("bingham", ("delay",), values)
    trial = Trial(model, 1.0, 1.0, 1.0, np.ones(10), np.ones(10))
    return SiteDiagnosis(
        "damper", kind, ("delay",), 2.0, 1.0, 1.0, 0.01, "", model, (trial,), trial, trial
    )


def test_a_filter_is_told_with_its_corner():
    """Two lags of tau have 1/(1 + (w tau)^2) = 1/sqrt(2) at w = 0.6436/tau."""
    text = low_pass_text(late(0.010, 1.0))
    assert "10 ms" in text
    corner = 0.6436 / (2.0 * np.pi * 0.005)
    assert corner == pytest.approx(20.5, abs=0.1)
    assert f"{corner:.2g} Hz" in text


def test_the_corner_of_butterworths_filter_is_its_natural_frequency():
    """Its delay at low frequency is 2 d/w, and at w half the power is left."""
    d, corner = sqrt(0.5), 25.0
    text = low_pass_text(late(2.0 * d / (2.0 * np.pi * corner), 1.0, damping=d))
    assert "damping ratio 0.71" in text
    assert "near 25 Hz" in text


@pytest.mark.parametrize("damping", [1.0, 0.8, 0.5])
def test_the_filter_is_that_of_second_order(damping):
    """Against the exact discretisation of its two states for a force that is held."""
    dt, time, names = 1e-3, 0.02, list(Delay.states)
    w = 2.0 * damping / time
    A, B = np.array([[0.0, 1.0], [-w * w, -2.0 * damping * w]]), np.array([[0.0], [w * w]])
    step, gain, *_ = cont2discrete((A, B, np.eye(2), np.zeros((2, 1))), dt)
    record = namedtuple("record", names)
    z, exact = record(*[0.0] * len(names)), np.zeros(2)
    p = SimpleNamespace(time=time, filtered=1.0, damping=damping)
    for value in np.random.default_rng(1).normal(size=200).tolist():
        z = record(*Delay.advance(SimpleNamespace(value=value, dt=dt), z, p))
        exact = step @ exact + gain[:, 0] * value
        assert z.low == pytest.approx(exact[0], abs=1e-12)


@pytest.mark.parametrize(
    "found", [late(0.010, 0.3), late(0.0, 1.0), late(0.010, 1.0, kind="unknown")]
)
def test_a_delay_is_no_filter(found):
    assert low_pass_text(found) == ""
