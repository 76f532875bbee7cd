"""A study's model held against its runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ..compare.comparison import Comparison, compare_held
from ..compare.held import Held, held_runs
from ..identify.fit import Problem
from ..identify.prepare import prepare
from ..physics.effect import EFFECTS
from .errors import StudyError
from .identification import as_model
from .judged import robust_z
from .model import StudyModel
from .structure import Sites, building_of
from .study import Study

Holder = Callable[[StudyModel], list[Held]]

QUANTITIES = {"damper": "force", "layer": "force of the isolation layer"}
"""What is compared at a site of a building."""

_MISFIT = 1.15  # z above which an error is more than noise


def holder(study: Study, role: str = "holdout") -> Holder:
    """Return what holds models against the runs of one role, "holdout" or "train".

    The runs are read and prepared once, so that several models can be held against them.

    Raises
    ------
    StudyError
        If this rig cannot be compared yet.
    RecordError
        If a run cannot be read or lacks a channel that is needed.
    """
    make = HOLDERS.get(study.settings.rig)
    if make is None:
        raise StudyError(f'{study.folder}: rig = "{study.settings.rig}" is not compared yet.')
    return make(study, role)


def hold_bench(study: Study, role: str) -> Holder:
    """Return what holds dampers against bench runs: motion prescribed, force measured."""
    shift = 7 if role == "holdout" else 0  # the same draws as an identification
    runs = getattr(study.runs(), role)
    problem = Problem([prepare(run, seed=31 * k + shift) for k, run in enumerate(runs)])

    def hold(model: StudyModel) -> list[Held]:
        foreign = [name for name in model.effects if EFFECTS[name].site == "structure"]
        if foreign:
            raise StudyError(f"{', '.join(foreign)}: of a structure, and on a bench there is none.")
        return held_runs(problem, as_model(model))

    return hold


def hold_structure(study: Study, role: str) -> Holder:
    """Return what holds models against a building's runs at one site, the same for all models.

    It is the site where the present model errs the most; where it errs nowhere, the one where the
    law without any effect does. A force that was not measured is reconstructed from equilibrium,
    and carries its noise.
    """
    present = study.model()
    sites = Sites(study.runs(), building_of(study, present))
    index = 0 if role == "train" else 1
    site, z = _worst(sites, present, index)
    if z <= _MISFIT and present.effects:
        site, z = _worst(sites, replace(present, effects={}), index)
    if z <= _MISFIT:  # nothing fails anywhere: the damper is what a study is about
        site = "damper" if "damper" in sites.problems(as_model(present)) else site

    def hold(model: StudyModel) -> list[Held]:
        own, pair = sites.lines(as_model(model), only=site)[site]
        held = held_runs(pair[index], own)
        name = "reconstructed force" if pair[index].reconstructed else QUANTITIES.get(site, "force")
        name = f"shear of {site}" if site.startswith("storey") else name
        return [replace(one, quantity=name) for one in held]

    return hold


def _worst(sites: Sites, model: StudyModel, index: int) -> tuple[str, float]:
    """Return the site where a model errs the most, and z there."""
    held = sites.lines(as_model(model))
    z = {site: robust_z(pair[index], own) for site, (own, pair) in held.items()}
    site = max(z, key=lambda name: z[name])
    return site, z[site]


HOLDERS: dict[str, Callable[[Study, str], Holder]] = {
    "bench": hold_bench,
    "structure": hold_structure,
}
"""What holds models against measured runs, by the rig."""


def compare_study(
    study: Study, model: StudyModel | None = None, *, role: str = "holdout"
) -> Comparison:
    """Hold a study's model, the present one by default, against its runs of one role.

    Raises
    ------
    StudyError, RecordError
        As `holder`, and if nothing tells what error is large.
    """
    held = holder(study, role)(model or study.model())
    return compare_held(held, seen=role == "train")
