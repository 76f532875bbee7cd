"""Blocks as text on a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from itertools import zip_longest
from textwrap import wrap

from .blocks import Block, Formula, Next, Table, Text, View

WIDTH = 100
MOST = 12
"""Lines of an answer, besides its tables, notes and blank lines; the rest is with the details."""
READ = 24
"""Columns that the last cell of a row needs, where it is broken into lines."""
WIDEST = 140
"""Of a table whose last cells have no more than that, before the cells stand below each other."""
_wrapped = partial(wrap, break_long_words=False, break_on_hyphens=False)
"""Breaks a text into lines, and no path or command at a hyphen."""
_NEXT = "Next:  "
_BRISTLE = "bristle "


def text(view: View, *, details: bool = False, elsewhere: str = "") -> str:
    """Return the answer of a view as text, with its details where they are asked for.

    Tables stay, and so do notes, which warn and say what is left out. Of words that go beyond
    `MOST` lines the last ones are details. `elsewhere` is a command that shows the details too.
    """
    out = _wrapped(view.title, WIDTH)
    then = [one for one in view.blocks if isinstance(one, Next)]
    room, kept, cut = MOST - len(out) - len(then) - 1, list[Block](), list[Block]()
    for block in view.blocks:
        words = isinstance(block, Text) and not _is_note(block)
        room -= len(lines(block)) if words else 0
        (cut if room < 0 and words else kept).append(block)
    more = [*cut, *view.details]
    last: Block = Text("")
    for one in (*kept, *(one for one in more if details or _is_note(one))):
        if isinstance(one, Next):
            continue
        gap = type(one) is not type(last) or isinstance(one, Table)
        if own := lines(one):
            out += [*([""] if gap else []), *own]
            last = one
    out += [""] if then else []
    for k, step in enumerate(then):
        why = f"   # {step.why}" if step.why else ""
        out.append(f"{_NEXT if k == 0 else ' ' * len(_NEXT)}{step.command}{why}")
    if not details and any(not _is_note(one) and lines(one) for one in more):
        out.append(f"Details:  --details{f', or {elsewhere}' if elsewhere else ''}")
    return "\n".join(out)


def _is_note(block: Block) -> bool:
    return isinstance(block, Text) and block.kind == "note"


def lines(block: Block) -> list[str]:
    """Return the lines of a block: none of a figure, which a terminal does not show."""
    if isinstance(block, Table):
        title = [block.title] if block.title else []
        note = _wrapped(block.note, WIDTH, initial_indent="  ", subsequent_indent="  ")
        return [*title, *aligned(block.header, block.rows, block.numbers), *note]
    if isinstance(block, Formula):
        return [f"  {block.text}"]
    if isinstance(block, Text) and block.text:
        warns = block.kind != "note" or block.text.startswith(("Error:", "Warning:"))
        words, ordered, order = block.text.rpartition(f":  {_BRISTLE}")
        words = f"{words}:" if ordered else block.text
        told = _wrapped(words if warns else f"Note: {words}", WIDTH)
        return [*told, f"  {_BRISTLE}{order}"] if ordered else told  # to be copied as it is
    return []


def aligned(
    header: Sequence[str], rows: Sequence[Sequence[str]], numbers: Iterable[int] = ()
) -> list[str]:
    """Return the lines of a table; `numbers` are the columns that are set right.

    Of a table that is too wide titles are broken, then long first cells beside numbers, then the
    last cells; where that is not enough, the cells of a row stand below each other.
    """
    right = set(numbers)
    last = len(header) - 1
    cells = [max(map(len, column), default=0) for column in zip(*rows, strict=True)]
    wide = [
        max(len(title), width)
        for title, width in zip(header, cells or [0] * len(header), strict=True)
    ]
    if sum(wide) + 2 * len(wide) > WIDTH and rows:
        words = [max(map(len, title.split()), default=0) for title in header]
        wide = [max(pair) for pair in zip(words, cells, strict=True)]
    named = rows and right >= set(range(1, len(header)))  # numbers follow the first column
    if named:
        longest = max(len(word) for row in rows for word in [*row[0].split(), ""])
        room = WIDTH - sum(wide[1:]) - 2 * len(wide)
        wide[0] = min(wide[0], max(longest, READ, room))
    if sum(wide) + 2 * len(wide) > WIDTH and named:
        fits = max(2, sum(sum(wide[: k + 1]) + 2 * k + 2 <= WIDTH for k in range(len(wide))))
        if fits < len(wide):
            parts = (slice(1, fits), slice(fits, None))  # numbers: the first column stands again
            both = [[[row[0], *row[part]] for row in (header, *rows)] for part in parts]
            tables = (aligned(one[0], one[1:], range(1, len(one[0]))) for one in both)
            return [line for lines in tables for line in (*lines, "")][:-1]
    if sum(wide) + 2 * len(wide) > WIDTH and last not in right:
        room = WIDTH - sum(wide[:last]) - 2 * len(wide)
        wide[last] = min(wide[last], max(READ, room))
    if sum(wide) + 2 * len(wide) > (WIDTH if last in right else WIDEST):
        return [line for row in rows for line in _stacked(header, row)]
    titles = [_wrapped(title, max(1, width)) for title, width in zip(header, wide, strict=True)]
    high = max(map(len, titles))
    table = [*zip(*([""] * (high - len(one)) + one for one in titles), strict=True)]
    for row in rows:
        broken = [
            _wrapped(cell, max(1, wide[k])) or [""] if k in (0, last) else [cell]
            for k, cell in enumerate(row)
        ]
        table += zip_longest(*broken, fillvalue="")
    return [
        "  " + "  ".join(
            cell.rjust(width) if k in right else cell.ljust(width)
            for k, (cell, width) in enumerate(zip(line, wide, strict=True))
        ).rstrip()
        for line in table
    ]  # fmt: skip


def _stacked(header: Sequence[str], row: Sequence[str]) -> list[str]:
    told = [f"{title}: {cell}" for title, cell in zip(header[1:], row[1:], strict=True) if cell]
    inside = (
        _wrapped(one, WIDTH, initial_indent=" " * 4, subsequent_indent=" " * 6) for one in told
    )
    return [f"  {row[0]}", *(line for lines in inside for line in lines)]
