"""What a notebook shows of a limit."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..draw import html
from ..draw.figure import DPI
from ..draw.style import png
from ..quantity import plain
from .picture import draw_limit
from .text import compared, confidence

if TYPE_CHECKING:
    from .result import Limit


def limit_html(found: Limit) -> str:
    """Return a limit as HTML: what is compared, how sure it is, and its picture."""
    title = f"{found.title}: the limit of the {found.statistic} of {found.output}"
    rows = [[name, plain(value, 4), said] for name, value, said in compared(found)]
    return html.fragment(
        title,
        html.table(["control", f"{found.statistic} [{found.unit}]", ""], rows, numbers=(1,)),
        html.items(confidence(found)),
        html.figure(png(draw_limit(found), DPI), title),
    )
