"""What a plan asks of a damper on a bench: its model, effects beside it, rivals, open parts."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from ..diagnose.candidates import LONG, joinable, short_search
from ..diagnose.effect_limits import NO_AMOUNT, EffectLimit, limit_of
from ..diagnose.effect_size import Known as Fitted
from ..diagnose.effect_size import Sized
from ..diagnose.learned.along import ALONG
from ..diagnose.opening import Opening
from ..diagnose.resolved_size import SMALLEST, resolved
from ..errors import StudyError
from ..findings import unknown
from ..identify.fit import identify
from ..identify.model import Model, Problem
from ..identify.search_context import refine
from ..identify.start_grid import SearchContext, ranked_guesses
from ..physics.drive import DRIVES, VOLTAGE
from ..physics.effect import EFFECTS, exclude, plain_name
from ..physics.laws import laws_of
from ..progress import tell
from ..quantity import quantity
from .basis import USUAL, basis_along, ranges
from .knowledge import Question, Rival
from .rig_limits import RigLimits

AT = " or "
"""Between the names of two rivals."""

NONE = "none"
"""The rival that is the model as it is."""

TYPICAL = 1.0
"""Size of an effect, over that of a first guess, at which it is looked at where no run shows it."""


@dataclass(frozen=True)
class SizedRival:
    """An effect at a size, beside a model.

    `size` over that of a first guess; `least` the size below which the steps of the integration
    decide; `limit` what the runs at hand say of it, None where there are none.
    """

    sized: Sized
    size: float
    least: float
    limit: EffectLimit | None = None

    def rival(self) -> Rival:
        """Return it as a rival of the model without it."""
        found = self.sized.with_value(self.sized.value(self.size))
        return Rival(self.sized.name, found, self.sized.without())


def effects_beside(opened: Opening, names: Sequence[str] = ()) -> list[SizedRival]:
    """Return effects that could join a model, each at the size from which it would be named now.

    Parameters
    ----------
    opened : the model, fitted to the runs at hand
    names : of the effects; all that can join where empty

    Raises
    ------
    StudyError
        If there is no such effect, or it cannot join the model.
    """
    problem, model = opened.searched, opened.before.model
    able = able_beside(model, problem, opened.shown)
    for name in names:
        refuse_unable(name, able, model)
    fitted = opened.known(model)
    return [sized_rival(name, fitted) for name in names or able]


def sized_rival(name: str, fitted: Fitted) -> SizedRival:
    """Return an effect beside a model, at the size from which it would be named."""
    sized = Sized(name, fitted)
    least = resolved(sized, SMALLEST)
    if not fitted.held_out:
        return SizedRival(sized, TYPICAL, least)
    limit = limit_of(sized)
    at = limit.named or limit.largest
    size = sized.size_of(at) if at else TYPICAL
    return SizedRival(sized, size, least, limit)


def able_beside(model: Model, problem: Problem, shown: Sequence[str] = ()) -> list[str]:
    """Return the effects with a size that can join a damper's model."""
    channels = tuple(channel for channel in ("force",) if channel in shown)
    return [
        name
        for name in sorted(joinable(model, channels, problem))
        if EFFECTS[name].amount and not any(exclude(name, one) for one in model.effects)
    ]


def refuse_unable(name: str, able: Sequence[str], model: Model) -> None:
    """Refuse an effect that is not among those that can join a model.

    Raises
    ------
    StudyError
        Saying why.
    """
    if name not in EFFECTS:
        raise StudyError(unknown("effect", name, sorted(EFFECTS)))
    if name in model.effects:
        raise StudyError(f"{name} is in the model already; --sharpen {name} sharpens it.")
    if not EFFECTS[name].amount:
        raise StudyError(
            f"{name} cannot be planned for: {NO_AMOUNT}. These can: {', '.join(able)}."
        )
    if name not in able:
        raise StudyError(
            f"{name} cannot be seen beside the law {model.law}: the law holds it already, or it "
            f"acts elsewhere. These can: {', '.join(able)}."
        )


