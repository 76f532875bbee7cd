"""Parameters of a damper model from bench measurements, with intervals that hold.

The residual is divided, sample by sample, by the noise that a true model would show: the force's
own and that of the measured motion carried through the model. Both are drawn (`Run.draws`), so
that correlation in time counts in the intervals as well.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..compiled.bench import Bench
from ..physics.damper import LAWS
from ..physics.effect import EFFECTS, Parameter

Array = NDArray[np.float64]

OTHER_LAWS: dict[str, Any] = {}
"""Laws that no damper has, by name: those of a building's parts join here."""

FIXED = ("exponent", "mass", "which")
"""Parameters that a fit leaves alone: choices and regularisations, not measurements."""


@dataclass(frozen=True)
class Run:
    """A measured run, its motion smoothed.

    `x`, `v`, `a`, `V`, `force` (n,) in SI, evenly spaced by `dt` [s]; `noise` the force channel's
    standard deviation [N]; `draws` (d, n, 4) draws of the error of x, v, a, V.
    """

    name: str
    dt: float
    x: Array
    v: Array
    a: Array
    V: Array
    force: Array
    noise: float
    draws: Array
    skip: int = 25


@dataclass(frozen=True)
class Model:
    """A law with effects and the values of their parameters by name, in SI."""

    law: str
    effects: tuple[str, ...] = ()
    values: dict[str, float] = field(default_factory=dict)

    def free(self) -> list[str]:
        """Return the names of the parameters that a fit moves."""
        names = [name for name in law_parameters(self.law) if name not in FIXED]
        for effect in self.effects:
            names += [
                f"{effect}.{name}" for name in EFFECTS[effect].parameters if name not in FIXED
            ]
        return [name for name in names if name not in self.held]

    held: tuple[str, ...] = ()

    def value(self, name: str) -> float:
        """Return a parameter's value, its default where none is given."""
        return float(self.values.get(name, parameter(self.law, name).value))


def parameter(law: str, name: str) -> Parameter:
    """Return the declaration of a law's or effect's parameter."""
    if "." in name:
        effect, own = name.split(".", 1)
        return EFFECTS[effect].parameters[own]
    return law_parameters(law)[name]


def law_parameters(law: str) -> dict[str, Parameter]:
    """Return the declarations of a law's own parameters by name."""
    declared: dict[str, Parameter] = (LAWS[law] if law in LAWS else OTHER_LAWS[law]).parameters
    return declared


@dataclass(frozen=True)
class Fit:
    """What a fit found.

    `model` with the values; `std` by name; `cost` the mean robust loss per sample on the runs
    fitted; `jacobian_rank_lost` names the parameters that the data cannot tell.
    """

    model: Model
    std: dict[str, float]
    cost: float
    unidentified: tuple[str, ...] = ()
    evaluations: int = 0


class Problem:
    """Runs held against a model: weighted residuals, fits, scores."""

    def __init__(self, runs: list[Run]) -> None:
        self.runs = runs
        self._benches: dict[tuple[str, tuple[str, ...]], Bench] = {}
        self._sizes: dict[str, float] = {}

    def size(self, unit: str) -> float:
        """Return the typical size on this rig of a parameter of some unit, in SI."""
        if not self._sizes:
            self._sizes = sizes(self.runs)
        return self._sizes.get(unit, 1.0)

    def bench(self, model: Model) -> Bench:
        key = (model.law, model.effects)
        if key not in self._benches:
            self._benches[key] = Bench(model.law, list(model.effects))
        return self._benches[key]

    def predict(self, model: Model, run: Run, draw: int | None = None) -> Array:
        """Return the model's force (n,) [N] for a run, or for one draw of its motion."""
        x, v, a, V = run.x, run.v, run.a, run.V
        if draw is not None:
            e = run.draws[draw]
            x, v, a, V = x + e[:, 0], v + e[:, 1], a + e[:, 2], V + e[:, 3]
        return self.bench(model).force(x, v, a, V, run.dt, model.values)

    def expectation(self, model: Model, draws: int = 12) -> list[tuple[Array, Array, Array]]:
        """Return per run: bias (n,) [N] of the prediction, noise (n,) [N], draws (d, n) [N]."""
        out = []
        for run in self.runs:
            middle = self.predict(model, run)
            spread = np.array(
                [self.predict(model, run, d) - middle for d in range(min(draws, len(run.draws)))]
            )
            if not len(spread):
                spread = np.zeros((1, len(middle)))
            bias = spread.mean(axis=0)
            variance = np.mean((spread - bias) ** 2, axis=0)
            out.append((bias, np.sqrt(run.noise**2 + variance), spread - bias))
        return out


