"""Results of a run: a pandas frame that knows its units and draws itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from ..view import Viewable

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure


class Results(pd.DataFrame, Viewable):
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
        shown = Results(self)
        shown.attrs = dict(self.attrs)
        if title:
            shown.attrs["made"] = {**self.attrs.get("made", {}), "title": title}
        return Viewable.plot(shown)

    def _repr_html_(self) -> str:
        return Viewable._repr_html_(self)
