"""What a plan asks of a damper on a bench, and for what purpose."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from math import inf, log
from typing import Any

import numpy as np

from ..comparison.names import site_name
from ..core.progress import tell
from ..core.text import command, quantity, short_z, unknown
from ..diagnosis.conclusion import lookalikes
from ..diagnosis.effect_limits import NO_AMOUNT, EffectLimit, limit_of
from ..diagnosis.effect_size import SMALLEST, Sized, SizeSearch, named_distance, resolved
from ..diagnosis.prepared import Prepared, of_layer
from ..diagnosis.rule import BENCH, DecisionRule
from ..diagnosis.site import joinable_at
from ..diagnosis.trials import LONG, joinable, short_search
from ..errors import StudyError
from ..identification.building_sites import StructureProblem
from ..identification.fit import fit_from_starts, refine
from ..identification.problem import Problem, Run
from ..identification.rig import DAMPER
from ..identification.rig_fit import joined
from ..identification.start_grid import SearchContext, ranked_guesses
from ..learning.curve import CurvePlace
from ..learning.signals import ALONG
from ..model.model import Model
from ..physics.drive import DRIVES, VOLTAGE
from ..physics.effect import EFFECTS, exclude, plain_name
from ..physics.laws import laws_of
from ..study.study import Study, behind_data
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
from .limits import RESERVE, RigLimits

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


def refuse_unable(name: str, able: Sequence[str], *models: Model) -> None:
    """Refuse an effect that is not among those that can join the models of a rig's sites.

    Raises
    ------
    StudyError
        Saying why.
    """
    if name not in EFFECTS:
        raise StudyError(unknown("effect", name, sorted(EFFECTS)))
    if any(name in one.effects for one in models):
        raise StudyError(f"{name} is in the model already; --sharpen {name} sharpens it.")
    these = f"These can: {', '.join(able)}."
    if not EFFECTS[name].amount:
        raise StudyError(f"{name} cannot be planned for: {NO_AMOUNT}. {these}")
    if name not in able:
        raise StudyError(
            f"{name} cannot be seen: the law {models[0].base_law} holds it already, or no run "
            f"shows where it acts. {these}"
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
    if plain_name(name) not in known:
        raise StudyError(unknown("effect or law", name, known))


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


def separated(known: Sequence[Information]) -> list[AskedFigure]:
    """Return by how much rivals are too near to be told apart: 1 where a verdict just can."""
    apart: dict[str, float] = {}
    for one in known:
        for name, distance in one.distances().items():
            apart[name] = min(apart.get(name, inf), distance)
    return [
        AskedFigure(
            "separate", name, BENCH.separating_sigma / distance if distance else inf, 1.0 / ENOUGH
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


def notes_of_error(study: Study, sites: Mapping[str, Prepared]) -> tuple[str, ...]:
    """Return what weakens a plan: effects that a verdict names and a model lacks, or its error.

    Parameters
    ----------
    study : with its model and verdict
    sites : the models with their runs by site, "" on a bench
    """
    verdict, there = study.verdict() or {}, [plain_name(one) for one in study.model().effects]
    named = verdict["effects"] if verdict.get("kind") == "effect" else ()
    missing = [one for one in map(plain_name, named) if one in EFFECTS and one not in there]
    if missing:
        add = command("add", study.folder, *missing)
        return (f"The model misses {', '.join(missing)}; a plan shows more after  {add} .",)
    return tuple(
        f"{f'At {site_name(site)} the' if site else 'The'} model errs by "
        f"{short_z(one.before.z)} times the noise; the plan counts that as noise."
        for site, one in sites.items()
        if one.before.z > one.rule.clean
    )


# What a plan asks at each site of a building: effects, rivals, parameters, open parts.


@dataclass(frozen=True)
class SiteRequest:
    """What a plan shall be for, and at which sites: empty for all."""

    request: PlanRequest
    sites: tuple[str, ...] = ()


def requests_of(request: PlanRequest | None, study: Study) -> list[SiteRequest]:
    """Return what a plan is for: what is asked for, or else what the verdict leaves open."""
    if request is None or request.nothing:
        return default_requests(study.verdict() or {})
    return [SiteRequest(request)]


def default_requests(verdict: Mapping[str, Any]) -> list[SiteRequest]:
    """Return what a plan is for where nobody says: what the verdict leaves open, or else all."""
    findings = verdict.get("findings") or [{"effects": (), **verdict, "site": DAMPER}]
    out = []
    if verdict.get("kind") == "ambiguous" and verdict.get("force") == "reconstructed":
        named = [name for one in findings if one["site"] == DAMPER for name in one["effects"]]
        alike = [twin for name in named for twin in twins_of(name)]
        if alike:
            out.append(
                SiteRequest(PlanRequest(separate=tuple(dict.fromkeys([*named, *alike]))), (DAMPER,))
            )
    for one in findings if not out else ():
        site, kind = one["site"], one.get("kind")
        names = tuple(dict.fromkeys(one.get("effects") or ()))
        if kind == "ambiguous" and len(names) > 1 and all(plain_name(n) in EFFECTS for n in names):
            out.append(SiteRequest(PlanRequest(separate=names), (site,)))
        elif kind == "unknown":
            out.append(SiteRequest(PlanRequest(learn=()), (site,)))
    return out or [SiteRequest(PlanRequest(see=(), sharpen=()))]


def twins_of(name: str) -> list[str]:
    """Return the effects that add up to one force with another while none is measured.

    What a part of the damper's law does is there the effect itself, at the damper.
    """
    effect = EFFECTS[name]
    moved = [effect.key(DAMPER)] if DAMPER in effect.sites and effect.site != DAMPER else []
    twins = [[twin] if twin in EFFECTS else moved for twin in lookalikes((name,))]
    return list(dict.fromkeys(one for own in twins for one in own))


def are_twins(one: str, other: str) -> bool:
    """Return whether two rivals add up to one force while the damper's is not measured."""
    pairs = ((one, other), (other, one))
    return any(name in EFFECTS and twin in twins_of(name) for name, twin in pairs)