def sizes(runs: list[Run]) -> dict[str, float]:
    """Return the typical size of a quantity on a rig by unit, from what was measured."""
    force = float(np.std(np.concatenate([r.force for r in runs])))
    x = float(np.std(np.concatenate([r.x - r.x.mean() for r in runs])))
    v = float(np.std(np.concatenate([r.v for r in runs])))
    a = float(np.std(np.concatenate([r.a for r in runs])))
    V = max(max(float(r.V.max()) for r in runs), 1e-9)
    return {
        "N": force, "N/m": force / x, "N/m2": force / x**2, "N/m3": force / x**3, "m": x, "m/s": v,
        "N.s/m": force / v, "N.s2/m2": force / v**2, "kg": force / a, "J": force * x, "V": V,
        "N/V": force / V, "N/(m.V)": force / (x * V), "N.s/(m.V)": force / (v * V), "1/m": 1.0 / x,
        "s": 0.05, "1": 1.0,
    }  # fmt: skip


def huber(z: Array, k: float = 2.0) -> Array:
    """Return Huber's loss of z, quadratic up to k."""
    size = np.abs(z)
    return np.where(size <= k, 0.5 * z * z, k * size - 0.5 * k * k)


def fit(
    problem: Problem,
    model: Model,
    *,
    expectation: list[tuple[Array, Array, Array]] | None = None,
    max_evaluations: int = 25,
    with_std: bool = True,
) -> Fit:
    """Fit the free parameters of a model to the problem's runs.

    Returns
    -------
    Fit
        Robust weighted least squares (Huber's loss) by a trust-region method within the physical
        bounds; standard deviations by the sandwich formula with the drawn noise.
    """
    names = model.free()
    expected = expectation or problem.expectation(model)
    start = np.array([model.value(name) for name in names])
    bounds = np.array([parameter(model.law, name).bounds for name in names], dtype=float)
    sizes = np.array([problem.size(parameter(model.law, name).unit) for name in names])
    scale = np.maximum(np.abs(start), 1e-2 * sizes)
    low, high = bounds[:, 0] / scale, bounds[:, 1] / scale
    inside = np.clip(
        start / scale, low + 1e-9 * (1 + np.abs(low)), high - 1e-9 * (1 + np.abs(high))
    )

    def residuals(theta: Array) -> Array:
        values = {**model.values, **dict(zip(names, theta * scale, strict=True))}
        trial = replace(model, values=values)
        parts = []
        for run, (bias, sigma, _) in zip(problem.runs, expected, strict=True):
            r = (run.force - problem.predict(trial, run) - bias) / sigma
            parts.append(np.nan_to_num(r[run.skip :], nan=1e6, posinf=1e6, neginf=-1e6))
        return np.concatenate(parts)

    found = least_squares(
        residuals, inside, bounds=(low, high), loss="huber", f_scale=2.0, x_scale="jac",
        max_nfev=max_evaluations, ftol=1e-6, xtol=1e-7, gtol=1e-10, diff_step=1e-5,
    )  # fmt: skip
    values = {**model.values, **dict(zip(names, found.x * scale, strict=True))}
    best = replace(model, values=values)
    cost = float(np.mean(huber(residuals(found.x))))
    std: dict[str, float] = {}
    lost: tuple[str, ...] = ()
    if with_std:
        std, lost = _intervals(names, found.jac, scale, problem, expected)
    return Fit(best, std, cost, lost, int(found.nfev))


