"""What a refit of the base law leaves of a force.

Variable projection: the laws are linear in all parameters but the normalising speed and, for
LuGre, the bristle's length. Those two are searched, the others follow from non-negative least
squares (Golub & Pereyra 1973; Lawson & Hanson 1974).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.optimize import minimize, nnls
from scipy.signal import butter, sosfiltfilt

from .kernel import bristle_along_path
from .rigs import Rig

REACH = 5.0  # factor either way within which the two searched parameters may move
STUCK = 1e-3  # m/s, slower than that a free base may be held (10 N size)
Array = NDArray[np.float64]
Signals = list[dict[str, Array]]


def _path(run: dict[str, Array]) -> Array:
    """Displacement that belongs to the velocity that is shown."""
    if "velocity_true" not in run:
        return run["displacement"]
    spline = make_interp_spline(run["time"], run["velocity"], k=5)
    return np.asarray(spline.antiderivative()(run["time"]))


class BaseLaw:
    """Regressors of a base law on given runs, as functions of its nonlinear parameters."""

    def __init__(self, rig: Rig, runs: Signals, force: str = "force", stride: int = 1) -> None:
        self.stride = stride
        self.rig = rig
        self.lugre = rig.law == "lugre"
        self.h = float(runs[0]["time"][1] - runs[0]["time"][0])
        self.runs = [(_path(r), r["velocity"]) for r in runs]
        self.v = np.concatenate([r["velocity"][::stride] for r in runs])
        self.e = np.concatenate([r["voltage"][::stride] for r in runs])
        self.f = np.concatenate([r[force][::stride] for r in runs])
        self.u = np.abs(self.v)
        # a base held by dry friction is no matter of the sliding law
        held = rig.building is not None and not self.lugre
        self.keep = self.u > (STUCK * rig.scales[1] if held else -1.0)
        self.f = self.f * self.keep
        self.sign = np.sign(self.v)

    def bristle(self, kappa: float) -> Array:
        parts = []
        for x, v in self.runs:
            z = np.empty(x.size)
            bristle_along_path(x, v, self.h, kappa, z)
            parts.append(z[:: self.stride])
        return np.concatenate(parts)

    def columns(self, search: Array) -> Array:
        """Columns (n, 4 or 5) at search = log of (v_n,) or (v_n, a_0)."""
        drag = self.v * np.exp(-self.u / np.exp(search[0]))
        if not self.lugre:
            a = np.stack([self.sign, self.sign * self.e, drag, drag * self.e], axis=1)
            return a * self.keep[:, None]
        kappa = float(np.exp(search[1]))
        m = kappa * self.bristle(kappa)
        turn = self.v - self.u * m
        return np.stack([m, m * self.e, turn, drag, drag * self.e], axis=1)

    def solve(self, search: Array) -> tuple[Array, Array]:
        """Linear parameters, never negative, and the residual (n,)."""
        a = self.columns(search)
        gram, right = a.T @ a, a.T @ self.f
        size = np.sqrt(np.diag(gram)) + 1e-300
        root = np.linalg.cholesky(gram / np.outer(size, size) + 1e-12 * np.eye(size.size))
        linear, _ = nnls(root.T, np.linalg.solve(root, right / size))
        linear = linear / size
        free = linear > 0.0
        if free.any():  # polish: the floor on the Gram matrix above costs digits
            linear[free] = np.linalg.lstsq(a[:, free], self.f, rcond=None)[0]
        return linear, self.f - a @ linear

    def start(self) -> Array:
        v = self.rig.values
        return np.log([v["v_n"], v["a_0"]]) if self.lugre else np.log([v["v_n"]])

    def _loss(self, search: Array, origin: Array) -> float:
        if np.any(np.abs(search - origin) > np.log(REACH)):
            return float(self.f @ self.f)
        _, residual = self.solve(search)
        return float(residual @ residual)

    def _grid(self) -> list[Array]:
        """Starts over the whole range: a bristle can also pose as a spring."""
        steps = np.log(REACH) * np.array([-0.9, -0.45, 0.0, 0.45, 0.9])
        origin = self.start()
        if not self.lugre:
            return [origin + q for q in steps]
        return [origin + np.array([p, q]) for q in steps for p in steps[::2]]

    def refit(self, start: Array | None = None) -> tuple[Array, float]:
        """Search parameters at the best fit, and the share of the force RMS that is left."""
        origin = self.start()
        starts = self._grid() + ([] if start is None else [start])
        begin = min(starts, key=lambda q: self._loss(q, origin))
        simplex = begin + np.vstack([np.zeros(begin.size), 0.15 * np.eye(begin.size)])
        found = minimize(
            self._loss,
            begin,
            args=(origin,),
            method="Nelder-Mead",
            options={
                "initial_simplex": simplex,
                "xatol": 1e-4,
                "fatol": 1e-8 * float(self.f @ self.f),
                "maxfev": 160,
            },
        )
        power = float(self.f @ self.f)
        return found.x, float(np.sqrt(max(found.fun, 0.0) / power)) if power > 0.0 else 0.0

    def values(self, search: Array) -> dict[str, float]:
        """Parameters of the law under their usual names."""
        linear, _ = self.solve(search)
        if not self.lugre:
            names = ("f_c", "f_v", "c_0", "c_v")
            return dict(zip(names, linear.tolist(), strict=True)) | {
                "v_n": float(np.exp(search[0]))
            }
        kappa = float(np.exp(search[1]))
        y0, y1, turn, drag0, drag1 = linear.tolist()
        named = {"sigma_a": y0 * kappa, "sigma_0": y1 * kappa, "sigma_1": turn}
        named |= {"sigma_2": drag0, "sigma_b": drag1, "v_n": float(np.exp(search[0]))}
        return named | {"a_0": kappa}

    def share(self, search: Array, linear: Array) -> float:
        """Share of the force RMS that given parameters leave on these runs."""
        residual = self.f - self.columns(search) @ linear
        return float(np.sqrt(residual @ residual / (self.f @ self.f)))

    def share_low_passed(self, search: Array, linear: Array, cut: float = 18.0) -> float:
        """The same with force and prediction through a zero-phase low-pass, cut in Hz."""
        sections = butter(4, cut, fs=1.0 / (self.h * self.stride), output="sos")
        ends = np.cumsum([x[:: self.stride].size for x, _ in self.runs])[:-1]
        left, whole = 0.0, 0.0
        predicted = self.columns(search) @ linear
        for f, g in zip(np.split(self.f, ends), np.split(predicted, ends), strict=True):
            a, b = sosfiltfilt(sections, f), sosfiltfilt(sections, f - g)
            whole, left = whole + float(a @ a), left + float(b @ b)
        return float(np.sqrt(left / whole))
