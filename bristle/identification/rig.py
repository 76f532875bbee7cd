"""A rig: its sites, at each of which a model's force is held against a measured one.

A test bench has one site, its damper. A building has several, and equilibrium says which: the
damper where its force is known, what the isolation layer carries beside it, each storey.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..core.text import quantity
from ..data.checks.channels import zero_of_load_cell
from ..data.measurement import Measurement
from ..errors import StudyError
from ..model.model import Model
from ..physics.building import Building, with_damper
from ..physics.effect import AT, EFFECTS, effects_of, plain_name
from ..physics.laws import law_of_part
from .building_motion import Response, responses
from .building_sites import StructurePair, blind_at_rest, device_moves, problems_of
from .error import refuse_empty
from .prepare import prepare
from .problem import Problem, Run
from .search import in_threads

# At which site of a building each effect of a model acts, and what a late load cell does to it.


def at_site(model: Model, site: str, sites: Container[str]) -> Model:
    """Return the part of a model that acts at one site, under that site's law.

    Parameters
    ----------
    model : the damper's law with the effects of all sites
    site : "damper", "layer", "storey1", ...
    sites : all sites that the runs show; without "layer" its effects are part of the damper's force
    """
    effects = tuple(name for name in model.effects if acts_at(name, model, site, sites))
    law = model.base_law if site == DAMPER else law_of_part(site).name
    return replace(model.only(effects, law=site == DAMPER), law=law)


def acts_at(name: str, model: Model, site: str, sites: Container[str]) -> bool:
    """Return whether an effect acts at a site; the number of its storey is the model's, if any.

    Parameters
    ----------
    name : of the effect, by a model's names
    model, site, sites : as in `at_site`
    """
    effect = EFFECTS[name]
    if effect.site != "structure":
        return site == "damper"
    if site.startswith("storey"):
        which = model.value(f"{name}.which") if "which" in effect.parameters else 0.0
        return "spring" in effect.hooks() and which in (0.0, float(site.removeprefix("storey")))
    return "force" in effect.hooks() and site == ("layer" if "layer" in sites else "damper")


def unassigned(model: Model, sites: Sequence[str]) -> list[str]:
    """Return the effects of a model that act at none of the sites that the runs show."""
    assigned = {name for site in sites for name in at_site(model, site, sites).effects}
    return [name for name in model.effects if name not in assigned]


def linear_storeys(effects: Sequence[str]) -> bool:
    """Return whether no effect acts on the springs of a building's storeys."""
    return not any("spring" in EFFECTS[name].hooks() for name in effects)


def late_effects(effects: Sequence[str]) -> list[str]:
    """Return the effects among these that show the force late."""
    known = [EFFECTS[name] for name in effects]
    return [e.name for e in known if e.site == "sensor" and e.shows == "force" and e.late]


def lateness(model: Model) -> float:
    """Return by how much [s] a model's effects show the force late."""
    return sum(model.value(f"{n}.{EFFECTS[n].late[0]}") for n in late_effects(model.effects))


def corrected_for_delay(found: list[Response], model: Model) -> tuple[list[Response], Model]:
    """Return responses whose measured force is set right by how late a model shows it.

    And the rest of that model. Equilibrium needs the force of the same instant as the
    accelerations.
    """
    late = late_effects(model.effects)
    if not late or any(one.force is None for one in found):
        return found, model
    rest = model.only(tuple(name for name in model.effects if name not in late))
    return [corrected(one, lateness(model), 1.0) for one in found], rest


def corrected(response: Response, delay: float, gain: float) -> Response:
    """Return a response whose force is what a cell of that delay [s] and gain has measured."""
    assert response.force is not None
    time = np.arange(len(response.force)) * response.dt
    force = np.interp(time + delay, time, response.force) if delay else response.force
    return replace(response, force=force / gain, noise_force=response.noise_force / gain)


ROLES = ("train", "holdout")
DAMPER = "damper"
_NOT_TOLD = (
    "Springs and damping of the storeys beside it are those of the building's file: equilibrium "
    "does not tell them from the damper's own."
)

_ZERO = (
    "All training runs alike show some {} however they move: the zero of the load cell, or a "
    "preload on the rod. Beside a law without a constant force it is fitted along, left out of the "
    "errors, and not in the FMU."
)

