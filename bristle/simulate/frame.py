"""Results of a run: a pandas frame that knows its units and draws itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from .picture import SHOWN, draw_run
from .summary import Summary, summarise

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

MOST_ROWS = 12
"""Outputs in the table that a notebook shows."""


class Results(pd.DataFrame):
    """Every output of a run at every step: a pandas frame that a notebook shows as table and plot.

    What is made of it, a slice or a sum, is a plain frame; `plot` of that is pandas' own.

    Attributes
    ----------
    index : Index
        Time [s]; row k holds the outputs at t_k, t = 0 included.
    columns : Index
        Outputs by name: "damper.force".
    attrs : dict
        `attrs["units"]` maps columns and "time" to units, `attrs["made"]` tells how the results
        were made, `attrs["complete"]` whether the run came to its end.

    Examples
    --------
    >>> import bristle
    >>> results = bristle.run("bench_sine_bingham", {"run.stop": 0.5})
    >>> results.attrs["units"]["damper.force"], results.attrs["complete"]
    ('N', True)
    >>> figure = results.plot()  # figure.savefig("run.png") keeps it
    """

    @property
    def _constructor(self) -> Callable[..., pd.DataFrame]:
        return pd.DataFrame

    def plot(self, title: str = "") -> Figure:  # type: ignore[override]  # pandas has an accessor
        """Return the figure of the run: accelerations, drifts, voltages, loops of the dampers.

        Parameters
        ----------
        title : str
            Above the panels; by default the scenario's title.
        """
        return draw_run(self, title).figure

    def _repr_html_(self) -> str:
        from ..draw import html
        from ..draw.figure import DPI
        from ..draw.style import png

        made = self.attrs.get("made", {})
        title = str(made.get("title") or made.get("file") or "results")
        state = "" if self.attrs.get("complete", True) else "; INCOMPLETE"
        found = summarise(self)
        rows = [_row(one) for one in found[:MOST_ROWS]]
        more = len(self.columns) - len(rows)
        first, last = float(self.index[0]), float(self.index[-1])
        return html.fragment(
            title,
            html.paragraphs(f"{len(self)} rows from {first:g} to {last:g} s{state}."),
            html.table(["output", "peak", "at [s]", "RMS", "unit"], rows, numbers=(1, 2, 3)),
            html.paragraphs(f"{more} more columns." if more > 0 else ""),
            html.figure(png(draw_run(self), DPI), title),
        )


def _row(one: Summary) -> list[str]:
    """Return an output's cells, in the units of the picture."""
    factor, unit = SHOWN.get(one.unit or "", (1.0, one.unit or ""))
    peak, rms = (f"{factor * value:.4g}" for value in (one.peak, one.rms))
    return [one.name, peak, f"{one.time_of_peak:.4g}", rms, unit]
