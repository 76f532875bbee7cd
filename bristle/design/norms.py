"""The H-infinity norm, bounded from both sides, and the least that any controller reaches."""

from __future__ import annotations

from math import inf

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ..errors import DesignError
from .plant import Plant, StateSpace

Array = NDArray[np.float64]

PRECISION = 1e-6
"""Relative precision of a norm."""


def gains(system: StateSpace, omega: Array) -> Array:
    """Return the largest singular value of the frequency response at `omega` (k,) rad/s."""
    A, B, C, D = system
    values, vectors = linalg.eig(A)
    if np.linalg.cond(vectors) < 1e10:
        left = np.linalg.solve(vectors, B)
        terms = left[None] / (1j * omega[:, None, None] - values[:, None])
        response = (C @ vectors) @ terms + D
    else:
        s = 1j * omega[:, None, None] * np.eye(len(A))
        response = C @ np.linalg.solve(s - A, np.broadcast_to(B, (len(omega), *B.shape))) + D
    largest: Array = np.linalg.norm(response, 2, axis=(1, 2))
    return largest


def hinf_norm(system: StateSpace) -> float:
    """Return the H-infinity norm of a stable system, to `PRECISION`; infinity if it is unstable.

    Bruinsma & Steinbuch (1990), Syst. Control Lett. 14(4), 287-293: the frequency response bounds
    the norm from below, a Hamiltonian matrix without imaginary eigenvalues from above.

    Raises
    ------
    DesignError
        If the two bounds do not meet: the system is too badly conditioned to be judged.
    """
    poles = np.linalg.eigvals(system.A)
    if not poles.real.max() < 0.0:
        return inf
    sizes = np.abs(poles)
    span = np.geomspace(max(sizes.min() * 1e-2, 1e-9), sizes.max() * 1e2, 200)
    omega = np.concatenate([[0.0], span, sizes, np.abs(poles.imag)])
    below = float(gains(system, omega).max())
    direct = float(np.linalg.norm(system.D, 2))
    below = max(below, direct * (1.0 + PRECISION))
    if below == 0.0:
        return 0.0
    for _ in range(50):
        above = below * (1.0 + 2.0 * PRECISION)
        crossings = _crossings(system, above)
        if len(crossings) == 0:
            return below * (1.0 + PRECISION)
        if len(crossings) == 1:
            middles = crossings
        else:
            middles = np.concatenate([crossings, 0.5 * (crossings[1:] + crossings[:-1])])
        raised = float(gains(system, middles).max())
        if raised <= below * (1.0 + 1e-3 * PRECISION):
            break
        below = raised
    raise DesignError(
        f"the H-infinity norm cannot be computed: the frequency response reaches {below:.6g}, and "
        f"{above:.6g} is not seen to bound it. The system is too badly conditioned."
    )


def _crossings(system: StateSpace, gamma: float) -> Array:
    """Return the frequencies [rad/s], rising, at which a singular value is gamma (above D's)."""
    A, B, C, D = system
    R = gamma**2 * np.eye(D.shape[1]) - D.T @ D
    inner = A + B @ np.linalg.solve(R, D.T @ C)
    outer = C.T @ (np.eye(len(D)) + D @ np.linalg.solve(R, D.T)) @ C
    hamiltonian = np.block([[inner, B @ np.linalg.solve(R, B.T)], [-outer, -inner.T]])
    values = np.linalg.eigvals(hamiltonian)
    on_axis = np.abs(values.real) <= 1e-8 * (np.abs(values) + 1e-3 * np.abs(values).max())
    rising: Array = np.unique(np.abs(values[on_axis].imag))
    return rising


def least_gamma(plant: Plant, tolerance: float = 1e-8) -> float:
    """Return the infimum of the closed-loop norm over all controllers.

    Two Riccati equations and bisection (Doyle, Glover, Khargonekar & Francis 1989, IEEE TAC 34(8)),
    with cross terms; safe where a library synthesis returned a norm 30 times too small.

    Raises
    ------
    DesignError
        If no controller reaches the open-loop norm, which does not happen for a stable plant: the
        problem is then badly conditioned.
    """
    low, high = 0.0, 1.001 * hinf_norm(plant.open_loop())
    if not _reachable(plant, high):
        raise DesignError(
            f"no controller reaches even the open-loop norm {high:.6g}: the plant is too badly "
            "conditioned. Bring weights and building to a common scale."
        )
    while high - low > tolerance * high:
        middle = 0.5 * (low + high)
        if _reachable(plant, middle):
            high = middle
        else:
            low = middle
    return high


def _reachable(plant: Plant, gamma: float) -> bool:
    """Return whether some controller brings the norm below gamma, for D11 = 0."""
    A, B1, B2, C1, _, D12, C2, D21, _ = plant
    X = _riccati(A, B1, B2, C1, D12, gamma)
    Y = _riccati(A.T, C1.T, C2.T, B1.T, D21.T, gamma)
    if X is None or Y is None:
        return False
    return bool(np.abs(np.linalg.eigvals(X @ Y)).max() < gamma**2)


def _riccati(
    A: Array, B1: Array, B2: Array, C1: Array, D12: Array, gamma: float
) -> Array | None:  # fmt: skip
    """Return the stabilising solution X >= 0 of the state-feedback Riccati equation, or None."""
    n = len(A)
    weight = np.linalg.inv(D12.T @ D12)
    drift = A - B2 @ weight @ D12.T @ C1
    cost = C1.T @ (np.eye(len(C1)) - D12 @ weight @ D12.T) @ C1
    hamiltonian = np.block([[drift, B1 @ B1.T / gamma**2 - B2 @ weight @ B2.T], [-cost, -drift.T]])
    _, Z, stable = linalg.schur(hamiltonian, sort="lhp")
    if stable != n or np.linalg.cond(Z[:n, :n]) > 1e14:
        return None
    X = np.linalg.solve(Z[:n, :n].T, Z[n:, :n].T).T
    X = 0.5 * (X + X.T)
    values = np.linalg.eigvalsh(X)
    return X if values[0] >= -1e-8 * max(1.0, values[-1]) else None
