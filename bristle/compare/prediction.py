"""A run held against a prediction, with the noise that a true model would show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..data.finer import between
from ..data.labels import Labels
from ..data.left_out import MISSING, SETTLING
from ..identify.error import ForceError, error_of, errors_by_run
from ..identify.fit import Model, Problem, Run
from ..identify.model import LOST
from ..identify.residuals import over_noise
from ..identify.structure import StructureRun
from ..physics.drive import VOLTAGE
from .coordinates import coordinates_of

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RunPrediction:
    """One output of one run, measured and predicted, in SI.

    `measured`, `predicted`, `sigma` (n,): `sigma` is the noise expected of a true model, the
    channel's own (`noise`) and that of the measured inputs carried through the model, of which
    `spread` (d, n) are draws. `coordinates` name to (n,). `numerical` (n,) is how far the
    prediction moves at half the step, None where that was not tried. The first `skip` samples do
    not count, for the model's states begin somewhere, nor do those where `known` (n,) is False:
    they were not measured but filled in. `site` of a building is "damper", "layer", "storey1" ...,
    "" on a bench. `index` (n,) numbers the samples where some were left out, None where none were.
    `drive` is the channel that commands the damper, `labels` what is known of the whole run,
    `units` those of the coordinates that are extra channels. `predicted` has the mean of the drawn
    errors in it, as z needs; `held` is the error of the prediction itself, None where both are one.
    `noise_known` is False where the output's noise cannot be told from its signal, so that no z
    says anything.
    """

    name: str
    dt: float
    measured: Array
    predicted: Array
    sigma: Array
    noise: float
    spread: Array
    coordinates: dict[str, Array] = field(default_factory=dict)
    numerical: Array | None = None
    quantity: str = "force"
    unit: str = "N"
    skip: int = 25
    known: NDArray[np.bool_] | None = None
    site: str = ""
    index: NDArray[np.int64] | None = None
    drive: str = VOLTAGE.name
    labels: Labels = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    held: ForceError | None = None
    noise_known: bool = True

    @property
    def error(self) -> ForceError:
        """The error on the run, the same as everywhere: see `identify.error`."""
        if self.held is not None:
            return self.held
        early = np.arange(len(self.measured)) < self.skip
        known = np.ones(len(self.measured), dtype=bool) if self.known is None else self.known
        return error_of(self.measured, self.predicted, {SETTLING: early, MISSING: ~known})

    @property
    def time(self) -> Array:
        """Time (n,) [s] from the run's begin."""
        index = np.arange(len(self.measured)) if self.index is None else self.index
        return np.asarray(index * self.dt, dtype=float)

    @property
    def residual(self) -> Array:
        """Measured less predicted, without the skipped samples, in the unit; 0 where not known."""
        error = self.measured - self.predicted
        return (error if self.known is None else np.where(self.known, error, 0.0))[self.skip :]

    @property
    def judged(self) -> NDArray[np.bool_]:
        """Which of the samples after the skipped ones count (n - skip,)."""
        known = np.ones(len(self.measured), dtype=bool) if self.known is None else self.known
        return known[self.skip :]

    @property
    def normalised(self) -> Array:
        """The residual over the noise expected of a true model."""
        return over_noise(self.residual, self.sigma[self.skip :])

    @property
    def carried(self) -> Array:
        """The draws of the carried noise (d, n) without the skipped samples."""
        return self.spread[:, self.skip :]

    def along(self) -> dict[str, Array]:
        """Return the coordinates without the skipped samples."""
        return {name: values[self.skip :] for name, values in self.coordinates.items()}

    def only_judged(self, values: Array) -> Array:
        """Return those of values (n - skip,) that count: a mean over others would be too small."""
        return values if self.judged.all() else values[self.judged]

    def judged_along(self) -> dict[str, Array]:
        """Return the coordinates at the samples that count."""
        return {name: self.only_judged(values) for name, values in self.along().items()}


def run_predictions(problem: Problem, model: Model, draws: int = 12) -> list[RunPrediction]:
    """Return the runs of a problem held against a model's force.

    Parameters
    ----------
    problem : Problem
        Runs that the model was not fitted to, if it is to be judged.
    draws : int
        How many draws of the measured inputs' error to carry through the model.
    """
    out = []
    problem = problem.with_excess(0.0)
    for run, (bias, sigma, spread), held in zip(
        problem.runs, problem.expectation(model, draws), errors_by_run(problem, model), strict=True
    ):
        predicted = problem.predict(model, run)
        finer = at_half_the_step(problem, model, run)
        if run.measured is not None:
            sigma = np.where(run.measured, sigma, sigma / LOST)  # `known` says it instead
        out.append(
            RunPrediction(
                run.name, run.dt, run.force, predicted + bias, sigma, run.noise, spread,
                coordinates_of_run(run), finer - predicted, skip=run.skip, known=run.measured,
                index=run.keep if isinstance(run, StructureRun) else None,
                drive=run.drive, labels=run.labels,
                units={name: one.unit for name, one in run.extra.items()}, held=held,
                noise_known=problem.noise_known,
            )
        )  # fmt: skip
    return out


def coordinates_of_run(run: Run) -> dict[str, Array]:
    """Return the coordinates (n,) of a run; time and history go on where samples are left out."""
    if isinstance(run, StructureRun) and run.whole is not None:
        return {name: y[run.keep] for name, y in coordinates_of_run(run.whole).items()}
    found = coordinates_of(run.dt, run.x, run.v, run.a, run.V, run.force, run.drive)
    numbers = {name: y for name, y in run.labels.items() if not isinstance(y, str)}
    measured = {name: one.values for name, one in run.extra.items()}
    return {**{name: np.full(len(run.x), y) for name, y in numbers.items()}, **measured, **found}


def at_half_the_step(problem: Problem, model: Model, run: Run) -> Array:
    """Return a model's force (n,) [N] at the samples of a run, evaluated twice as often."""
    whole = run.whole if isinstance(run, StructureRun) else run
    if whole is None or whole.finer is None:
        return problem.predict(model, halved(run))[::2]
    often = replace(whole, finer=whole.finer.halved())
    again = replace(run, whole=often) if isinstance(run, StructureRun) else often
    return problem.predict(model, again)


def halved(run: Run) -> Run:
    """Return a run with a sample between any two: motion by Hermite's cubic, voltage by a line."""
    x, v, a = run.x, run.v, run.a
    whole: dict[str, Any] = {}
    if isinstance(run, StructureRun) and run.whole is not None:
        keep = np.empty(2 * len(x) - 1, dtype=np.int64)
        keep[::2], keep[1::2] = 2 * run.keep, 2 * run.keep[:-1] + 1
        whole = {"whole": halved(run.whole), "keep": keep}
    return replace(
        run,
        **whole,
        dt=0.5 * run.dt,
        x=between(x, v, run.dt),
        v=between(v, a, run.dt),
        a=between(a, None, run.dt),
        V=between(run.V, None, run.dt),
        force=between(run.force, None, run.dt),
        draws=np.zeros((0, 2 * len(x) - 1, 4)),
        extra={
            name: replace(one, values=between(one.values, None, run.dt))
            for name, one in run.extra.items()
        },
        left_out={},
    )
