"""What a plan asks at each site of a building: effects, rivals, parameters, open parts.

The damper's model is its law; that of the isolation layer and of a storey is a line.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from math import hypot, inf
from typing import Any

import numpy as np

from ..core.progress import tell
from ..core.text import unknown
from ..diagnosis.conclusion import lookalikes
from ..diagnosis.prepared import Prepared, of_layer
from ..diagnosis.rule import BENCH, SITE
from ..diagnosis.site import joinable_at
from ..errors import StudyError
from ..identification.building_sites import StructureProblem, StructureRun
from ..identification.fit import fit_from_starts
from ..identification.problem import Problem, Run
from ..identification.rig import DAMPER, at_site
from ..identification.rig_fit import fit_line, joined
from ..learning.curve import CurvePlace
from ..learning.signals import ALONG
from ..model.model import Model
from ..physics.drive import VOLTAGE
from ..physics.effect import EFFECTS, exclude, plain_name
from ..physics.laws import LAWS, law_of_part
from .information import (
    USUAL,
    Evidence,
    Information,
    PreparedQuestion,
    Question,
    Rival,
    of_roles,
    ranges,
)
from .limits import RESERVE, RigLimits
from .questions import (
    AT,
    NONE,
    PlanRequest,
    Purposes,
    SizedRival,
    Stated,
    able_beside,
    coordinates_of,
    fitted_with,
    open_parts,
    parameters_of,
    rivals_of,
    seen,
    sized_rival,
)


@dataclass(frozen=True)
class SiteRequest:
    """What a plan shall be for, and at which sites: empty for all."""

    request: PlanRequest
    sites: tuple[str, ...] = ()


def default_requests(verdict: Mapping[str, Any]) -> list[SiteRequest]:
    """Return what a plan is for where nobody says: what the verdict leaves open, or else all."""
    findings = verdict.get("findings") or []
    out = []
    if verdict.get("kind") == "ambiguous" and verdict.get("force") == "reconstructed":
        named = [name for one in findings if one["site"] == DAMPER for name in one["effects"]]
        alike = [twin for name in named for twin in twins_of(name)]
        if alike:
            out.append(
                SiteRequest(PlanRequest(separate=tuple(dict.fromkeys([*named, *alike]))), (DAMPER,))
            )
    for one in findings if not out else ():
        site, names = one["site"], tuple(dict.fromkeys(one.get("effects") or ()))
        if one["kind"] == "ambiguous" and len(names) > 1:
            out.append(SiteRequest(PlanRequest(separate=names), (site,)))
        elif one["kind"] == "unknown":
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
        if name in LAWS and site == DAMPER:
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
        law = request.separate is not None and name in request.separate and name in (*LAWS, NONE)
        known = any(_asked_for(one, (name,)) for one in there)
        if not law and not known and not any(name in twins_of(one) for one in there):
            _refuse_effect(name, there, sites)
    if request.separate is not None and len(request.separate) < 2:
        raise StudyError("--separate needs two or more rivals, such as  --separate gas_spring none")
    own = [full for site, one in sites.items() for full in _own_parameters(site, one.before.model)]
    short = [name for one in sites.values() for name in one.before.model.free()]
    for name in request.sharpen or ():
        if not any(one.startswith(f"{name}.") for one in (*own, *short)):
            parameters_of(own, (name,))


def _refuse_effect(name: str, there: Sequence[str], sites: Mapping[str, Prepared]) -> None:
    if name not in EFFECTS:
        raise StudyError(unknown("effect", name, sorted(EFFECTS)))
    inside = [site for site, one in sites.items() if name in one.before.model.effects]
    if inside:
        raise StudyError(f"{name} is in the model already; --sharpen {name} sharpens it.")
    raise StudyError(
        f"{name} cannot be seen at a site of this building: no run shows its site, or the model "
        f"there holds it already. These can: {', '.join(there)}."
    )


def _learned_at(requests: Sequence[SiteRequest], sites: Mapping[str, Prepared]) -> list[str]:
    """Return the sites at which a part without a form is to be learned: where the model errs."""
    named = [site for one in requests if one.request.learn is not None for site in one.sites]
    loud = [site for site, one in sites.items() if one.before.z > one.rule.clean]
    return named or [max(loud, key=lambda site: sites[site].before.z) if loud else DAMPER]


def _parts(
    site: str, opened: Prepared, names: Sequence[str], limits: RigLimits, drive: str
) -> Question:
    """Return the question what a part without a form does at a site, along coordinates there."""
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
    drive = drive or VOLTAGE.name
    own = coordinates_of(names, able, there, drive) or [name for name in USUAL if name in able]
    return open_parts(opened.before.model, there, own, drive)


def largest_motion(runs: Sequence[Any]) -> tuple[float, float]:
    """Return the largest displacement [m] and velocity [m/s] of runs of a site."""
    whole = [one.whole for one in runs if isinstance(one, StructureRun) and one.whole is not None]
    return (
        max(float(np.max(np.abs(one.x))) for one in whole),
        max(float(np.max(np.abs(one.v))) for one in whole),
    )


# A damper's force that would be measured: layer and damper are then two sites, not one.

LAYER = "layer"
BOTH = (DAMPER, LAYER)
Key = tuple[str, str, str]  # site, purpose, name of the figure


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


def with_measured_force(
    stand: Stated, sites: Sequence[dict[str, StructureProblem]], roles: Sequence[bool]
) -> dict[Key, float]:
    """Return the figures of a reconstructed damper's site if its force were measured in the tests.

    Parameters
    ----------
    stand : the purposes of the site, with what the runs at hand say
    sites : of each test, with the damper's force
    roles : of each test, whether it is held out
    """
    before = stand.asked[0].problem
    assert isinstance(before, StructureProblem)
    if not before.reconstructed or not all(DAMPER in one for one in sites):
        return {}
    damper = [list(one[DAMPER].runs) for one in sites]
    layer = [one[LAYER] for one in sites if LAYER in one]
    found = _of_damper(stand, damper, roles)
    if len(layer) == len(sites):
        problem = layer[0].of(list(chain(*(one.runs for one in layer))))
        line = fit_line(problem, law_of_part(LAYER).name).model
        found |= _of_layer(stand.purposes, line, problem, [list(one.runs) for one in layer], roles)
        found |= _apart(stand, damper, line, problem)
    return found


def _evidence(
    asked: PreparedQuestion, runs: Sequence[Sequence[Run]], roles: Sequence[bool]
) -> Evidence:
    """Return what tests say of a question."""
    each = of_roles([asked.evidence(own) for own in runs], roles)
    return sum(each[1:], start=each[0])


def _of_damper(
    stand: Stated, runs: Sequence[Sequence[Run]], roles: Sequence[bool]
) -> dict[Key, float]:
    """Return the figures of the damper's own effects and parameters.

    The layer's are no part of a measured force: the tests say nothing of them there.
    """
    asked, now = stand.asked[0], stand.known[0]
    names = [*asked.names, *(one.name for one in asked.question.rivals)]
    own = np.array([not _of_structure(name) for name in names])
    own = np.append(own, np.ones(asked.question.width - len(own), dtype=bool))
    told = _evidence(asked, runs, roles)
    known = now.with_runs([told.within(np.outer(own, own))])
    purposes = replace(stand.purposes, rivals=())
    return {
        (DAMPER, one.purpose, one.name): one.value
        for one in purposes.figures([known])
        if not _of_structure(one.name)
    }


def _of_structure(name: str) -> bool:
    """Return whether a parameter or an effect is one of the structure."""
    effect = EFFECTS.get(name.partition(".")[0])
    return effect is not None and effect.site == "structure"


def _of_layer(
    purposes: Purposes,
    line: Model,
    problem: StructureProblem,
    runs: Sequence[Sequence[Run]],
    roles: Sequence[bool],
) -> dict[Key, float]:
    """Return from what size the layer's effects are named at their own site."""
    effects = [one for one in purposes.effects if _of_structure(one.sized.name)]
    question = Question(line, tuple(_on_line(one, line) for one in effects))
    if not effects:
        return {}
    known = Information(question, _evidence(PreparedQuestion(question, problem), runs, roles))
    return {(DAMPER, one.purpose, one.name): one.value for one in seen(known, SITE)}