def able_at(site: str, opened: Prepared) -> list[str]:
    """Return the effects with a size that can join the model of a site."""
    model = opened.before.model
    if site != DAMPER:
        return [name for name in joinable_at(site, model) if EFFECTS[name].amount]
    layer = [
        name
        for name in of_layer(model, opened.problem)
        if EFFECTS[name].amount and not any(exclude(name, one) for one in model.effects)
    ]
    return [*able_beside(model, opened.searched, opened.shown), *layer]


def purposes_at(
    sites: Mapping[str, Prepared], requests: Sequence[SiteRequest], limits: RigLimits, drive: str
) -> dict[str, Purposes]:
    """Return what a plan is for, by site; sites of which nothing is asked are left out.

    Parameters
    ----------
    sites : the models, fitted to the runs at hand
    requests : what is asked for
    limits : of table and building
    drive : the channel of the command

    Raises
    ------
    StudyError
        If a request names what no site has.
    """
    able = {site: able_at(site, opened) for site, opened in sites.items()}
    for one in requests:
        _refuse_unknown(one.request, able, sites)
    out = {}
    for site, opened in sites.items():
        tell(f"looking at effects: {site}")
        own = [one.request for one in requests if not one.sites or site in one.sites]
        found = Purposes(opened.before.model, rule=opened.rule, drive=drive)
        for request in own:
            found = _with_request(found, request, site, opened, able[site])
        if any(request.learn is not None for request in own) and site in _learned_at(
            requests, sites
        ):
            coordinates = next(request.learn for request in own if request.learn is not None) or ()
            found = replace(found, parts=_parts(site, opened, coordinates, limits, drive))
        if found.effects or found.rivals or found.parameters or found.parts is not None:
            out[site] = found
    if not out:
        raise StudyError("no test serves that purpose: none of these sites has what was asked for.")
    return out


def _with_request(
    found: Purposes, request: PlanRequest, site: str, opened: Prepared, able: Sequence[str]
) -> Purposes:
    """Return purposes with what a request asks of a site, but for parts without a form."""
    model = opened.before.model
    if request.see is not None:
        names = [name for name in able if not request.see or _asked_for(name, request.see)]
        found = replace(found, effects=tuple(_sized(names, opened)))
    if request.separate is not None:
        found = replace(found, rivals=tuple(_rivals(request.separate, site, opened, able)))
    if request.sharpen is not None:
        own = _own_parameters(site, model)
        asked = [
            name for name in own if not request.sharpen or name in _meant(own, request.sharpen)
        ]
        found = replace(found, parameters=tuple(own[name] for name in asked))
    return found


def _asked_for(name: str, names: Sequence[str]) -> bool:
    return name in names or plain_name(name) in names


def _sized(names: Sequence[str], opened: Prepared) -> list[SizedRival]:
    """Return effects, each at the size from which it would be named now."""
    if not names:
        return []
    fitted = opened.known(opened.before.model)
    return [sized_rival(name, fitted) for name in names]


def _rivals(
    names: Sequence[str], site: str, opened: Prepared, able: Sequence[str]
) -> list[Question]:
    """Return rivals at a site: those that can act there; of a single one the model as it is."""
    model = opened.before.model
    models: dict[str, Model] = {}
    for name in names:
        if name in law_rivals() and site == DAMPER:
            models[name] = fit_from_starts(opened.searched, Model(name, model.effects)).model
        own = next((one for one in able if _asked_for(one, (name,))), "")
        if own:
            models[name] = _with_effect(own, opened)
        elif plain_name(name) != name and plain_name(name) in able:
            models[name] = _moved(name, _with_effect(plain_name(name), opened))
    if not models:
        return []
    if NONE in names or len(models) == 1:
        models[NONE] = model
    return rivals_of(models)


