"""Tables of text on a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def print_tables(tables: Iterable[tuple[str, Sequence[str], Sequence[Sequence[str]]]]) -> None:
    """Print tables of (title, header, rows), columns aligned, the first one to the left."""
    for title, header, rows in tables:
        print(f"\n{title}")
        widths = [max(len(row[i]) for row in [header, *rows]) for i in range(len(header))]
        for row in [header, *rows]:
            cells = [
                row[0].ljust(widths[0]),
                *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)),
            ]
            print("  " + "  ".join(cells).rstrip())


def aligned(table: Sequence[Sequence[str]], left: int = 2) -> list[str]:
    """Return the lines of a table, its first columns to the left."""
    wide = [max(len(cells[k]) for cells in table) for k in range(len(table[0]))]
    return [
        "  " + "  ".join(
            cell.ljust(width) if k < left else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(cells, wide, strict=True))
        ).rstrip()
        for cells in table
    ]  # fmt: skip
