"""Pieces of an HTML page that needs nothing else: no network, no script, images inside."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape

__all__ = ["CSS", "escape", "figure", "items", "page", "paragraphs", "section", "table", "tiles"]

CSS = """
:root { --ink: #1f2933; --soft: #5b6770; --line: #dfe4e8; --wash: #f6f8f9; --blue: #0072b2;
  --red: #b84a00; --green: #00795a; --purple: #8a4a78; }
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body { margin: 0; color: var(--ink); background: #fff;
  font: 16px/1.55 "Source Sans 3", "Segoe UI", "Helvetica Neue", Helvetica, Arial, sans-serif; }
main { max-width: 57rem; margin: 0 auto; padding: 3.2rem 1.6rem 4rem; }
h1 { font-size: 2.1rem; line-height: 1.15; margin: 0 0 .5rem; letter-spacing: -.01em; }
h2 { font-size: 1.28rem; line-height: 1.3; margin: 3.1rem 0 .7rem; padding-top: .9rem;
  border-top: 1px solid var(--line); }
h3 { font-size: 1rem; margin: 1.6rem 0 .4rem; }
p { margin: .55rem 0; max-width: 46rem; }
.lead { font-size: 1.12rem; }
.soft, figcaption, .about { color: var(--soft); }
.about { margin: 0; }
.notes { white-space: pre-line; border-left: 3px solid var(--line); padding: .1rem 0 .1rem 1rem;
  margin: 1.3rem 0; max-width: 46rem; }
.verdict { border: 1px solid var(--line); border-left: 6px solid var(--tone); border-radius: 4px;
  background: var(--wash); padding: 1rem 1.3rem 1.05rem; margin: 1.7rem 0 1.2rem; }
.verdict .kind { color: var(--tone); font-weight: 600; font-size: .84rem; letter-spacing: .06em;
  text-transform: uppercase; }
.verdict p:first-of-type { margin-top: .15rem; }
.verdict .say { font-size: 1.22rem; line-height: 1.4; }
.tiles { display: flex; flex-wrap: wrap; gap: .8rem; margin: 1.2rem 0; padding: 0; list-style: none; }
.tiles li { flex: 1 1 9.5rem; border: 1px solid var(--line); border-radius: 4px; padding: .65rem .9rem; }
.tiles b { display: block; font-size: 1.55rem; line-height: 1.2; font-weight: 600;
  font-variant-numeric: tabular-nums; }
.tiles span { color: var(--soft); font-size: .86rem; line-height: 1.3; display: block; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: .92rem; margin: .7rem 0 1rem;
  font-variant-numeric: tabular-nums; }
th { text-align: left; font-weight: 600; color: var(--soft); font-size: .82rem; vertical-align: bottom;
  border-bottom: 1.5px solid var(--ink); padding: .35rem .8rem .35rem 0; }
td { border-bottom: 1px solid var(--line); padding: .38rem .8rem .38rem 0; vertical-align: top; }
th.n, td.n { text-align: right; }
td.n { white-space: nowrap; }
tr.strong td { font-weight: 600; }
figure { margin: 1.1rem 0 1.4rem; }
figure img { width: 100%; height: auto; display: block; }
figcaption { font-size: .9rem; line-height: 1.45; margin-top: .5rem; max-width: 46rem; }
code, pre { font-family: "JetBrains Mono", Menlo, Consolas, "DejaVu Sans Mono", monospace; font-size: .86em; }
pre { background: var(--wash); border: 1px solid var(--line); border-radius: 4px; padding: .8rem 1rem;
  overflow-x: auto; line-height: 1.5; }
ul { padding-left: 1.2rem; max-width: 46rem; }
li { margin: .25rem 0; }
footer { margin-top: 3rem; padding-top: .9rem; border-top: 1px solid var(--line); color: var(--soft);
  font-size: .86rem; }
@page { size: A4; margin: 16mm 15mm 18mm; }
@media print {
  body { font-size: 10.2pt; line-height: 1.42; }
  main { max-width: none; padding: 0; }
  h1 { font-size: 20pt; } h2 { font-size: 13pt; margin-top: 1.5rem; break-after: avoid; }
  figure, .verdict, .tiles, tr, pre { break-inside: avoid; }
  .verdict, pre { background: #fff; }
  thead { display: table-header-group; }
  .scroll { overflow: visible; }
}
"""


def page(title: str, body: Iterable[str], foot: str) -> str:
    """Return a whole HTML document."""
    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en">',
            "<head>",
            '<meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            '<meta name="color-scheme" content="light">',
            f"<title>{escape(title)}</title>",
            f"<style>{CSS}</style>",
            "</head>",
            "<body>",
            "<main>",
            *body,
            f"<footer>{foot}</footer>",
            "</main>",
            "</body>",
            "</html>",
            "",
        ]
    )


def section(title: str, *parts: str) -> str:
    """Return a section; parts are HTML, empty ones are left out."""
    inner = "\n".join(part for part in parts if part)
    return f"<section>\n<h2>{escape(title)}</h2>\n{inner}\n</section>"


def paragraphs(*texts: str, kind: str = "") -> str:
    """Return texts as paragraphs; they are plain text."""
    attribute = f' class="{kind}"' if kind else ""
    return "\n".join(f"<p{attribute}>{escape(text)}</p>" for text in texts if text)


def items(texts: Iterable[str]) -> str:
    """Return texts as a list; they are plain text."""
    rows = [f"<li>{escape(text)}</li>" for text in texts]
    return "<ul>\n" + "\n".join(rows) + "\n</ul>" if rows else ""


def tiles(pairs: Iterable[tuple[str, str]]) -> str:
    """Return numbers with what they are, side by side."""
    rows = [f"<li><b>{escape(n)}</b><span>{escape(about)}</span></li>" for n, about in pairs]
    return '<ul class="tiles">\n' + "\n".join(rows) + "\n</ul>"


def table(
    header: Sequence[str],
    rows: Sequence[Sequence[str]],
    numbers: Iterable[int] = (),
    strong: Iterable[int] = (),
) -> str:
    """Return a table; columns in `numbers` are set right, rows in `strong` bold."""
    right, bold = set(numbers), set(strong)

    def cell(kind: str, i: int, text: str) -> str:
        mark = ' class="n"' if i in right else ""
        return f"<{kind}{mark}>{escape(text)}</{kind}>"

    lines = ['<div class="scroll">', "<table>", "<thead><tr>"]
    lines.append("".join(cell("th", i, text) for i, text in enumerate(header)))
    lines.append("</tr></thead>")
    lines.append("<tbody>")
    for k, row in enumerate(rows):
        begin = '<tr class="strong">' if k in bold else "<tr>"
        lines.append(begin + "".join(cell("td", i, text) for i, text in enumerate(row)) + "</tr>")
    return "\n".join([*lines, "</tbody>", "</table>", "</div>"])


def figure(png: bytes, alt: str, caption: str = "") -> str:
    """Return a figure with the image inside."""
    data = base64.b64encode(png).decode("ascii")
    below = f"\n<figcaption>{escape(caption)}</figcaption>" if caption else ""
    image = f'<img src="data:image/png;base64,{data}" alt="{escape(alt)}">'
    return f"<figure>\n{image}{below}\n</figure>"
