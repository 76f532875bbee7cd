"""View 3, Where it fails: every sample of the compared runs; view 4: without and with an effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..comparison.misfit import run_error
from ..comparison.names import name_of, site_name
from ..comparison.patterns import ResidualPattern
from ..comparison.predictions import RunPrediction, shown
from ..comparison.result import Comparison
from ..errors import StudyError
from ..study.steps import before_after, compare_study, predictions
from ..study.study import Study
from ..study.study_file import ROLES, TEST

MOST = 250_000
"""Samples of all runs that are sent; of more every second, third ... is."""
PATTERNS = 5


def answer(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return what view 3 shows of a study.

    Parameters
    ----------
    folder : of the study
    arguments : `role` "holdout" or "train"; test runs are opened by a command alone

    Raises
    ------
    StudyError, RecordError, TrustError
        As `compare_study`.
    """
    role = arguments.get("role", "holdout")
    if role == TEST or role not in ROLES:
        raise StudyError(f'role "{role}"; "holdout" or "train" is right.')
    study = Study(folder)
    found = compare_study(study, role=role)
    return {
        "role": role, "sentences": list(found.sentences), "interval": list(found.z_interval),
        "right": found.right,
        **linked(found),
        "patterns": [_pattern(one, found) for one in found.patterns[:PATTERNS]],
        "spectrum": {
            "frequency": found.spectrum.frequency, "residual": found.spectrum.residual,
            "noise": found.spectrum.noise,
        },
        "sites": [
            {"name": site_name(one.site), "z": one.z, "fails": one.fails} for one in found.sites
        ],
    }  # fmt: skip


def linked(found: Comparison, most: int = MOST) -> dict[str, Any]:
    """Return what the linked pictures show of a comparison.

    Parameters
    ----------
    found : what is compared
    most : samples of all runs at the most
    """
    every = every_of(found.predictions, most)
    return {
        "z": found.z, "quantity": found.quantity, "unit": found.unit,
        "site": site_name(found.site) if found.site else "", "every": every,
        "drive": found.drive.name, "drive_unit": found.drive.unit,
        "runs": [_run(one, found, every) for one in found.predictions],
    }  # fmt: skip


def every_of(predictions: Sequence[RunPrediction], most: int = MOST) -> int:
    """Return 1 where all samples are sent, 2 where every second is, and so on."""
    samples = sum(len(one.measured) for one in predictions)
    return max(1, -(-samples // most))


def _run(one: RunPrediction, found: Comparison, every: int) -> dict[str, Any]:
    """Return a run's samples in SI: measured, predicted, the noise expected, and the motion."""
    error = next(run for run in found.runs if run.name == one.name)
    part = slice(one.skip, None, every)
    coordinates = {
        name: one.coordinates[name][part]
        for name in ("displacement", "velocity", one.drive)
        if name in one.coordinates
    }
    known = one.known[part] if one.known is not None else None
    return {
        "name": one.name, "z": error.z, "rms": error.rms, "noise": error.noise,
        "dt": one.dt * every, "time": one.time[part], "measured": one.measured[part],
        "predicted": one.predicted[part], "sigma": one.sigma[part],
        "normalised": one.normalised[::every],
        "known": None if known is None else known.astype(float), **coordinates,
    }  # fmt: skip


def _pattern(one: ResidualPattern, found: Comparison) -> dict[str, Any]:
    units = found.predictions[0].units
    factor, unit = shown(one.coordinate, units, float(np.max(np.abs(one.centre))))
    return {
        "name": name_of(one.coordinate, found.site), "unit": unit, "share": one.share, "p": one.p,
        "significant": one.significant, "turned": one.turned, "centre": factor * one.centre,
        "mean": one.mean, "std": one.std,
    }  # fmt: skip


def residual(folder: Path, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the residuals of the models of `before_after` on held-out runs, for view 4.

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
        "runs": [_residuals(*both, every) for both in zip(found.before, found.after, strict=True)],
    }  # fmt: skip


def _residuals(before: RunPrediction, after: RunPrediction, every: int) -> dict[str, Any]:
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
