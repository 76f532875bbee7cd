"""What a notebook shows of a design."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..draw import html
from ..draw.figure import DPI
from ..draw.style import png
from .picture import draw_result, headline

if TYPE_CHECKING:
    from .result import DesignResult

_SHOWN = {
    "gamma": "gamma",
    "least_gamma": "least gamma of any controller",
    "norm": "closed-loop norm, recomputed",
    "largest_norm": "largest closed-loop norm, recomputed",
    "open_loop_norm": "norm without control",
    "largest_real_part": "largest real part of a pole [1/s]",
    "fastest_pole": "fastest pole [rad/s]",
    "sampled_loop_modulus": "largest modulus of a sampled pole",
}


def design_html(result: DesignResult) -> str:
    """Return a design as HTML: its numbers in a table, and its picture."""
    facts, made = result.facts, result.controller
    size = f"{made.n} states, sampled at {1e3 * made.sample_period:g} ms"
    speeds = f", a table of {made.rows} speeds" if made.rows > 1 else ""
    rows = [[name, f"{facts[key]:.5g}"] for key, name in _SHOWN.items() if key in facts]
    return html.fragment(
        headline(result),
        html.paragraphs(f"{made.kind}: {size}{speeds}."),
        html.table(["what", "value"], rows, numbers=(1,)),
        html.figure(png(draw_result(result), DPI), headline(result)),
    )
