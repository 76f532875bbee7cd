"""Markdown of the generated pages: tables, formulas, units and bounds."""

from __future__ import annotations

import re
import textwrap

from bristle.model.equations import formulas
from bristle.view.formula import formula as formula_html


def table(titles: list[str], rows: list[list[str]]) -> str:
    """Return a Markdown table."""
    lines = [titles, ["---"] * len(titles), *rows]
    cells = [[cell.replace("|", "\\|") for cell in row] for row in lines]
    return "\n".join("| " + " | ".join(row) + " |" for row in cells)


def formula(text: str) -> str:
    """Return a docstring's text as Markdown, its formulas set by the browser (MathML)."""
    first, _, rest = text.strip("\n").partition("\n")
    if first.startswith(" "):  # an effect's text, which begins with its formula
        first, rest = "", text.strip("\n")
    lines = [first, *textwrap.dedent(rest).splitlines()]
    about, _, equation = first.partition(": ")
    if "=" in equation:
        set_ = [formula_html(one) for one in formulas(first)]
        lines[:1] = [f"{about}:", "", *set_, ""]
    block = [k for k, line in enumerate(lines) if line.startswith("    ")]
    if block and any("=" in lines[k] for k in block):
        told = [piece for k in block for piece in _pieces(lines[k].strip())]
        lines[block[0] : block[-1] + 1] = told
    return "\n".join(lines).strip("\n")


def _pieces(line: str) -> list[str]:
    """Return the formulas of a line of a docstring set, and the prose between them, a line each."""
    return [
        f"{formula_html(one)}\n" if "=" in one else f"{one}\n"
        for one in re.split(r"[,;]\s{2,}", line)
    ]


def unit(name: str | None) -> str:
    """Return a unit as Markdown, "" where there is none."""
    return f"`{name}`" if name else ""


def span(low: float | None, high: float | None) -> str:
    """Return bounds in words, "" where there are none."""
    return "" if low is None or high is None else f"{low:g} to {high:g}"
