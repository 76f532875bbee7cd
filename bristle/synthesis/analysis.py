"""Norms, margins, poles and responses of a closed loop, and the least that can be reached."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ..component.controller_file import Controller, building_digest
from ..core.arrays import Array
from ..core.progress import counted
from ..errors import DesignError
from ..physics.building import Building, frequencies
from ..view import Viewable
from .damper import Bank, coefficients
from .lmi import Solution
from .plant import Plant, StateSpace, structure
from .task import FASTEST_TIMES_PERIOD, MOST_SAMPLES, SPEEDS, Task

_DIGITS = 12


@dataclass(frozen=True, repr=False)
class DesignResult(Viewable):
    """A verified controller.

    Attributes
    ----------
    task : Task
    controller : Controller
        For the run, discrete; `controller.save(path)` writes the controller file.
    speeds : (k,) array
        Speeds of the table's rows [m/s]; one zero without a table.
    plants : list of Plant
        The generalized plants at these speeds; empty for LQG.
    bank : Bank
        The controllers at these speeds, continuous.
    solution : Solution or None
        The matrices that prove gamma, in normalised, balanced states.

    Examples
    --------
    >>> import bristle
    >>> result = bristle.design({"kind": "lqg", "sample_period": 0.001})
    >>> result.controller.sample_period, result.task.kind
    (0.001, 'lqg')
    """

    task: Task
    controller: Controller
    speeds: Array
    plants: list[Plant]
    bank: Bank
    solution: Solution | None

    @property
    def facts(self) -> dict[str, Any]:
        """The design's numbers: gamma, norms, poles ..."""
        return self.controller.facts


def packed(task: Task, discrete: Bank, facts: dict[str, Any]) -> Controller:
    """Return the controller of a discrete bank, its numbers rounded to 12 digits."""
    rows, n, _ = discrete.A.shape
    return Controller(
        kind=task.kind,
        title=task.title,
        n=n,
        rows=rows,
        v_top=task.scheduling.grid[-1] if rows > 1 else 0.0,
        sample_period=float(task.sample_period),
        A=flat(discrete.A),
        B=flat(discrete.B),
        W=flat(discrete.W),
        C=flat(discrete.C),
        facts={"building": task.building.name, "task": task.digest(), **facts},
        design=task.data(),
        building=building_digest(task.building),
    )


def flat(values: Array) -> list[float]:
    """Return a matrix row by row, its numbers rounded to 12 digits."""
    return [float(f"{value:.{_DIGITS}g}") for value in values.ravel().tolist()]


def pole_list(poles: NDArray[np.complex128]) -> list[list[float]]:
    """Return poles as [real part, imaginary part], slowest first."""
    return [[float(p.real), float(p.imag)] for p in sorted(poles, key=lambda p: (abs(p), p.imag))]


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
        response = _response(system, omega)
    largest: Array = np.linalg.norm(response, 2, axis=(1, 2))
    return largest


def _response(system: StateSpace, omega: Array) -> NDArray[np.complex128]:
    """Return the frequency response (k, outputs, inputs) at `omega` (k,) rad/s."""
    A, B, C, D = system
    s = 1j * omega[:, None, None] * np.eye(len(A))
    found = C @ np.linalg.solve(s - A, np.broadcast_to(B, (len(omega), *B.shape))) + D
    return np.asarray(found, dtype=np.complex128)


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


# Stability margins of a designed loop, cut at the measured acceleration.
#
# python-control's `stability_margins` finds crossings as roots of polynomials, which overflow for
# the plants of an LPV design; here they are read from a dense frequency response, and the modulus
# margin from a norm.

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
    L = -_response(G, omega)[:, 0, 0] * _response(K, omega)[:, 0, 0]
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


# Frequency responses for a report: loops, weights and controller; a task's before its design.


