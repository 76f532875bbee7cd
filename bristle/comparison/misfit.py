"""How wrong a prediction is on a run and at a site, and which sites fail."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from statistics import NormalDist
from typing import Any

import numpy as np

from ..core.arrays import Array
from ..errors import RecordError
from ..identification.error import ForceError, pooled
from ..identification.search import HUBER_AT_ONE, losses, mean_loss, z_scale
from .patterns import LEVEL, Finder, ResidualPattern
from .predictions import RunPrediction, rms

CLOSE = 1.1
"""z up to which an error is what noise explains."""
MIN_SAMPLES = 100
"""Samples that a run of a comparison has at the least, beside those that are skipped."""


@dataclass(frozen=True)
class RunMisfit:
    """The error on one run.

    `error` is the one that every command tells. `z` RMS(residual)/noise expected of a true model,
    by a robust scale; `numerical_z` the same of what half the step changes. `noise`, `numerical`
    [unit]: RMS of the noise expected, of what half the step changes; `residual`, `scatter`,
    `spread` the RMS of the residual that z judges, and the standard deviations of it and of the
    measured output, over `samples`.
    """

    name: str
    error: ForceError
    samples: int
    z: float
    residual: float
    noise: float
    numerical: float
    numerical_z: float
    scatter: float
    spread: float

    @property
    def fit(self) -> float:
        """The normalised root mean square fit, 1 - RMS(residual)/std(measured) [1]."""
        return 1.0 - self.residual / self.spread if self.spread > 0.0 else float("nan")

    @property
    def accounted(self) -> float:
        """The variance accounted for (VAF), 1 - var(residual)/var(measured) [1]."""
        return 1.0 - (self.scatter / self.spread) ** 2 if self.spread > 0.0 else float("nan")

    @property
    def rms(self) -> float:
        """The RMS of the error [unit]."""
        return self.error.headline[0]

    @property
    def signal(self) -> float:
        """The RMS of the measured output [unit]."""
        return self.error.signal_all if self.error.over_all else self.error.signal

    @property
    def share(self) -> float:
        """The error over the RMS of the measured output [1]."""
        return self.error.headline[1]

    def as_dict(self) -> dict[str, Any]:
        """Return the error as JSON has it."""
        return {
            **asdict(self), "error": self.error.as_dict(), "fit": self.fit,
            "accounted": self.accounted,
        }  # fmt: skip


@dataclass(frozen=True)
class SiteMisfit:
    """How wrong a model is at one site of a building.

    `site` is "damper", "layer", "storey1" ...; `quantity`, `unit` what is compared there; `runs`
    the error of each run, `total` over all; `z_interval` the 95 % interval of the total z;
    `pattern` that of the error, None where chance explains all of it. `fails`: the error is more
    than noise, and chance is no fair explanation of that, all sites together.
    """

    site: str
    quantity: str
    unit: str
    runs: tuple[RunMisfit, ...]
    total: RunMisfit
    z_interval: tuple[float, float]
    pattern: ResidualPattern | None
    fails: bool = False

    @property
    def z(self) -> float:
        """RMS(residual)/noise expected of a true model, over all runs; NaN without a sample."""
        return self.total.z

    @property
    def identifiable(self) -> bool:
        """Whether z tells it: there are samples, and their noise is known."""
        return self.z == self.z

    @property
    def why_not(self) -> str:
        """Why z tells nothing, "" where it does; a base that hardly slides leaves few samples."""
        if self.identifiable:
            return ""
        return "no known noise" if self.total.samples else "too few samples"

    def as_dict(self) -> dict[str, Any]:
        """Return the error as JSON has it."""
        return {
            "site": self.site,
            "quantity": self.quantity,
            "unit": self.unit,
            "z": self.z,
            "z_interval": list(self.z_interval),
            "fails": self.fails,
            "total": self.total.as_dict(),
            "runs": [run.as_dict() for run in self.runs],
            "place": self.pattern.as_dict() if self.pattern else None,
        }


def refuse(predictions: Sequence[RunPrediction]) -> None:
    """Raise RecordError where runs are too few, too short, not finite or without noise."""
    if not predictions:
        raise RecordError("there is no run to compare with.")
    for one in predictions:
        if len(one.measured) <= one.skip + MIN_SAMPLES:
            raise RecordError(
                f"{one.name}: {len(one.measured)} samples; a comparison needs "
                f"{one.skip + MIN_SAMPLES}."
            )
        for what, values in (("predicted", one.predicted), ("measured", one.measured)):
            bad = np.flatnonzero(~np.isfinite(values))
            if len(bad):
                raise RecordError(
                    f"{one.name}: the {what} {one.quantity} is {values[bad[0]]} at "
                    f"{one.time[bad[0]]:g} s. Look at the model's values there."
                )
        if not np.min(one.sigma) > 0.0:
            raise RecordError(
                f"{one.name}: the noise of the {one.quantity} is zero, so no error can be "
                f"judged. Give one in study.toml, noise = ... in [channels.{one.quantity}]."
            )


def without_z(run: RunMisfit) -> RunMisfit:
    """Return an error whose noise is not known: nothing says how much of it is noise."""
    none = float("nan")
    return replace(run, z=none, numerical_z=none, noise=none)


def run_error(name: str, predictions: Sequence[RunPrediction]) -> RunMisfit:
    """Return the error over some runs; over those without a sample for z as well."""
    error = pooled(one.error for one in predictions)
    predictions = [one for one in predictions if one.judged.any()]
    if not predictions:
        nothing = float("nan")
        return RunMisfit(name, error, 0, *[nothing] * 7)
    residual = np.concatenate([one.residual[one.judged] for one in predictions])
    sigma = np.concatenate([one.sigma[one.skip :][one.judged] for one in predictions])
    tried = [
        one.numerical[one.skip :][one.judged] for one in predictions if one.numerical is not None
    ]
    moved = np.concatenate(tried) if len(tried) == len(predictions) else np.full(1, np.nan)
    measured = np.concatenate([one.measured[one.skip :][one.judged] for one in predictions])
    return RunMisfit(
        name, error, len(residual), z_scale(residual / sigma), rms(residual), rms(sigma),
        rms(moved), z_scale(moved / (sigma if len(moved) == len(sigma) else 1.0)),
        float(np.std(residual)), float(np.std(measured)),
    )  # fmt: skip


def total_error(able: Sequence[RunPrediction], every: Sequence[RunPrediction]) -> RunMisfit:
    """Return the error over all runs: z of those that are long enough, the error of every one."""
    return replace(run_error("all runs", able), error=pooled(one.error for one in every))


def interval_of_z(normalised: Sequence[Array], finder: Finder) -> tuple[float, float]:
    """Return the 95 % interval of z over all runs, by the scatter of the loss over blocks."""
    loss = losses(np.concatenate(list(normalised)))
    if not loss.any():  # a model that meets every sample exactly
        return 0.0, 0.0
    blocks = finder.blocks
    counts = np.bincount(blocks.label, weights=loss > 0.0)
    means = np.bincount(blocks.label, weights=loss)[counts > 0] / counts[counts > 0]
    mean = mean_loss(loss)
    std = float(np.std(means)) / np.sqrt(max(len(means) - 1, 1))
    low, high = max(mean - 1.96 * std, 0.0), mean + 1.96 * std
    return float(np.sqrt(low / HUBER_AT_ONE)), float(np.sqrt(high / HUBER_AT_ONE))


def with_failures(sites: Iterable[SiteMisfit]) -> tuple[SiteMisfit, ...]:
    """Return sites of which it is known which ones fail, those first, then by z.

    Of twenty storeys one has a large z by chance: a site fails if the chance of its z is small for
    the largest of all of them (Bonferroni), by the scatter that its interval states.
    """
    sites = list(sites)
    far = NormalDist().inv_cdf(1.0 - LEVEL / max(len(sites), 1)) / 1.96

    def fails(one: SiteMisfit) -> bool:
        high = one.z_interval[1]
        return one.z > CLOSE and one.z**2 - far * (high**2 - one.z**2) > 1.0

    found = [replace(one, fails=fails(one)) for one in sites]
    return tuple(
        sorted(found, key=lambda one: (not one.fails, -one.z if one.identifiable else 0.0))
    )
