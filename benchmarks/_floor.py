"""What models without physics reach on measured runs, and the best published law: a floor.

A model of a damper is worth its error beside what can be reached on the same runs. Gradient
boosting and a small neural network get the histories of motion and command; a law of the literature
is fitted by least squares. Their settings are chosen on parts of the training runs alone.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bristle.core.arrays import Array
from bristle.identification.fit import Search
from bristle.identification.problem import Problem, Run
from bristle.model.model import Model

FOLDS = 4
"""Parts of the training runs that are left out in turn."""

SEEDS = (1, 2, 3)
"""Networks whose mean predicts: one alone depends on its first weights."""

SPANS = (0.1, 0.4)
"""How far back a history goes [s]."""

PAST = 7
"""Samples of a history, at times that double."""

FEW = 20
"""Jacobians of a fit by least squares, from values that are near."""

WITHOUT = "not run: they need scikit-learn, pip install 'bristle[benchmarks]'"


@dataclass(frozen=True)
class Reached:
    """What a model reaches: its name, settings or law, and its error over the force's RMS.

    `share` on held-out runs; `folds` on the parts of the training runs that chose the settings.
    """

    name: str
    chosen: str
    share: float
    folds: float


def have_learner() -> bool:
    """Return whether scikit-learn is installed."""
    return importlib.util.find_spec("sklearn") is not None


def share_of(errors: Sequence[Array], runs: Sequence[Run]) -> float:
    """Return the RMS of errors, each (n - skip,) [N], over the RMS of the runs' force."""
    force = np.concatenate([run.force for run in runs])
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2) / np.mean(force**2)))


def histories(run: Run, span: float, position: bool) -> Array:
    """Return what a model without physics sees at each sample of a run: columns (n, k).

    Velocity now and before, the way since then, acceleration; the command now, and before where it
    moves. Before the run's begin its first sample stands.

    Parameters
    ----------
    run : the run, its motion smoothed as for every model
    span : how far back the history goes [s]
    position : whether the displacement itself is among the columns: its zero may be anywhere
    """
    steps = np.unique(np.round(span / run.dt / 2.0 ** np.arange(PAST)).astype(int))
    n = np.arange(len(run.force))
    columns = [run.v, run.a, run.V]
    if position:
        columns.append(run.x)
    for step in steps[steps > 0]:
        then = np.maximum(n - step, 0)
        columns += [run.v[then], run.x - run.x[then], run.V[then]]
    return np.column_stack(columns)


