"""What a closed-loop prediction has found: peaks and RMS, with errors and bands, in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..compare.names import name_of
from ..data.channels import channel_unit
from ..draw.style import percent
from ..quantity import plain, scale

Band = tuple[float, float]
KINDS = {"peak": "Peak", "rms": "RMS"}


@dataclass(frozen=True)
class Predicted:
    """Peak or RMS of one response in one run, in SI.

    `kind` "peak" or "rms"; `measured` None where the response was not measured; `predicted` that of
    the model with its best values, the noise of the sensor added; `band` the 95 % band of what
    would be measured; `before`, `before_band` the same of the model before the last step; None
    where there is none.
    """

    run: str
    response: str
    kind: str
    measured: float | None
    predicted: float
    band: Band | None = None
    before: float | None = None
    before_band: Band | None = None

    @property
    def unit(self) -> str:
        """Its SI unit."""
        return channel_unit(self.response)

    @property
    def error(self) -> float | None:
        """Predicted over measured, less one; None where nothing was measured."""
        return _error(self.predicted, self.measured)

    @property
    def error_before(self) -> float | None:
        """The same of the model before the last step."""
        return _error(self.before, self.measured)

    @property
    def inside(self) -> bool | None:
        """Whether the measured figure is in the band, None where one of the two is missing."""
        if self.measured is None or self.band is None:
            return None
        return self.band[0] <= self.measured <= self.band[1]

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON has it."""
        return {
            **asdict(self), "unit": self.unit, "error": self.error,
            "error_before": self.error_before, "inside": self.inside,
        }  # fmt: skip


@dataclass(frozen=True)
class ClosedLoop:
    """The responses of a building with a model's damper under ground motions alone.

    `rows` per run, response and kind of figure; `draws` how many draws made the bands; `step` the
    last step of the history, "" where there is no model before it; `strokes` [m] how far the damper
    moves in each run; `role` of the runs in the study, "" where they are of no study.
    """

    rows: tuple[Predicted, ...]
    draws: int
    step: str = ""
    notes: tuple[str, ...] = ()
    strokes: tuple[float, ...] = ()
    role: str = ""

    def sentences(self) -> tuple[str, ...]:
        """Return what an engineer would say: how wrong, within the band or not, and before."""
        runs = list(dict.fromkeys(row.run for row in self.rows))
        judged = [row for row in self.rows if row.error is not None]
        given = f"From the ground motion of {_runs(runs)} alone"
        if not judged:
            return (
                f"{given}, the model predicts these responses; nothing was measured to compare "
                "them with.",
            )
        said = [f"{given}, the model predicts {_both(judged, before=False)}."]
        within = [row.inside for row in judged if row.inside is not None]
        if within:
            said.append(
                f"{sum(within)} of {len(within)} measured figures lie within the 95 % band."
            )
        if self.step:
            said.append(f'Before the step "{self.step}" it predicted {_both(judged, before=True)}.')
        return tuple(said)

    def tables(self) -> list[tuple[str, list[str], list[list[str]]]]:
        """Return title, header and rows of a table per run and kind of figure."""
        out = []
        for run in dict.fromkeys(row.run for row in self.rows):
            for kind, title in KINDS.items():
                rows = [row for row in self.rows if (row.run, row.kind) == (run, kind)]
                out.append((f"{title}, {run}", *_table(rows, bool(self.step))))
        return out

    def as_dict(self) -> dict[str, Any]:
        """Return all of it as JSON has it, in SI."""
        return {
            "sentences": list(self.sentences()),
            "role": self.role or None,
            "draws": self.draws,
            "step": self.step or None,
            "rows": [row.as_dict() for row in self.rows],
            "strokes": list(self.strokes),
            "notes": list(self.notes),
        }


def _error(predicted: float | None, measured: float | None) -> float | None:
    if predicted is None or measured is None or measured == 0.0:
        return None
    return predicted / measured - 1.0


def _runs(runs: Sequence[str]) -> str:
    return runs[0] if len(runs) == 1 else f"{len(runs)} runs"


def _both(rows: Sequence[Predicted], *, before: bool) -> str:
    """Return how wrong peaks and RMS are: "the peaks within 3.1 % (median; at worst ...) and"."""
    parts = []
    for kind, title in (("peak", "peaks"), ("rms", "RMS values")):
        errors = {}
        for row in rows:
            error = row.error_before if before else row.error
            if row.kind == kind and error is not None:
                errors[row.response, row.run] = abs(error)
        if errors:
            (response, _), worst = max(errors.items(), key=lambda item: item[1])
            parts.append(
                f"the {title} within {percent(float(np.median(list(errors.values()))))} "
                f"(median; at worst {percent(worst)}, {name_of(response)})"
            )
    return " and ".join(parts)


def _table(rows: Sequence[Predicted], with_before: bool) -> tuple[list[str], list[list[str]]]:
    measured = any(row.measured is not None for row in rows)
    header = ["response", *(["measured"] if measured else []), "predicted", "95 % band"]
    header += ["error"] if measured else []
    header += (["before", "error before"] if measured else ["before"]) if with_before else []
    return header, [_cells(row, measured, with_before) for row in rows]


def _cells(row: Predicted, measured: bool, with_before: bool) -> list[str]:
    size = max(row.predicted, row.measured or 0.0)
    factor, unit = scale(row.unit, size)

    def text(value: float | None) -> str:
        return "-" if value is None else plain(factor * value, 4)

    outside = " *" if row.inside is False else ""
    band = f"{text(row.band[0])} to {text(row.band[1])}{outside}" if row.band else "-"
    cells = [f"{name_of(row.response)} [{unit}]", *([text(row.measured)] if measured else [])]
    cells += [text(row.predicted), band, *([_percent(row.error)] if measured else [])]
    if with_before:
        cells += [text(row.before), *([_percent(row.error_before)] if measured else [])]
    return cells


def _percent(error: float | None) -> str:
    if error is None:
        return "-"
    return f"{'+' if error >= 0.0 else '-'}{percent(abs(error))}"
