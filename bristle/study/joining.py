"""Which effects may join a study's model."""

from __future__ import annotations

from ..data.model import StudyModel
from ..errors import StudyError
from ..findings import unknown
from ..physics.effect import EFFECTS, laws_joined
from ..physics.laws import LAWS


def refuse_effect(model: StudyModel, name: str) -> None:
    """Refuse an effect that is not known, is in a model already, or cannot join it.

    Raises
    ------
    StudyError
        Saying which of these it is, and what would be right.
    """
    if name not in EFFECTS:
        raise StudyError(unknown("effect", name, sorted(EFFECTS)))
    effect = EFFECTS[name]
    if name in model.effects:
        raise StudyError(f"{name} is in the model already.")
    if effect.site == "damper" and not effect.joins(LAWS[model.base_law]):
        raise StudyError(
            f"{name} cannot join the law {model.law}; it joins {', '.join(laws_joined(effect))}."
        )
    for other in model.effects:
        if other in effect.excludes or name in EFFECTS[other].excludes:
            raise StudyError(f"{name} and {other} cannot be joined: undo the other one first.")
