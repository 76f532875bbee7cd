"""A matplotlib figure that a notebook shows as it is, whatever the session's backend."""

from __future__ import annotations

import io
import warnings
from typing import Any

from matplotlib.figure import Figure

from .look import look

DPI = 110
"""Dots per inch of what a notebook shows."""


class Picture(Figure):
    """A figure outside of pyplot: no window opens, and nothing keeps it but its owner."""

    def _repr_png_(self) -> bytes:
        return as_png(self, DPI)


def as_png(figure: Any, dpi: int) -> bytes:
    """Return a figure as the bytes of a PNG; the same drawing gives the same bytes."""
    file = io.BytesIO()
    with look(), warnings.catch_warnings():
        # A title may be in a script that the font lacks; its boxes are no news per glyph.
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        figure.savefig(file, format="png", dpi=dpi)
    return file.getvalue()