_STILL = (
    "{}: the damper's ends do not move beyond the noise of their velocity, so that the damper is "
    "not judged there."
)


class Seeds(NamedTuple):
    """Seeds of the draws of the motion's error: that of run k is `apart` k more than the first."""

    train: int = 0
    holdout: int = 7
    apart: int = 31


@dataclass(frozen=True, eq=False)
class Site:
    """A place on a rig where a model's force is held against a measured one.

    Parameters
    ----------
    name : str
        "damper", "layer", "storey1" ...
    make : callable
        Returns the runs of a role, "train" or "holdout"; None where no run is held out.
    quantity, unit : str
        What is compared, in words.
    shown : str
        The name that answers give the site: "" for the one of a bench, which goes without saying.
    is_line : bool
        Whether the model there is a line, k x + c v, that is fitted along with the effects and is
        no part of a study's model; else it is the damper's law.
    any_law : bool
        Whether every law can be held against these samples; else some were left out that one law
        cannot tell.
    """

    name: str
    make: Callable[[str], Problem | None] = field(repr=False)
    quantity: str = "force"
    unit: str = "N"
    shown: str = ""
    is_line: bool = False
    any_law: bool = True

    @cached_property
    def train(self) -> Problem:
        """The runs that models are fitted to."""
        found = self.make(ROLES[0])
        assert found is not None
        return found

    @cached_property
    def holdout(self) -> Problem | None:
        """The runs that models are judged on, None where none is held out."""
        return self.make(ROLES[1])

    @property
    def pair(self) -> tuple[Problem, Problem]:
        """The runs of both roles, where some are held out."""
        held_out = self.holdout
        assert held_out is not None
        return self.train, held_out

    def problem_of(self, role: str) -> Problem | None:
        """Return the runs of a role, None where no run is held out."""
        return self.train if role == ROLES[0] else self.holdout


@dataclass(frozen=True, eq=False)
class Rig:
    """The sites of a rig, by name.

    Parameters
    ----------
    sites_for : callable
        A model to the sites that it is held against. A building's depend on it: on its law, on
        whether its storeys stay straight, and on a delay of the force that equilibrium asks for.
    building : Building or None
        What equilibrium is asked of; None on a bench.
    notes : tuple of str
        What weakens an identification on this rig, in sentences.
    """

    sites_for: Callable[[Model], dict[str, Site]] = field(repr=False)
    building: Building | None = None
    notes: tuple[str, ...] = ()

    def sites(self, model: Model) -> dict[str, Site]:
        """Return the sites that a model is held against.

        Raises
        ------
        StudyError
            If an effect of the model acts at no site that these runs show.
        """
        if self.building is None:
            _refuse_on_bench(model)
        found = self.sites_for(model)
        lost = unassigned(model, list(found)) or self._beside_nothing(model, found)
        if lost:
            raise StudyError(
                f"{', '.join(lost)}: acts at no site that these runs show; they show "
                f"{', '.join(found)}."
            )
        return found

    def _beside_nothing(self, model: Model, found: Mapping[str, Site]) -> list[str]:
        """Return the isolation layer's effects where neither it nor a damper beside it is shown."""
        building = self.building
        if building is None or "layer" in found:
            return []
        if building.device(building.studied).on_first:
            return []
        effects = [EFFECTS[name] for name in model.effects if EFFECTS[name].site == "structure"]
        return [one.name for one in effects if "force" in one.hooks()]

    def prepare(self, model: Model) -> None:
        """Prepare all runs now, in place of where they are first asked for.

        Raises as `sites`, and a RecordError where too few samples of a role count.
        """
        for site in self.sites(model).values():
            for role in ROLES:
                problem = site.problem_of(role)
                if problem is not None:
                    refuse_empty(problem.runs)


def _refuse_on_bench(model: Model) -> None:
    """Refuse effects that have no site on a bench, or are named as in a building."""
    effects = {name: EFFECTS[name] for name in model.effects}
    foreign = [name for name, effect in effects.items() if effect.sites == ("structure",)]
    if foreign:
        raise StudyError(f"{', '.join(foreign)}: of a structure, and on a bench there is none.")
    sited = [name for name in effects if AT in name]
    if sited:
        raise StudyError(
            f"{', '.join(sited)}: on a bench all is at the damper, and the plain name is right: "
            f"{', '.join(map(plain_name, sited))}."
        )
    able = {effect.name for effect in effects_of(DAMPER, model.base_law)}
    unfit = [
        name for name, effect in effects.items() if DAMPER in effect.sites and name not in able
    ]
    if unfit:
        raise StudyError(f"{', '.join(unfit)} cannot join the law {model.base_law}.")


