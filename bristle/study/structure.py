"""A building's study: its sites fitted one by one, and judged together.

The damper's law is fitted to the damper's force. The line that the isolation layer and each storey
follow is fitted to what equilibrium leaves there; its effects are fitted with it. Their stiffness
and damping are not part of model.toml: they are fitted anew wherever a model is judged.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..data.model import StudyModel
from ..diagnose.sites import try_effect
from ..diagnose.structure_damper import fit_damper
from ..errors import StudyError
from ..identify.fit import Fit, Model, fit, identify
from ..identify.line import fit_line
from ..identify.placed import at_site, homeless, on_time
from ..identify.response import Response, responses
from ..identify.search_context import refine
from ..identify.structure import StructureProblem, problems_of
from ..identify.table import error_rms, force_rms
from ..physics.building import Building, paper_building, read_building
from ..physics.effect import EFFECTS
from .judged import robust_z
from .study import Runs, Study

Pair = tuple[StructureProblem, StructureProblem]


def building_of(study: Study, model: StudyModel) -> Building:
    """Return the building of a study: its file, or the paper's where it names none."""
    return read_building(study.folder / model.building) if model.building else paper_building()


class Sites:
    """The runs of a building's study as problems by site, and models fitted to them.

    Raises
    ------
    RecordError
        If a channel is missing, or the building has other levels than were measured.
    """

    def __init__(self, runs: Runs, building: Building) -> None:
        self.building = building
        self._found = responses(runs.all, building)
        self._count = len(runs.train)
        self._made: dict[tuple[object, ...], dict[str, Pair]] = {}

    def problems(self, model: Model) -> dict[str, Pair]:
        """Return the problems by site, each for training and held-out runs."""
        straight = "storey_softening" not in model.effects
        late = model.value("delay.time") if "delay" in model.effects else 0.0
        key = (model.law, straight, late)
        if key not in self._made:
            plain = self._pairs(self._found, model.law, straight)
            if late and "layer" in plain:  # equilibrium needs the force of the same instant
                right = self._pairs(on_time(self._found, model)[0], model.law, straight)
                plain = {site: plain[site] if site == "damper" else right[site] for site in plain}
            self._made[key] = plain
        return self._made[key]

    def _pairs(self, found: list[Response], law: str, straight: bool) -> dict[str, Pair]:
        return problems_of(
            found[: self._count], found[self._count :], self.building, law, linear_storeys=straight
        )

    def placed(self, model: Model) -> dict[str, Pair]:
        """Return the problems of a model whose effects all have a site.

        Raises
        ------
        StudyError
            If an effect acts at a site that these runs do not show.
        """
        problems = self.problems(model)
        lost = homeless(model, list(problems))
        if lost:
            raise StudyError(
                f"{', '.join(lost)}: acts at no site that these runs show; they show "
                f"{', '.join(problems)}."
            )
        return problems

    def fitted(self, model: Model, starts: int, begin: Mapping[str, float] | None) -> SiteFits:
        """Return a model fitted at all its sites, from the values in `begin` too, if given."""
        problems = self.placed(model)
        fits: dict[str, Fit] = {}
        if "damper" in problems:
            fits["damper"] = _fit_damper(model, problems, starts, begin or {})
            model = replace(model, values={**model.values, **fits["damper"].model.values})
            problems = self.placed(model)
        for site, pair in problems.items():
            if site != "damper":
                fits[site] = _fit_line(at_site(model, site, problems), site, pair, begin or {})
        return SiteFits(fits, problems)

    def lines(self, model: Model, only: str = "") -> dict[str, tuple[Model, Pair]]:
        """Return by site the model as it stands; only lines are fitted, to the training runs.

        `only` names the one site that is asked for.
        """
        problems = self.placed(model)
        out = {}
        for site, pair in problems.items():
            if only and site != only:
                continue
            own = at_site(model, site, problems)
            if site != "damper":
                line = fit_line(pair[0], own.law).model.values
                held = tuple(name for name in own.values if "." in name)
                own = replace(own, values={**line, **own.values}, held=held)
                if own.effects:
                    own = fit(pair[0], own, with_std=False).model
            out[site] = own, pair
        return out

    def errors(self, model: Model, cutoff: float) -> dict[str, float]:
        """Return z of the worst site, and the RMS error [N] of the forces of all sites together.

        Its share is that of the RMS of all these forces.
        """
        return errors_of_sites(self.lines(model), cutoff)


