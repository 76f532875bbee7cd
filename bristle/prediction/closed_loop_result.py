"""What a closed-loop prediction has found: peaks and RMS, with errors and bands, in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from ..comparison.names import effect_name, name_of
from ..core.text import command, percent, plain, scale
from ..data.channels import channel_unit
from ..model.draws import widest
from ..view import Viewable

Band = tuple[float, float]
KINDS = {"peak": "Peaks", "rms": "RMS"}
PARAMETERS, MISSED = "the parameters", "what the model misses"
CAUSES = (PARAMETERS, MISSED)
"""Causes of a band beside effects that the runs do not exclude."""


@dataclass(frozen=True)
class Predicted:
    """Peak or RMS of one response in one run, in SI.

    `kind` "peak" or "rms"; `measured` None where the response was not measured; `predicted` that of
    the model with its best values, the noise of the sensor added; `band` the 95 % band of what
    would be measured; `before` the figure of the model before the last step, None where there is
    none. `parts` is which share of the band's variance is from what, the largest
    first, where effects that the runs do not exclude are part of it.
    """

    run: str
    response: str
    kind: str
    measured: float | None
    predicted: float
    band: Band | None = None
    before: float | None = None
    parts: dict[str, float] = field(default_factory=dict)

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

    @property
    def width(self) -> float:
        """The width of the band over the figure; 0 without a band."""
        if self.band is None or self.predicted == 0.0:
            return 0.0
        return (self.band[1] - self.band[0]) / self.predicted

    def told(self) -> str:
        """Return the figure with its band, "12.1 mm, 95 % band 11.6 to 12.9 mm"."""
        factor, unit = scale(self.unit, self.predicted)
        low, high = self.band or (self.predicted, self.predicted)
        shown = [plain(factor * value) for value in (self.predicted, low, high)]
        return f"{shown[0]} {unit}, 95 % band {shown[1]} to {shown[2]} {unit}"

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON has it."""
        return {
            **asdict(self), "unit": self.unit, "error": self.error,
            "error_before": self.error_before, "inside": self.inside,
        }  # fmt: skip


@dataclass(frozen=True, repr=False)
class ClosedLoop(Viewable):
    """The responses of a building with a model's damper under ground motions alone.

    `rows` per run, response and kind of figure; `draws` how many draws made the bands; `step` the
    last step of the history, "" where there is no model before it; `strokes` [m] how far the damper
    moves in each run; `role` of the runs in the study, "" where they are of no study; `folder` of
    the study, for the next command.
    """

    rows: tuple[Predicted, ...]
    draws: int
    step: str = ""
    notes: tuple[str, ...] = ()
    strokes: tuple[float, ...] = ()
    role: str = ""
    folder: str = "FOLDER"

    def sentences(self) -> tuple[str, ...]:
        """Return what an engineer would say: how wrong, within the band or not, and before."""
        runs = list(dict.fromkeys(row.run for row in self.rows))
        judged = [row for row in self.rows if row.error is not None]
        given = f"From the ground motion of {_runs(runs)} alone"
        if not judged:
            return (
                f"{given}, the model predicts these responses; nothing was measured to compare "
                "them with.",
                *([f'Before: by the model before the step "{self.step}".'] if self.step else []),
                *self._limits(),
            )
        said = [f"{given}, the model predicts {_both(judged, before=False)}."]
        within = [row.inside for row in judged if row.inside is not None]
        if within:
            said.append(
                f"{sum(within)} of {len(within)} measured figures lie within the 95 % band."
            )
        if self.step:
            said.append(f'Before the step "{self.step}" it predicted {_both(judged, before=True)}.')
        return (*said, *self._limits())

    def _limits(self) -> tuple[str, ...]:
        """Return the sentences on a band with what limits leave open; none without."""
        rows = [row for row in self.rows if row.parts and row.band is not None]
        if not rows:
            return ()
        least = max((row for row in rows if row.kind == "peak"), key=lambda row: row.width)
        first, share = next(iter(least.parts.items()))
        open_effect = first not in CAUSES
        said = (
            f"The least certain peak is that of {name_of(least.response)} in {least.run}: "
            f"{least.told()}; {percent(share, 0)} of the band's variance is "
            + (
                f"{effect_name(first)}, which the runs do not exclude."
                if open_effect
                else f"{first}."
            )
        )
        most, share = widest([row.parts for row in rows], CAUSES)
        if not most:
            return (said, "No effect that the runs do not exclude widens the bands by much.")
        return (
            said,
            f"Over all figures {effect_name(most)} widens the bands most, by {percent(share, 0)} "
            "of the variance. A test that shows it would narrow them:  "
            f"{command('plan', self.folder, '--see', most.partition(' ')[0])}",
        )

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