def law_rivals() -> list[str]:
    """Return the names of the laws that a damper's model may have in place of its own."""
    return [law.name for law in laws_of("damper")]


def refuse_no_rival(name: str) -> None:
    """Refuse a name of neither an effect, nor the law of a damper, nor the model as it is.

    Raises
    ------
    StudyError
        With the nearest names.
    """
    known = [*law_rivals(), *sorted(EFFECTS), NONE]
    if name not in known:
        raise StudyError(unknown("effect or law", name, known))


def rivals(opened: Opening, names: Sequence[str]) -> list[Question]:
    """Return questions whose rivals are each other: the model with one effect, or with another.

    Parameters
    ----------
    opened : the model, fitted to the runs at hand
    names : of effects, laws, or "none" for the model as it is; two or more

    Raises
    ------
    StudyError
        If fewer than two are given, or one is not known.
    """
    return rivals_of({name: _fitted(name, opened) for name in names})


def rivals_of(models: Mapping[str, Model]) -> list[Question]:
    """Return questions whose rivals are each other, one per model by name.

    Raises
    ------
    StudyError
        If there are fewer than two.
    """
    if len(models) < 2:
        raise StudyError("--separate needs two or more rivals, such as  --separate gas_spring none")
    asked: dict[str, list[Rival]] = {name: [] for name in models}
    for name, other in combinations(models, 2):
        pair = f"{name}{AT}{other}"
        asked[name].append(Rival(pair, models[other], models[name]))
        asked[other].append(Rival(pair, models[name], models[other]))
    return [Question(model, tuple(asked[name])) for name, model in models.items()]


def _fitted(name: str, opened: Opening) -> Model:
    """Return the model with an effect, or with another law, fitted to the training runs."""
    model, problem = opened.before.model, opened.searched
    if name == NONE:
        return model
    if name in law_rivals():
        return identify(problem, name, model.effects).model
    plain = plain_name(name)
    refuse_no_rival(plain)
    refuse_unable(plain, able_beside(model, problem, opened.shown), model)
    return fitted_with(plain, model, problem)


def fitted_with(name: str, model: Model, problem: Problem) -> Model:
    """Return a damper's model with one more effect, fitted to runs."""
    tell(f"fitting {name}")
    context = SearchContext(model, problem)
    found = short_search(name, context, ranked_guesses(name, context), False)
    return refine(found.model, problem, LONG)


def open_parts(
    model: Model, limits: RigLimits, names: Sequence[str] = (), drive: str = "voltage"
) -> Question:
    """Return the question what a part without a form does along coordinates.

    Parameters
    ----------
    model : the fitted model beside which it acts
    limits : of the rig, which say what a coordinate spans
    names : of the coordinates; the usual ones where empty
    drive : the channel of the command, as a study names it
    """
    able = ranges(limits)
    own = coordinates_of(names, able, limits, drive) or [name for name in USUAL if name in able]
    return Question(model, bases=tuple(basis_along(name, limits) for name in own))


def coordinates_of(
    names: Sequence[str], able: Collection[str], limits: RigLimits, drive: str
) -> list[str]:
    """Return the coordinates that are meant, as `ALONG` names them.

    Parameters
    ----------
    names : as they are asked for, those of the command by the name of the study's
    able : the coordinates that tests can cover
    limits : of the rig
    drive : the channel of the command

    Raises
    ------
    StudyError
        If one cannot be covered: there is none of that name, or the command does not move.
    """
    known = {name.replace(VOLTAGE.name, drive): name for name in able}
    found = []
    for name in names:
        own = known.get(name, name)
        if own not in able:
            plain = own.replace(drive, VOLTAGE.name)
            held = limits.command[0] == limits.command[1]
            if held and plain in ALONG and "V" in ALONG[plain].needs:
                level = quantity(limits.command[0], DRIVES[drive].unit)
                raise StudyError(
                    f"nothing can be learned along {name}: the {drive} does not move, it is "
                    f"{level} throughout. Where the rig can move it, a rig.toml says so with "
                    "command in [limits]."
                )
            raise StudyError(unknown("coordinate", name, sorted(known)))
        found.append(own)
    return found