def responses(result: DesignResult, omega: Array, row: int = 0) -> dict[str, Array]:
    """Return gains at `omega` (k,) [rad/s] with the speed held at one row of the table.

    Parameters
    ----------
    result : DesignResult
        Of kind "hinf" or "lpv".
    omega : (k,) array
        Frequencies [rad/s].
    row : int
        Row of the table; 0 without one.

    Returns
    -------
    dict of (k,) arrays
        `open_loop`, `closed_loop`: largest singular value from disturbance to weighted outputs [1],
        which gamma bounds. `acceleration_open`, `acceleration_closed`: floor acceleration per
        ground acceleration [1]; `command`: command per ground acceleration; `controller`: command
        per measured acceleration. `acceleration_bound`, `command_bound`: gamma over the weights,
        what the two closed loops stay below.

    Raises
    ------
    DesignError
        For an LQG design, which has no weights of this kind.
    """
    if not result.plants:
        raise DesignError("an LQG design has no weighted loop to show.")
    plant, K = result.plants[row], result.bank.at(row)
    gamma, weights = result.facts["gamma"], result.task.weights
    closed = plant.closed_loop(K)
    n = plant.order
    ground = closed.B[:, :1]
    command = np.hstack([np.zeros((1, n)), K.C])
    acceleration = np.hstack([plant.C2, plant.D22 @ K.C])
    nothing = np.zeros((1, 1))
    return {
        "open_loop": gains(plant.open_loop(), omega),
        "closed_loop": gains(closed, omega),
        "acceleration_open": gains(StateSpace(plant.A, plant.B1[:, :1], plant.C2, nothing), omega),
        "acceleration_closed": gains(StateSpace(closed.A, ground, acceleration, nothing), omega),
        "command": gains(StateSpace(closed.A, ground, command, nothing), omega),
        "controller": gains(K, omega),
        "acceleration_bound": gamma / np.abs(weights.acceleration.response(omega)),
        "command_bound": gamma / np.abs(weights.command.response(omega)),
    }


def omega_of(building: Building) -> Array:
    """Return frequencies (k,) [rad/s] a decade beyond the building's, dense around each of them."""
    modes = 2.0 * np.pi * np.array(frequencies(building))
    around = (modes[:, None] * (1.0 + np.linspace(-0.1, 0.1, 81))[None]).ravel()
    return np.sort(np.concatenate([np.geomspace(modes[0] / 20, modes[-1] * 10, 600), around]))


def curves(result: DesignResult) -> dict[str, Any]:
    """Return what the figure of a design shows, as plain lists; empty for LQG.

    Returns
    -------
    dict
        `frequency` (k,) [Hz], and `speeds`: for each speed of the grid [m/s] the gains (k,) of
        `responses`.
    """
    if not result.plants:
        return {}
    omega = omega_of(result.task.building)
    return {
        "frequency": (omega / (2.0 * np.pi)).tolist(),
        "speeds": [
            {
                "speed": float(result.speeds[row]),
                **{name: one.tolist() for name, one in responses(result, omega, row).items()},
            }
            for row in grid_rows(result)
        ],
    }  # fmt: skip


def task_curves(task: Task) -> dict[str, Array]:
    """Return what a task weighs, before it is solved, at the frequencies of `omega_of`.

    Returns
    -------
    dict of (k,) arrays
        `frequency` [Hz]; `acceleration_open`: top floor per ground acceleration [1] without the
        damper that is commanded, as of a design "hinf"; `acceleration_weight` [s2/m],
        `command_weight` [1/N, 1/V]: sizes of the weights.
    """
    omega = omega_of(task.building)
    s = structure(task.plant_building, stiffness=task.stiffness, device=task.place)
    ground = StateSpace(s.A, s.B[:, 1:2], s.C[:1], s.D[:1, 1:2])
    return {
        "frequency": omega / (2.0 * np.pi),
        "acceleration_open": gains(ground, omega),
        "acceleration_weight": np.abs(task.weights.acceleration.response(omega)),
        "command_weight": np.abs(task.weights.command.response(omega)),
    }


# Checks a designed controller without the solver: poles, sampling, closed-loop norms.

BEYOND = 1e-3
"""Relative excess of a closed-loop norm over gamma that counts as rounding."""


def check_poles(bank: Bank, r: Array, h: float) -> dict[str, float]:
    """Refuse controllers that are unstable, or too fast for the sample period h [s].

    An unstable controller behind a saturated actuator drifts into saturation and stays there.

    Returns
    -------
    dict
        `largest_real_part` [1/s] and `fastest_pole` [rad/s] over all speeds r (k,) [m/s].

    Raises
    ------
    DesignError
        With the pole and the speed.
    """
    poles = bank.poles
    worst = np.unravel_index(np.argmax(poles.real), poles.shape)
    fastest = np.unravel_index(np.argmax(np.abs(poles)), poles.shape)
    if poles[worst].real >= 0.0:
        raise DesignError(
            f"the controller is unstable{_at(r, int(worst[0]))}: pole {_number(poles[worst])} "
            "rad/s. A larger tau or less demanding weights would help."
        )
    if abs(poles[fastest]) * h > FASTEST_TIMES_PERIOD:
        raise DesignError(
            f"the controller is too fast for its sample period of {h:g} s"
            f"{_at(r, int(fastest[0]))}: pole {_number(poles[fastest])} rad/s, at most "
            f"{FASTEST_TIMES_PERIOD / h:.4g} rad/s can be sampled. A larger tau, less demanding "
            "weights or a shorter sample period would help."
        )
    return {
        "largest_real_part": float(poles[worst].real),
        "fastest_pole": float(abs(poles[fastest])),
    }


