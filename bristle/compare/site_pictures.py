"""The picture of a building's sites: z at each, over the band that noise explains."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..draw.style import BLUE, FLOOR, GREY, INK, VERMILION, Page, look, short_z
from .errors import CLOSE
from .names import name_of, site_name
from .sentences import FAINT

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .comparison import Comparison
    from .errors import SiteError

_TICKS = (0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 1000.0)


def sites_height(count: int) -> float:
    """Return the height [in] of a panel of so many sites, with its title and axis."""
    return 0.95 + 0.25 * count


def draw_sites(axes: Axes, sites: Sequence[SiteError], before: Sequence[SiteError] = ()) -> None:
    """Draw z at every site of a building, the top storey above, over the band of noise.

    Small dots are runs, the large one all of them with the 95 % interval; `before` are the sites of
    an earlier model, drawn as rings.
    """
    shown = sorted((one for one in sites if one.identifiable), key=lambda one: _floor(one.site))
    earlier = {one.site: one.z for one in before if one.identifiable}
    axes.set_xscale("log")
    axes.axvspan(1.0 / CLOSE, CLOSE, color=FLOOR, lw=0.0)
    for y, one in enumerate(shown):
        colour = VERMILION if one.fails else BLUE
        axes.plot(one.z_interval, [y, y], color=colour, lw=1.6)
        axes.plot([run.z for run in one.runs], [y] * len(one.runs), ".", ms=4, color=GREY)
        axes.plot([one.z], [y], "o", ms=5.5, color=colour)
        if one.site in earlier:
            axes.plot([earlier[one.site]], [y], "o", ms=6.5, mfc="none", mec=GREY, mew=1.1)
        pattern = one.pattern if one.fails and one.pattern and one.pattern.share >= FAINT else None
        turns = (
            f", along {name_of(pattern.coordinate, one.site).removeprefix('the ')}"
            if pattern
            else ""
        )
        axes.text(1.02, y, f"z = {short_z(one.z)}{turns}", transform=axes.get_yaxis_transform(),
                  va="center", fontsize=8.5, color=colour if one.fails else INK)  # fmt: skip
    names = [site_name(one.site).removeprefix("the ") for one in shown]
    axes.set_yticks(range(len(shown)), names, fontsize=9, color=INK)
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(-0.6, len(shown) - 0.4)
    every = [z for one in shown for z in (one.z, *one.z_interval, *(r.z for r in one.runs))]
    every += list(earlier.values())
    low, high = min([*every, 0.7]), max([*every, 2.0])
    axes.set_xlim(0.9 * max(low, 0.1), 1.15 * high)
    steps = [z for z in _TICKS if axes.get_xlim()[0] <= z <= axes.get_xlim()[1]]
    axes.set_xticks(steps, [f"{z:g}" for z in steps])
    axes.xaxis.set_minor_formatter(lambda value, _: "")
    axes.grid(visible=False, axis="y")
    axes.set_title("error / noise (z) at every site; green: noise floor")


def _floor(site: str) -> int:
    """Return where a site is drawn, from below: damper, layer, storeys."""
    if site.startswith("storey"):
        return int(site.removeprefix("storey"))
    return {"damper": -1}.get(site, 0)


def sites_page(now: Comparison, before: Comparison | None, width: float) -> Page:
    """Return z at every site of a building, and of the model before the last added effect."""
    with look():
        page = Page(width, sites_height(len(now.sites)), "")
        grid = page.grid(1, 1, top=0.35, bottom=0.35, left=1.2, right=2.9)
        draw_sites(page.figure.add_subplot(grid[0, 0]), now.sites, before.sites if before else ())
    return page
