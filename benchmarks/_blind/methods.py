"""What users would otherwise try, on the same cases: terms, sparse regression, correlation tests.

Each starts from the base law refitted to the data and knows its form; the laws are solved by
variable projection from the true parameters, which favours the peers.

stepwise        forward selection of terms. Textbook: polynomial terms of the raw channels by
                Akaike's criterion (1974, IEEE TAC 19, 716-723). Informed: terms that an expert
                writes for each effect, channels through 18 Hz, kept where they lower the held-out
                error by 3 %; "unknown" where more than 1.15 times the noise is left.
sparse          sequentially thresholded least squares (Brunton, Proctor & Kutz 2016, PNAS 113,
                3932-3937), by pysindy where it is installed, else written here. Textbook:
                polynomial terms, threshold 0.1 on normalised terms. Informed: the expert's terms,
                the threshold chosen on held-out runs, most sparse within 3 % of the best.
correlation     auto-correlation of the residuals and cross-correlation with velocity and voltage
                against 99 % bounds (Ljung 1999, System Identification, ch. 16; the plot of MATLAB's
                `resid`). Textbook: any of the 25 lags beyond 2.58/sqrt(n). Calibrated: beyond the
                largest value in simulations of the fitted model with noise on every channel.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.ndimage import median_filter
from scipy.signal import butter, sosfiltfilt

from bristle.core.arrays import Array
from tests.independent.refit import BaseLaw
from tests.independent.rigs import SIZES, Rig

if TYPE_CHECKING:
    from .cases import Recorded

Signals = dict[str, Array]

CUT = 18.0  # Hz
GAIN = 0.03  # share by which a term must lower the held-out error
LEFT = 1.15  # times the noise, above which something unknown is left
MOST = 6  # terms
LAGS = 25
DRAWS = 6
MARGIN = 1.5  # on the largest of these draws, for 77 lags are looked at
METHODS = (
    "stepwise, informed", "stepwise, textbook", "sparse, informed", "sparse, textbook",
)  # fmt: skip
TESTS = ("correlation, textbook", "correlation, calibrated")


# --- data and base law --------------------------------------------------------------------------


def _rig(case: Recorded) -> Rig:
    """Return the rig with its true parameters, from which the refit starts."""
    truth, task = case.truth, case.task
    sizes = truth["scales"]
    return Rig(
        task.rig, task.law, truth["base"], sizes["force"], sizes["speed"], sizes["stroke"], None,
        SIZES[task.rig.split("_")[1]],
    )  # fmt: skip


def low_passed(run: Signals, cut: float = CUT) -> Signals:
    """Return a run, its motion through a zero-phase low-pass, its voltage through a median."""
    rate = 1.0 / float(run["time"][1] - run["time"][0])
    sections = butter(2, cut, fs=rate, output="sos")
    motion = {n: sosfiltfilt(sections, run[n]) for n in ("displacement", "velocity")}
    return {**run, **motion, "voltage": median_filter(run["voltage"], 25, mode="nearest")}


class Regression:
    """Base law and extra terms as columns; their Gram matrices, train and held out.

    `train`, `held` (m + 1, m + 1) hold the mean products of all columns and, last, of the force.
    Columns have unit RMS on the training runs.
    """

    def __init__(self, names: list[str], base: int, parts: tuple[Array, Array]) -> None:
        self.names, self.base, self.count = names, base, len(parts[0])
        size = np.sqrt(np.mean(parts[0] ** 2, axis=0)) + 1e-300
        size[-1] = 1.0
        self.train, self.held = ((p / size).T @ (p / size) / len(p) for p in parts)

    def solve(self, chosen: list[int]) -> tuple[Array, float, float]:
        """Return coefficients of base and chosen terms, mean squares left, train and held out."""
        use = [*range(self.base), *(self.base + k for k in chosen)]
        gram = self.train[np.ix_(use, use)]
        theta = np.linalg.lstsq(gram, self.train[use, -1], rcond=1e-12)[0]
        left = []
        for whole in (self.train, self.held):
            square = whole[-1, -1] - 2.0 * theta @ whole[use, -1]
            left.append(float(max(square + theta @ whole[np.ix_(use, use)] @ theta, 1e-300)))
        return theta, left[0], left[1]


# --- terms --------------------------------------------------------------------------------------


def expert_terms(run: Signals, rig: Rig, predicted: Array) -> dict[str, tuple[str, Array]]:
    """Return the terms that an expert writes for each effect: name -> (effect, (n,))."""
    x, v, V = run["displacement"], run["velocity"], run["voltage"]
    step = float(run["time"][1] - run["time"][0])
    sign, a = np.sign(v), np.gradient(v, step)
    v_n = rig.values["v_n"]
    energy = np.cumsum(run["force"] * v) * step
    smooth = _mean(V, 10)
    terms = {
        f"stribeck {w}": ("stribeck", sign * np.exp(-((v / (w * v_n)) ** 2))) for w in (0.5, 1, 2)
    }
    terms |= {
        f"stribeck {w} V": ("stribeck", V * sign * np.exp(-((v / (w * v_n)) ** 2)))
        for w in (0.5, 1, 2)
    }
    terms |= {
        "f |v|": ("flattening", predicted * np.abs(v)),
        "v |v|": ("quadratic_damping", v * np.abs(v)),
        "f sgn v": ("asymmetry", predicted * sign),
        "f E": ("temperature", predicted * energy),
        "x": ("gas_spring", x),
        "x^3": ("gas_spring", x**3),
        "a": ("fluid_inertia", a),
        "V^2 sgn v": ("saturation", smooth**2 * sign),
        "V^2 v": ("saturation", smooth**2 * v * np.exp(-np.abs(v) / v_n)),
        "dV sgn v": ("coil_lag", np.gradient(smooth, step) * sign),
        "df": ("delay", np.gradient(predicted, step)),
        "a D": ("velocity_sensor", a * np.exp(-np.abs(v) / v_n)),
    }
    return terms


def textbook_terms(run: Signals, rig: Rig, predicted: Array) -> dict[str, tuple[str, Array]]:
    """Return polynomial terms of the channels up to third order: name -> (effect, (n,))."""
    x, v, V = run["displacement"], run["velocity"], run["voltage"]
    step = float(run["time"][1] - run["time"][0])
    a = np.gradient(v, step)
    rate = np.gradient(V, step)
    return {
        "x": ("gas_spring", x), "x^2": ("gas_spring", x**2), "x^3": ("gas_spring", x**3),
        "v |v|": ("quadratic_damping", v * np.abs(v)), "v^3": ("flattening", v**3),
        "v^2": ("asymmetry", v**2), "|v|": ("asymmetry", np.abs(v)),
        "V": ("asymmetry", V), "V^2": ("asymmetry", V**2),
        "V^2 sgn v": ("saturation", V**2 * np.sign(v)), "V^2 v": ("saturation", V**2 * v),
        "V v^3": ("flattening", V * v**3), "V x": ("gas_spring", V * x),
        "a": ("fluid_inertia", a), "V' sgn v": ("coil_lag", rate * np.sign(v)),
        "t sgn v": ("temperature", run["time"] * np.sign(v)),
        "t v": ("temperature", run["time"] * v),
    }  # fmt: skip


def _mean(values: Array, half: int) -> Array:
    kernel = np.ones(2 * half + 1) / (2 * half + 1)
    return np.convolve(np.pad(values, half, mode="edge"), kernel, mode="valid")


@dataclass(frozen=True)
class BaseFit:
    """The base law refitted to training runs: its nonlinear and its linear parameters."""

    rig: Rig
    search: Array
    linear: Array

    @staticmethod
    def of(rig: Rig, train: list[Signals]) -> BaseFit:
        """Return the fit to these runs."""
        law = BaseLaw(rig, train)
        search, _ = law.refit()
        return BaseFit(rig, search, law.solve(search)[0])

    def again(self, train: list[Signals]) -> BaseFit:
        """Return the fit of the linear parameters to other runs."""
        return replace(self, linear=BaseLaw(self.rig, train).solve(self.search)[0])

    def columns(self, runs: list[Signals]) -> tuple[Array, Array]:
        """Return the law's columns (n, m) and the measured force (n,)."""
        law = BaseLaw(self.rig, runs)
        return law.columns(self.search), law.f


