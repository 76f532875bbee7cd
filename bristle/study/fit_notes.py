"""What there is to say of a fit: doubts about its runs, and how far its numbers can be trusted."""

from __future__ import annotations

import numpy as np

from ..data.checks.clipping import saturated_share
from ..data.measurement import Measurement
from ..data.model import StudyModel
from ..errors import StudyError
from ..identify.begin import under_load_text
from ..identify.error import ForceError
from ..identify.residuals import robust_z
from ..identify.rig_fit import SiteModel, SiteModels
from ..identify.table import LawError
from ..quantity import plain
from .identified import Identified

_MISFIT = 1.15  # z above which an error is more than noise
_LESS = 0.95  # share of the model's error below which what least squares leave is told
_SATURATED = 0.95  # share of samples at the extremes of a force above which it tells nothing else


def doubts(runs: list[Measurement]) -> list[str]:
    """Refuse a force that is nothing but its ends; return what weakens an identification.

    Raises
    ------
    StudyError
        If nearly all samples of a force are at its extremes.
    """
    notes = []
    for run in runs:
        share = saturated_share(run["force"])
        if share > _SATURATED:
            raise StudyError(
                f"{run.name}: {share:.0%} of the force's samples are at its extremes: the load "
                "cell or its amplifier is saturated, or this is a friction without noise that "
                "nothing changes, and no law is told by it. Measure with a wider range or with "
                "other motions, or leave the run out in study.toml."
            )
        if share > 0.0:
            notes.append(f"{run.name}: {share:.1%} of the force's samples are at its extremes.")
    doubtful: dict[str, int] = {}
    for run in runs:
        for channel, fact in run.noise_facts.items():
            if fact is not None and fact.colour in ("slow", "hidden", "rough", "blue"):
                doubtful[channel] = doubtful.get(channel, 0) + 1
    if doubtful:
        where = ", ".join(f"{c} ({n} of {len(runs)} runs)" for c, n in doubtful.items())
        notes.append(
            f"The noise is hard to separate from the signal: {where}. Give it in study.toml: z and "
            "intervals depend on it."
        )
    return notes


def under_load(at: SiteModel) -> list[str]:
    """Return the sentence that tells which runs begin under a load that the model carries."""
    problems = (at.site.train, at.site.holdout)
    loads = {
        run.name: float(np.mean(run.force[: run.rest]))
        for problem in problems
        if problem is not None
        for run in problem.runs
        if problem.carrying(at.model, run)
    }
    return [under_load_text(loads)] if loads else []


def by_site(models: SiteModels) -> list[str]:
    """Return the sentence that tells z by site.

    None where the one site goes without saying, or no run is held out.
    """
    problems = {at.site.shown: at.site.holdout for at in models.values()}
    if "" in problems:
        return []
    z = {n: robust_z(p, models[n].model) for n, p in problems.items() if p is not None}
    if not z:
        return []
    text = ", ".join(f"{site} {plain(z[site])}" for site in sorted(z, key=lambda site: -z[site]))
    return [f"z on held-out runs by site: {text}; the z of the errors is that of the worst site."]


def weighing(rows: list[LawError], model: StudyModel, own: ForceError, z: float) -> list[str]:
    """Return what a model that errs by more than noise does to intervals and to the fit.

    Parameters
    ----------
    rows : the table of laws at a site
    model : the study's model
    own : its error at that site on the training runs
    z : of the whole rig there
    """
    if z <= _MISFIT:
        return []
    lead = "The error exceeds the noise"
    if z != z:
        lead = "The noise of the force is not known, so that there is no z"
    notes = [
        f"{lead}. The intervals come from the error itself: they describe "
        "the best values of this model, not the constants of a damper."
    ]
    same = [row for row in rows if row.law == model.law and not model.effects]
    if same and same[0].error_train.rms < _LESS * own.rms:
        notes.append(
            f"The fit weighs each sample by its noise and by what the model misses, and counts "
            f"outliers less. Least squares of the force alone, as in the table, would leave "
            f"{same[0].error_train.text()} on the training runs instead of {own.text()}."
        )
    return notes


def why(found: Identified) -> str:
    """Return what a step of the history says of an identification."""
    runs, held_out = len(found.train.runs), len(found.holdout.runs) if found.holdout else 0
    lost = ", ".join(found.unidentified)
    return (
        f"fit to {runs} training run{'s' * (runs != 1)}, tested on {held_out} held out; "
        f"{found.fit.agreed} of {found.fit.starts} starts agree"
        + (f"; the data do not identify {lost}" if lost else "")
    )
