"""A limit in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..quantity import plain

if TYPE_CHECKING:
    from .result import Limit

AGREE = 0.02
"""Share by which starts that agree differ at most."""
TRUST = 0.01
"""Share by which the coupled engine may find another value than the search."""


def compared(found: Limit) -> list[tuple[str, float, str]]:
    """Return what is compared: name, value, and what is to be said of it."""
    unit, (at, best) = found.command_unit, found.best_constant
    levels = sorted(found.constant)
    rows = [(f"constant {V:g} {unit}", found.constant[V], "") for V in (levels[0], levels[-1])]
    rows.append((f"the scenario's own {found.command}", found.as_it_is, ""))
    rows.append((f"best constant {found.command}, known in advance", best, f"{at:g} {unit}"))
    rows += [
        (f"receding horizon, {seconds:g} s of preview", value, _below(value, best))
        for seconds, value in found.previews.items()
    ]
    rows.append(
        (f"limit: any {found.command}, motion known", found.value, _below(found.value, best))
    )
    if found.bound is not None:
        said = f"any force up to {plain(found.most_force)} N that gives no energy"
        rows.append(("lower bound", found.bound, said))
    return rows


def confidence(found: Limit) -> list[str]:
    """Return how sure a limit is, a sentence each."""
    values = ", ".join(plain(start.value, 4) for start in found.starts)
    count = len(found.starts)
    said = [f"{found.agreeing} of {count} starts agree within {100 * AGREE:g} %: {values}."]
    apart = abs(found.value / found.searched - 1.0)
    word = "confirms" if apart <= TRUST else "does not confirm"
    said.append(
        f"The coupled engine {word} the value: {plain(found.value, 4)}, "
        f"the search's own {plain(found.searched, 4)}."
    )
    if found.bound is None:
        said.append("No lower bound: the damper has effects, or the convex program failed.")
    if not found.sure:
        said.append("Not sure: more starts (--starts 8) may find less.")
    return said


def _below(value: float, best: float) -> str:
    share = 100.0 * (1.0 - value / best)
    return f"{abs(share):.0f} % {'below' if share >= 0.0 else 'above'} the best constant"
