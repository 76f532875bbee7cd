"""The figure of a passive optimum: one curve per ground motion over the constant voltage."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ..draw.style import INK, PALE, Page, label, look, ramp

if TYPE_CHECKING:
    from .passive import Passive

_DPI = 160


def passive_figure(found: Passive, path: str | Path) -> None:
    """Draw the judged output over the voltage, the least of each motion marked, into a file.

    Raises
    ------
    RunError
        If the file cannot be written or its ending is no format.
    """
    draw_passive(found).save(Path(path), dpi=_DPI)


def draw_passive(found: Passive) -> Page:
    """Return the figure, drawn and not yet written."""
    with look():
        return _page(found)


def _page(found: Passive) -> Page:
    fair = found.goals["regret"]
    what = found.what
    title = f"Best constant voltage for {len(found.motions)} ground motions: {fair.voltage:.2g} V"
    subtitle = (
        f"{what} over the voltage. Ring: least for the motion. Dashed: the "
        f"voltage that is at most {100 * (fair.value - 1):.0f} % above the least for any of them."
    )
    page = Page(7.6, 4.7, title, subtitle)
    axes = page.figure.add_subplot(page.grid(1, 1, left=0.5, right=1.9)[0, 0])
    axes.axvline(fair.voltage, color=PALE, linestyle=(0, (4, 3)), linewidth=1.2)
    colours = ramp(len(found.motions))
    for motion, values, best, colour in zip(
        found.motions, found.values, found.best, colours, strict=True
    ):
        axes.plot(found.grid, values, color=colour, linewidth=1.6)
        axes.plot(
            best.voltage, best.value, "o", markersize=8, markerfacecolor="white",
            markeredgecolor=INK,
        )  # fmt: skip
        label(axes, f"{best.value:.3g}", best.voltage, best.value, INK, xytext=(0, 8), ha="center")
        end, last = float(found.grid[-1]), float(values[-1])
        label(axes, motion.name, end, last, colour, xytext=(8, 0), va="center")
    axes.set_title(f"{what} [{found.unit}]")
    axes.set_xlabel("voltage [V]")
    axes.set_ylim(0.0, 1.06 * float(found.values.max()))
    return page