def parts_of(runs: Sequence[Run], folds: int = FOLDS) -> list[NDArray[np.int64]]:
    """Return the fold of each sample, per run: whole runs if there are enough, else stretches."""
    if len(runs) >= folds:
        return [np.full(len(run.force), k % folds) for k, run in enumerate(runs)]
    return [np.arange(len(run.force)) * folds // len(run.force) for run in runs]


@dataclass(frozen=True)
class Learner:
    """A model without physics: its name, and the settings that are tried.

    `made` returns models, whose mean predicts, for settings.
    """

    name: str
    grid: dict[str, tuple[Any, ...]]
    made: Callable[..., list[Any]]

    def settings(self) -> Iterator[dict[str, Any]]:
        """Yield all settings."""
        histories_tried = {"span": SPANS, "position": (True, False)}
        names = (*histories_tried, *self.grid)
        for values in product(*histories_tried.values(), *self.grid.values()):
            yield dict(zip(names, values, strict=True))


def _boosting(**settings: Any) -> list[Any]:
    from sklearn.ensemble import HistGradientBoostingRegressor

    return [HistGradientBoostingRegressor(random_state=1, early_stopping=False, **settings)]


def _network(width: int, alpha: float) -> list[Any]:
    from sklearn.neural_network import MLPRegressor
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    return [
        make_pipeline(
            StandardScaler(),
            MLPRegressor(
                hidden_layer_sizes=(width, width),
                alpha=alpha,
                max_iter=100,
                random_state=seed,
                learning_rate_init=3e-3,
                tol=1e-6,
                n_iter_no_change=100,
            ),
        )
        for seed in SEEDS
    ]


LEARNERS = (
    Learner(
        "gradient boosting",
        {"max_leaf_nodes": (8, 31), "max_iter": (300,)}, _boosting,
    ),
    Learner("neural network", {"width": (32,), "alpha": (1e-3, 0.3)}, _network),
)  # fmt: skip


def fitted(
    learner: Learner, settings: dict[str, Any], runs: Sequence[Run],
    keeps: Sequence[NDArray[np.bool_]], most: int = len(SEEDS),
) -> Callable[[Run], Array]:  # fmt: skip
    """Return what predicts the force (n,) [N] of a run, fitted to the samples kept of runs.

    Parameters
    ----------
    learner, settings : the model
    runs : of the training
    keeps : per run, (n,) the samples that are fitted
    most : of the models whose mean predicts
    """
    own = {key: value for key, value in settings.items() if key not in ("span", "position")}
    seen = {key: settings[key] for key in ("span", "position")}
    X = np.concatenate(
        [histories(run, **seen)[keep] for run, keep in zip(runs, keeps, strict=True)]
    )
    F = np.concatenate([run.force[keep] for run, keep in zip(runs, keeps, strict=True)])
    middle, size = float(np.mean(F)), float(np.std(F))
    models = [model.fit(X, (F - middle) / size) for model in learner.made(**own)[:most]]

    def predict(run: Run) -> Array:
        columns = histories(run, **seen)
        return middle + size * np.mean([model.predict(columns) for model in models], axis=0)

    return predict


def judged(run: Run) -> NDArray[np.bool_]:
    """Return which samples of a run count (n,): those that count for every model."""
    return np.arange(len(run.force)) >= run.skip


def fold_share(learner: Learner, settings: dict[str, Any], runs: Sequence[Run]) -> float:
    """Return the error on the parts of training runs left out in turn, over the force's RMS."""
    parts, errors = parts_of(runs), []
    for fold in range(FOLDS):
        keeps = [judged(run) & (part != fold) for run, part in zip(runs, parts, strict=True)]
        predict = fitted(learner, settings, runs, keeps, most=1)
        for run, part in zip(runs, parts, strict=True):
            out = judged(run) & (part == fold)
            if out.any():
                errors.append((run.force - predict(run))[out])
    return share_of(errors, runs)


def without_physics(learner: Learner, train: Sequence[Run], held: Sequence[Run]) -> Reached:
    """Return what a model without physics reaches, its settings chosen on the training runs.

    Parameters
    ----------
    learner : the model
    train : the runs that it is fitted to, parts of which choose its settings
    held : the runs that judge it, once
    """
    tried = [(fold_share(learner, one, train), one) for one in learner.settings()]
    least, best = min(tried, key=lambda pair: pair[0])
    predict = fitted(learner, best, train, [judged(run) for run in train])
    errors = [(run.force - predict(run))[judged(run)] for run in held]
    told = ", ".join(f"{key} {value}" for key, value in best.items())
    return Reached(learner.name, told, share_of(errors, held), least)


def least_squares(begin: Model, train: Problem, held: Problem) -> float:
    """Return what a law leaves on held-out runs, fitted by plain least squares of the force [1].

    Parameters
    ----------
    begin : the law, its values near the least
    train, held : the runs that it is fitted to, and those that judge it, once
    """
    from scipy.optimize import least_squares as solve

    size = float(np.sqrt(np.mean(np.concatenate([run.force for run in train.runs]) ** 2)))
    none = [(np.zeros(1), np.ones(1), np.zeros((1, 1))) for _ in train.runs]
    scaled = Search(train, begin, none, begin.free(), logarithms=False)

    def residuals(theta: Array) -> Array:
        return np.concatenate(errors_of(scaled.at(theta), train)) / size

    begun = np.clip(scaled.start, scaled.low + 1e-9, scaled.high - 1e-9)
    found = solve(residuals, begun, bounds=(scaled.low, scaled.high), max_nfev=FEW, diff_step=1e-5)
    return share_of(errors_of(scaled.at(found.x), held), held.runs)


def errors_of(model: Model, problem: Problem, zero: float = 0.0) -> list[Array]:
    """Return per run the error (n - skip,) [N] of a model's force above a `zero` [N]."""
    return [(run.force - problem.predict(model, run) - zero)[run.skip :] for run in problem.runs]
