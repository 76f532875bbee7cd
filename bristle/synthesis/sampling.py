"""From hats to a controller: reconstruction, exact sampling, and the table over the speed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from .lmi import Solution
from .plant import Plant, StateSpace, Units

Array = NDArray[np.float64]


class Bank(NamedTuple):
    """Controllers of one order at several speeds: A (k, n, n), B (k, n, 1), C (k, 1, n).

    x' = A x + B y, u = C x; `W` (k, n, 1) is the column of a second input.
    """

    A: Array
    B: Array
    W: Array
    C: Array

    def at(self, k: int) -> StateSpace:
        """Return the controller k, from y to u."""
        return StateSpace(self.A[k], self.B[k], self.C[k], np.zeros((1, 1)))

    @property
    def poles(self) -> NDArray[np.complex128]:
        """Poles (k, n) [rad/s]."""
        values: NDArray[np.complex128] = np.linalg.eigvals(self.A).astype(np.complex128)
        return values


def reconstruct(s: Solution, plants: list[Plant], r: Array, units: Units) -> Bank:
    """Return the controllers at several speeds.

    N M^T = I - X Y with M = Y, N = Y^-1 - X(r) where Y is constant, and N = X, M^T = X^-1 - Y(r)
    where X is: either way no rate of the speed enters. A direct path D22 from command to
    measurement is taken out of y inside the controller.

    Parameters
    ----------
    s : the solution of the inequalities
    plants : k plants in `units`, one per speed
    r : (k,) m/s
    units : what command and measurement were divided by; the controllers are free of it
    """
    X, Y = s.X(r), s.Y(r)
    Ah, Bh, Ch = s.hats(r)
    n = len(s.X0)
    unit = np.broadcast_to(np.eye(n), X.shape)
    if s.varies in ("none", "X"):
        Mt, N = Y, np.linalg.solve(Y, unit) - X
    else:
        Mt, N = np.linalg.solve(X, unit) - Y, X
    A, B2, C2, D22 = (
        np.array([getattr(plant, name) for plant in plants]) for name in ("A", "B2", "C2", "D22")
    )
    inner = Ah - X @ A @ Y - Bh @ C2 @ Y - X @ B2 @ Ch
    right = np.linalg.solve(Mt.transpose(0, 2, 1), unit).transpose(0, 2, 1)  # M^-T
    A_K = np.linalg.solve(N, inner) @ right
    B_K = np.linalg.solve(N, Bh)
    C_K = Ch @ right
    A_K = A_K - B_K @ D22 @ C_K
    C_K = C_K / units.command
    return Bank(A_K, np.asarray(B_K / units.measurement), anti_windup(C_K), C_K)


def anti_windup(C: Array) -> Array:
    """Return C^T/(C C^T) (k, n, 1): the column that moves u by as much as it is fed."""
    squares = (C @ C.transpose(0, 2, 1))[:, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        column = np.where(squares > 0.0, C[:, 0] / squares, 0.0)
    return column[:, :, None]


def sampled(bank: Bank, h: float) -> Bank:
    """Return the bank in discrete time: exact for inputs held over the sample period h [s]."""
    k, n, _ = bank.A.shape
    together = np.zeros((k, n + 2, n + 2))
    together[:, :n, :n] = bank.A
    together[:, :n, n : n + 1] = bank.B
    together[:, :n, n + 1 :] = bank.W
    stepped = linalg.expm(together * h)
    return Bank(
        stepped[:, :n, :n], stepped[:, :n, n : n + 1], stepped[:, :n, n + 1 :], bank.C
    )  # fmt: skip