def errors_of_sites(held: Mapping[str, tuple[Model, Pair]], cutoff: float) -> dict[str, float]:
    """Return the errors of models by site, each of the worst or of all sites together."""
    out: dict[str, float] = {}
    for i, role in enumerate(("train", "holdout")):
        each = [(model, pair[i]) for model, pair in held.values()]
        out[f"z_{role}"] = max(robust_z(problem, model) for model, problem in each)
        squares = [error_rms(problem, model, cutoff) ** 2 for model, problem in each]
        forces = [force_rms(problem.runs, cutoff) ** 2 for _, problem in each]
        out[f"rms_{role}"] = float(np.sqrt(sum(squares)))
        out[f"share_{role}"] = out[f"rms_{role}"] / float(np.sqrt(sum(forces)))
    return out


@dataclass(frozen=True)
class SiteFits:
    """The fits by site, and the problems that they were fitted to."""

    fits: dict[str, Fit]
    problems: dict[str, Pair]

    def one(self, model: Model) -> Fit:
        """Return all sites' fits as one of the whole model; a storey's effect is the mean of all.

        The mean counts each storey by its certainty.
        """
        values, std, lost = dict(model.values), {}, list[str]()
        names = dict.fromkeys(name for found in self.fits.values() for name in found.std)
        for name in names:
            if "." not in name and name not in self._damper():
                continue  # the lines are not part of the model
            told = [
                (found.model.value(name), found.std[name])
                for found in self.fits.values() if name in found.std
            ]  # fmt: skip
            weight = np.array([1.0 / max(spread, 1e-300) ** 2 for _, spread in told])
            values[name] = float(np.dot(weight, [value for value, _ in told]) / weight.sum())
            std[name] = float(weight.sum() ** -0.5)
            unsure = [name in f.unidentified for f in self.fits.values() if name in f.std]
            lost += [name] if all(unsure) else []
        damper = self.fits.get("damper")
        if damper is None:
            lost = [*Model(model.law).free(), *lost]
        else:
            values.update({n: v for n, v in damper.model.values.items() if n not in std})
            lost = list(dict.fromkeys([*damper.unidentified, *lost]))
        return Fit(
            replace(model, values=values), std, max(f.cost for f in self.fits.values()),
            tuple(lost), starts=damper.starts if damper else 1,
            agreed=damper.agreed if damper else 1,
        )  # fmt: skip

    def _damper(self) -> dict[str, float]:
        return self.fits["damper"].std if "damper" in self.fits else {}

    def notes(self) -> list[str]:
        """Return what was found of the lines, one sentence each."""
        out = []
        for site, found in self.fits.items():
            if site != "damper":
                told = [
                    f"{name} = {found.model.value(name):.5g} +- {1.96 * found.std[name]:.2g} {unit}"
                    for name, unit in (("k", "N/m"), ("c", "N s/m")) if name in found.std
                ]  # fmt: skip
                out.append(f"{site}: " + ", ".join(told) + " (fitted along, not in model.toml).")
        return out


def _fit_damper(
    model: Model, problems: Mapping[str, Pair], starts: int, begin: Mapping[str, float]
) -> Fit:
    """Return the damper's law fitted from several starts, and from `begin`."""
    train, held_out = problems["damper"]
    own = at_site(model, "damper", problems)
    layer = [name for name in own.effects if EFFECTS[name].site == "structure"]
    if not layer:
        found = identify(
            train, own.law, own.effects, starts, values=own.values, held=own.held,
            limits=own.limits,
        )  # fmt: skip
    else:  # of a reconstructed force the layer's effects are a part
        first = replace(own, effects=tuple(e for e in own.effects if e not in layer))
        bare = fit_damper(train, at_site(first, "damper", problems))
        grown = bare.model
        for name in layer:
            grown = try_effect(name, grown, train, held_out).model
        found = fit(train, refine(replace(grown, effects=own.effects, held=own.held), train))
        found = replace(found, starts=bare.starts, agreed=bare.agreed)
    if begin:
        known = {n: v for n, v in begin.items() if _of(n, own)}
        other = fit(train, replace(found.model, values={**found.model.values, **known}))
        better = replace(other, starts=found.starts, agreed=found.agreed)
        found = better if other.cost < found.cost else found
    return found


def _of(name: str, model: Model) -> bool:
    effect, dot, _ = name.partition(".")
    return effect in model.effects if dot else name in model.values


def _fit_line(own: Model, site: str, pair: Pair, begin: Mapping[str, float]) -> Fit:
    """Return a layer's or storey's line fitted with its effects."""
    train, held_out = pair
    found = fit_line(train, own.law)
    if not own.effects:
        return found
    grown = replace(found.model, held=own.held, limits=own.limits)
    for name in own.effects:
        grown = try_effect(name, grown, train, held_out).model
    tried = [replace(grown, held=own.held, limits=own.limits)]
    for values in (own.values, {n: v for n, v in begin.items() if _of(n, own) and "." in n}):
        if values:
            tried.append(replace(tried[0], values={**grown.values, **values}))
    return min((fit(train, model) for model in tried), key=lambda one: one.cost)