def regression(
    base: BaseFit, train: list[Signals], held: list[Signals], terms: Callable[..., Any], cut: float
) -> tuple[Regression, list[str]]:
    """Return the regression problem and the effect that each term stands for.

    With a `cut` [Hz] force, base law and terms go through the same low-pass, else none does.
    """
    parts, names, effects, width = [], [], [], 0
    for runs in (train, held):
        pieces = []
        for run in runs:
            columns, force = base.columns([run])
            made = terms(run, base.rig, columns @ base.linear)
            names, effects = list(made), [effect for effect, _ in made.values()]
            width = columns.shape[1]
            extra = np.column_stack([values for _, values in made.values()])
            pieces.append(_filtered(np.column_stack([columns, extra, force]), run, cut))
        parts.append(np.concatenate(pieces))
    return Regression(names, width, (parts[0], parts[1])), effects


def _filtered(columns: Array, run: Signals, cut: float) -> Array:
    if cut <= 0.0:
        return columns
    rate = 1.0 / float(run["time"][1] - run["time"][0])
    return np.asarray(sosfiltfilt(butter(2, cut, fs=rate, output="sos"), columns, axis=0))


# --- methods ------------------------------------------------------------------------------------


def stepwise(problem: Regression, by_held_out: bool) -> list[int]:
    """Return the terms chosen one after the other, by held-out error or by Akaike's criterion."""
    chosen: list[int] = []
    _, now, held = problem.solve(chosen)
    while len(chosen) < MOST:
        rest = [k for k in range(len(problem.names)) if k not in chosen]
        if not rest:
            break
        tried = {k: problem.solve([*chosen, k]) for k in rest}
        best = min(rest, key=lambda k: tried[k][2 if by_held_out else 1])
        _, after, after_held = tried[best]
        if by_held_out and np.sqrt(after_held) > (1.0 - GAIN) * np.sqrt(held):
            break
        if not by_held_out and problem.count * np.log(now / after) <= 2.0:
            break
        chosen.append(best)
        now, held = after, after_held
    return chosen


