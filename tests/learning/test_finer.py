"""A curve that is steep between its knots gets twice as many, where that is more than chance."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bristle.diagnosis.trials import Trial
from bristle.learning import fit
from bristle.learning.curve import Curve
from bristle.learning.fit import Fitted
from bristle.learning.signals import SLIP
from bristle.model.model import Model

CURVE = Curve("yield", "speed", (), (0.0, 0.1, 0.4), (0.0, 2.0, -1.0), held=(0, 2))
NONE = np.zeros(0)


def fitted(curve: Curve, z: float, loss: float) -> Fitted:
    return Fitted(
        curve, (0.0,) * len(curve.values), Trial(Model("bingham"), z, z, 0.1, NONE, NONE), loss
    )


def test_with_twice_the_knots_a_curve_is_the_same():
    finer = CURVE.finer()
    assert finer.knots == pytest.approx((0.0, 0.05, 0.1, 0.25, 0.4))
    assert finer.held == (0, 4)
    at = np.linspace(-0.1, 0.5, 61)
    same = np.interp(at, CURVE.knots, CURVE.values)
    np.testing.assert_allclose(np.interp(at, finer.knots, finer.values), same, atol=1e-12)
    assert replace(finer, knots=(), values=(), held=()) == replace(
        CURVE, knots=(), values=(), held=()
    )


@pytest.mark.parametrize(
    ("z", "share", "knots"),
    [(1.2, 0.8, 5), (1.2, 0.99, 3), (1.02, 0.8, 3)],
    ids=["it does better", "it does no better", "noise alone is left"],
)
def test_it_is_taken_where_it_does_better(
    monkeypatch: pytest.MonkeyPatch, z: float, share: float, knots: int
) -> None:
    def again(chosen: Any, *_: Any) -> list[Fitted]:
        return [fitted(one.curve, z, share * one.loss) for one in chosen]

    monkeypatch.setattr(fit, "_fitted", again)
    opened: Any = SimpleNamespace(
        before=fitted(CURVE, 3.0, 9.0).trial, searched=None, held_out=None
    )
    found = fit._finer(fitted(CURVE, z, 1.4), "learned_1", opened)
    assert len(found.curve.knots) == knots


def test_what_has_no_table_of_few_knots_is_left_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fit, "_fitted", lambda *_: pytest.fail("fitted"))
    many = tuple(np.linspace(0.0, 0.02, 65).tolist())
    for curve in (
        replace(CURVE, across="voltage", levels=(0.0, 5.0)),
        replace(CURVE, part=SLIP),
        replace(CURVE, along="displacement", knots=many, values=many),
    ):
        best = fitted(curve, 1.5, 2.0)
        opened: Any = SimpleNamespace(before=best.trial, searched=None, held_out=None)
        assert fit._finer(best, "learned_1", opened) is best
