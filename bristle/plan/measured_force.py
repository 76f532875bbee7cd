"""A damper's force that would be measured: layer and damper are then two sites, not one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain
from math import hypot, inf

import numpy as np

from ..diagnose.rule import BENCH, SITE
from ..identify.assigned import at_site
from ..identify.line import fit_line
from ..identify.model import Model, Problem, Run
from ..identify.rig import DAMPER
from ..identify.structure import StructureProblem
from ..physics.effect import EFFECTS
from ..physics.laws import law_of_part
from .building_sites import are_twins
from .goal import Purposes, Stated
from .knowledge import Asked, Evidence, Known, Question, Rival, of_roles
from .purposes import seen
from .questions import AT, SizedRival

LAYER = "layer"
BOTH = (DAMPER, LAYER)
Key = tuple[str, str, str]


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


def _evidence(asked: Asked, runs: Sequence[Sequence[Run]], roles: Sequence[bool]) -> Evidence:
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
    known = Known(question, _evidence(Asked(question, problem), runs, roles))
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
            out[key] = max(out.get(key, 0.0), BENCH.tells / apart if apart else inf)
    return out


def _distance(problem: Problem, runs: Sequence[Run], one: Model, other: Model) -> float:
    """Return how far a model is from another, refitted, in standard deviations."""
    if (one.law, one.effects) == (other.law, other.effects):
        return 0.0
    question = Question(one, (Rival("other", other, one),))
    known = Known(question, Asked(question, problem).evidence(runs))
    return known.distances()["other"]
