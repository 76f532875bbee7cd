"""What a closed-loop prediction has found, in words and tables."""

from __future__ import annotations

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
            Next(command("run", found.scenario), f"applies the motion of {found.run}"),
        ),
    )  # fmt: skip


@view_of(ClosedLoop)
def closed_loop_view(found: ClosedLoop) -> View:
    """Return the view of a closed-loop prediction: how wrong it is, its peaks, then its RMS."""
    title, *rest = found.sentences()
    runs = list(dict.fromkeys(row.run for row in found.rows))
    peaks, rms = ([_table(found, kind, run) for run in runs] for kind in KINDS)
    # A command that ends a note is copied to a shell: no full stop is part of it.
    notes = [
        Text(f"{capital(note, runs)}{'' if note.endswith('.') or ':  bristle ' in note else '.'}",
             "note")
        for note in found.notes
    ]  # fmt: skip
    return View(title, (*map(Text, rest), *peaks, *notes), tuple(rms))


def _table(found: ClosedLoop, kind: str, run: str) -> Table:
    """Return the table of the peaks, or of the RMS values, of a run."""
    rows = [row for row in found.rows if (row.kind, row.run) == (kind, run)]
    measured = any(row.measured is not None for row in rows)
    parts = any(row.parts for row in rows)
    header = [*(["response", "measured"] if measured else ["response"]), "predicted"]
    header += ["95 % band", *(["widened by"] if parts else []), *(["error"] if measured else [])]
    header += ["error before" if measured else "before"] if found.step else []
    cells = [_cells(row, measured, bool(found.step), parts) for row in rows]
    numbers = [k for k, name in enumerate(header) if name not in ("response", "widened by")]
    return Table(header, cells, numbers, f"{KINDS[kind]} of {run}")


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
        cells.append(_signed(row.error_before) if measured else text(row.before))
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
    size = percent(abs(error))
    return size if size == percent(0.0) else f"{'+' if error > 0.0 else '-'}{size}"
