"""The generalized plant: building, damper and weights, from disturbance and command to costs.

        x' = A x + B1 w + B2 u,   z = C1 x + D11 w + D12 u,   y = C2 x + D21 w + D22 u

w = [ground acceleration, noise]; z = [W_y y, W_u u]; y is the top floor's absolute acceleration
plus noise; u the damper's force [N] or the signed voltage [V]. Structure of Shirazi et al. (2012),
IEEE TCST 20(5), fig. 12; its numbers are lost.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import linalg

from ..core.arrays import Array
from ..errors import DesignError
from ..physics.building import Building, Device, Matrix
from .weights import Weights


class StateSpace(NamedTuple):
    """x' = A x + B u, y = C x + D u."""

    A: Array
    B: Array
    C: Array
    D: Array


class States(NamedTuple):
    """A change of states, x = T x_s and x_s = inverse x; T (n, k), inverse (k, n), k <= n."""

    T: Array
    inverse: Array


class Plant(NamedTuple):
    """A generalized plant; shapes A (n, n), B1 (n, 2), B2 (n, 1), C1 (2, n), C2 (1, n)."""

    A: Array
    B1: Array
    B2: Array
    C1: Array
    D11: Array
    D12: Array
    C2: Array
    D21: Array
    D22: Array

    @property
    def order(self) -> int:
        """Number of states."""
        return len(self.A)

    def transformed(self, states: States) -> Plant:
        """Return the plant in other states, or projected on some of them."""
        T, inverse = states
        return self._replace(
            A=inverse @ self.A @ T,
            B1=inverse @ self.B1,
            B2=inverse @ self.B2,
            C1=self.C1 @ T,
            C2=self.C2 @ T,
        )

    def open_loop(self) -> StateSpace:
        """Return w -> z with u = 0."""
        return StateSpace(self.A, self.B1, self.C1, self.D11)

    def closed_loop(self, K: StateSpace) -> StateSpace:
        """Return w -> z with u = K y; K has no direct path."""
        return StateSpace(
            np.block(
                [[self.A, self.B2 @ K.C], [K.B @ self.C2, K.A + K.B @ self.D22 @ K.C]],
            ),
            np.vstack([self.B1, K.B @ self.D21]),
            np.hstack([self.C1, self.D12 @ K.C]),
            self.D11,
        )


class Units(NamedTuple):
    """What command, measurement and gamma are divided by for the solver's sake: powers of ten."""

    command: float
    measurement: float
    gamma: float

    def normalised(self, plant: Plant) -> Plant:
        """Return the plant in these units."""
        root = self.gamma**0.5
        return plant._replace(
            B1=plant.B1 / root,
            B2=plant.B2 / self.command,
            C1=plant.C1 / root,
            D12=plant.D12 / (self.command * root),
            C2=plant.C2 / self.measurement,
            D21=plant.D21 / (self.measurement * root),
            D22=plant.D22 / (self.command * self.measurement),
        )


def structure(
    building: Building,
    damping: float = 0.0,
    stiffness: float = 0.0,
    device: Device | None = None,
) -> StateSpace:
    """Return the building from [force, ground acceleration] to [top acceleration, displacement].

    Parameters
    ----------
    building : Building
    damping, stiffness : float
        What the damper adds where it is [N s/m, N/m].
    device : Device, optional
        Where the damper is, if not on the first level.

    Returns
    -------
    StateSpace
        States [q, q']; inputs force [N, positive against +x] and ground acceleration [m/s2];
        outputs the top level's absolute acceleration [m/s2], the damper's displacement [m] and
        velocity [m/s].
    """
    M, C, K = (np.array(matrix) for matrix in building[1:4])
    n = building.size
    b = np.array((device or building.device("")).incidence(n))
    C += damping * np.outer(b, b)
    K += stiffness * np.outer(b, b)
    push = -b
    acceleration = np.linalg.solve(M, np.column_stack([-K, -C, push]))
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:] = acceleration[:, : 2 * n]
    B = np.zeros((2 * n, 2))
    B[n:, 0] = acceleration[:, -1]
    B[n:, 1] = -1.0
    outputs = np.zeros((3, 2 * n))
    outputs[0] = A[-1]
    outputs[1, :n] = b
    outputs[2, n:] = b
    D = np.zeros((3, 2))
    D[0, 0] = B[-1, 0]
    return StateSpace(A, B, outputs, D)


def generalized(
    building: Building,
    weights: Weights,
    gain: float = 1.0,
    damping: float = 0.0,
    stiffness: float = 0.0,
    device: Device | None = None,
) -> Plant:
    """Return the generalized plant.

    Parameters
    ----------
    building : Building
    weights : Weights
    gain : float
        Force per unit of command [N or N/V]: 1 when the command is the force itself.
    damping, stiffness : float
        What the damper adds where it is without a command [N s/m, N/m].
    device : Device, optional
        Where the damper is, if not on the first level.
    """
    s = structure(building, damping, stiffness, device)
    Ay, By, Cy, Dy = weights.acceleration.state_space()
    Au, Bu, Cu, Du = weights.command.state_space()
    n, ny, nu = len(s.A), len(Ay), len(Au)
    push, ground = gain * s.B[:, :1], s.B[:, 1:]
    y, direct = s.C[:1], gain * s.D[:1, :1]
    A = linalg.block_diag(s.A, Ay, Au)
    A[n : n + ny, :n] = By @ y
    B1 = np.zeros((n + ny + nu, 2))
    B1[:n, :1] = ground
    return Plant(
        A=A,
        B1=B1,
        B2=np.vstack([push, By @ direct, Bu]),
        C1=np.block([[Dy * y, Cy, np.zeros((1, nu))], [np.zeros((1, n + ny)), Cu]]),
        D11=np.zeros((2, 2)),
        D12=np.vstack([Dy * direct, [[Du]]]),
        C2=np.hstack([y, np.zeros((1, ny + nu))]),
        D21=np.array([[0.0, weights.noise]]),
        D22=direct,
    )


