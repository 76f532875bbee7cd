"""What a reader of a comparison has to know of it, in sentences."""

from __future__ import annotations

from .cells import Bench
from .entry import Entry


def of_designs(entries: list[Entry]) -> list[str]:
    """Say which designs were made by the comparison, and why."""
    anew = [one.name for one in entries if one.anew]
    if not anew:
        return []
    return [
        f"{', '.join(anew)}: the library's designs belong to its own building and damper. New ones "
        "were made for these, with the same weights brought to their size; a design file with "
        "weights of your own may find better ones (bristle design)."
    ]


def of_engines(bench: Bench, entries: list[Entry]) -> list[str]:
    """Say where two engines stand side by side."""
    stepped = [one.name for one in entries if bench.engine_of(one) == "fmu"]
    if not stepped or len(stepped) == len(entries):
        return []
    return [
        f"{', '.join(stepped)}: stepped as FMUs every {1e3 * bench.step:g} ms. The others are "
        "solved as one system, without coupling error; the engine fmu steps all of them."
    ]
