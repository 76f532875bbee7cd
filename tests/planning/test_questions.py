"""What can be asked of tests: an effect that cannot is refused with the reason."""

from __future__ import annotations

import pytest

from bristle.diagnosis.effect_limits import NO_AMOUNT
from bristle.errors import StudyError
from bristle.model.model import Model
from bristle.physics.effect import EFFECTS
from bristle.planning.questions import refuse_unable

MODEL = Model("bingham", ("gas_spring",))


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("gas_sprin", 'there is no effect "gas_sprin"'),
        ("gas_spring", "is in the model already; --sharpen gas_spring"),
        ("base_friction", "cannot be seen: the law bingham holds it"),
    ],
)
def test_an_effect_that_cannot_be_asked_for_is_refused(name: str, told: str) -> None:
    with pytest.raises(StudyError, match=told):
        refuse_unable(name, ["coil_lag"], MODEL)


def test_an_effect_without_an_amount_is_refused_for_that(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(EFFECTS["stribeck"], "amount", "")
    with pytest.raises(StudyError, match=NO_AMOUNT):
        refuse_unable("stribeck", ["coil_lag"], MODEL)
    refuse_unable("coil_lag", ["coil_lag"], MODEL)