def _intervals(
    names: list[str],
    jacobian: Array,
    scale: Array,
    problem: Problem,
    expected: list[tuple[Array, Array, Array]],
) -> tuple[dict[str, float], tuple[str, ...]]:
    norms = np.linalg.norm(jacobian, axis=0)
    safe = np.where(norms > 0, norms, 1.0)
    _, s, vt = np.linalg.svd(jacobian / safe, full_matrices=False)
    weak = s < 1e-6 * s[0]
    inverse = vt.T @ np.diag(np.where(weak, 0.0, 1.0 / np.where(weak, 1.0, s) ** 2)) @ vt
    meat = (jacobian / safe).T @ (jacobian / safe)
    scores = []
    count = min(len(spread) for _, _, spread in expected)
    own = np.concatenate(
        [
            np.full(len(r.force) - r.skip, r.noise) / e[1][r.skip :]
            for r, e in zip(problem.runs, expected, strict=True)
        ]
    )
    meat = ((jacobian / safe) * own[:, None] ** 2).T @ (jacobian / safe)
    for d in range(count):
        e = np.concatenate(
            [
                s_[d][r.skip :] / sig[r.skip :]
                for r, (_, sig, s_) in zip(problem.runs, expected, strict=True)
            ]
        )
        scores.append((jacobian / safe).T @ e)
    if count > 1:
        scores_array = np.array(scores)
        meat = meat + scores_array.T @ scores_array / count
    covariance = inverse @ meat @ inverse
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0)) / safe * scale
    direction = vt[weak]
    lost = tuple(
        name
        for i, name in enumerate(names)
        if norms[i] == 0 or (len(direction) and np.max(np.abs(direction[:, i])) > 0.3)
    )
    return dict(zip(names, std, strict=True)), lost


def start_model(runs: list[Run], law: str, exponent: float = 1.0) -> Model:
    """Return a start for a rig of any size: the Bingham law by linear least squares.

    For each trial of v_n the law is linear in f_c, f_v, c_0, c_v; LuGre takes its steady sliding
    from it and a bristle deflection of a part of the typical stroke.
    """
    v = np.concatenate([run.v for run in runs])
    V = np.concatenate([run.V for run in runs])
    f = np.concatenate([run.force for run in runs])
    sign = np.tanh(v / (0.05 * np.std(v)))
    best, found = np.inf, None
    for v_n in np.std(v) * np.geomspace(0.05, 5.0, 25):
        e = v * (np.exp(-np.abs(v) / v_n) if exponent else 1.0)
        A = np.column_stack([sign, V * sign, e, V * e])
        theta, *_ = np.linalg.lstsq(A, f, rcond=None)
        theta = np.maximum(theta, 0.0)
        cost = float(np.median(np.abs(f - A @ theta)))
        if cost < best:
            best, found = cost, (v_n, theta)
    assert found is not None
    v_n, (f_c, f_v, c_0, c_v) = found
    floor = 0.02 * np.std(f)
    f_c, f_v = max(f_c, floor), max(f_v, floor / max(np.std(V), 1e-9) * 0.1)
    c_0, c_v = max(c_0, floor / np.std(v)), max(c_v, 0.1 * floor / np.std(v))
    if law == "bingham":
        return Model(
            law,
            (),
            {"f_c": f_c, "f_v": f_v, "c_0": c_0, "c_v": c_v, "v_n": v_n, "exponent": exponent},
        )
    x = np.concatenate([run.x - run.x.mean() for run in runs])
    a_0 = 1.0 / (0.15 * np.std(x))
    return Model(
        law, (),
        {
            "sigma_a": f_c * a_0, "sigma_0": f_v * a_0, "sigma_1": 0.02 * c_0 + 1e-9,
            "sigma_2": c_0, "sigma_b": c_v, "v_n": v_n, "a_0": a_0, "exponent": exponent,
        },
    )  # fmt: skip


def identify(problem: Problem, law: str, effects: tuple[str, ...] = (), starts: int = 4) -> Fit:
    """Fit a law from several starts; return the best fit with its intervals."""
    first = start_model(problem.runs, law)
    trials: list[dict[str, float]] = []
    factors = [1.0, 0.25, 4.0, 12.0] if law == "lugre" else [1.0, 0.4, 2.5]
    for factor in factors[:starts]:
        values = dict(first.values)
        if law == "lugre":
            for name in ("a_0", "sigma_a", "sigma_0"):
                values[name] *= factor
        else:
            values["v_n"] *= factor
        trials.append(values)
    expected = problem.expectation(replace(first, values=trials[0]), draws=0)
    fits = [
        fit(problem, Model(law, effects, values), expectation=expected, with_std=False)
        for values in trials
    ]
    best = min(fits, key=lambda one: one.cost)
    for _ in range(2):
        best = fit(problem, best.model, expectation=problem.expectation(best.model))
    return best
