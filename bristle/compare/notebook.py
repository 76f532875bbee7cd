"""What a notebook shows of a comparison."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..draw import html
from ..draw.figure import DPI
from ..draw.style import png
from .picture import draw_comparison, headline
from .tables import pattern_table, run_table, site_table

if TYPE_CHECKING:
    from .comparison import Comparison


def comparison_html(comparison: Comparison) -> str:
    """Return a comparison as HTML: sentences, the errors in tables, and its picture."""
    tables = [site_table(comparison)] if comparison.sites else []
    tables += [run_table(comparison), pattern_table(comparison)]
    parts = [html.paragraphs(*comparison.sentences)]
    for title, header, rows in tables:
        parts += [html.paragraphs(f"{title}."), html.table(header, rows, range(1, len(header)))]
    picture = png(draw_comparison(comparison), DPI)
    return html.fragment(headline(comparison), *parts, html.figure(picture, headline(comparison)))
