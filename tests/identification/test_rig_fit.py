"""What sites that share a parameter say of it together."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest

from bristle.identification.fit import Fit
from bristle.identification.rig_fit import RigFit
from bristle.model.model import Model

NAME = "storey_softening.d_half"


def of(*found: tuple[float, float]) -> RigFit:
    """Return the fits of storeys with a value and its standard deviation each."""
    fits = {}
    for number, (value, std) in enumerate(found, 1):
        model = Model("linear_storey", ("storey_softening",), {NAME: value})
        variance = np.array([[std**2 if np.isfinite(std) else 0.0]])
        fits[f"storey{number}"] = Fit(model, {NAME: std}, 0.0, covariance=variance)
    return RigFit(fits, {})


def whole(*found: tuple[float, float]) -> Fit:
    return of(*found).whole(Model("lugre", ("storey_softening",), {NAME: 0.0}))


def test_the_mean_counts_each_storey_by_its_certainty() -> None:
    both = whole((1.0, 0.1), (3.0, 0.2))
    assert both.model.value(NAME) == pytest.approx((1.0 * 4.0 + 3.0) / 5.0)
    assert both.std[NAME] == pytest.approx((0.1**-2 + 0.2**-2) ** -0.5)
    assert both.covariance is not None
    assert both.covariance[0, 0] == pytest.approx(both.std[NAME] ** 2)


@pytest.mark.parametrize("std", [0.0, 1e-200])
def test_a_value_without_an_error_stands_alone(std: float) -> None:
    assert whole((1.0, std)).std[NAME] == std
    both = whole((1.0, std), (3.0, 0.2))
    assert both.model.value(NAME) == 1.0
    assert both.std[NAME] == pytest.approx(std, abs=1e-100)
    assert np.isfinite(both.covariance).all()


def test_values_that_nothing_tells_count_alike() -> None:
    both = whole((1.0, inf), (3.0, inf))
    assert both.model.value(NAME) == 2.0
    assert both.std[NAME] == inf
    told = whole((1.0, inf), (3.0, 0.2))
    assert told.model.value(NAME) == 3.0
    assert told.std[NAME] == 0.2
