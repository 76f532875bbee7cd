"""Stability margins of a designed loop, cut at the measured acceleration.

python-control's `stability_margins` finds crossings as roots of polynomials, which overflow for
the plants of an LPV design; here they are read from a dense frequency response, and the modulus
margin from a norm.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .norms import hinf_norm
from .plant import Plant, StateSpace

if TYPE_CHECKING:
    from .result import DesignResult

Array = NDArray[np.float64]

_POINTS = 4000
_NEAR = np.linspace(-3.0, 3.0, 121)
"""Points around each resonance, in half its width."""


class Margins(NamedTuple):
    """How far a loop is from instability.

    `modulus`: least distance of L from -1, 1/||1/(1 + L)||. `gain_up`, `gain_down`: factors on the
    loop's gain at which it turns unstable, None where there is none. `phase` [deg]: least phase at
    gain 1, None where the gain never is 1.
    """

    modulus: float
    gain_up: float | None
    gain_down: float | None
    phase: float | None


def grid_rows(result: DesignResult) -> list[int]:
    """Return the rows of the table nearest to the design's grid speeds; [0] without a table."""
    if len(result.speeds) == 1:
        return [0]
    grid = np.array(result.task.scheduling.grid)
    rows: list[int] = np.abs(result.speeds[None] - grid[:, None]).argmin(axis=1).tolist()
    return rows


def margins(plant: Plant, K: StateSpace) -> Margins:
    """Return the margins of the loop L = -G K, with u = K y and the speed held.

    Parameters
    ----------
    plant : Plant
        The generalized plant; G is its path from command to measurement.
    K : StateSpace
        The controller, without a direct path.
    """
    n = plant.order
    closed = plant.closed_loop(K)
    sensitivity = StateSpace(
        closed.A,
        np.vstack([np.zeros((n, 1)), K.B]),
        np.hstack([plant.C2, plant.D22 @ K.C]),
        np.eye(1),
    )
    omega = _frequencies(plant.A, K.A, closed.A)
    G = StateSpace(plant.A, plant.B2, plant.C2, plant.D22)
    L = -_response(G, omega) * _response(K, omega)
    up, down = _gains(L)
    return Margins(1.0 / hinf_norm(sensitivity), up, down, _phase(L))


def facts_of(result: DesignResult) -> dict[str, Any]:
    """Return the least margins over the grid's speeds, for a report.

    Returns
    -------
    dict
        `modulus`, `gain_up`, `gain_down`, `phase` [deg], and `speeds` [m/s] with each one's
        margins.
    """
    rows = grid_rows(result)
    each = [margins(result.plants[k], result.bank.at(k)) for k in rows]
    return {
        "modulus": min(m.modulus for m in each),
        "gain_up": _least([m.gain_up for m in each]),
        "gain_down": max((m.gain_down for m in each if m.gain_down is not None), default=None),
        "phase": _least([m.phase for m in each]),
        "speeds": [
            {"speed": float(result.speeds[k]), **m._asdict()}
            for k, m in zip(rows, each, strict=True)
        ],
    }


def _least(values: list[float | None]) -> float | None:
    return min((value for value in values if value is not None), default=None)


def _frequencies(*matrices: Array) -> Array:
    poles = np.concatenate([np.linalg.eigvals(A) for A in matrices])
    sizes = np.abs(poles)
    sizes = sizes[sizes > 0.0]
    span = np.geomspace(sizes.min() * 1e-2, sizes.max() * 1e2, _POINTS)
    near = np.abs(poles.imag)[:, None] + _NEAR[None] * np.abs(poles.real)[:, None]
    omega = np.unique(np.concatenate([span, near[near > 0.0].ravel()]))
    return np.asarray(omega, dtype=np.float64)


def _response(system: StateSpace, omega: Array) -> NDArray[np.complex128]:
    A, B, C, D = system
    s = 1j * omega[:, None, None] * np.eye(len(A))
    response = C @ np.linalg.solve(s - A, np.broadcast_to(B, (len(omega), *B.shape))) + D
    return np.asarray(response[:, 0, 0], dtype=np.complex128)


def _gains(L: NDArray[np.complex128]) -> tuple[float | None, float | None]:
    """Return the factors nearest to 1 from above and below that take L through -1."""
    a, b = L[:-1], L[1:]
    at = np.flatnonzero((a.imag < 0.0) != (b.imag < 0.0))
    share = a.imag[at] / (a.imag[at] - b.imag[at])
    real = a.real[at] + share * (b.real[at] - a.real[at])
    factors = -1.0 / real[real < 0.0]
    up, down = factors[factors > 1.0], factors[factors < 1.0]
    return (float(up.min()) if len(up) else None, float(down.max()) if len(down) else None)


def _phase(L: NDArray[np.complex128]) -> float | None:
    """Return the least angle [deg] between L and -1 where its size is 1."""
    size = np.abs(L)
    at = np.flatnonzero((size[:-1] < 1.0) != (size[1:] < 1.0))
    if len(at) == 0:
        return None
    share = (1.0 - size[at]) / (size[at + 1] - size[at])
    crossing = L[at] + share * (L[at + 1] - L[at])
    return float(np.degrees(np.abs(np.angle(-crossing))).min())
