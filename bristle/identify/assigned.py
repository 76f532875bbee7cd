"""At which site of a building each effect of a model acts, and what a late load cell does to it."""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import replace

import numpy as np

from ..physics.effect import EFFECTS
from ..physics.laws import law_of_part
from .model import Model
from .response import Response


def at_site(model: Model, site: str, sites: Container[str]) -> Model:
    """Return the part of a model that acts at one site, under that site's law.

    Parameters
    ----------
    model : the damper's law with the effects of all sites
    site : "damper", "layer", "storey1", ...
    sites : all sites that the runs show; without "layer" its effects are part of the damper's force
    """
    effects = tuple(name for name in model.effects if acts_at(name, model, site, sites))
    law = model.law
    if site != "damper":
        law = law_of_part(site).name
    own = {n: v for n, v in model.values.items() if _belongs(n, effects, site)}
    limits = {n: v for n, v in model.limits.items() if _belongs(n, effects, site)}
    fixed = tuple(n for n in model.fixed if _belongs(n, effects, site))
    return Model(law, effects, own, fixed, limits)


def _belongs(name: str, effects: tuple[str, ...], site: str) -> bool:
    effect, dot, _ = name.partition(".")
    return effect in effects if dot else site == "damper"


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
    rest = replace(
        model,
        effects=tuple(name for name in model.effects if name not in late),
        values={n: v for n, v in model.values.items() if n.partition(".")[0] not in late},
    )
    return [corrected(one, lateness(model), 1.0) for one in found], rest


def corrected(response: Response, delay: float, gain: float) -> Response:
    """Return a response whose force is what a cell of that delay [s] and gain has measured."""
    assert response.force is not None
    time = np.arange(len(response.force)) * response.dt
    force = np.interp(time + delay, time, response.force) if delay else response.force
    return replace(response, force=force / gain, noise_force=response.noise_force / gain)
