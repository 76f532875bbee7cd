"""Synthesis by linear matrix inequalities: one plant, or a grid of plants over the speed.

Basic characterisation of Gahinet & Apkarian (1994), Int. J. Robust Nonlinear Control 4(4), and
Apkarian & Adams (1998), IEEE TCST 6(1), with Dh = 0: no direct path from y to u. "h" is a hat.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..core.arrays import Array
from ..core.text import install
from ..errors import DesignError
from .plant import Plant

STRICT = (1e-7, 1e-5, 1e-3)
"""How far below zero the inequalities are held, in balanced states: the next where one fails."""
VARIES = {"none": (False, False), "X": (True, False), "Y": (False, True), "both": (True, True)}
"""Which of X and Y depend on the speed."""
ROUNDING = 1e-9
"""Eigenvalues above zero by no more than this share of the largest entry count as rounding."""
SLACK = 0.01
"""Largest relative growth of gamma that makes an inexact solution hold; beyond it is refused."""


@dataclass(frozen=True)
class Solution:
    """Lyapunov matrices and hats: X(r) = X0 + r X1, Y likewise; hats free at each grid point.

    Attributes
    ----------
    grid : (k,) array
        Speeds [m/s]; one zero for a single plant.
    X0, X1, Y0, Y1 : (n, n) arrays
        X1, Y1 are zero where constant.
    Ah, Bh, Ch : (k, n, n), (k, n, 1), (k, 1, n) arrays
    gamma : float
        Bound on the closed-loop norm that the inequalities prove, checked without the solver.
    solver_gamma : float
        What the solver said.
    status : str
        "optimal" or "optimal_inaccurate".
    """

    grid: Array
    X0: Array
    X1: Array
    Y0: Array
    Y1: Array
    Ah: Array
    Bh: Array
    Ch: Array
    gamma: float
    solver_gamma: float
    status: str
    varies: str
    rate: float
    tau: float

    def X(self, r: Array) -> Array:  # noqa: N802
        """Return X (k, n, n) at speeds r (k,)."""
        return self.X0 + r[:, None, None] * self.X1

    def Y(self, r: Array) -> Array:  # noqa: N802
        """Return Y (k, n, n) at speeds r (k,)."""
        return self.Y0 + r[:, None, None] * self.Y1

    def hats(self, r: Array) -> tuple[Array, Array, Array]:
        """Return Ah, Bh, Ch at speeds r (k,), linear between grid points."""
        if len(self.grid) == 1:
            still = np.zeros(len(r), dtype=np.int64)
            return self.Ah[still], self.Bh[still], self.Ch[still]
        k = np.clip(np.searchsorted(self.grid, r, side="right") - 1, 0, len(self.grid) - 2)
        share = ((r - self.grid[k]) / (self.grid[k + 1] - self.grid[k]))[:, None, None]
        Ah, Bh, Ch = (h[k] + share * (h[k + 1] - h[k]) for h in (self.Ah, self.Bh, self.Ch))
        return Ah, Bh, Ch


def solve(
    plants: list[Plant], grid: Array, tau: float, varies: str = "none", rate: float = 1.0
) -> Solution:
    """Return the least gamma and the matrices that prove it.

        minimise gamma  s.t. the synthesis LMI at each grid point and [[X, tau I], [tau I, Y]] >= 0

    tau > 1 keeps X Y away from I, where the controller's poles go to infinity; gamma then depends
    on the plants' states: they must be balanced, all by the same T.

    Parameters
    ----------
    plants : list of Plant
        One per grid point.
    grid : (k,) array
        Speeds [m/s].
    tau : float
        At least 1.
    varies : {"none", "X", "Y", "both"}
    rate : float
        Bound on the rate of change of the speed [m/s2]; counts where X or Y varies.

    Raises
    ------
    DesignError
        If the solver fails, or its solution does not hold when checked without it.
    """
    doubt = ""
    for strict in STRICT:
        try:
            return _solved(plants, grid, tau, varies, rate, strict)
        except _DoesNotHoldError as error:
            doubt = str(error)
    raise DesignError(doubt)


class _DoesNotHoldError(DesignError):
    """A solution that does not stand up to its check."""


def _solved(
    plants: list[Plant], grid: Array, tau: float, varies: str, rate: float, strict: float
) -> Solution:
    top = float(grid[-1]) or 1.0
    problem, unknowns = _problem(plants, grid / top, tau, varies, rate / top, strict)
    status = _run_solver(problem)
    X0, X1, Y0, Y1 = (_symmetric(unknowns[name]) for name in ("X0", "X1", "Y0", "Y1"))
    Ah, Bh, Ch = (np.array([hat.value for hat in unknowns[name]]) for name in ("Ah", "Bh", "Ch"))
    gamma = float(unknowns["gamma"].value)
    draft = Solution(
        grid, X0, X1 / top, Y0, Y1 / top, Ah, Bh, Ch, gamma, gamma, status, varies, rate, tau
    )
    return _certified(draft, plants)


def _problem(
    plants: list[Plant], grid: Array, tau: float, varies: str, rate: float, strict: float
) -> tuple[Any, dict[str, Any]]:
    cp = _cvxpy()
    n = plants[0].order
    x_varies, y_varies = VARIES[varies]
    unknowns: dict[str, Any] = {"gamma": cp.Variable()}
    for name, free in (("X0", True), ("X1", x_varies), ("Y0", True), ("Y1", y_varies)):
        unknowns[name] = cp.Variable((n, n), symmetric=True) if free else np.zeros((n, n))
    for name, shape in (("Ah", (n, n)), ("Bh", (n, 1)), ("Ch", (1, n))):
        unknowns[name] = [cp.Variable(shape) for _ in plants]
    constraints = []
    for k, (plant, r) in enumerate(zip(plants, grid, strict=True)):
        X = unknowns["X0"] + r * unknowns["X1"]
        Y = unknowns["Y0"] + r * unknowns["Y1"]
        hats = [unknowns[name][k] for name in ("Ah", "Bh", "Ch")]
        for sign in (1.0, -1.0) if x_varies or y_varies else (0.0,):
            dX, dY = sign * rate * unknowns["X1"], sign * rate * unknowns["Y1"]
            blocks = _blocks(plant, unknowns["gamma"], (X, dX), (Y, dY), hats)
            full = cp.bmat(blocks)
            size = full.shape[0]
            constraints.append(0.5 * (full + full.T) << -strict * np.eye(size))
    # X and Y are affine in r: where they hold at both ends they hold between.
    for r in (grid[0], grid[-1]) if x_varies or y_varies else (0.0,):
        X = unknowns["X0"] + r * unknowns["X1"]
        Y = unknowns["Y0"] + r * unknowns["Y1"]
        coupling = tau * np.eye(n)
        pair = cp.bmat([[X, coupling], [coupling, Y]])
        constraints.append(0.5 * (pair + pair.T) >> 0)
    return cp.Problem(cp.Minimize(unknowns["gamma"]), constraints), unknowns


def _blocks(
    p: Plant, gamma: Any, X_rate: tuple[Any, Any], Y_rate: tuple[Any, Any], hats: Sequence[Any]
) -> list[list[Any]]:
    """Return the blocks of the synthesis LMI; numbers or cvxpy expressions alike.

    `X_rate`, `Y_rate` are X and Y with their rates, `hats` the controller's transformed A, B, C.
    """
    (X, dX), (Y, dY), (Ah, Bh, Ch) = X_rate, Y_rate, hats
    first = X @ p.A + Bh @ p.C2
    second = p.A @ Y + p.B2 @ Ch
    cross = Ah + p.A.T
    left = X @ p.B1 + Bh @ p.D21
    right = p.C1 @ Y + p.D12 @ Ch
    m, k = p.B1.shape[1], len(p.C1)
    return [
        [dX + first + first.T, cross, left, p.C1.T],
        [cross.T, second + second.T - dY, p.B1, right.T],
        [left.T, p.B1.T, -gamma * np.eye(m), p.D11.T],
        [p.C1, right, p.D11, -gamma * np.eye(k)],
    ]


def _cvxpy() -> Any:
    try:
        import cvxpy
    except ImportError:
        raise DesignError(
            f"this design needs cvxpy, which is not installed:  {install('design')}"
        ) from None
    return cvxpy


def _run_solver(problem: Any) -> str:
    cp = _cvxpy()
    try:
        with warnings.catch_warnings():
            # Inexact solutions are checked below, with numbers.
            warnings.filterwarnings("ignore", "Solution may be inaccurate")
            problem.solve(solver=cp.CLARABEL)
    except cp.error.SolverError as error:
        raise DesignError(f"the solver CLARABEL failed: {error}") from None
    status = str(problem.status)
    if status not in ("optimal", "optimal_inaccurate"):
        raise DesignError(
            f"the solver CLARABEL found no solution ({status}). Weights with less gain, a shorter "
            "grid or a smaller tau would make the problem easier."
        )
    return status


def _symmetric(unknown: Any) -> Array:
    value = unknown if isinstance(unknown, np.ndarray) else unknown.value
    half: Array = 0.5 * (value + value.T)
    return half


def eigenvalues(s: Solution, plants: list[Plant], r: Array, gamma: float) -> tuple[Array, Array]:
    """Return the largest eigenvalue of the LMI at speeds r (k,), and the LMI's largest entry (k,).

    Over both signs of the rate. Below zero the bound gamma is proved there; between grid points the
    hats are interpolated.

    Parameters
    ----------
    s : the solution to check
    plants : k plants in the solver's units, one per speed
    r : (k,) m/s
    gamma : bound on the closed-loop norm, in the solver's units
    """
    X, Y = s.X(r), s.Y(r)
    hats = s.hats(r)
    worst, entry = np.full(len(r), -np.inf), np.zeros(len(r))
    for sign in (1.0, -1.0) if s.varies != "none" else (0.0,):
        dX, dY = sign * s.rate * s.X1, sign * s.rate * s.Y1
        full = np.array(
            [
                np.block(_blocks(p, gamma, (X[k], dX), (Y[k], dY), [hat[k] for hat in hats]))
                for k, p in enumerate(plants)
            ]
        )
        worst = np.maximum(worst, np.linalg.eigvalsh(full)[:, -1])
        entry = np.maximum(entry, np.abs(full).max(axis=(1, 2)))
    return worst, entry


def _certified(s: Solution, plants: list[Plant]) -> Solution:
    """Return the solution with the least gamma at which it holds, found without the solver."""
    n = len(s.X0)
    ends = s.grid[[0, -1]]
    for X, Y in zip(s.X(ends), s.Y(ends), strict=True):
        pair = np.linalg.eigvalsh(np.block([[X, np.eye(n)], [np.eye(n), Y]]))
        if not pair[0] > -ROUNDING * pair[-1]:
            raise _DoesNotHoldError(
                f"the solver's solution ({s.status}) is not one: the least eigenvalue of "
                f"[[X, I], [I, Y]] is {pair[0]:.3g}, the largest {pair[-1]:.3g}."
            )
    for growth in (0.0, *np.geomspace(1e-7, SLACK, 21)):
        gamma = s.solver_gamma * (1.0 + float(growth))
        worst, entry = eigenvalues(s, plants, s.grid, gamma)
        if np.all(worst <= ROUNDING * entry):
            return replace(s, gamma=gamma)
    k = int(np.argmax(worst / entry))
    raise _DoesNotHoldError(
        f"the solver's solution ({s.status}, gamma {s.solver_gamma:.5g}) does not hold: even with "
        f"gamma {100 * SLACK:g} % larger the LMI at {s.grid[k]:g} m/s has the eigenvalue "
        f"{worst[k]:.3g} where negative ones are due (largest entry {entry[k]:.3g}). "
        "Less demanding weights or a larger tau would help."
    )