def _on_line(one: SizedRival, line: Model) -> Rival:
    """Return an effect of the layer beside its line, as large as beside the damper's law."""
    rival = one.rival()
    return Rival(rival.name, _part(rival.model, line), _part(rival.without, line))


def _part(model: Model, line: Model) -> Model:
    """Return the layer's part of a model: its line with the layer's effects."""
    part = at_site(model, LAYER, BOTH)
    return replace(
        part, values={**line.values, **part.values}, limits={**part.limits, **line.limits}
    )


def _apart(
    stand: Stated, damper: Sequence[Sequence[Run]], line: Model, problem: StructureProblem
) -> dict[Key, float]:
    """Return by how much rivals are too near to be told apart, by damper and layer together."""
    out: dict[Key, float] = {}
    runs, own = list(chain(*damper)), stand.asked[0].problem
    for question in stand.purposes.rivals:
        for rival in question.rivals:
            two = (question.model, rival.model)
            at_damper = _distance(own, runs, *(at_site(one, DAMPER, BOTH) for one in two))
            in_layer = _distance(problem, problem.runs, *(_part(one, line) for one in two))
            apart = hypot(at_damper, in_layer)
            key = (DAMPER, "separate", rival.name)
            out[key] = max(out.get(key, 0.0), BENCH.separating_sigma / apart if apart else inf)
    return out


def _distance(problem: Problem, runs: Sequence[Run], one: Model, other: Model) -> float:
    """Return how far a model is from another, refitted, in standard deviations."""
    if (one.law, one.effects) == (other.law, other.effects):
        return 0.0
    question = Question(one, (Rival("other", other, one),))
    known = Information(question, PreparedQuestion(question, problem).evidence(runs))
    return known.distances()["other"]
