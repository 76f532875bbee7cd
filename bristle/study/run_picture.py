"""The picture of a measured run: its channels over time."""

from __future__ import annotations

from ..data.measurement import Measurement
from ..draw.style import BLUE, VERMILION, Page, look

_SCALES = {"m": (1e3, "mm"), "m/s": (1e3, "mm/s")}
_ROW = 1.15
"""Height of a channel's row [in]."""
_ROWS = 8
_SHOWN = 4000  # samples per line: more are not seen


def draw_run(run: Measurement) -> Page:
    """Return the channels of a run over time; samples that were not measured are marked."""
    channels = list(run.channels)[:_ROWS]
    every = max(1, len(run.time) // _SHOWN)
    missing = ~run.measured
    with look():
        about = f"{run.sampling.rate:.4g} Hz, {run.duration:.4g} s"
        more = f" Not shown: {', '.join(list(run.channels)[_ROWS:])}." * (len(run.channels) > _ROWS)
        gaps = " Red: not measured, filled in." if missing.any() else ""
        page = Page(9.2, _ROW * len(channels) + 0.4, run.name, f"{about}.{gaps}{more}")
        grid = page.grid(len(channels), 1, top=0.35, bottom=0.5, left=0.7, row_gap=0.42)
        shared = None
        for row, channel in enumerate(channels):
            axes = shared = page.figure.add_subplot(grid[row, 0], sharex=shared)
            factor, unit = _SCALES.get(run.units[channel], (1.0, run.units[channel]))
            values = factor * run[channel]
            axes.plot(run.time[::every], values[::every], color=BLUE, lw=0.8)
            axes.plot(run.time[missing], values[missing], ".", ms=3.0, color=VERMILION)
            axes.set_title(f"{channel.replace('_', ' ')} [{unit}]")
            axes.margins(x=0.0)
            axes.tick_params(labelbottom=row == len(channels) - 1)
        if shared is not None:
            shared.set_xlabel("time [s]", loc="right", labelpad=0)
    return page