def family(
    building: Building, weights: Weights, gains: Array, dampings: Array, stiffness: float = 0.0,
    device: Device | None = None,
) -> list[Plant]:  # fmt: skip
    """Return the generalized plants of several gains and dampings; see `generalized`.

    Gains and dampings enter affinely: three plants make them all.

    Parameters
    ----------
    building : Building
    weights : Weights
    gains : (k,) array
        Force per unit of command [N or N/V].
    dampings : (k,) array
        What the damper adds where it is without a command [N s/m].
    stiffness : float
        The same [N/m], one for all plants.
    device : Device, optional
        Where the damper is, if not on the first level.
    """
    origin = generalized(building, weights, 0.0, 0.0, stiffness, device)
    by_gain = generalized(building, weights, 1.0, 0.0, stiffness, device)
    by_damping = generalized(building, weights, 0.0, 1.0, stiffness, device)
    return [
        Plant(
            *(
                zero + gain * (one - zero) + damping * (other - zero)
                for zero, one, other in zip(origin, by_gain, by_damping, strict=True)
            )
        )
        for gain, damping in zip(gains.tolist(), dampings.tolist(), strict=True)
    ]


def check_building(building: Building, device: Device | None = None) -> None:
    """Refuse a building whose modes a damper cannot damp, on the first level or as a `device`.

    Raises
    ------
    DesignError
        Naming the mode that is undamped, unstable or out of the damper's reach.
    """
    s = structure(building, device=device)
    values, left = linalg.eig(s.A, left=True, right=False)
    reach = np.abs(left.conj().T @ s.B[:, 0]) / (
        np.linalg.norm(left, axis=0) * np.linalg.norm(s.B[:, 0])
    )
    where = f"at {device.name}" if device and device.name else "on the first level"
    for value, share in sorted(zip(values, reach, strict=True), key=lambda pair: abs(pair[0])):
        mode = f"building {building.name!r}: the mode of {abs(value) / (2 * np.pi):.4g} Hz"
        if value.real > -1e-9 * abs(value):
            raise DesignError(
                f"{mode} is not damped (real part {value.real:.3g} 1/s): a design "
                "needs every mode stable without control; give the building damping."
            )
        if share < 1e-9:
            raise DesignError(f"{mode} is not controllable: the damper {where} does not move it.")


NOTHING = 1e-13
"""Square of a Hankel singular value, as a share of the largest, that is rounding."""


def balancing(plant: Plant, order: int | None = None) -> States:
    """Return the states that balance the plant from all inputs to all outputs, strongest first.

    Gramians W_c = L L^T, L^T W_o L = U S U^T, T = L U S^(-1/4) (Moore 1981, IEEE TAC 26(1)). The
    LMIs are solved in these states: unscaled, a solver calls a value optimal that is 4 % too large.

    Parameters
    ----------
    plant : Plant
    order : int, optional
        How many states to keep; else all.

    Raises
    ------
    DesignError
        If a state is neither reached nor seen, so that no balancing exists.
    """
    B = np.hstack([plant.B1, plant.B2])
    C = np.vstack([plant.C1, plant.C2])
    controllable = linalg.solve_continuous_lyapunov(plant.A, -B @ B.T)
    observable = linalg.solve_continuous_lyapunov(plant.A.T, -C.T @ C)
    try:
        L = linalg.cholesky(0.5 * (controllable + controllable.T), lower=True)
        squares, U = linalg.eigh(0.5 * L.T @ (observable + observable.T) @ L)
        if squares[0] <= NOTHING * squares[-1]:
            raise linalg.LinAlgError
    except linalg.LinAlgError:
        raise DesignError(
            "the plant cannot be balanced: one of its states is not reached by any input or not "
            "seen in any output. A weight's poles and zeros must not cancel."
        ) from None
    T = (L @ U * squares**-0.25)[:, ::-1]
    return States(T[:, :order], np.linalg.inv(T)[:order])


# What dampers that are not commanded add to the linear plant.


class Share(NamedTuple):
    """What a passive device adds to the linear plant: damping [N s/m] and stiffness [N/m]."""

    damping: float = 0.0
    stiffness: float = 0.0


def with_share(building: Building, device: Device, share: Share) -> Building:
    """Return a building with a device's linear share: C + c b b^T, K + k b b^T."""
    b = device.incidence(building.size)

    def added(matrix: Matrix, factor: float) -> Matrix:
        return tuple(
            tuple(value + factor * b[i] * b[j] for j, value in enumerate(row))
            for i, row in enumerate(matrix)
        )

    return building._replace(
        C=added(building.C, share.damping), K=added(building.K, share.stiffness)
    )
