"""The refitted model in a verdict: with its effect, or with the best where none explains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bristle.diagnosis import Diagnosis
from bristle.diagnosis.site_diagnosis import SiteDiagnosis
from bristle.diagnosis.trials import Trial
from bristle.model.model import Model

EMPTY = np.zeros(0)
BEFORE = Trial(Model("bingham", (), {"f_c": 1.0}), 5.0, 5.0, 1.0, EMPTY, EMPTY)
SPRING = replace(
    BEFORE, model=Model("bingham", ("gas_spring",), {"f_c": 1.2, "gas_spring.k": 40.0}), z=2.0
)


def verdict(kind: str, effects: tuple[str, ...], best: Trial) -> Diagnosis:
    """Return a verdict on a damper, with one trial."""
    model = best.model if effects else BEFORE.model
    found = SiteDiagnosis(
        "damper", kind, effects, 5.0, best.z, 0.6, float("nan"), model=model, trials=(best,),
        before=BEFORE, after=best,
    )  # fmt: skip
    return Diagnosis(kind, effects, ("Because.",), {"damper": found})


@pytest.mark.parametrize(
    ("kind", "effects"),
    [("effect", ("gas_spring",)), ("ambiguous", ("gas_spring", "duffing")), ("unknown", ())],
)
def test_the_refitted_model_is_in_the_verdict(kind: str, effects: tuple[str, ...]) -> None:
    told = verdict(kind, effects, SPRING).refined
    assert told == {"effects": ["gas_spring"], "values": {"f_c": 1.2, "gas_spring.k": 40.0}}


def test_nothing_is_told_where_no_effect_was_refitted() -> None:
    assert not verdict("none", (), SPRING).refined
    assert not verdict("unknown", (), replace(SPRING, refined=False)).refined
    assert not Diagnosis("insufficient", (), ("Too short.",)).refined