def check_sampled_loop(plants: list[Plant], discrete: Bank, r: Array, h: float) -> float:
    """Refuse a controller whose sampled loop, with the plant held at each speed, is unstable.

    Parameters
    ----------
    plants : k plants in SI, one per speed
    discrete : the k controllers in discrete time
    r : (k,) m/s, for the message
    h : sample period [s]

    Returns
    -------
    float
        The largest modulus of a closed-loop pole in discrete time, below 1.

    Raises
    ------
    DesignError
        With the modulus and the speed.
    """
    n, m = plants[0].order, discrete.A.shape[1]
    k = len(plants)
    together = np.zeros((k, n + 1, n + 1))
    together[:, :n, :n] = [plant.A for plant in plants]
    together[:, :n, n:] = [plant.B2 for plant in plants]
    stepped = linalg.expm(together * h)
    loop = np.zeros((k, n + m, n + m))
    loop[:, :n, :n] = stepped[:, :n, :n]
    loop[:, :n, n:] = stepped[:, :n, n:] @ discrete.C
    loop[:, n:, :n] = discrete.B @ np.array([plant.C2 for plant in plants])
    direct = np.array([plant.D22 for plant in plants])
    loop[:, n:, n:] = discrete.A + discrete.B @ direct @ discrete.C
    moduli = np.abs(np.linalg.eigvals(loop)).max(axis=1)
    worst = int(np.argmax(moduli))
    if moduli[worst] >= 1.0:
        raise DesignError(
            f"sampled at {h:g} s the closed loop is unstable{_at(r, worst)}: a pole of modulus "
            f"{moduli[worst]:.6g}. A shorter sample period or less demanding weights would help."
        )
    return float(moduli[worst])


def closed_loop_norms(plants: list[Plant], bank: Bank, r: Array) -> Array:
    """Return the closed-loop H-infinity norms with plant and controller held at each speed r (k,).

    Raises
    ------
    DesignError
        If a closed loop is unstable.
    """
    pairs = counted(list(enumerate(plants)), "verifying the closed loop: norm")
    norms = np.array([hinf_norm(plant.closed_loop(bank.at(k))) for k, plant in pairs])
    if not np.all(np.isfinite(norms)):
        k = int(np.argmax(~np.isfinite(norms)))
        raise DesignError(f"the closed loop is unstable{_at(r, k)}, whatever the solver said.")
    return norms


def check_bound(norms: Array, bound: float, r: Array) -> None:
    """Refuse norms (k,) above the bound that the solver promised.

    Raises
    ------
    DesignError
        With both.
    """
    k = int(np.argmax(norms))
    if norms[k] > bound * (1.0 + BEYOND):
        raise DesignError(
            f"the closed-loop norm{_at(r, k)} is {norms[k]:.6g}, above the bound {bound:.6g}: "
            "the solution cannot be trusted. A larger tau or a higher order would help."
        )


def _at(r: Array, k: int) -> str:
    return f" at {r[k]:.4g} m/s" if len(r) > 1 else ""


def _number(value: complex) -> str:
    sign = "+" if value.imag >= 0.0 else "-"
    return f"{value.real:.4g}{sign}{abs(value.imag):.4g}j" if value.imag else f"{value.real:.4g}"


# Whether a design task asks for what its plant can use: warnings, each with the plausible range.

EFFORT = (1e-4, 10.0)
"""Cost of a command over the acceleration that it can make, both weighted, at the first mode; the
reference designs have 0.02 to 0.05. Below, any command is free; above, none is worth its cost."""
NOISE = (1e-6, 1.0)
"""Noise over the acceleration that a unit of ground acceleration makes at resonance."""
OPEN_LOOP = (1e-3, 1e4)
"""Weighted response to the ground without control: gamma is of this size at most."""


class Reach(NamedTuple):
    """Peak gains of the plant: of the ground on the top level, of a command on top and drift."""

    ground: float
    command: float
    drift: float


def implausible(task: Task) -> list[str]:
    """Return what looks unmeant in a task, a sentence each, with the plausible range.

    Parameters
    ----------
    task : Task

    Returns
    -------
    list of str
        Empty where nothing looks unmeant.
    """
    reach = reach_of(task)
    found = _sampling(task)
    found += _lqg(task, reach) if task.kind == "lqg" else _weights(task, reach)
    return [*found, *(_scheduling(task) if task.kind == "lpv" else [])]


