"""Which column belongs to which level of a building."""

from __future__ import annotations

from dataclasses import replace

from ..channels import DRIVE, is_channel
from .candidates import Candidate

_ENDINGS = {
    "displacement": "displacement",
    "velocity": "velocity",
    "acceleration": "acceleration_absolute",
}


def structure_guesses(candidates: list[Candidate], levels: list[str]) -> dict[str, Candidate]:
    """Return the channels of a structure: ports by name, levels by word or by number.

    A number alone counts the levels from the lowest: with a base, `acc1` is the base's and `acc2`
    that of floor 1, unless another column names the base.
    """
    chosen: dict[str, Candidate] = {}
    named_base = any(c.place == "base" for c in candidates)
    for candidate in sorted(candidates, key=lambda one: -one.rank):
        channel, text = _channel(candidate, levels, named_base)
        if channel is None or channel in chosen or (candidate.rank == 0):
            continue
        chosen[channel] = replace(candidate, reason=f"{candidate.reason}{text}")
    return chosen


def _channel(candidate: Candidate, levels: list[str], named_base: bool) -> tuple[str | None, str]:
    quantity = candidate.quantity
    if is_channel(quantity) and quantity not in _ENDINGS and quantity != "drift":
        return quantity, ""
    if quantity == "drift":
        return (f"drift{candidate.number}", "") if candidate.number else (None, "")
    if quantity in (*DRIVE, "force"):
        return quantity, ""
    if quantity not in _ENDINGS:
        return None, ""
    if candidate.place == "ground":
        return ("ground_acceleration", "") if quantity == "acceleration" else (None, "")
    level, text = candidate.place, ""
    if not level and candidate.number is not None:
        offset = candidate.number - (0 if named_base and levels[0] == "base" else 1)
        if not 0 <= offset < len(levels):
            return None, ""
        level = levels[offset]
        text = f"; number {candidate.number} of the levels, counted from the lowest, is {level}"
    if not level and quantity != "acceleration":
        level, text = levels[0], f"; without a number it is taken as that of {levels[0]}"
    if not level:
        return "ground_acceleration", "; without a number it is taken as that of the ground"
    return f"{level}_{_ENDINGS[quantity]}", text
