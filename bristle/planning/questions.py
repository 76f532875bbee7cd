"""What a plan asks of a damper on a bench, and for what purpose."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from math import inf, log

import numpy as np

from ..core.progress import tell
from ..core.text import command, quantity, short_z, unknown
from ..diagnosis.effect_limits import NO_AMOUNT, EffectLimit, limit_of
from ..diagnosis.effect_size import SMALLEST, Sized, SizeSearch, named_distance, resolved
from ..diagnosis.prepared import Prepared
from ..diagnosis.rule import BENCH, DecisionRule
from ..diagnosis.trials import LONG, joinable, short_search
from ..errors import StudyError
from ..identification.fit import fit_from_starts
from ..identification.problem import Problem, Run
from ..identification.start_grid import SearchContext, ranked_guesses, refine
from ..learning.signals import ALONG
from ..model.model import Model
from ..physics.drive import DRIVES, VOLTAGE
from ..physics.effect import EFFECTS, exclude, plain_name
from ..physics.laws import laws_of
from ..study.changes import behind_data
from ..study.study import Study
from .information import (
    USUAL,
    Goal,
    Information,
    PreparedQuestion,
    Question,
    Rival,
    basis_along,
    ranges,
)
from .limits import RigLimits

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


def effects_beside(opened: Prepared, names: Sequence[str] = ()) -> list[SizedRival]:
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


def sized_rival(name: str, fitted: SizeSearch) -> SizedRival:
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


def rivals(opened: Prepared, names: Sequence[str]) -> list[Question]:
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


def _fitted(name: str, opened: Prepared) -> Model:
    """Return the model with an effect, or with another law, fitted to the training runs."""
    model, problem = opened.before.model, opened.searched
    if name == NONE:
        return model
    if name in law_rivals():
        return fit_from_starts(problem, Model(name, model.effects)).model
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


# What a plan is for: figures that are to become small, from what runs say of questions.
#
# - separate: how far rival models are apart, once each is fitted again;
# - see: from what size an effect is named;
# - sharpen: standard deviations of parameters;
# - learn: how well a part without a form is held along its coordinates.


ENOUGH = 3.0
"""How many times as far apart as a verdict asks rivals are of no more use."""

SMALL = 0.0003
"""Share of its size to which a parameter need not be known better."""

SEEN = 0.003
"""Size, over that of a first guess, from which an effect that is seen is of no more use."""

HELD = 1e-3
"""Standard deviation of a curve, or of a force, over noise, from which less is of no more use."""

HIDDEN = 1e6
"""What is not seen at all costs as much as a figure so many times what is enough."""

LEAST = 1e-3
"""Share of an effect's change that must be left; below that it is the error of sensitivities."""


@dataclass(frozen=True)
class AskedFigure:
    """A number that a plan makes smaller.

    `purpose` "separate", "see", "sharpen" or "learn"; `name` of effect, pair,
    parameter or coordinate; `value` of it, in `unit`; `enough` what need not be less.
    """

    purpose: str
    name: str
    value: float
    enough: float

    @property
    def cost(self) -> float:
        """What a plan is to make small: the logarithm, no more than flat below what is enough."""
        return log(min(max(self.value / self.enough, 1.0), HIDDEN))


def seen(
    known: Information, rule: DecisionRule = BENCH, least: Mapping[str, float] | None = None
) -> list[AskedFigure]:
    """Return from what size each effect would be named, over the size that was asked for.

    Parameters
    ----------
    known : what runs say
    rule : the numbers that decide
    least : by effect, the size over the one asked for below which the integration's steps decide:
        no test shows less
    """
    least = least or {}
    held_out = known.told.held_out
    wanted = named_distance(known.told.samples, held_out, rule) if held_out else inf
    left, kept = known.distances(), known.kept()
    return [
        AskedFigure(
            "see", name,
            wanted / left[name] if kept[name] > LEAST and left[name] > 0.0 else inf,
            max(SEEN, least.get(name, 0.0)),
        )
        for name in left
    ]  # fmt: skip