def reach_of(task: Task) -> Reach:
    """Return peak gains over frequency, per unit of command: N, or V for "lpv"."""
    s = structure(task.plant_building, stiffness=task.stiffness, device=task.place)
    gain = 1.0
    if task.kind == "lpv":
        speeds = np.array(task.scheduling.grid)
        gain = float(coefficients(task.damper, speeds, task.scheduling.eps)[1].max())

    def peak(column: int, row: int) -> float:
        part = StateSpace(
            s.A, s.B[:, [column]], s.C[[row]], s.D[np.ix_([row], [column])]
        )  # fmt: skip
        return float(hinf_norm(part))

    return Reach(peak(1, 0), gain * peak(0, 0), gain * peak(0, 1))


def _sampling(task: Task) -> list[str]:
    fastest = frequencies(task.building)[-1]
    shortest = 1.0 / (MOST_SAMPLES * fastest)
    if task.sample_period >= shortest:
        return []
    return [
        f"sample_period = {task.sample_period:g} s takes more than {MOST_SAMPLES} samples in a "
        f"period of the fastest mode, {fastest:.4g} Hz; {shortest:.2g} s or more is plausible."
    ]


def _scheduling(task: Task) -> list[str]:
    s, typical = task.scheduling, task.damper.speed
    low, high = (factor * typical for factor in SPEEDS)
    found = []
    if not low <= s.grid[-1] <= high:
        found.append(
            f"scheduling: the grid ends at {s.grid[-1]:g} m/s; the damper's typical speed is "
            f"{typical:g} m/s, so that {low:.3g} to {high:.3g} m/s is plausible. Faster motion is "
            "taken as the last speed."
        )
    if s.eps > s.grid[-1]:
        found.append(
            f"scheduling: eps = {s.eps:g} m/s smooths the sign function beyond the whole grid; "
            f"less than {s.grid[1]:g} m/s, the first speed of the grid, is plausible."
        )
    return found


def _weights(task: Task, reach: Reach) -> list[str]:
    first = np.array([2.0 * pi * frequencies(task.building)[0]])
    unit = "1/V" if task.kind == "lpv" else "1/N"
    acceleration = float(np.abs(task.weights.acceleration.response(first))[0])
    command = float(np.abs(task.weights.command.response(first))[0])
    found = []
    open_loop = acceleration * reach.ground
    if not OPEN_LOOP[0] <= open_loop <= OPEN_LOOP[1]:
        low, high = (limit / reach.ground for limit in OPEN_LOOP)
        found.append(
            f"weights: the weight on the acceleration is {acceleration:.3g} s2/m at the first "
            f"mode; the ground moves the top level up to {reach.ground:.3g} times its own "
            f"acceleration, so that {low:.1g} to {high:.1g} s2/m is plausible."
        )
    worth = acceleration * reach.command
    if not EFFORT[0] <= command / worth <= EFFORT[1]:
        low, high = (limit * worth for limit in EFFORT)
        why = "no command is worth its cost" if command > worth else "any command is nearly free"
        found.append(
            f"weights: the weight on the command is {command:.3g} {unit} at the first mode: {why}. "
            f"With this acceleration weight and plant {low:.1g} to {high:.1g} {unit} is plausible."
        )
    return [*found, *_noise("weights", task.weights.noise, reach)]


def _lqg(task: Task, reach: Reach) -> list[str]:
    w = task.lqg
    worth = w.acceleration * reach.command**2 + w.drift * reach.drift**2
    found = []
    if not EFFORT[0] ** 2 <= w.force / worth <= EFFORT[1] ** 2:
        low, high = (limit**2 * worth for limit in EFFORT)
        why = "no force is worth its cost" if w.force > worth else "any force is nearly free"
        found.append(
            f"lqg: force = {w.force:g}: {why}. With these weights on acceleration and drift, and "
            f"this plant, {low:.1g} to {high:.1g} is plausible."
        )
    return [*found, *_noise("lqg", w.noise / w.ground, reach)]


def _noise(where: str, noise: float, reach: Reach) -> list[str]:
    low, high = (limit * reach.ground for limit in NOISE)
    if low <= noise <= high:
        return []
    what = "noise" if where == "weights" else "noise over ground"
    return [
        f"{where}: {what} = {noise:g} m/s2; a ground acceleration of 1 m/s2 makes up to "
        f"{reach.ground:.3g} m/s2, so that {low:.1g} to {high:.1g} is plausible."
    ]