def bench_rig(
    train: Sequence[Measurement], holdout: Sequence[Measurement], seeds: Seeds | None = None
) -> Rig:
    """Return the rig of a damper on a test bench: motion prescribed, force measured.

    The motion is smoothed where a role's runs are first asked for.

    Parameters
    ----------
    train, holdout : runs to fit to, and those held out, if any
    seeds : of the draws of the motion's error
    """
    seeds = seeds or Seeds()
    zero = zero_of_load_cell(train)
    runs = {ROLES[0]: (train, seeds.train), ROLES[1]: (holdout, seeds.holdout)}

    def problem(role: str) -> Problem | None:
        measured, first = runs[role]

        def prepared(k: int) -> Run:
            return prepare(measured[k], seed=seeds.apart * k + first)

        if not measured:
            return None
        # The first by itself: it compiles what the others need, or reads it from disk.
        found = Problem([prepared(0), *in_threads(prepared, range(1, len(measured)))])
        return found if zero is None else found.with_free_zero(zero)

    site = Site(DAMPER, problem)
    notes = () if zero is None else (_ZERO.format(quantity(zero, "N")),)
    return Rig(lambda _model: {DAMPER: site}, notes=notes)


def building_rig(
    train: Sequence[Measurement], holdout: Sequence[Measurement], building: Building
) -> Rig:
    """Return the rig of a building with its damper: ground motion in, response out.

    Parameters
    ----------
    train, holdout : runs to fit to, and those held out
    building : its masses count everywhere; its stiffnesses and damping where a force that was not
        measured is reconstructed

    Raises
    ------
    RecordError
        If a channel is missing, or the building has other levels than were measured.
    """
    building = with_damper(building)
    found = responses([*train, *holdout], building)
    notes: tuple[str, ...] = ()
    if any(one.damped for one in found) and any(one.force is None for one in found):
        device = found[0].device
        place = f" ({device.name}, {device.place(building.levels())})" if device.name else ""
        notes = (f"The damper's force{place} was not measured: it is computed from equilibrium.",)
        if not device.on_first:
            notes = (*notes, _NOT_TOLD)
    still = [one.name for one in found if one.damped and not device_moves(one)]
    if 0 < len(still) < len(found):
        notes = (*notes, _STILL.format(", ".join(still)))
    return Rig(_BuildingSites(found, len(train), building), building, notes)


class _BuildingSites:
    """The sites of a building's responses by model, each kind made once."""

    def __init__(self, found: list[Response], count: int, building: Building) -> None:
        self._found, self._building = found, building
        self._count = count  # the first ones are for training
        self._made: dict[tuple[object, ...], dict[str, Site]] = {}

    def __call__(self, model: Model) -> dict[str, Site]:
        straight, late = linear_storeys(model.effects), lateness(model)
        key = (model.base_law, straight, late)
        if key not in self._made:
            plain = self._sites(self._found, model.base_law, straight)
            if late and "layer" in plain:  # equilibrium needs the force of the same instant
                corrected = corrected_for_delay(self._found, model)[0]
                right = self._sites(corrected, model.base_law, straight)
                plain = {name: plain[name] if name == DAMPER else right[name] for name in plain}
            self._made[key] = plain
        return self._made[key]

    def _sites(self, found: list[Response], law: str, straight: bool) -> dict[str, Site]:
        problems = problems_of(
            found[: self._count], found[self._count :], self._building, law, linear_storeys=straight
        )
        return {name: building_site(name, pair, law) for name, pair in problems.items()}


def building_site(name: str, pair: StructurePair, law: str) -> Site:
    """Return a site of a building from its runs of both roles."""
    quantity = f"shear of storey {name.removeprefix('storey')}"
    if name == DAMPER:
        quantity = "reconstructed force" if pair[0].reconstructed else "force"
    elif name == "layer":
        quantity = "force of the isolation layer"
    return Site(
        name, lambda role: pair[ROLES.index(role)], quantity, shown=name, is_line=name != DAMPER,
        any_law=not blind_at_rest(law),
    )  # fmt: skip
