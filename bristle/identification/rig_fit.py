"""A model fitted to a rig at all its sites, and judged there."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from ..core.arrays import Array
from ..core.text import plain
from ..errors import RecordError
from ..model.model import Model
from ..physics.effect import EFFECTS
from ..physics.laws import LAWS, Law
from ..physics.tuples import Inputs
from .building_sites import StructureProblem, thinned
from .error import ForceError, errors_by_run, pooled
from .fit import Fit, fit, fit_from_starts, refine
from .low_passed import error_rms, force_rms
from .problem import Problem, Run, excess_of, z_if_known
from .rig import DAMPER, ROLES, Rig, Site, at_site
from .start_grid import initial_guesses

# The linear law of a layer or storey fitted to its runs, in closed form.


DAMPING = "c"
"""The parameter of the linear laws that adds to the building's own damping."""


def fit_line(problem: StructureProblem, law: str) -> Fit:
    """Return the linear law fitted to a problem, by weighted linear least squares in three passes.

    The weights are those of Huber's loss at the expected noise. What the building and the line
    damp together stays above zero; where the data push below, `c` is at its bound, without a
    standard deviation. The bound goes along in the model's `limits`.
    """
    names = list(LAWS[law].parameters)
    limits = {DAMPING: (-problem.damped, float("inf"))} if np.isfinite(problem.damped) else {}
    model = Model(law, (), dict.fromkeys(names, 0.0), limits=limits)
    bounds = np.array([model.bounds(name) for name in names]).T
    columns = [line_columns(run, LAWS[law]) for run in problem.runs]
    A = np.concatenate(columns)
    force = np.concatenate([run.force for run in problem.runs])
    noise = [max(run.whole_noise, 1e-300) for run in problem.runs]
    sigma = np.repeat(noise, [len(run.force) for run in problem.runs])
    weight = np.ones(len(force))
    scale = np.maximum(np.sqrt(np.mean(A**2, axis=0)), 1e-300)
    theta = np.zeros(len(names))
    for _ in range(4):
        w = np.sqrt(weight) / sigma
        theta = _within(A / scale * w[:, None], force * w, bounds * scale)
        z = np.abs(force - A @ (theta / scale)) / sigma
        spread = max(1.0, float(np.median(z)) / 0.6745)
        weight = np.minimum(1.0, 2.0 * spread / np.maximum(z, 1e-300))
    theta = theta / scale
    model = replace(model, values=dict(zip(names, theta.tolist(), strict=True)))
    z = (force - A @ theta) / sigma
    cost = float(np.mean(np.where(np.abs(z) <= 2.0, 0.5 * z * z, 2.0 * np.abs(z) - 2.0)))
    free = [name for name in names if not (name == DAMPING and at_bound(model))]
    covariance = _line_covariance(
        problem, model, [part[:, [names.index(n) for n in free]] for part in columns]
    )
    std = dict(zip(free, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    return Fit(model, std, cost, covariance=covariance)


def _within(A: Array, b: Array, bounds: Array) -> Array:
    """Return the least squares solution (p,) of A theta = b within bounds (2, p)."""
    theta = np.linalg.lstsq(A, b, rcond=1e-10)[0]
    if np.all((bounds[0] <= theta) & (theta <= bounds[1])):
        return np.asarray(theta)
    Q, R = np.linalg.qr(A)
    return np.asarray(lsq_linear(R, Q.T @ b, (bounds[0], bounds[1]), method="bvls").x)


def at_bound(model: Model) -> bool:
    """Return whether a line's damping is at its lower bound."""
    low, _ = model.bounds(DAMPING)
    return bool(np.isfinite(low) and model.value(DAMPING) <= low + 1e-9 * abs(low))


def _line_covariance(problem: StructureProblem, model: Model, columns: list[Array]) -> Array:
    """Return the covariance (p, p) of the parameters whose columns (n, p) are given.

    By the sandwich formula with the drawn, correlated noise.
    """
    count = columns[0].shape[1]
    bread, meat = np.zeros((count, count)), np.zeros((count, count))
    scores: list[Array] = []
    expected = problem.expectation(model)
    for run, part, (_, sigma, spread) in zip(problem.runs, columns, expected, strict=True):
        J = part / sigma[:, None]
        bread += J.T @ J
        meat += (J * (run.noise / sigma)[:, None] ** 2).T @ J
        own = (spread / sigma) @ J
        scores = [a + b for a, b in zip(scores, own, strict=True)] if scores else list(own)
    found = np.array(scores)
    inverse = np.linalg.pinv(bread)
    covariance: Array = inverse @ (meat + found.T @ found / max(len(found), 1)) @ inverse
    return covariance


def line_columns(run: Run, law: type[Law]) -> Array:
    """Return the force (n, p) of each parameter of a linear law at 1, the others at zero."""
    whole, keep = run.remembered
    q = Inputs(*whole.smoothed, 0.0, 0.0, False)
    zero, none = np.zeros_like(q.x), dict.fromkeys(law.parameters, 0.0)
    own = [law.hooks()["force"](q, (), law.at({**none, name: 1.0})) for name in law.parameters]
    return np.column_stack([whole.seen(zero + force)[keep] for force in own])


# Fits at one site: the damper's law with its effects, or the line of a layer or storey with its.
#
# Effects of a structure join one by one, each searched from several starts.

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
    count : how many starting points are tried for the damper's law, 0 for none beside `also`
    also : values in SI by name from which one more fit begins; the better one counts
    """
    own, train = at_site(model, site.name, sites), site.train

    def search(problem: Problem) -> Fit:
        if site.is_line:
            return _fit_line(own, problem, also)
        return _fit_law(own, problem, MORE * count if problem.excess else count, also)

    found = search(train)
    if site.is_line and not own.effects:
        return found  # a line's weights follow its error by themselves
    return _beside_excess(found, train, search)


def _beside_excess(found: Fit, problem: Problem, search: Callable[[Problem], Fit]) -> Fit:
    """Return a fit, made anew where its model does not explain the runs.

    What the model misses then counts beside the noise; see `problem.excess_of`.

    Parameters
    ----------
    found : what the search came to on the runs
    problem : the runs, without an excess
    search : for the model on runs
    """
    excess = excess_of(problem, found.model)
    if not excess:
        return found
    problem = problem.with_excess(excess)
    again, from_there = search(problem), fit(problem, found.model)
    if again.cost <= from_there.cost:
        return again
    return _in_place_of(again, from_there)


def _in_place_of(searched: Fit, other: Fit) -> Fit:
    """Return a fit from one start with the starts of a search and what it found to be silent."""
    held = [name for name in searched.unidentified if name not in searched.std]
    lost = tuple(dict.fromkeys((*held, *other.unidentified)))
    return replace(other, starts=searched.starts, agreed=searched.agreed, unidentified=lost)


def _fit_law(own: Model, train: Problem, count: int, also: Values) -> Fit:
    """Return the damper's law fitted from several starts, and from the values in `also`.

    From these alone where no start is asked for and they are all that a test bench needs.
    """
    inside = isinstance(train, StructureProblem)
    there = {name: value for name, value in also.items() if _belongs(name, own)}
    begin = replace(own, values={**own.values, **there})
    if not count and not inside and {*begin.free()} <= {*there}:
        return fit_from_starts(train, begin, 0)
    count = count or MORE
    layer = [name for name in own.effects if inside and EFFECTS[name].site == "structure"]
    if not layer:
        found = fit_from_starts(train, own, count)
        known = {name.partition(".")[0] for name in also}
        far = [name for name in own.effects if EFFECTS[name].start_shares and name not in known]
        late = [] if inside else far
        if late:  # whose defaults may be where the runs never come
            found = min(found, _fit_grown(own, late, train), key=lambda one: one.cost)
    else:  # of a reconstructed force the layer's effects are a part
        found = _fit_grown(own, layer, train)
    if also:
        values = {**found.model.values, **there}
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
    known = {
        name: value
        for name, value in present.values.items()
        if name.partition(".")[0] in present.effects or name in present.fixed
    }
    return fit_from_starts(problem, replace(present, values=known))


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

    def search(problem: Problem) -> Fit:
        return fit(problem, own, with_std=False)

    return _beside_excess(search(train), train, search).model


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


class SiteModel(NamedTuple):
    """A site, and the part of a model that predicts its runs."""

    site: Site
    model: Model


SiteModels = dict[str, SiteModel]
"""What predicts a rig's runs, by site."""


_TINY = 1e-150  # its square and the inverse of that are numbers still


@dataclass(frozen=True)
class RigFit:
    """The fits by site."""

    fits: dict[str, Fit]
    sites: dict[str, Site]

    def whole(self, model: Model) -> Fit:
        """Return all sites' fits as one of the whole model; a storey's effect is the mean of all.

        The mean counts each storey by its certainty. A line's own parameters are no part of it.
        """
        values, std, lost = dict(model.values), {}, list[str]()
        damper = self.fits.get(DAMPER)
        for name in dict.fromkeys(name for found in self.fits.values() for name in found.std):
            identifiable = self._telling(name)
            if not identifiable:
                continue
            values[name], std[name] = _mean(
                [(f.model.value(name), f.std[name]) for f in identifiable]
            )
            lost += [name] if all(name in f.unidentified for f in identifiable) else []
        if damper is None:
            lost = [*Model(model.law).free(), *lost]
        else:
            values.update({n: v for n, v in damper.model.values.items() if n not in std})
            lost = list(dict.fromkeys([*damper.unidentified, *lost]))
        covariance = self._covariance(list(std))
        return Fit(
            model.identified(values, std, lost, covariance), std,
            max(f.cost for f in self.fits.values()), tuple(lost),
            starts=damper.starts if damper else 1, agreed=damper.agreed if damper else 1,
            covariance=covariance,
        )  # fmt: skip

    def _telling(self, name: str) -> list[Fit]:
        """Return the fits that tell a parameter; the damper's law has its own names."""
        damper = self.fits.get(DAMPER)
        able = self.fits.values() if "." in name else [damper] if damper else []
        return [found for found in able if name in found.std]

    def _covariance(self, names: list[str]) -> Array:
        """Return the covariance (p, p) of parameters that sites share, each counted as `_mean`."""
        total = np.zeros((len(names), len(names)))
        telling = {name: self._telling(name) for name in names}
        shares = {n: _shares([f.std[n] for f in telling[n]]) for n in names}
        for found in self.fits.values():
            own = list(found.std)
            shared = [n for n in names if any(f is found for f in telling[n])]
            if found.covariance is None or not shared:
                continue
            part = np.zeros((len(names), len(own)))
            for name in shared:
                place = next(k for k, f in enumerate(telling[name]) if f is found)
                part[names.index(name), own.index(name)] = shares[name][place]
            total += part @ found.covariance @ part.T
        return total

    def notes(self) -> dict[str, str]:
        """Return what was found of the lines: site to sentence."""
        return {
            name: _line_text(found, self.sites[name])
            for name, found in self.fits.items() if self.sites[name].is_line
        }  # fmt: skip


def _line_text(found: Fit, site: Site) -> str:
    """Return what was found of a line; its damping is that of the building's file and its own."""
    problem = site.train
    already = problem.damped if isinstance(problem, StructureProblem) else 0.0
    already = already if np.isfinite(already) else 0.0
    texts = []
    if "k" in found.std:
        k, error = plain(found.model.value("k"), 5), plain(1.96 * found.std["k"], 2)
        texts.append(f"k = {k} ± {error} N/m")
    if DAMPING in found.std and not at_bound(found.model):
        whole = plain(already + found.model.value(DAMPING), 4)
        error = plain(1.96 * found.std[DAMPING], 2)
        texts.append(f"c = {whole} ± {error} N s/m, {plain(already, 4)} of the file")
    text = ", ".join(texts) + " (fitted as well; not in model.toml)."
    if at_bound(found.model):
        text += (
            " The data ask for a negative damping, so it is held at zero "
            f"({plain(already, 4)} N s/m of the file are removed). A missing effect or a late "
            "velocity may feed energy in."
        )
    return text


def _mean(estimates: list[tuple[float, float]]) -> tuple[float, float]:
    """Return the mean of values with their standard deviations, and its own."""
    if len(estimates) == 1:
        return estimates[0]
    share = _shares([std for _, std in estimates])
    known = [(part, std) for part, (_, std) in zip(share, estimates, strict=True) if part > 0.0]
    mean = float(np.dot(share, [value for value, _ in estimates]))
    return mean, float(np.sqrt(sum((part * std) ** 2 for part, std in known)))


def _shares(stds: list[float]) -> Array:
    """Return what each of several estimates counts in their mean, by its certainty.

    Where none is told (a parameter that the data do not move) all count alike; where one is told
    without an error (a parameter at its bound) it stands alone.
    """
    std = np.maximum(stds, _TINY)
    if not np.isfinite(std).any():
        return np.full(len(stds), 1.0 / len(stds))
    weight = (np.min(std) / std) ** 2
    return np.asarray(weight / weight.sum())


def fit_rig(
    rig: Rig, model: Model, starts: int = 4, also: Mapping[str, float] | None = None
) -> RigFit:
    """Fit a model to the training runs of a rig, the damper's law first.

    Parameters
    ----------
    rig : the sites with their runs
    model : the damper's law with the effects of all sites
    starts : how many starting points are tried for the damper's law, 0 for none beside `also`
    also : values in SI by name from which one more fit begins at each site; the better one counts

    Raises
    ------
    StudyError, RecordError
        If an effect acts at no site of the rig, or a run cannot be held against a model.
    """
    also = also or {}
    sites = rig.sites(model)
    fits: dict[str, Fit] = {}
    if DAMPER in sites:
        fits[DAMPER] = fit_site(model, sites[DAMPER], sites, starts, also)
        # A delay of the force that was found moves what equilibrium leaves to the other sites.
        model = replace(model, values={**model.values, **fits[DAMPER].model.values})
        sites = rig.sites(model)
    for name, site in sites.items():
        if name != DAMPER:
            fits[name] = fit_site(model, site, sites, starts, also)
    return RigFit(fits, sites)


def site_models(rig: Rig, model: Model) -> SiteModels:
    """Return by site what predicts its runs: the model as it stands, with lines fitted.

    Lines are fitted to the training runs; the values of effects stay.
    """
    sites = rig.sites(model)
    found = {}
    for name, site in sites.items():
        own = at_site(model, name, sites)
        found[name] = SiteModel(site, with_line(own, site) if site.is_line else own)
    return found


class RigErrors(NamedTuple):
    """The errors of a model on a rig.

    `numbers` by name: "z_train" that of the worst site, "error_train" [N] and "error_share_train"
    the error over all sites, "rms_train" [N] and "share_train" the same behind a low-pass on both
    forces; "..._holdout" where runs are held out. `force` the error by role over all sites,
    `at` by role and site.
    """

    numbers: dict[str, float]
    force: dict[str, ForceError]
    at: dict[str, dict[str, ForceError]]


def errors_of(models: SiteModels, cutoff: float) -> RigErrors:
    """Return the errors of what predicts a rig's runs, on training runs and on held-out ones.

    Parameters
    ----------
    models : by site
    cutoff : Hz, of the low-pass for the low-passed errors; 0 for none

    Raises
    ------
    RecordError
        If the force of a model is not finite on a run.
    """
    out: dict[str, float] = {}
    at = force_errors(models)
    force = {role: pooled(found.values()) for role, found in at.items()}
    for role, error in force.items():
        pairs = [pair for _, pair in _pairs(models, role)]
        out[f"z_{role}"] = max(z_if_known(*pair) for pair in pairs)
        out[f"error_{role}"], out[f"error_share_{role}"] = error.headline
        squares = [error_rms(*pair, cutoff) ** 2 for pair in pairs]
        forces = [force_rms(problem.runs, cutoff) ** 2 for problem, _ in pairs]
        out[f"rms_{role}"] = float(np.sqrt(sum(squares)))
        out[f"share_{role}"] = out[f"rms_{role}"] / float(np.sqrt(sum(forces)))
    return RigErrors(out, force, at)


def force_errors(models: SiteModels) -> dict[str, dict[str, ForceError]]:
    """Return the error by role and site of what predicts a rig's runs.

    Raises
    ------
    RecordError
        If the force of a model is not finite on a run.
    """
    out: dict[str, dict[str, ForceError]] = {}
    for role in ROLES:
        for name, (problem, model) in _pairs(models, role):
            runs = errors_by_run(problem, model)
            _refuse_not_finite(problem, model, runs)
            out.setdefault(role, {})[name] = pooled(runs)
    return out


def _pairs(models: SiteModels, role: str) -> Iterator[tuple[str, tuple[Problem, Model]]]:
    """Yield the runs of a role and what predicts them, by site."""
    for name, (site, model) in models.items():
        problem = site.problem_of(role)
        if problem is not None:
            yield name, (problem, model)


def _refuse_not_finite(problem: Problem, model: Model, errors: Sequence[ForceError]) -> None:
    """Refuse a model whose force is not a number on a run."""
    for run, error in zip(problem.runs, errors, strict=True):
        if not np.isfinite(error.rms_all):
            raise RecordError(
                f"{run.name}: the force of the model {model.law} is not finite there, so there is "
                "no error. Bounds or fixed values in model.toml, or another law, keep it finite."
            )