def thresholded(problem: Regression, threshold: float) -> list[int]:
    """Return the terms that sequentially thresholded least squares keeps, largest first.

    The terms' part beside the base law is regressed on what the base law leaves, both over the RMS
    of what it leaves. A root of the Gram matrix has the least squares of all samples.
    """
    b, m = problem.base, problem.base + len(problem.names)
    root = np.linalg.cholesky(problem.train + 1e-12 * np.eye(m + 1)).T
    beside = root[b:, b:]  # the triangle below the base columns: orthogonal to them
    left = float(np.sqrt(np.sum(beside[:, -1] ** 2))) or 1.0
    theta = _stlsq(beside[:, :-1], beside[:, -1] / left, threshold)
    return sorted(np.flatnonzero(theta).tolist(), key=lambda k: -abs(theta[k]))


def _stlsq(columns: Array, target: Array, threshold: float) -> Array:
    """Return coefficients (m,) by pysindy's STLSQ, without it by the algorithm as published."""
    try:
        from pysindy.optimizers import STLSQ
    except ImportError:
        return stlsq(columns, target, threshold)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns where nothing is kept
        found = STLSQ(threshold=threshold, alpha=1e-9, max_iter=20).fit(columns, target)
    return np.asarray(found.coef_, dtype=float).reshape(-1)


def stlsq(columns: Array, target: Array, threshold: float, rounds: int = 20) -> Array:
    """Return coefficients (m,): least squares, those below the threshold to zero, and again."""
    theta = np.linalg.lstsq(columns, target, rcond=1e-10)[0]
    for _ in range(rounds):
        small = np.abs(theta) < threshold
        if np.all(theta[small] == 0.0):
            break
        theta = np.zeros_like(theta)
        if not np.all(small):
            theta[~small] = np.linalg.lstsq(columns[:, ~small], target, rcond=1e-10)[0]
    return theta


def sparsest(problem: Regression) -> list[int]:
    """Return the fewest terms whose held-out error is within 3 % of the best threshold's."""
    found = [thresholded(problem, t) for t in np.geomspace(0.03, 10.0, 16)] + [[]]
    errors = [np.sqrt(problem.solve(chosen)[2]) for chosen in found]
    fair = [c for c, e in zip(found, errors, strict=True) if e <= (1.0 + GAIN) * min(errors)]
    return min(fair, key=len)


def correlations(residual: Array, inputs: list[Array]) -> Array:
    """Return correlation of a residual with itself at lags 1 to 25 and with inputs at 0 to 25."""
    e = residual - residual.mean()
    n, size = len(e), float(np.sqrt(np.mean(e**2))) or 1.0
    out = [float(e[k:] @ e[:-k]) / (n * size**2) for k in range(1, LAGS + 1)]
    for u in inputs:
        w = u - u.mean()
        spread = float(np.sqrt(np.mean(w**2))) or 1.0
        out += [float(e[k:] @ w[: n - k]) / (n * size * spread) for k in range(LAGS + 1)]
    return np.array(out)


