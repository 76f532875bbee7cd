"""The policy's estimator: a Kalman filter of the building and of the ground that shakes it."""

from __future__ import annotations

import numpy as np
from scipy import linalg

from bristle.core.arrays import Array
from bristle.errors import DesignError
from bristle.synthesis.plant import StateSpace

GROUNDS = ((5.0, 0.5), (25.0, 0.5))
"""Corner [rad/s] and damping ratio of the layers whose sum the ground motion is taken for."""
NOISE = (0.04, 1e-4, 1e-3)
"""Noise of floor acceleration [m/s2], displacement [m] and velocity [m/s] beside white noise of
1 m/s2 s^0.5 under each layer: only the ratio counts."""


def estimator(structure: StateSpace, h: float) -> tuple[Array, Array]:
    """Return A (n, n) and B (n, 4) of x_k = A x_k-1 + B m_k.

    The states are the building's and two of each layer of ground (Kanai 1957, Tajimi 1960); m holds
    floor acceleration [m/s2], displacement [m], velocity [m/s] and force [N] of the damper. The
    force is that of the interval before the sample.

    Parameters
    ----------
    structure : as `plant.structure` returns it, m states
    h : sample period [s]

    Raises
    ------
    DesignError
        If the filter's Riccati equation has no solution.
    """
    m = len(structure.A)
    n = m + 2 * len(GROUNDS)
    A, push, shaken = np.zeros((n, n)), np.zeros((n, 1)), np.zeros((n, len(GROUNDS)))
    A[:m, :m], push[:m, 0] = structure.A, structure.B[:, 0]
    for k, (corner, damping) in enumerate(GROUNDS):
        at = m + 2 * k
        A[at : at + 2, at : at + 2] = [[0.0, 1.0], [-(corner**2), -2.0 * damping * corner]]
        A[:m, at] = structure.B[:, 1] * corner**2
        A[:m, at + 1] = structure.B[:, 1] * 2.0 * damping * corner
        shaken[at + 1, k] = 1.0
    seen = np.zeros((3, n))
    seen[:, :m] = structure.C
    stepped = linalg.expm(np.block([[A, push], [np.zeros((1, n + 1))]]) * h)
    phi, gamma = stepped[:n, :n], stepped[:n, n:]
    # The noise's covariance over a sample, after Van Loan (1978), IEEE TAC 23(3).
    both = linalg.expm(np.block([[-A, shaken @ shaken.T], [np.zeros((n, n)), A.T]]) * h)
    noisy = both[n:, n:].T @ both[:n, n:]
    R = np.diag(np.square(NOISE))
    try:
        P = linalg.solve_discrete_are(phi.T, seen.T, noisy + 1e-12 * np.eye(n), R)
        gain = np.linalg.solve(seen @ P @ seen.T + R, seen @ P).T
    except (np.linalg.LinAlgError, ValueError) as error:
        raise DesignError(f"policy: the estimator's Riccati equation: {error}.") from None
    rest = np.eye(n) - gain @ seen
    direct = gain @ structure.D[:, :1]
    return rest @ phi, np.hstack([gain, rest @ gamma - direct])
