"""A model fitted to a rig at all its sites, and judged there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordError
from ..quantity import plain
from .assigned import at_site
from .error import ForceError, errors_by_run, pooled
from .fit import Fit
from .line import DAMPING, at_bound
from .model import Model, Problem
from .residuals import told_z
from .rig import DAMPER, ROLES, Rig, Site
from .site_fit import fit_site, with_line
from .structure import StructureProblem
from .table import error_rms, force_rms

Array = NDArray[np.float64]


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
        return Fit(
            replace(model, values=values), std, max(f.cost for f in self.fits.values()),
            tuple(lost), starts=damper.starts if damper else 1,
            agreed=damper.agreed if damper else 1, covariance=self._covariance(list(std)),
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

    def notes(self) -> list[str]:
        """Return what was found of the lines, one sentence each."""
        out = []
        for name, found in self.fits.items():
            if self.sites[name].is_line:
                out.append(f"{name}: {_line_text(found, self.sites[name])}")
        return out


def _line_text(found: Fit, site: Site) -> str:
    """Return what was found of a line; its damping is that of the building's file and its own."""
    problem = site.train
    already = problem.damped if isinstance(problem, StructureProblem) else 0.0
    already = already if np.isfinite(already) else 0.0
    texts = []
    if "k" in found.std:
        k, error = plain(found.model.value("k"), 5), plain(1.96 * found.std["k"], 2)
        texts.append(f"k = {k} +- {error} N/m")
    if DAMPING in found.std and not at_bound(found.model):
        whole = plain(already + found.model.value(DAMPING), 4)
        error = plain(1.96 * found.std[DAMPING], 2)
        texts.append(f"c = {whole} +- {error} N s/m, {plain(already, 4)} of the file")
    text = ", ".join(texts) + " (fitted too, not in model.toml)."
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
    starts : how many starting points are tried for the damper's law
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
        out[f"z_{role}"] = max(told_z(*pair) for pair in pairs)
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
