"""Fits at one site: the damper's law with its effects, or the line of a layer or storey with its.

Effects of a structure join one by one, each searched from several starts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from ..physics.effect import EFFECTS
from .assigned import at_site
from .fit import Fit, fit, identify
from .line import fit_line
from .model import Model, Problem
from .residuals import excess_of
from .rig import DAMPER, Site
from .search_context import refine
from .start_grid import initial_guesses
from .structure import StructureProblem, thinned
from .watch import MODEL, series

QUICK = 8
"""Sweeps of the first, short search from each start, on every fifth sample."""

MORE = 2
"""Times as many starts where a law does not explain the runs: its loss has several valleys then."""

Values = Mapping[str, float]


def fit_site(model: Model, site: Site, sites: Mapping[str, Site], count: int, also: Values) -> Fit:
    """Return a model's part at one site fitted to its training runs.

    Parameters
    ----------
    model : the damper's law with the effects of all sites
    site, sites : the one to fit, and all sites that the runs show
    count : how many starting points are tried for the damper's law
    also : values in SI by name from which one more fit begins; the better one counts
    """
    own = at_site(model, site.name, sites)

    def searched(train: Problem) -> Fit:
        if site.is_line:
            return _fit_line(own, train, also)
        return _fit_law(own, train, MORE * count if train.excess else count, also)

    with series(MODEL, site.shown):
        if site.is_line and not own.effects:
            return searched(site.train)  # a line's weights follow its error by themselves
        return weighed(site.train, searched)


def weighed(problem: Problem, searched: Callable[[Problem], Fit]) -> Fit:
    """Return what a search ends at, made anew where its model does not explain the runs.

    What the model misses then counts beside the noise; see `residuals.excess_of`.

    Parameters
    ----------
    problem : the runs, without an excess
    searched : the search for a model on them
    """
    found = searched(problem)
    excess = excess_of(problem, found.model)
    if not excess:
        return found
    problem = problem.with_excess(excess)
    again, from_there = searched(problem), fit(problem, found.model)
    if again.cost <= from_there.cost:
        return again
    return _in_place_of(again, from_there)


def _in_place_of(searched: Fit, other: Fit) -> Fit:
    """Return a fit from one start with the starts of a search and what it found to be silent."""
    held = [name for name in searched.unidentified if name not in searched.std]
    lost = tuple(dict.fromkeys((*held, *other.unidentified)))
    return replace(other, starts=searched.starts, agreed=searched.agreed, unidentified=lost)


def _fit_law(own: Model, train: Problem, count: int, also: Values) -> Fit:
    """Return the damper's law fitted from several starts, and from the values in `also`."""
    inside = isinstance(train, StructureProblem)
    layer = [name for name in own.effects if inside and EFFECTS[name].site == "structure"]
    if not layer:
        found = identify(
            train, own.law, own.effects, count, values=own.values, fixed=own.fixed,
            limits=own.limits,
        )  # fmt: skip
        late = [] if inside else [name for name in own.effects if EFFECTS[name].start_shares]
        if late:  # whose defaults may be where the runs never come
            found = min(found, _fit_grown(own, late, train), key=lambda one: one.cost)
    else:  # of a reconstructed force the layer's effects are a part
        found = _fit_grown(own, layer, train)
    if also:
        known = {name: value for name, value in also.items() if _belongs(name, own)}
        values = {**found.model.values, **known}
        other = fit(train, replace(found.model, values=values))
        if other.cost < found.cost:
            found = _in_place_of(found, other)
    return found


def _fit_grown(own: Model, late: list[str], train: Problem) -> Fit:
    """Return a law fitted without some of its effects, which then join one by one."""
    first = replace(own, effects=tuple(name for name in own.effects if name not in late))
    without = fit_damper(train, at_site(first, DAMPER, (DAMPER,)))
    grown = without.model
    for name in late:
        grown = joined(name, grown, train)
    whole = refine(replace(grown, effects=own.effects, fixed=own.fixed), train)
    return replace(fit(train, whole), starts=without.starts, agreed=without.agreed)


def fit_damper(problem: Problem, present: Model) -> Fit:
    """Return the damper's law fitted anew, with the effects that the model has already."""
    effects = present.effects
    known = {n: v for n, v in present.values.items() if n.partition(".")[0] in effects}
    kept = {n: v for n, v in present.values.items() if n in present.fixed}
    return identify(
        problem, present.law, effects, values={**known, **kept}, fixed=present.fixed,
        limits=present.limits,
    )  # fmt: skip


def _belongs(name: str, model: Model) -> bool:
    effect, dot, _ = name.partition(".")
    return effect in model.effects if dot else name in model.values


def _fit_line(own: Model, problem: Problem, also: Values) -> Fit:
    """Return a layer's or storey's line fitted with its effects."""
    train = _structure(problem)
    found = fit_line(train, own.law)
    if not own.effects:
        return found
    limits = {**found.model.limits, **own.limits}
    grown = replace(found.model, fixed=own.fixed, limits=limits)
    for name in own.effects:
        grown = joined(name, grown, train)
    tried = [replace(grown, fixed=own.fixed, limits=limits)]
    for values in (own.values, {n: v for n, v in also.items() if _belongs(n, own) and "." in n}):
        if values:
            tried.append(replace(tried[0], values={**grown.values, **values}))
    return min((fit(train, model) for model in tried), key=lambda one: one.cost)


def with_line(own: Model, site: Site) -> Model:
    """Return a model's part at a line's site with its line fitted, its effects as they stand."""
    train = _structure(site.train)
    line = fit_line(train, own.law).model
    fixed = tuple(name for name in own.values if "." in name)
    values, limits = {**line.values, **own.values}, {**line.limits, **own.limits}
    own = replace(own, values=values, fixed=fixed, limits=limits)
    if not own.effects:
        return own
    return weighed(train, lambda problem: fit(problem, own, with_std=False)).model


def _structure(problem: Problem) -> StructureProblem:
    assert isinstance(problem, StructureProblem)
    return problem


def joined(effect: str, base: Model, train: Problem) -> Model:
    """Return a model fitted with one more effect, the best of several starts."""
    few = thinned(train) if isinstance(train, StructureProblem) else train
    screening_noise = few.expectation(base)
    searched = [
        fit(few, model, expectation=screening_noise, max_evaluations=QUICK, with_std=False)
        for model in initial_guesses(effect, base, train)
    ]
    best = min(searched, key=lambda one: one.cost).model
    expected = train.expectation(base)
    return fit(train, best, expectation=expected, max_evaluations=25, with_std=False).model
