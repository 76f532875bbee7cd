"""All laws against the runs of a study: how each does, and a model brought to another law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ..data.checks.levels import tells_a_bend
from ..data.model import StudyModel, new_model
from ..errors import StudyError
from ..findings import command
from ..identify.model import Model
from ..identify.rig import DAMPER, Rig
from ..physics.effect import EFFECTS
from ..physics.forms import LINEAR_FORM, split_form
from ..physics.laws import DEFAULT, base_and_variant
from ..progress import tell
from .runs import Runs
from .settings import ALL
from .study import Study

if TYPE_CHECKING:
    from ..diagnose.law_trials import LawTrial


def refuse_in_building(law: str | None, in_building: bool) -> None:
    """Refuse to compare all laws, without their effects, on a rig that is no test bench.

    Raises
    ------
    StudyError
        If all laws were asked for and the damper is in a building.
    """
    if law == ALL and in_building:
        raise StudyError(
            "identify compares all laws on a test bench alone: in a building the law decides "
            "which samples its fit and z take. Name one law, or let diagnose seek it "
            "with its effects (--law all)."
        )


def law_or_all(study: Study, law: str | None) -> str | None:
    """Return what was asked for; where nothing was, "all" as long as nobody chose a law.

    A study that was made without a law begins with a stand-in. Once its model has another law, or
    an effect, that is what somebody or a verdict chose.
    """
    if law is not None or study.settings.law != ALL or study.settings.has_building:
        return law
    model = study.model()
    return None if model.law != DEFAULT or model.effects else ALL


def all_laws(rig: Rig, runs: Runs, present: Model) -> tuple[LawTrial, ...]:
    """Return how every law does on a bench, the best on held-out runs first.

    Parameters
    ----------
    rig : the bench with its runs
    runs : the measurements that it was made of, whose command decides on quadratic forms
    present : the model as it is; each law has those of its effects that can join it

    Raises
    ------
    StudyError
        If the rig is a building.
    """
    from ..diagnose.law_trials import try_laws  # takes long: most identify one law

    refuse_in_building(ALL, rig.building is not None)
    tell("trying every law")
    site = rig.sites(present)[DAMPER]
    held_out = site.train if site.holdout is None else site.holdout
    return try_laws(site.train, held_out, present, bends=tells_a_bend(runs.train))


def left_out_notes(rig: Rig, present: Model) -> tuple[str, ...]:
    """Return the sentence that tells which laws `all_laws` leaves out, none where it tries all.

    Parameters
    ----------
    rig : the bench with its runs
    present : the model as it is
    """
    from ..diagnose.law_text import left_out
    from ..diagnose.law_trials import not_finite

    unfit = not_finite(rig.sites(present)[DAMPER].train, present)
    return (left_out(unfit),) if unfit else ()


def with_law(model: StudyModel, law: str) -> StudyModel:
    """Return a model with another law, such as "lugre[quadratic]", and the effects that can join.

    Raises
    ------
    PhysicsError
        If there is no such law.
    """
    base, _ = base_and_variant(law)
    kept = {
        name: values
        for name, values in model.effects.items()
        if base.site not in EFFECTS[name].sites or EFFECTS[name].joins(base)
    }
    return replace(new_model(law, (), model.building, model.drive), effects=kept)


def law_command(folder: object, law: str, *others: str) -> str:
    """Return the command that identifies a study's model with a law, in the law's form."""
    plain, form, _ = split_form(law)
    words: Sequence[str] = ("--command", form) if form not in ("", LINEAR_FORM) else ()
    return command("identify", folder, "--law", plain, *words, *others)