def separated(known: Sequence[Information], rule: DecisionRule = BENCH) -> list[AskedFigure]:
    """Return by how much rivals are too near to be told apart: 1 where a verdict just can."""
    apart: dict[str, float] = {}
    for one in known:
        for name, distance in one.distances().items():
            apart[name] = min(apart.get(name, inf), distance)
    return [
        AskedFigure(
            "separate", name, rule.separating_sigma / distance if distance else inf, 1.0 / ENOUGH
        )
        for name, distance in apart.items()
    ]


def sharpened(known: Information, names: Sequence[str]) -> list[AskedFigure]:
    """Return the standard deviation of each parameter, over its size."""
    found = known.deviations()
    return [AskedFigure("sharpen", name, found[name], SMALL) for name in names or found]


def learned(known: Information) -> list[AskedFigure]:
    """Return how well a part without a form is held: over all the rig can do, or by coordinate."""
    if known.typical is not None:
        return [AskedFigure("learn", "force", known.of_force(), HELD)]
    return [
        AskedFigure("learn", name, float(np.sqrt(np.mean(spread**2))), HELD)
        for name, spread in known.of_bases().items()
    ]


def cost_of(figures: Sequence[AskedFigure]) -> float:
    """Return what a plan is to make small: the mean of each purpose's figures, of all purposes."""
    purposes = {one.purpose for one in figures}
    parts = [float(np.mean([f.cost for f in figures if f.purpose == one])) for one in purposes]
    return float(np.mean(parts)) if parts else 0.0


# The goal of a plan: its purposes as questions, and the figures that it is judged by.

DRAWN = 2
"""Further values of the parameters at which a plan is judged: it holds beside the fitted ones."""

UNSURE = 0.02
"""Standard deviation of a parameter, over its size, from which that is worth its cost."""


@dataclass(frozen=True)
class RunsAtHand:
    """The runs at hand; none of them before the first measurement."""

    train: Sequence[Run] = ()
    held_out: Sequence[Run] = ()


@dataclass(frozen=True)
class Purposes:
    """What a plan is for; a purpose that is not asked is empty.

    `effects` to be seen; `rivals` questions whose rivals are each other; `parameters` to be
    sharpened; `parts` the question with a part without a form, None where nothing is to be learned;
    `rule` the numbers that decide there; `drive` the channel of the command, "" for none.
    """

    model: Model
    effects: tuple[SizedRival, ...] = ()
    rivals: tuple[Question, ...] = ()
    parameters: tuple[str, ...] = ()
    parts: Question | None = None
    rule: DecisionRule = BENCH
    drive: str = ""

    @property
    def judged(self) -> bool:
        """Whether a verdict is asked for."""
        return bool(self.effects or self.rivals)

    def questions(self) -> list[Question]:
        """Return the questions, in the order in which `figures` takes them."""
        rivals = tuple(one.rival() for one in self.effects)
        bases = self.parts.bases if self.parts is not None else ()
        own = Question(self.model, rivals, bases)
        return [own, *self.rivals]

    def figures(self, known: Sequence[Information]) -> list[AskedFigure]:
        """Return what a plan makes smaller, of what runs say of the questions."""
        own, *rivals = known
        least = {one.sized.name: one.least / one.size for one in self.effects}
        out = seen(own, self.rule, least) if self.effects else []
        out += separated(rivals) if rivals else []
        out += sharpened(own, self.parameters) if self.parameters else []
        return out + (learned(own) if self.parts is not None else [])


@dataclass(frozen=True)
class Stated:
    """A goal with what it is made of.

    `asked`, `known` of the fitted parameters alone: what a table tells; `goal` with others drawn.
    """

    purposes: Purposes
    asked: tuple[PreparedQuestion, ...]
    known: tuple[Information, ...]
    goal: Goal = field(repr=False)


