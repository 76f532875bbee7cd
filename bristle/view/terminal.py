"""Blocks as text on a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from textwrap import wrap

from .blocks import Block, Formula, Next, Table, Text, View

WIDTH = 100
WIDEST = 120
"""Of a table, before the cells of a row stand below each other."""
_NEXT = "Next:  "


def text(view: View, *, details: bool = False, elsewhere: str = "") -> str:
    """Return the answer of a view as text, with its details where they are asked for.

    Notes, which warn and say what is left out, are never left away. `elsewhere` is a command that
    shows the details too.
    """
    more = [one for one in view.details if details or _is_note(one)]
    every = [one for one in (*view.blocks, *more) if not isinstance(one, Next)]
    out = wrap(view.title, WIDTH)
    last: Block = Text("")
    for one in every:
        gap = type(one) is not type(last) or isinstance(one, Table)
        if own := lines(one):
            out += [*([""] if gap else []), *own]
            last = one
    then = [one for one in view.blocks if isinstance(one, Next)]
    out += [""] if then else []
    for k, step in enumerate(then):
        why = f"   # {step.why}" if step.why else ""
        out.append(f"{_NEXT if k == 0 else ' ' * len(_NEXT)}{step.command}{why}")
    if not details and any(not _is_note(one) and lines(one) for one in view.details):
        out.append(f"Details:  --details{f', or {elsewhere}' if elsewhere else ''}")
    return "\n".join(out)


def _is_note(block: Block) -> bool:
    return isinstance(block, Text) and block.kind == "note"


def lines(block: Block) -> list[str]:
    """Return the lines of a block: none of a figure, which a terminal does not show."""
    if isinstance(block, Table):
        title = [block.title] if block.title else []
        note = wrap(block.note, WIDTH, initial_indent="  ", subsequent_indent="  ")
        return [*title, *aligned(block.header, block.rows, block.numbers), *note]
    if isinstance(block, Formula):
        return [f"  {block.text}"]
    if isinstance(block, Text) and block.text:
        return wrap(f"Note: {block.text}" if block.kind == "note" else block.text, WIDTH)
    return []


def aligned(
    header: Sequence[str], rows: Sequence[Sequence[str]], numbers: Iterable[int] = ()
) -> list[str]:
    """Return the lines of a table; `numbers` are the columns that are set right.

    Of a table that is too wide titles are broken; where that is not enough, the cells of a row
    stand below each other.
    """
    right = set(numbers)
    cells = [max(map(len, column), default=0) for column in zip(*rows, strict=True)]
    wide = [
        max(len(title), width)
        for title, width in zip(header, cells or [0] * len(header), strict=True)
    ]
    if sum(wide) + 2 * len(wide) > WIDTH and rows:
        words = [max(map(len, title.split()), default=0) for title in header]
        wide = [max(pair) for pair in zip(words, cells, strict=True)]
    if sum(wide) + 2 * len(wide) > WIDTH and right >= set(range(1, len(header))):
        fits = max(2, sum(sum(wide[: k + 1]) + 2 * k + 2 <= WIDTH for k in range(len(wide))))
        if fits < len(wide):
            parts = (slice(1, fits), slice(fits, None))  # numbers: the first column stands again
            both = [[[row[0], *row[part]] for row in (header, *rows)] for part in parts]
            tables = (aligned(one[0], one[1:], range(1, len(one[0]))) for one in both)
            return [line for lines in tables for line in (*lines, "")][:-1]
    if sum(wide) + 2 * len(wide) > WIDEST:
        return [line for row in rows for line in _stacked(header, row)]
    titles = [wrap(title, width) for title, width in zip(header, wide, strict=True)]
    high = max(map(len, titles))
    head = zip(*([""] * (high - len(one)) + one for one in titles), strict=True)
    return [
        "  " + "  ".join(
            cell.rjust(width) if k in right else cell.ljust(width)
            for k, (cell, width) in enumerate(zip(line, wide, strict=True))
        ).rstrip()
        for line in (*head, *rows)
    ]  # fmt: skip


def _stacked(header: Sequence[str], row: Sequence[str]) -> list[str]:
    told = [f"{title}: {cell}" for title, cell in zip(header[1:], row[1:], strict=True) if cell]
    inside = (wrap(one, WIDTH, initial_indent=" " * 4, subsequent_indent=" " * 6) for one in told)
    return [f"  {row[0]}", *(line for lines in inside for line in lines)]


def print_tables(tables: Iterable[tuple[str, Sequence[str], Sequence[Sequence[str]]]]) -> None:
    """Print tables of (title, header, rows), columns aligned, the first one to the left."""
    for title, header, rows in tables:
        print("", title, *aligned(header, rows, range(1, len(header))), sep="\n")
