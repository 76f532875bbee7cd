"""Markdown of the generated pages: tables, formulas, units and bounds."""

from __future__ import annotations

import textwrap


def table(titles: list[str], rows: list[list[str]]) -> str:
    """Return a Markdown table."""
    lines = [titles, ["---"] * len(titles), *rows]
    cells = [[cell.replace("|", "\\|") for cell in row] for row in lines]
    return "\n".join("| " + " | ".join(row) + " |" for row in cells)


def formula(text: str) -> str:
    """Return a docstring's text as Markdown: its indented formulas are a block of code."""
    first, _, rest = text.strip("\n").partition("\n")
    if first.startswith(" "):  # an effect's text, which begins with its formula
        first, rest = "", text.strip("\n")
    about, _, equation = first.partition(": ")
    if "=" in equation:
        first = f"{about}:\n\n    {equation}\n"
    return f"{first}\n{textwrap.dedent(rest)}".strip("\n")


def unit(name: str | None) -> str:
    """Return a unit as Markdown, "" where there is none."""
    return f"`{name}`" if name else ""


def span(low: float | None, high: float | None) -> str:
    """Return bounds in words, "" where there are none."""
    return "" if low is None or high is None else f"{low:g} to {high:g}"
