"""How coordinates and sites of a building are named in a sentence."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence

from ..core.text import joined
from ..data.channels import label_name
from ..physics.drive import DRIVES
from ..physics.effect import EFFECTS

_LIBRARY = "bristle.physics.effects."

NAMES = {
    **{f"{name}_rate": f"recent changes of the {name}" for name in DRIVES},
    "dissipated_energy": "the energy dissipated so far",
    "time_since_reversal": "the time since the last reversal",
    "rest": "how long the damper has just been at rest",
    "time": "time",
    "direction": "the direction of motion",
}
OF_STOREY = {"displacement": "drift", "velocity": "drift rate", "speed": "drift speed"}
"""What the motion at a storey is called."""


PROPER = ("Duffing", "Stribeck")
"""Names of effects that begin with that of a person."""


def effect_name(name: str) -> str:
    """Return an effect as people write it, "gas spring"; a user's own as it is typed.

    Parameters
    ----------
    name : as in a model, of one at another site with it: "base_friction@damper"
    """
    key, _, site = name.partition("@")
    effect = EFFECTS.get(key)
    if effect is not None and effect.changes:
        on = joined([label_name(label) for label in effect.labels.values()])
        return f"the dependence of {effect.changes} on {on}" if on else name
    if effect is None or not effect.__module__.startswith(_LIBRARY):
        return name
    title = effect.first_line().partition(":")[0]
    own = title if title.startswith(PROPER) else title[:1].lower() + title[1:]
    return f"{own} of {site_name(site)}" if site else own


def effect_names(names: Iterable[str]) -> str:
    """Return effects as people write them, as a list in words."""
    return joined([effect_name(name) for name in names])


def name_of(coordinate: str, site: str = "") -> str:
    """Return a coordinate as it is named in a sentence, at a site of a building if one is given."""
    if site.startswith("storey"):
        coordinate = OF_STOREY.get(coordinate, coordinate)
    return NAMES.get(coordinate, coordinate.replace("_", " "))


def site_name(site: str) -> str:
    """Return a site as it is named in a sentence: "the isolation layer", "storey 2"."""
    if site.startswith("storey"):
        return f"storey {site.removeprefix('storey')}"
    return {"layer": "the isolation layer"}.get(site, f"the {site}")


def site_names(sites: Sequence[str]) -> str:
    """Return sites as they are named together: "the damper and storeys 1 to 9"."""
    numbers = sorted(
        int(site.removeprefix("storey")) for site in sites if site.startswith("storey")
    )
    names = sorted(site_name(site) for site in sites if not site.startswith("storey"))
    spans: list[str] = []
    for _, group in itertools.groupby(enumerate(numbers), lambda pair: pair[1] - pair[0]):
        row = [number for _, number in group]
        spans += [f"{row[0]} to {row[-1]}"] if len(row) > 2 else [str(number) for number in row]
    if spans:
        names.append(f"storey{'s' * (len(numbers) > 1)} {joined(spans)}")
    return joined(names)
