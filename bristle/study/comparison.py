"""A study's model held against its runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ..compare.comparison import Comparison, compare_held
from ..compare.held import Held, held_runs
from ..compare.names import place_name
from ..compare.sites import compare_sites, site_errors
from ..data.model import StudyModel
from ..errors import StudyError
from ..identify.fit import Problem
from ..identify.model import Model
from ..identify.prepare import prepare
from ..identify.structure import StructureProblem
from ..physics.effect import EFFECTS
from .identification import as_model
from .structure import Pair, Sites, building_of
from .study import Study

QUANTITIES = {"damper": "force", "layer": "force of the isolation layer"}
"""What is compared at a site of a building."""


class Holder:
    """What holds models against the runs of one role, always at the same site.

    Called with a model it returns the runs held against it there.
    """

    def __init__(self, hold: Callable[[StudyModel], list[Held]], seen: bool) -> None:
        self._hold = hold
        self.seen = seen

    def __call__(self, model: StudyModel) -> list[Held]:
        return self._hold(model)

    def compare(self, model: StudyModel) -> Comparison:
        """Compare a model; of a building it knows how the other sites stand."""
        return compare_held(self(model), seen=self.seen)


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

    return Holder(hold, role == "train")


class BuildingHolder(Holder):
    """What holds models against a building's runs, at one site at length and at all in short.

    The site is that where the present model errs the most; where it errs nowhere, the one where the
    law without any effect does. A force that was not measured is reconstructed from equilibrium,
    and carries its noise.
    """

    def __init__(self, study: Study, role: str) -> None:
        super().__init__(self._at_site, role == "train")
        self._sites = Sites(study.runs(), building_of(study, study.model()))
        self._index = 0 if role == "train" else 1
        self._known: tuple[Model, dict[str, tuple[Model, Pair]]] | None = None
        self.site = self._chosen(study.model())

    def compare(self, model: StudyModel) -> Comparison:
        """Compare a model at the site, and tell how it stands at the others."""
        return compare_sites(self._everywhere(model), self.site, seen=self.seen)

    def _everywhere(self, model: StudyModel) -> dict[str, list[Held]]:
        return {name: self._held(name, *one) for name, one in self._lines(model).items()}

    def _at_site(self, model: StudyModel) -> list[Held]:
        return self._held(self.site, *self._lines(model)[self.site])

    def _lines(self, model: StudyModel) -> dict[str, tuple[Model, Pair]]:
        """Return the models by site; those of the last model are kept, for an effect takes long."""
        wanted = as_model(model)
        if self._known is None or self._known[0] != wanted:
            self._known = wanted, self._sites.lines(wanted)
        return self._known[1]

    def _held(self, site: str, model: Model, pair: Pair) -> list[Held]:
        problem = pair[self._index]
        name = _quantity(site, problem)
        return [replace(one, quantity=name, site=site) for one in held_runs(problem, model)]

    def _chosen(self, present: StudyModel) -> str:
        worst = site_errors(self._everywhere(present))[0]
        if not worst.fails and present.effects:
            worst = site_errors(self._everywhere(replace(present, effects={})))[0]
        if not worst.fails and "damper" in self._lines(present):
            return "damper"  # nothing fails anywhere: it is what a study is about
        return worst.site


def _quantity(site: str, problem: StructureProblem) -> str:
    """Return what is compared at a site, in words."""
    if problem.reconstructed:
        return "reconstructed force"
    return QUANTITIES.get(site, f"shear of {place_name(site)}")


HOLDERS: dict[str, Callable[[Study, str], Holder]] = {
    "bench": hold_bench,
    "structure": BuildingHolder,
}
"""What holds models against measured runs, by the rig."""


def compare_study(
    study: Study, model: StudyModel | None = None, *, role: str = "holdout"
) -> Comparison:
    """Hold a study's model, the present one by default, against its runs of one role.

    Of a building it tells all sites, and at length the one where the present model fails the most.

    Raises
    ------
    StudyError, RecordError
        As `holder`, and if nothing tells what error is large.
    """
    return holder(study, role).compare(model or study.model())