def _with_effect(name: str, opened: Prepared) -> Model:
    """Return the model of a site with one more effect, fitted."""
    if EFFECTS[name].site == "structure":
        tell(f"fitting {name}")
        return joined(name, opened.before.model, opened.problem)
    return fitted_with(name, opened.before.model, opened.searched)


def _moved(name: str, model: Model) -> Model:
    """Return the model with an effect of the layer at the damper, where it does the same."""
    layer = plain_name(name)
    effects = tuple(name if one == layer else one for one in model.effects)
    values = {
        f"{name}.{key.partition('.')[2]}" if key.startswith(f"{layer}.") else key: value
        for key, value in model.values.items()
    }
    return replace(model, effects=effects, values=values)


def _own_parameters(site: str, model: Model) -> dict[str, str]:
    """Return the parameters of a site's model by the names that a plan calls them."""
    prefix = "" if site == DAMPER else f"{site}."
    return {f"{prefix}{name}": name for name in model.free()}


def _meant(own: Mapping[str, str], names: Sequence[str]) -> set[str]:
    """Return which of a site's parameters are meant by names of them, of effects, or of the site.

    Parameters
    ----------
    own : parameters by the names that a plan calls them
    names : that were given
    """
    return {
        full
        for full, name in own.items()
        for one in names
        if full == one or full.startswith(f"{one}.") or name.startswith(f"{one}.")
    }


def _refuse_unknown(
    request: PlanRequest, able: Mapping[str, Sequence[str]], sites: Mapping[str, Prepared]
) -> None:
    """Refuse names of effects and parameters that no site has."""
    there = sorted({name for names in able.values() for name in names})
    for name in (*(request.see or ()), *(request.separate or ())):
        if name in (request.separate or ()):
            refuse_no_rival(name)
        law = name in (request.separate or ()) and name in (*law_rivals(), NONE)
        known = any(_asked_for(one, (name,)) for one in there)
        if not law and not known and not any(name in twins_of(one) for one in there):
            refuse_unable(name, there, *(one.before.model for one in sites.values()))
    if request.separate is not None and len(request.separate) < 2:
        raise StudyError("--separate needs two or more rivals, such as  --separate gas_spring none")
    own = [full for site, one in sites.items() for full in _own_parameters(site, one.before.model)]
    short = [name for one in sites.values() for name in one.before.model.free()]
    for name in request.sharpen or ():
        if not any(one.startswith(f"{name}.") for one in (*own, *short)):
            parameters_of(own, (name,))


def _learned_at(requests: Sequence[SiteRequest], sites: Mapping[str, Prepared]) -> list[str]:
    """Return the sites at which a part without a form is to be learned: where the model errs."""
    named = [site for one in requests if one.request.learn is not None for site in one.sites]
    loud = [site for site, one in sites.items() if one.before.z > one.rule.clean]
    return named or [max(loud, key=lambda site: sites[site].before.z) if loud else DAMPER]


def _parts(
    site: str, opened: Prepared, names: Sequence[str], limits: RigLimits, drive: str
) -> Question:
    """Return the question what a part without a form does at a site, along coordinates there."""
    drive = drive or VOLTAGE.name
    if not isinstance(opened.problem, StructureProblem):
        return open_parts(opened.before.model, limits, names, drive)
    runs = [*opened.problem.runs, *opened.held_out.runs]
    stroke = limits.damper_stroke if not site.startswith("storey") else limits.drift
    reached, fastest = largest_motion(runs)
    stroke = stroke if stroke < inf else reached / RESERVE
    there = replace(
        limits, stroke=stroke, speed=fastest / RESERVE * stroke * RESERVE / reached,
        band=(0.0, inf),
    )  # fmt: skip
    place = CurvePlace(site)
    able = [name for name in ranges(there) if place.offers(ALONG[name].needs)]
    own = coordinates_of(names, able, there, drive) or [name for name in USUAL if name in able]
    return open_parts(opened.before.model, there, own, drive)


def largest_motion(runs: Sequence[Run]) -> tuple[float, float]:
    """Return the largest displacement [m] and velocity [m/s] of runs of a site."""
    whole = [one.remembered[0] for one in runs]
    return (
        max(float(np.max(np.abs(one.x))) for one in whole),
        max(float(np.max(np.abs(one.v))) for one in whole),
    )


def of_one_force(stand: Mapping[str, Stated]) -> set[str]:
    """Return the pairs of rivals that no motion tells apart while the force is not measured.

    Parameters
    ----------
    stand : the purposes of each site, with what the runs at hand say
    """
    if DAMPER not in stand:
        return set()
    problem = stand[DAMPER].asked[0].problem
    if not (isinstance(problem, StructureProblem) and problem.reconstructed):
        return set()
    pairs = {rival.name for one in stand[DAMPER].purposes.rivals for rival in one.rivals}
    return {pair for pair in pairs if are_twins(*pair.split(AT))}
