"""View 4, What is missing: the residual of a model without and with an effect."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..comparison.misfit import run_error
from ..comparison.names import site_name
from ..comparison.predictions import RunPrediction
from ..study.steps import before_after, predictions
from ..study.study import Study
from .errors_view import every_of


def answer(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the residuals on held-out runs of the models of `before_after`, sample by sample.

    Parameters
    ----------
    folder : of the study
    arguments : none are taken

    Raises
    ------
    StudyError, RecordError, TrustError
        As `before_after` and `predictions`.
    """
    study = Study(folder)
    pair = before_after(study)
    if pair is None:
        return {"effects": []}
    found = predictions(study, pair)
    every = every_of(found.before)
    one = found.before[0]
    return {
        "effects": list(pair.effects), "step": pair.step,
        "kind": (study.verdict() or {}).get("kind", ""), "quantity": one.quantity, "unit": one.unit,
        "site": site_name(one.site) if one.site else "", "every": every,
        "before": found.z_before, "after": found.z_after,
        "runs": [_run(a, b, every) for a, b in zip(found.before, found.after, strict=True)],
    }  # fmt: skip


def _run(before: RunPrediction, after: RunPrediction, every: int) -> dict[str, Any]:
    """Return a run's motion, and of both models residual and expected noise, in SI."""
    part = slice(before.skip, None, every)
    motion: dict[str, Any] = {
        name: before.coordinates[name][part]
        for name in ("displacement", "velocity")
        if name in before.coordinates
    }
    return {
        "name": before.name, "time": before.time[part], **motion,
        **{
            when: {
                "z": run_error(one.name, [one]).z, "residual": one.residual[::every],
                "sigma": one.sigma[part], "normalised": one.normalised[::every],
            }
            for when, one in (("before", before), ("after", after))
        },
    }  # fmt: skip
