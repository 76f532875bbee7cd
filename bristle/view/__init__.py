"""Results as blocks, and what renders them: a terminal, a report, a notebook, the local page."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from ..core.text import shown
from ..errors import RunError
from .blocks import VIEWS, Figure, Text, View

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawn


class Viewable:
    """A result with a view: a Python shell shows its words, a notebook its tables and figures.

    The `view.py` beside the result is imported when a result of its package is first shown.
    """

    def view(self) -> View:
        """Return what the result shows, as blocks."""
        kinds = type(self).__mro__
        if not any(kind in VIEWS for kind in kinds):
            import_module(f"{type(self).__module__.rpartition('.')[0]}.view")
        return next(VIEWS[kind] for kind in kinds if kind in VIEWS)(self)

    def plot(self) -> Drawn:
        """Return the result's figure.

        Raises
        ------
        RunError
            If it has none, such as an ensemble of which fewer than two runs are done.
        """
        view = self.view()
        if (figure := next(view.every(Figure), None)) is None:
            raise RunError(f"{view.title}: there is nothing to draw.")
        return figure.draw().figure

    def __repr__(self) -> str:
        view = self.view()
        return shown(self, view.title, [one.text for one in view.blocks if isinstance(one, Text)])

    def _repr_html_(self) -> str:
        from .html import notebook

        return notebook(self.view())
