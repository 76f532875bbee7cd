"""The look of every figure: colours that the colour-blind can tell apart, units, direct labels."""

from __future__ import annotations

import io
import textwrap
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.files import writing
from ..core.text import short_z as short_z
from ..errors import not_usable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.gridspec import GridSpec


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


FORMATS = ("png", "svg", "pdf")

# Okabe & Ito (2008), Color Universal Design.
BLUE, VERMILION, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
FLOOR = "#d9efe6"
"""The band of z that noise explains."""
PALE = "#b8b8b8"
COLOURS = (BLUE, VERMILION, GREEN, PURPLE)

_TOGETHER = "\0"  # a blank at which no line is broken; no heading has this character
MARGIN = 0.16
"""Space between text and the edge of a figure [in]."""

RECONSTRUCTED = (
    "Damper parameters are reconstructed, not those of the paper's tables: see docs, Physics."
)


def ramp(count: int) -> list[Any]:
    """Return colours for an ordered series: dark to light, told apart in grey as well."""
    from matplotlib import colormaps

    places = [0.8 * i / max(count - 1, 1) for i in range(count)]
    return [colormaps["plasma"](place) for place in places]


class Page:
    """A figure with a heading that says the finding, room for panels, and a note at the foot.

    Parameters
    ----------
    width, height : float
        Of the panels with their labels [in]; heading and note come on top.
    title, subtitle, note : str
        Any may be empty; lines are broken to the width.
    """

    def __init__(
        self, width: float, height: float, title: str, subtitle: str = "", note: str = ""
    ) -> None:

        parts = [
            (_broken(title, width, 9.2), {"fontsize": 12.5, "fontweight": "bold"}, 0.235),
            (_broken(subtitle, width, 14.8), {"fontsize": 9, "color": GREY}, 0.175),
        ]
        self.head = MARGIN + sum((text.count("\n") + 1) * line for text, _, line in parts if text)
        foot = _broken(note, width, 17.0)
        self.foot = MARGIN + (0.13 * (foot.count("\n") + 1) if foot else 0.0)
        self.width, self.height = width, height + self.head + self.foot
        self.figure: Figure = _pictures()(figsize=(self.width, self.height))
        top = self.height - MARGIN * 0.7
        for text, font, line in parts:
            if text:
                self._text(text, top, va="top", **font)
                top -= (text.count("\n") + 1) * line
        if foot:
            self._text(foot, 0.6 * MARGIN, va="bottom", fontsize=7, color=GREY)

    def _text(self, text: str, inches: float, **look: Any) -> None:
        self.figure.text(MARGIN / self.width, inches / self.height, text, ha="left", **look)

    def grid(
        self,
        rows: int,
        columns: int,
        *,
        left: float = 0.65,
        right: float = 0.25,
        top: float = 0.35,
        bottom: float = 0.5,
        row_gap: float = 0.6,
        column_gap: float = 0.7,
        **ratios: Any,
    ) -> GridSpec:
        """Return a grid for panels; distances in inches, from the edges of the room for panels.

        Parameters
        ----------
        rows, columns : how many panels
        left, right, top, bottom : from the edges to the panels [in], room for their labels
        row_gap, column_gap : between panels [in]
        ratios : passed on to matplotlib's `add_gridspec`, such as `width_ratios`
        """
        inner_width = self.width - left - right
        inner_height = self.height - self.head - self.foot - top - bottom
        panel_width = (inner_width - (columns - 1) * column_gap) / columns
        panel_height = (inner_height - (rows - 1) * row_gap) / rows
        return self.figure.add_gridspec(
            rows,
            columns,
            left=left / self.width,
            right=1.0 - right / self.width,
            bottom=(self.foot + bottom) / self.height,
            top=1.0 - (self.head + top) / self.height,
            wspace=column_gap / panel_width,
            hspace=row_gap / panel_height,
            **ratios,
        )

    def save(self, path: Path, dpi: int = 300) -> None:
        """Write the figure; the same drawing gives the same bytes.

        Raises
        ------
        RunError
            If the format is not known or the file cannot be written, exit code 2.
        """
        kind = path.suffix.lower().lstrip(".")
        if kind not in FORMATS:
            raise not_usable(
                f'{path}: "{path.suffix}" is no format of a figure; there are {", ".join(FORMATS)}.'
            )
        undated = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind)
        with writing(path, not_usable):
            _save(self.figure, path, dpi=dpi, metadata=undated)


def png(drawn: Page | Figure, dpi: int = 160) -> bytes:
    """Return a page or figure as the bytes of a PNG; the same drawing gives the same bytes."""
    file = io.BytesIO()
    _save(drawn.figure, file, format="png", dpi=dpi)  # a figure's `figure` is itself
    return file.getvalue()


def _save(figure: Any, target: Any, **how: Any) -> None:
    with look(), warnings.catch_warnings():
        # A title may be in a script that the font lacks; its boxes are no news per glyph.
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        figure.savefig(target, **how)


def _broken(text: str, width: float, per_inch: float) -> str:
    """Return a text broken into lines that fit; characters per inch follow from the font size.

    A line's last two words stay together: no unit stands alone below its number.
    """
    fits = max(20, int((width - 2 * MARGIN) * per_inch))
    lines = (_TOGETHER.join(line.rsplit(" ", 1)) for line in text.splitlines())
    return "\n".join(textwrap.fill(line, fits) for line in lines).replace(_TOGETHER, " ")


def zero_lines(axes: Axes) -> None:
    """Draw the axes through the origin."""
    axes.axhline(0.0, color=PALE, linewidth=0.8, zorder=1)
    axes.axvline(0.0, color=PALE, linewidth=0.8, zorder=1)


def label(
    axes: Axes, text: str, x: float, y: float, colour: Any, inline: bool = False, **also: Any
) -> None:
    """Write a label beside the line that it names, or into it, in the colour of the line.

    Parameters
    ----------
    axes, text : where and what to write
    x, y : the point that is labelled, in the units of the axes
    colour : of the line
    inline : whether the text stands in the line, on white, and not beside it
    also : passed on to matplotlib's `annotate`, such as `xytext` [points from the point]
    """
    from matplotlib.patheffects import withStroke

    settings: dict[str, Any] = {"fontsize": 8.5, "xytext": (0, 0), **also}
    if inline:
        settings |= {"ha": "center", "va": "center"}
        settings["bbox"] = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
    else:
        settings["path_effects"] = [withStroke(linewidth=2.5, foreground="white")]
    axes.annotate(
        text, (x, y), color=colour, textcoords="offset points", annotation_clip=False, **settings
    )


DPI = 110
"""Dots per inch of what a notebook shows."""


@cache
def _pictures() -> type[Figure]:
    """Return the class of all figures; what draws none does not import matplotlib."""
    from matplotlib.figure import Figure

    class Picture(Figure):
        """A figure outside of pyplot: no window opens, and nothing keeps it but its owner."""

        def _repr_png_(self) -> bytes:
            return png(self, DPI)

    return Picture
