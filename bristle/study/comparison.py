"""A study's model held against its runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ..compare.comparison import Comparison, compare_held
from ..compare.held import Held, held_runs
from ..identify.fit import Problem
from ..identify.prepare import prepare
from ..identify.response import responses
from ..identify.structure import StructureProblem, damper_run, sliding
from ..physics.building import paper_building, read_building
from ..physics.effect import EFFECTS
from .errors import StudyError
from .identification import as_model
from .model import StudyModel
from .study import Study

Holder = Callable[[StudyModel], list[Held]]


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
    """Return what holds dampers against a building's runs: base motion in, force out.

    A force that was not measured is reconstructed from equilibrium, and carries its noise.
    """
    file = study.model().building
    building = read_building(study.folder / file) if file else paper_building()
    runs = study.runs()
    found = responses(runs.all, building)
    chosen = found[: len(runs.train)] if role == "train" else found[len(runs.train) :]
    reconstructed = any(one.force is None for one in found)
    whole = [damper_run(one, building, "lugre") for one in chosen]
    moving = [replace(run, measured=sliding(one)) for run, one in zip(whole, chosen, strict=True)]

    def hold(model: StudyModel) -> list[Held]:
        # A base that dry friction holds tells nothing of the force of a law that jumps at v = 0.
        part = moving if model.base_law == "bingham" else whole
        held = held_runs(StructureProblem(part, 0, reconstructed), as_model(model))
        return (
            [replace(one, quantity="reconstructed force") for one in held]
            if (reconstructed)
            else held
        )

    return hold


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
