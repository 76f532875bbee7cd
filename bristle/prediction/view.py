"""What a closed-loop prediction has found, in words and tables."""

from __future__ import annotations

from collections.abc import Sequence

from ..comparison.names import effect_name, name_of
from ..core.text import capital, command, percent, plain, scale
from ..view.blocks import Next, Table, Text, View, view_of
from .closed_loop_result import CAUSES, KINDS, ClosedLoop, Predicted
from .export import Exported


@view_of(Exported)
def exported_view(found: Exported) -> View:
    """Return the view of an export: the FMU, what it was found to give, how it is run."""
    proof = found.proof.lines(found.fmu.parent) if found.proof else ()
    notes = [Text(capital(note, ()), "note") for note in found.notes]
    return View(
        f"{found.fmu}: the damper with the model's values.",
        (
            *map(Text, proof), *notes,
            Next(command("run", found.scenario), f"applies the motion of {found.run} to it"),
        ),
    )  # fmt: skip


@view_of(ClosedLoop)
def closed_loop_view(found: ClosedLoop) -> View:
    """Return the view of a closed-loop prediction: how wrong it is, its peaks, then its RMS."""
    title, *rest = found.sentences()
    runs = list(dict.fromkeys(row.run for row in found.rows))
    peaks, rms = (_table(found, kind, runs) for kind in KINDS)
    # A command that ends a note is copied to a shell: no full stop is part of it.
    notes = [
        Text(f"{capital(note, runs)}{'' if note.endswith('.') or ':  bristle ' in note else '.'}",
             "note")
        for note in found.notes
    ]  # fmt: skip
    return View(title, (*map(Text, rest), peaks, *notes), (rms,))


def _table(found: ClosedLoop, kind: str, runs: Sequence[str]) -> Table:
    """Return the table of peaks, or of RMS values, of all runs."""
    rows = [row for row in found.rows if row.kind == kind]
    measured = any(row.measured is not None for row in rows)
    parts = any(row.parts for row in rows)
    header = ["run", *(["response", "measured"] if measured else ["response"]), "predicted"]
    header += ["95 % band", *(["widened by"] if parts else []), *(["error"] if measured else [])]
    if found.step:
        header += ["before", *(["error before"] if measured else [])]
    cells = [[row.run, *_cells(row, measured, bool(found.step), parts)] for row in rows]
    one = len(runs) == 1
    title = f"{KINDS[kind]} of {runs[0]}" if one else KINDS[kind]
    header, cells = (header[1:], [row[1:] for row in cells]) if one else (header, cells)
    words = {"run", "response", "widened by"}
    return Table(header, cells, [k for k, name in enumerate(header) if name not in words], title)


def _cells(row: Predicted, measured: bool, with_before: bool, parts: bool) -> list[str]:
    factor, unit = scale(row.unit, max(row.predicted, row.measured or 0.0))

    def text(value: float | None) -> str:
        return "" if value is None else plain(factor * value, 4)

    outside = " (missed)" if row.inside is False else ""
    band = f"{text(row.band[0])} to {text(row.band[1])}{outside}" if row.band else "no band"
    cells = [f"{name_of(row.response)} [{unit}]", *([text(row.measured)] if measured else [])]
    cells += [text(row.predicted), band, *([_widening(row)] if parts else [])]
    cells += [_signed(row.error)] if measured else []
    if with_before:
        cells += [text(row.before), *([_signed(row.error_before)] if measured else [])]
    return cells


def _widening(row: Predicted) -> str:
    """Return the two largest parts of a band's variance."""
    return ", ".join(
        f"{name if name in CAUSES else effect_name(name)} {percent(part, 0)}"
        for name, part in [*row.parts.items()][:2]
    )


def _signed(error: float | None) -> str:
    if error is None:
        return ""
    return f"{'+' if error >= 0.0 else '-'}{percent(abs(error))}"