def stated(
    purposes: Purposes, problem: Problem, measured: RunsAtHand, z: float, seed: int
) -> Stated:
    """Return the goal that purposes are.

    Parameters
    ----------
    purposes : what the plan is for
    problem : runs that stand for the sizes of the rig
    measured : the runs at hand
    z : error over noise of the model
    seed : of the values that are drawn
    """
    asked = tuple(PreparedQuestion(one, problem, z) for one in purposes.questions())
    known = tuple(_known(one, measured) for one in asked)
    generator = np.random.default_rng(seed)
    unsure = max((max(one.deviations().values(), default=0.0) for one in known), default=0.0)
    drawn = DRAWN if unsure > UNSURE else 0
    sets = [asked]
    for _ in range(drawn):
        sets.append(tuple(a.drawn(k, generator) for a, k in zip(asked, known, strict=True)))
    width = len(asked)

    def cost(found: Sequence[Information]) -> float:
        parts = [found[k : k + width] for k in range(0, len(found), width)]
        return float(np.mean([cost_of(purposes.figures(one)) for one in parts]))

    goal = Goal(
        tuple(a for one in sets for a in one), known * len(sets), width, cost, purposes.judged
    )
    return Stated(purposes, asked, known, goal)


def _known(asked: PreparedQuestion, measured: RunsAtHand) -> Information:
    train, held_out = (asked.evidence(runs) for runs in (measured.train, measured.held_out))
    return Information(asked.question, train + held_out.judging())


# What a plan shall be for, as it is asked for, or as a verdict leaves it open.


@dataclass(frozen=True)
class PlanRequest:
    """What a plan shall be for: None for a purpose that is not asked for, () for all it can be.

    Attributes
    ----------
    separate : tuple of str
        Rivals: effects, laws, or "none" for the model as it is.
    see : tuple of str
        Effects.
    sharpen : tuple of str
        Parameters of law and effects, or effects.
    learn : tuple of str
        Coordinates on which an unknown part may depend.
    """

    separate: tuple[str, ...] | None = None
    see: tuple[str, ...] | None = None
    sharpen: tuple[str, ...] | None = None
    learn: tuple[str, ...] | None = None

    @property
    def nothing(self) -> bool:
        """Whether no purpose is given."""
        return self == PlanRequest()


def default_request(study: Study) -> PlanRequest:
    """Return what a plan is for where nobody says: what the verdict leaves open, or else all."""
    verdict = study.verdict() or {}
    kind = verdict.get("kind", "")
    named = tuple(dict.fromkeys(map(plain_name, verdict.get("effects", ()))))
    if kind == "ambiguous" and len(named) > 1 and all(name in EFFECTS for name in named):
        return PlanRequest(separate=named)
    if kind == "unknown":
        return PlanRequest(learn=())
    return PlanRequest(see=(), sharpen=())


def parameters_of(free: Sequence[str], names: Sequence[str]) -> tuple[str, ...]:
    """Return the parameters that are meant by names of them or of effects; all where empty.

    Raises
    ------
    StudyError
        If a name is that of none.
    """
    out: list[str] = []
    for name in names:
        own = [one for one in free if one == name or one.startswith(f"{name}.")]
        if not own:
            raise StudyError(unknown("parameter", name, free))
        out += own
    return tuple(dict.fromkeys(out)) or tuple(free)


def notes_of_change(study: Study) -> tuple[str, ...]:
    """Return how the data are others than the present model, or its verdict, knows."""
    verdict = study.verdict() or {}
    stale = study.stale(verdict) if verdict else ""
    return tuple(note for note in (behind_data(study), stale) if note)


def note_of_missing(study: Study, there: Sequence[str]) -> tuple[str, ...]:
    """Return what is said of effects that a verdict names and a model lacks, nothing of others.

    Parameters
    ----------
    study : with its verdict
    there : the effects of the model
    """
    verdict = study.verdict() or {}
    if verdict.get("kind") != "effect":
        return ()
    named = [name for name in map(plain_name, verdict["effects"]) if name in EFFECTS]
    missing = [name for name in named if name not in there]
    if not missing:
        return ()
    add = command("add", study.folder, *missing)
    return (f"The model misses {', '.join(missing)}; a plan shows more after  {add} .",)


def misfit_note(z: float) -> str:
    """Return what is said of a model's error over noise."""
    return f"errs by {short_z(z)} times the noise; the plan counts that as noise."