def _noise(values: Array) -> float:
    """Return the white noise of a channel from its third differences, robustly."""
    return float(np.median(np.abs(np.diff(values, 3)))) / 0.6745 / np.sqrt(20.0)


def correlation_alarms(base: BaseFit, train: list[Signals], held: list[Signals]) -> dict[str, bool]:
    """Return whether each of the two correlation tests says that the model is not right.

    In the calibration the law is fitted anew to each simulation of the training runs, for noise on
    its inputs biases it, and a biased law leaves a correlated residual.
    """

    def statistic(fit: BaseFit, runs: list[Signals]) -> Array:
        columns, force = fit.columns(runs)
        inputs = [np.concatenate([run[name] for run in runs]) for name in ("velocity", "voltage")]
        return np.abs(correlations(force - columns @ fit.linear, inputs))

    seen = statistic(base, held)
    n = sum(len(run["time"]) for run in held)
    draws = zip(simulated(base, train, 7), simulated(base, held, 8), strict=True)
    largest = np.max([statistic(base.again(one), other) for one, other in draws], axis=0)
    bound = 2.58 / np.sqrt(n)
    return {
        "correlation, textbook": bool(np.any(seen > bound)),
        "correlation, calibrated": bool(np.any(seen > MARGIN * largest + bound)),
    }


def simulated(base: BaseFit, noisy: list[Signals], seed: int = 7) -> list[list[Signals]]:
    """Return draws of the runs as the fitted base law would have answered, with fresh noise."""
    rng = np.random.default_rng(seed)
    quiet = [low_passed(run) for run in noisy]
    forces = []
    for run in quiet:
        columns, _ = base.columns([run])
        forces.append(columns @ base.linear)
    out = []
    for _ in range(DRAWS):
        runs = []
        for run, seen, force in zip(quiet, noisy, forces, strict=True):
            made = {**run, "force": force}
            for name in ("displacement", "velocity", "voltage", "force"):
                made[name] = made[name] + _noise(seen[name]) * rng.standard_normal(len(force))
            runs.append(made)
        out.append(runs)
    return out


def ask(case: Recorded) -> dict[str, Any]:
    """Return what every method says of a case: effects named in order, whether "unknown"."""
    rig = _rig(case)
    raw = case.part("train"), case.part("holdout")
    smooth = [low_passed(r) for r in raw[0]], [low_passed(r) for r in raw[1]]
    out: dict[str, Any] = {}
    plain, expert = BaseFit.of(rig, raw[0]), BaseFit.of(rig, smooth[0])
    for style, base, runs, terms, cut in (
        ("informed", expert, smooth, expert_terms, CUT),
        ("textbook", plain, raw, textbook_terms, 0.0),
    ):
        problem, effects = regression(base, *runs, terms, cut)
        before = time.perf_counter()
        chosen = stepwise(problem, style == "informed")
        middle = time.perf_counter()
        kept = sparsest(problem) if style == "informed" else thresholded(problem, 0.1)
        after = time.perf_counter()
        unknown = style == "informed" and error_ratio(problem, chosen, base, raw[1]) > LEFT
        out[f"stepwise, {style}"] = _said(effects, chosen, unknown, middle - before)
        out[f"sparse, {style}"] = _said(effects, kept, False, after - middle)
    begun = time.perf_counter()
    for name, alarm in correlation_alarms(plain, *raw).items():
        out[name] = {"named": [], "unknown": alarm, "seconds": time.perf_counter() - begun}
    return out


def error_ratio(
    problem: Regression, chosen: list[int], base: BaseFit, held: list[Signals]
) -> float:
    """Return the held-out error over that of the base law, were it true, with the same noise."""
    squares = []
    for runs in simulated(base, held):
        for run in [low_passed(r) for r in runs]:
            columns, force = base.columns([run])
            left = _filtered((force - columns @ base.linear)[:, None], run, CUT)
            squares.append(float(np.mean(left**2)))
    return float(np.sqrt(problem.solve(chosen)[2] / np.mean(squares)))


def _said(effects: list[str], chosen: list[int], unknown: bool, seconds: float) -> dict[str, Any]:
    named = list(dict.fromkeys(effects[k] for k in chosen))
    return {"named": named, "unknown": bool(unknown), "seconds": seconds}
