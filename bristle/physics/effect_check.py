"""What the class data of an effect must be for a search to begin from and a verdict to rest on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ..errors import PhysicsError
from .field_check import (
    ANY_BY_NAME,
    GRIDS,
    PARAMETERS,
    SWITCH,
    TABLES,
    TEXT,
    TEXT_BY_NAME,
    TEXTS,
)
from .law_check import PARTS

if TYPE_CHECKING:
    from .effect import Effect

MIMICKED = ("force_bias", "late_drive", "limited_drive")
"""Faults of a sensor that an effect may look like: the force's zero, a drive on record late, or one
that was limited in slew or range behind its record."""


FIELDS = {
    **dict.fromkeys(("name", "site", "kind", "shows", "source", "expect"), TEXT),
    **dict.fromkeys(("family", "absorbed_by", "offset", "mass", "amount"), TEXT),
    **dict.fromkeys(("acts_on", "needs", "bristles", "assumed", "joint", "late"), TEXTS),
    **dict.fromkeys(("sites", "excludes", "start_ties", "mimics", "faults"), TEXTS),
    **dict.fromkeys(("contact", "passive", "zero_at_rest"), SWITCH),
    **dict.fromkeys(("states", "starts", "lookalikes", "labels", "label_means"), TEXT_BY_NAME),
    "channels": TEXT_BY_NAME,
    **dict.fromkeys(("start_grid", "start_limits"), ANY_BY_NAME),
    "parameters": PARAMETERS,
    "tables": TABLES,
    "start_shares": GRIDS,
}
"""The class data of an effect, and of which kind each is."""


def check_sites(
    effect: type[Effect], where: str, known: tuple[str, ...],
    shared: tuple[tuple[str, ...], tuple[str, ...]],
) -> None:  # fmt: skip
    """Refuse sites that there are not, and what an effect of several cannot use at all of them.

    Parameters
    ----------
    effect, where : the class, and how a message begins
    known : the sites that there are
    shared : the hooks and the signals that a damper and a structure both have
    """
    if not (isinstance(effect.sites, tuple) and effect.sites):
        raise PhysicsError(f"{where}: sites = {effect.sites!r}; a tuple of {known} is right.")
    for site in effect.sites:
        if site not in known:
            raise PhysicsError(f"{where}: site {site!r} is none of {known}.")
    if len(effect.sites) == 1:
        return
    if len(set(effect.sites)) < len(effect.sites) or "sensor" in effect.sites:
        raise PhysicsError(f'{where}: sites = {effect.sites}; each once, and "sensor" alone.')
    for what, used, both in (
        ("defines", tuple(effect.hooks()), shared[0]),
        ("needs", effect.needs, shared[1]),
    ):
        wrong = [one for one in used if one not in both]
        if wrong:
            raise PhysicsError(
                f"{where}: {what} {wrong}, which not all of its sites have; {list(both)} they do."
            )


def check_search(effect: type[Effect], where: str) -> None:
    """Refuse starts that a search could not begin from."""
    grids: list[tuple[str, Mapping[str, tuple[float, ...]]]] = [
        ("start_grid", effect.start_grid),
        ("start_limits", effect.start_limits),
    ]
    grids += [("start_shares", grid) for grid in effect.start_shares]
    grids += [("start_ties", dict.fromkeys(effect.start_ties, (0.0,)))]
    for field, grid in grids:
        unknown = [name for name in grid if name not in effect.parameters]
        if unknown:
            raise PhysicsError(
                f"{where}: {field} names {unknown}; its parameters are {list(effect.parameters)}."
            )
        if not all(isinstance(values, tuple) and values for values in grid.values()):
            raise PhysicsError(f"{where}: {field} holds a tuple of numbers for each parameter.")
    told = [name for name in (*effect.labels, *effect.label_means) if name not in effect.assumed]
    if told:
        raise PhysicsError(f"{where}: labels names {told}, which assumed must name as well.")
    told = [n for n in effect.channels if n not in effect.assumed or n not in effect.parameters]
    if told:
        raise PhysicsError(
            f"{where}: channels names {told}; parameters that assumed names as well are right."
        )
    if effect.channels and effect.sites != ("damper",):
        raise PhysicsError(f"{where}: channels are what an effect of the damper alone may follow.")
    wrong = [name for name in effect.channels.values() if not name.isidentifier()]
    if wrong:
        raise PhysicsError(f"{where}: channels names {wrong}; letters, digits and _ are right.")
    if effect.start_grid and effect.start_shares:
        raise PhysicsError(f"{where}: start_grid or start_shares is right, not both.")
    for name, limits in effect.start_limits.items():
        if len(limits) != 2 or not limits[0] < limits[1]:
            raise PhysicsError(f"{where}: start_limits of {name} = {limits}; low, high is right.")
    if bool(effect.start_ties) != hasattr(effect, "tie"):
        raise PhysicsError(f"{where}: start_ties and a static method tie(p, sizes) go together.")


def check_verdict(effect: type[Effect], where: str) -> None:
    """Refuse class data that a verdict could not be made from."""
    for field, given, known in (
        ("mimics", effect.mimics, MIMICKED),
        ("absorbed_by", [effect.absorbed_by] if effect.absorbed_by else [], PARTS),
    ):
        wrong = [one for one in given if one not in known]
        if wrong:
            raise PhysicsError(f"{where}: {field} names {wrong}; there are {list(known)}.")
    for field, name, unit in (("offset", effect.offset, "N"), ("mass", effect.mass, "kg")):
        if name and (name not in effect.parameters or effect.parameters[name].unit != unit):
            raise PhysicsError(f"{where}: {field} = {name!r}; a parameter in {unit} is right.")
    if effect.amount and effect.amount.removeprefix("1/") not in effect.parameters:
        raise PhysicsError(
            f'{where}: amount = {effect.amount!r}; a parameter, or "1/" and a parameter, is right: '
            f"there are {list(effect.parameters)}."
        )
    others = [parameter for name, parameter in effect.parameters.items() if name != effect.offset]
    if effect.offset and not all(p.bounds[0] <= 0.0 <= p.bounds[1] for p in others):
        raise PhysicsError(f"{where}: offset asks that all other parameters may be zero.")
    if effect.faults and effect.site != "sensor":
        raise PhysicsError(f"{where}: faults are those of a sensor's effect.")
    if not all(isinstance(why, str) and why for why in effect.lookalikes.values()):
        raise PhysicsError(f"{where}: lookalikes holds a sentence for each.")
