"""The settings of matplotlib that all figures share."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

INK, GREY = "#222222", "#666666"

_STYLE: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 9,
    "text.color": INK,
    "text.parse_math": False,  # titles and names are a user's; a $ in them is a $
    "axes.labelcolor": GREY,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": GREY,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "grid.color": "#ececec",
    "grid.linewidth": 0.7,
    "axes.axisbelow": True,
    "axes.titlelocation": "left",
    "axes.titlesize": 10,
    "axes.titlepad": 7,
    "lines.linewidth": 1.3,
    "lines.solid_capstyle": "round",
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "legend.frameon": False,
    "agg.path.chunksize": 10000,
    "svg.fonttype": "none",
    "svg.hashsalt": "bristle",
}


@contextmanager
def look() -> Iterator[None]:
    """Apply the style within a `with` block; settings of the user stay as they are."""
    from matplotlib import rc_context, rcParamsDefault

    settings: dict[Any, Any] = {k: v for k, v in rcParamsDefault.items() if not _of_backend(k)}
    settings.update(_STYLE)
    with rc_context(settings):
        yield


def _of_backend(key: str) -> bool:
    # Those of interactive backends, and those that matplotlib warns of when they are set.
    return key.startswith(("backend", "toolbar", "webagg", "interactive", "animation", "keymap"))
