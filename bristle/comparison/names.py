"""How coordinates and sites of a building are named in a sentence."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from ..physics.drive import DRIVES

NAMES = {
    **{f"{name}_rate": f"recent changes of the {name}" for name in DRIVES},
    "dissipated_energy": "the energy dissipated so far",
    "time_since_reversal": "the time since the last reversal",
    "rest": "the recent time at rest",
    "time": "time",
    "direction": "the direction of motion",
}
OF_STOREY = {"displacement": "drift", "velocity": "drift rate", "speed": "drift speed"}
"""What the motion at a storey is called."""


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


def joined(names: Sequence[str]) -> str:
    """Return names as a list in words: "a, b and c"."""
    return " and ".join(part for part in (", ".join(names[:-1]), *names[-1:]) if part)
