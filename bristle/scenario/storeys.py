"""Check of the stiffness that a building's matrix leaves to each storey."""

from __future__ import annotations

from collections.abc import Iterator

from ..core.config import Document
from ..data.building_file import read_building
from ..errors import PhysicsError
from ..physics.building import ROUNDING, Building
from ..physics.effect import EFFECTS
from .parts import Part


def check_storeys(part: Part, document: Document) -> None:
    """Warn of storeys without a positive stiffness; refuse them where an effect needs it.

    Matrices that were condensed may have such entries. But an effect that takes a share of the
    storey's stiffness pushes outwards there.

    Parameters
    ----------
    part : Part
        Any component; one without a building of its own is passed over.
    document : Document
        Takes what is found.
    """
    if part.building is None:
        return
    try:
        building = read_building(part.building)
    except PhysicsError:  # told where the component is described
        return
    path, where = (*part.path, "building"), f"[components.{part.name}] building"
    levels = ["ground", *building.levels()]
    least = ROUNDING * max(abs(value) for row in building.K for value in row)
    for i, stiffness in enumerate(building.stiffnesses):
        if stiffness > least:
            continue
        text = (
            f"K gives {stiffness:.4g} N/m between {levels[i]} and {levels[i + 1]}; a positive "
            f"stiffness is right, {_right(i)}."
        )
        needing = list(_needing(part, building, i))
        for name in needing:
            place = part.places.get(f"{name}.on", path)
            document.error(
                place, f"{part.name}.{name} needs the stiffness below each level: {text}"
            )
        if not needing:
            document.warning(path, f"{where}: {text}")


def _right(i: int) -> str:
    """Return where in K the stiffness below level i stands."""
    if i == 0:
        return "the sum of the first row of K"
    return f"with a negative entry in row {i + 1}, column {i} of K"


def _needing(part: Part, building: Building, i: int) -> Iterator[str]:
    """Yield the effects in use that need the stiffness below level i."""
    layer = building.isolated and i == 0
    storey = i if building.isolated else i + 1
    for name, effect in EFFECTS.items():
        if part.value(f"{name}.on") is not True or "stiffness" not in effect.needs:
            continue
        only = part.real(f"{name}.which") or 0.0  # 0: every storey
        of_storeys = "storey" in effect.needs or "drift" in effect.needs
        if (layer and not of_storeys) or (of_storeys and not layer and only in (0.0, storey)):
            yield name
