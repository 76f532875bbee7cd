"""Which effects may join a study's model."""

from __future__ import annotations

from pathlib import Path

from ..data.model import StudyModel
from ..errors import StudyError
from ..findings import unknown
from ..physics.effect import AT, EFFECTS, exclude, laws_joined
from ..physics.laws import LAWS
from ..physics.user import waiting, why_left_out


def as_named_here(name: str, bench: bool) -> str:
    """Return the name that a study's model gives an effect: its site is told where it must be.

    NAME@SITE is an effect at another site than the one that its plain name means.
    """
    own, at, site = name.partition(AT)
    if not at or own not in EFFECTS or site not in EFFECTS[own].sites:
        return name
    if not bench:
        return EFFECTS[own].key(site)
    if site == "structure":
        raise StudyError(f"{name}: a test bench has no structure; {own} is that of the damper.")
    return own


def refuse_left_out(file: Path) -> None:
    """Refuse an effect or law of a user's own that was left out when its file was read.

    Raises
    ------
    TrustError
        If its code must not run yet.
    StudyError
        Saying what is wrong with the file, and where.
    """
    if untrusted := waiting(file):
        raise untrusted
    if why := why_left_out(file):
        raise StudyError(why)


def refuse_effect(model: StudyModel, name: str, bench: bool) -> None:
    """Refuse an effect that is not known, is in a model already, or cannot join it.

    Parameters
    ----------
    model : what it is to join
    name : as the model would name it
    bench : whether the model is of a damper on a bench

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
    if bench and effect.sites == ("structure",):
        raise StudyError(f"{name} acts in a structure, and on a test bench there is none.")
    at_damper = "damper" in effect.sites if bench else effect.site == "damper"
    if at_damper and not effect.joins(LAWS[model.base_law]):
        raise StudyError(
            f"{name} cannot join the law {model.law}; it joins {', '.join(laws_joined(effect))}."
        )
    for other in model.effects:
        if exclude(name, other):
            raise StudyError(f"{name} and {other} cannot be joined: undo the other one first.")
