"""Blocks as HTML, and pages that need nothing else: no network, no script, images inside."""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Iterable, Mapping, Sequence
from html import escape as escape
from pathlib import Path
from typing import Any

import numpy as np

from ..core.files import as_json
from .blocks import Block, Figure, Formula, Table, Text, View

CSS = Path(__file__).with_name("page.css").read_text(encoding="utf-8")

_NARROW = 3
"""Columns up to which a table fits on the screen of a telephone."""

_NOTEBOOK = (
    ".bristle p { max-width: 46rem; margin: .3rem 0; } "
    ".bristle th, .bristle td { text-align: left; } "
    ".bristle th.n, .bristle td.n { text-align: right; } "
    ".bristle tr.strong td { font-weight: 600; } "
    ".bristle figure { margin: .6rem 0; } .bristle img { max-width: 100%; }"
)


def notebook(view: View) -> str:
    """Return what a notebook shows of a result: the whole of its view."""
    from .style import DPI

    return (
        f'<div class="bristle">\n<style>{_NOTEBOOK}</style>\n'
        f"<p><strong>{escape(view.title)}</strong></p>\n"
        f"{blocks((*view.blocks, *view.details), dpi=DPI)}\n</div>"
    )


def answer(view: View) -> str:
    """Return the title and the answer of a view: its words in a frame, the rest below it."""
    words = [one for one in view.blocks if isinstance(one, Text) and one.kind != "note"]
    return "\n".join(
        [
            f'<div class="verdict" style="--tone: var(--{view.tone or "soft"})">',
            f'<div class="kind">{escape(view.title)}</div>',
            blocks(words),
            "</div>",
            blocks(one for one in view.blocks if one not in words),
        ]
    )


def blocks(shown: Iterable[Block], dpi: int = 160) -> str:
    """Return blocks as HTML, notes that follow each other as one list; a page has its own links.

    Figures are drawn here, with `dpi` dots per inch.
    """
    parts, notes = [], list[str]()
    for block in shown:
        if isinstance(block, Text) and block.kind == "note":
            notes.append(block.text)
            continue
        parts += [items(notes), _block(block, dpi)]
        notes = []
    return "\n".join(part for part in [*parts, items(notes)] if part)


def _block(block: Block, dpi: int) -> str:
    if isinstance(block, Text):
        return paragraphs(block.text, kind=block.kind)
    if isinstance(block, Formula):
        return formula(block.exact or block.text)
    if isinstance(block, Table):
        head = f"<h3>{escape(block.title)}</h3>\n" if block.title else ""
        cells = table(block.header, block.rows, block.numbers, block.strong)
        return head + cells + paragraphs(block.note, kind="soft")
    if isinstance(block, Figure):
        from .style import png

        return figure(png(block.draw(), dpi), block.alt, block.caption)
    return ""


def formula(text: str) -> str:
    """Return an equation, as it is typed."""
    return f'<div class="formula"><code>{escape(text)}</code></div>'


def page(title: str, body: Iterable[str], foot: str) -> str:
    """Return a whole HTML document."""
    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en">',
            "<head>",
            '<meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            '<meta name="color-scheme" content="light dark">',
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


def section(title: str, *parts: str, name: str = "") -> str:
    """Return a section; parts are HTML, empty ones are left out. Links lead to its `name`."""
    inner = "\n".join(part for part in parts if part)
    place = f' id="{escape(name)}"' if name else ""
    return f"<section>\n<h2{place}>{escape(title)}</h2>\n{inner}\n</section>"


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
    kinds: Mapping[tuple[int, int], str] | None = None,
) -> str:
    """Return a table.

    Parameters
    ----------
    header : titles of the columns
    rows : texts of each row, one per column; they are escaped
    numbers : indices of the columns that are set right
    strong : indices of the rows that are bold
    kinds : by row and column the class of a cell: "strong" is bold; "good", "bad", "open" are
        verdicts in their colours
    """
    right, bold = set(numbers), set(strong)

    several = len(header) > _NARROW

    def cell(kind: str, i: int, text: str, own: str = "") -> str:
        names = " ".join([*(["n"] if i in right else []), *([own] if own else [])])
        mark = f' class="{names}"' if names else ""
        if kind == "th":
            mark += ' scope="col"'
        elif several:  # where rows stand below each other, each value says what it is
            mark += f' data-of="{escape(header[i])}"'
        return f"<{kind}{mark}>{escape(text)}</{kind}>"

    kind = ' class="wide"' if several else ""
    lines = ['<div class="scroll">', f"<table{kind}>", "<thead><tr>"]
    lines.append("".join(cell("th", i, text) for i, text in enumerate(header)))
    lines.append("</tr></thead>")
    lines.append("<tbody>")
    for k, row in enumerate(rows):
        begin = '<tr class="strong">' if k in bold else "<tr>"
        cells = (cell("td", i, text, (kinds or {}).get((k, i), "")) for i, text in enumerate(row))
        lines.append(begin + "".join(cells) + "</tr>")
    return "\n".join([*lines, "</tbody>", "</table>", "</div>"])


def figure(png: bytes, alt: str, caption: str = "") -> str:
    """Return a figure with the image inside."""
    data = base64.b64encode(png).decode("ascii")
    below = f"\n<figcaption>{escape(caption)}</figcaption>" if caption else ""
    image = f'<img src="data:image/png;base64,{data}" alt="{escape(alt)}">'
    return f"<figure>\n{image}{below}\n</figure>"


# Blocks for the local page, and answers with many numbers: JSON, then arrays as 32-bit floats.

ALIGN = 4


def page_data(shown: Iterable[Block]) -> list[dict[str, Any]]:
    """Return the words and tables of blocks as JSON has them; the page draws its own figures."""
    out: list[dict[str, Any]] = []
    for block in shown:
        if isinstance(block, Table):
            out.append({**block._asdict(), "numbers": list(block.numbers)})
        elif isinstance(block, Text) and block.text:
            out.append(block._asdict())
    return out


def pack(content: Any) -> bytes:
    """Return plain data with numpy arrays in it as bytes; what is not finite in JSON is null.

    Parameters
    ----------
    content : dict, list, tuple, text, number, None, and arrays of any shape, which are made flat
    """
    arrays: list[bytes] = []
    count = 0

    def laid(value: Any) -> Any:
        nonlocal count
        flat = np.ascontiguousarray(value, dtype="<f4").ravel()
        arrays.append(flat.tobytes())
        count += len(flat)
        return {"array": [count - len(flat), len(flat)]}

    head = json.dumps(as_json(content, laid), ensure_ascii=False).encode()
    head += b" " * (-len(head) % ALIGN)
    return b"".join([struct.pack("<I", len(head)), head, *arrays])


def unpack(data: bytes) -> Any:
    """Return what `pack` was given; arrays are flat and of 32-bit floats."""
    (length,) = struct.unpack_from("<I", data)
    floats = np.frombuffer(data, dtype="<f4", offset=4 + length)

    def whole(value: Any) -> Any:
        if isinstance(value, dict):
            if set(value) == {"array"}:
                first, count = value["array"]
                return floats[first : first + count]
            return {key: whole(one) for key, one in value.items()}
        return [whole(one) for one in value] if isinstance(value, list) else value

    return whole(json.loads(data[4 : 4 + length]))
