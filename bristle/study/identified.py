"""What an identification of a study's model found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..data.model import StudyModel
from ..identify.fit import Fit, Problem
from ..identify.rig_fit import SiteModel
from ..identify.table import LawError
from .history import Step


@dataclass(frozen=True)
class Identified:
    """What an identification found.

    `fit` in SI; `model` the study's model with the values; `table` the errors of the laws after
    the low-pass at `cutoff` [Hz]; `before`, `after` errors of the two models; `notes` what to
    know; `step` the history's new step, None where nothing was written; `at` the site that a
    picture shows, with the part of the model that predicts its runs.
    """

    fit: Fit
    model: StudyModel
    table: list[LawError]
    cutoff: float
    before: dict[str, float]
    after: dict[str, float]
    notes: tuple[str, ...]
    step: Step | None
    at: SiteModel

    @property
    def train(self) -> Problem:
        """The runs at that site that the model was fitted to."""
        return self.at.site.train

    @property
    def holdout(self) -> Problem | None:
        """The runs at that site that the model was judged on, None where none is held out."""
        return self.at.site.holdout

    @property
    def unidentified(self) -> tuple[str, ...]:
        """Names of the parameters that the data cannot tell."""
        return self.fit.unidentified

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        rows = {row["name"]: row for row in self.parameters()}
        return {
            "schema": 1,
            "law": self.model.law,
            "effects": list(self.model.effects),
            "parameters": {
                name: {key: row[key] for key in row if key != "name"} for name, row in rows.items()
            },
            "unidentified": list(self.unidentified),
            "starts": self.fit.starts,
            "agreed": self.fit.agreed,
            "cut_off": self.cutoff,
            "before": self.before,
            "after": self.after,
            "table": [row.as_dict() for row in self.table],
            "notes": list(self.notes),
            "step": self.step.number if self.step else None,
        }

    def parameters(self) -> list[dict[str, Any]]:
        """Return one row per parameter: name, value, unit, half of its 95 % interval, how."""
        rows = []
        for name, value in self.model.flat().items():
            if name in self.fit.unidentified:
                how = "cannot be told"
            elif name in self.fit.std:
                how = "identified"
            else:
                how = "held"
            half = 1.96 * value.std if value.std is not None and how == "identified" else None
            rows.append(
                {
                    "name": name, "value": value.value, "unit": value.unit, "interval95": half,
                    "how": how,
                }
            )  # fmt: skip
        return rows
