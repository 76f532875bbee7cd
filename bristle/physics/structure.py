"""A building under ground motion and device forces: an exact linear step, split around effects.

The step is exact for ground acceleration linear in time and forces held or linear in time; the
forces of effects enter as linear in time and are iterated. One source for both paths: flat lists
inside FMUs, arrays under numba.
"""

from __future__ import annotations

from collections.abc import Collection
from math import inf
from typing import Any, NamedTuple

from . import effects as _effects  # noqa: F401  (importing it registers the effects)
from .building import Building
from .effect import effects_of
from .generate import Functions, Sets, Slots, switched
from .linear import Row, inverse, multiply, phi_functions

# The text of a structure's functions, generated from the hooks of its effects.
#
# Effects of the isolation layer act on the first level. Those of the storeys are called for each,
# with its drift and with states of its own: behind the layer's in `z`, a block for every level.

_SHARED = {"dt": "dt", "energy": "energy", "halt": "halt"}
_ISOLATION = {
    "x": "x[0]",
    "v": "x[n]",
    "stiffness": "stiffnesses[0] if isolated else 0.0",
    **_SHARED,
}
_STOREY = {
    "drift": "drift",
    "drift_rate": "drift_rate",
    "stiffness": "stiffnesses[i]",
    "storey": "storey",
    **_SHARED,
}


def _each_storey(*body: str) -> list[str]:
    """Return the loop over the storeys; `i` is the level that a storey carries."""
    return [
        "    for i in range(1 if isolated else 0, n):",
        "        drift = x[i] - (x[i - 1] if i > 0 else 0.0)",
        "        drift_rate = x[n + i] - (x[n + i - 1] if i > 0 else 0.0)",
        "        storey = float(i if isolated else i + 1)",
        *("    " + line for line in body),
    ]


def _of_storeys(slots: Slots) -> Slots:
    """Return the slots of the effects of storeys, each storey with states of its own."""
    part = slots.only(lambda effect: "spring" in effect.hooks())
    return part.at(f" + (i + 1) * {slots.z_size}")


def forces_source(slots: Slots) -> str:
    """Return `effect_forces`: what all effects but contacts exert on the levels."""
    smooth = slots.only(lambda effect: not effect.contact)
    storeys = switched(_of_storeys(slots), "spring", "pull += {call}", **_STOREY)
    lines = [
        "def effect_forces(n, isolated, stiffnesses, x, dt, energy, halt, z, p, on, forces):",
        "    for i in range(n):",
        "        forces[i] = 0.0",
        *switched(smooth, "force", "forces[0] += {call}", **_ISOLATION),
        *_each_storey(
            "    pull = 0.0",
            *storeys,
            "    forces[i] += pull",
            "    if i > 0:",
            "        forces[i - 1] -= pull",
        ),
    ]
    return "\n".join(lines)


def contact_source(slots: Slots) -> str:
    """Return `contact_force`: the force of friction and stops on the first level."""
    contact = slots.only(lambda effect: effect.contact)
    lines = [
        "def contact_force(n, isolated, stiffnesses, x, dt, energy, halt, z, p, on):",
        "    total = 0.0",
        *switched(contact, "force", "total += {call}", **_ISOLATION),
        "    return total",
    ]
    return "\n".join(lines)


def advance_source(slots: Slots) -> str:
    """Return `advance_effects`: the states after a step, at one motion of all levels."""
    base = slots.only(lambda effect: "force" in effect.hooks() or "spring" not in effect.hooks())
    storeys = _of_storeys(slots)
    lines = [
        "def advance_effects(",
        "    n, isolated, stiffnesses, x, dt, energy, halt, force, z, p, on, z_next",
        "):",
        *_advanced(base, **_ISOLATION, force="force"),
        *_each_storey("    pass", *_advanced(storeys, **_STOREY)),
        "    return",
    ]
    return "\n".join(lines)


def _advanced(slots: Slots, **q: str) -> list[str]:
    """Return the source that advances the states of effects, by Euler's rule where they flow."""
    lines = switched(slots, "rate", "{z_next}= {call}", **q)
    for effect in slots.effects:
        if "rate" in effect.hooks():
            places = slots.places(effect)
            lines.append(f"    if on[{slots.switches[effect.name]}]:")
            lines += [f"        z_next[{k}] = z[{k}] + dt * z_next[{k}]" for k in places]
    return [*lines, *switched(slots, "advance", "{z_next}= {call}", **q)]


EFFECT_STEP = 5e-4
"""Longest substep [s] of a structure with effects."""

SWEEPS = 3
"""How often the forces of effects are iterated in a substep."""

MOST_TRIALS = 40
"""How many forces of a contact are tried in a sweep; one to three are the rule."""


class StepMatrices(NamedTuple):
    """Exact step of x = [q, q'] over h: x_1 = phi x_0 + held u_0 + ramp (u_1 - u_0), u = (f, a_g).

    `phi` (2n, 2n); `held`, `ramp` (2n, n + 1): columns for a force on each level [N, positive
    against +x] and for the ground acceleration [m/s2]. All flat, row-major.
    """

    h: float
    phi: Any
    held: Any
    ramp: Any


class Matrices(NamedTuple):
    """Flat matrices of a building, as the laws use them.

    `M_inverse`, `C`, `K` (n, n), `stiffnesses` (n,), `mass` the first level's mass [kg].
    """

    n: int
    M_inverse: Any
    C: Any
    K: Any
    stiffnesses: Any
    mass: float
    isolated: bool


def matrices(building: Building) -> Matrices:
    """Return the building's matrices, flat."""
    n = building.size
    flat = [[value for row in matrix for value in row] for matrix in building[1:4]]
    return Matrices(
        n, inverse(flat[0], n), flat[1], flat[2], list(building.stiffnesses), flat[0][0],
        building.isolated,
    )  # fmt: skip


def step_matrices(m: Matrices, h: float) -> StepMatrices:
    """Return the exact step over h [s]."""
    size, forced = 4 * m.n * m.n, 2 * m.n * (m.n + 1)
    phi, held, ramp = [0.0] * size, [0.0] * forced, [0.0] * forced
    fill_step(m.n, m.M_inverse, m.C, m.K, h, phi, held, ramp, [0.0] * fill_size(m.n))
    return StepMatrices(h, phi, held, ramp)


def fill_size(n: int) -> int:
    """Return the size of work of `fill_step` for n levels."""
    return 22 * n * n + 2 * n * (n + 1)


def fill_step(
    n: int, M_inverse: Row, C: Row, K: Row, h: float, phi: Row, held: Row, ramp: Row, work: Row
) -> None:
    """Fill in the matrices of the exact step over h [s], see `StepMatrices`.

    Parameters
    ----------
    n : number of levels
    M_inverse, C, K : (n, n) flat [1/kg, N s/m, N/m]
    h : length of the step [s]
    phi, held, ramp : (2n, 2n), (2n, n + 1), (2n, n + 1) flat, filled
    work : (`fill_size(n)`,) or more, room to work
    """
    size, square, whole = 2 * n, n * n, 4 * n * n
    minus_k, minus_c = work[0:square], work[square : 2 * square]
    at = 2 * square
    a, phi_1 = work[at : at + whole], work[at + whole : at + 2 * whole]
    at += 2 * whole
    phi_2, spare = work[at : at + whole], work[at + whole : at + 3 * whole]
    at += 3 * whole
    b = work[at : at + size * (n + 1)]
    multiply(M_inverse, K, n, n, n, minus_k)
    multiply(M_inverse, C, n, n, n, minus_c)
    for i in range(whole):
        a[i] = 0.0
    for i in range(size * (n + 1)):
        b[i] = 0.0
    for i in range(n):
        a[i * size + n + i] = h
        for j in range(n):
            a[(n + i) * size + j] = -h * minus_k[i * n + j]
            a[(n + i) * size + n + j] = -h * minus_c[i * n + j]
            b[(n + i) * (n + 1) + j] = -h * M_inverse[i * n + j]
        b[(n + i) * (n + 1) + n] = -h
    phi_functions(a, size, phi, phi_1, phi_2, spare)
    multiply(phi_1, b, size, size, n + 1, held)
    multiply(phi_2, b, size, size, n + 1, ramp)


def free_step(
    n: int, phi: Row, held: Row, ramp: Row, x0: Row, a0: float, a1: float, x1: Row
) -> None:
    """Fill x1 with the state after a step under ground motion alone.

    Parameters
    ----------
    n : number of levels
    phi, held, ramp : flat matrices of the step, see `StepMatrices`
    x0, x1 : (2n,) state [m, m/s] at begin (kept) and end (filled)
    a0, a1 : ground acceleration at begin and end [m/s2], linear between
    """
    size = 2 * n
    for i in range(size):
        total = held[i * (n + 1) + n] * a0 + ramp[i * (n + 1) + n] * (a1 - a0)
        for j in range(size):
            total += phi[i * size + j] * x0[j]
        x1[i] = total


def add_force(n: int, held: Row, ramp: Row, level: int, f0: float, f1: float, x1: Row) -> None:
    """Add what a force on one level does over a step to the state at its end.

    Parameters
    ----------
    n : number of levels
    held, ramp : flat matrices of the step, see `StepMatrices`
    level : which level, 0 the first
    f0, f1 : the force at begin and end [N], linear between
    x1 : (2n,) state at the end [m, m/s], changed in place
    """
    for i in range(2 * n):
        x1[i] += held[i * (n + 1) + level] * f0 + ramp[i * (n + 1) + level] * (f1 - f0)


def accelerations(n: int, M_inverse: Row, C: Row, K: Row, x: Row, forces: Row, out: Row) -> None:
    """Fill `out` with the absolute accelerations q'' + a_g.

    Parameters
    ----------
    n : number of levels
    M_inverse, C, K : (n, n) flat [1/kg, N s/m, N/m]
    x : (2n,) state [m, m/s]
    forces : (n,) force on each level [N], positive against +x
    out : (n,) filled [m/s2]
    """
    for i in range(n):
        out[i] = 0.0
    for j in range(n):
        load = forces[j]
        for k in range(n):
            load += K[j * n + k] * x[k] + C[j * n + k] * x[n + k]
        for i in range(n):
            out[i] -= M_inverse[i * n + j] * load


def holding_force(n: int, C: Row, K: Row, mass: float, x: Row, a_g: float, others: float) -> float:
    """Return the force [N] at which the first level does not accelerate relative to the ground.

    With a full mass matrix the coupling to the other levels' accelerations is left out (a chain has
    none).

    Parameters
    ----------
    n : number of levels
    C, K : (n, n) flat [N s/m, N/m]
    mass : of the first level [kg]
    x : (2n,) state [m, m/s]
    a_g : ground acceleration [m/s2]
    others : sum of all other forces on that level [N]
    """
    total = -mass * a_g - others
    for j in range(n):
        total -= K[j] * x[j] + C[j] * x[n + j]
    return total


SETS = Sets(
    {
        "effect_forces": forces_source,
        "contact_force": contact_source,
        "advance_effects": advance_source,
    },
    *effects_of("structure"),
)
effect_forces, contact_force, advance_effects = SETS.library.made.values()


def functions_of(effects: Collection[str]) -> Functions:
    """Return functions of effects: the library's, if it has them."""
    return SETS.serving(*(e for e in effects_of("structure") if e.name in effects))


class Setup(NamedTuple):
    """A structure with effects as a step needs it: numbers that stay over a run.

    `n` levels, the first of them `isolated` or a storey; `stiffnesses` (n,) N/m of the layer and
    the storeys, from below; `phi`, `held`, `ramp` the flat matrices of a step of `h` [s] (see
    `StepMatrices`); `p`, `on` parameters and switches of the effects by slot, any of which is
    `active`.
    """

    n: int
    isolated: bool
    stiffnesses: Row
    phi: Row
    held: Row
    ramp: Row
    h: float
    p: Row
    on: Row
    active: bool


class Loads(NamedTuple):
    """What acts over a step, linear from begin to end.

    `a0`, `a1` ground acceleration [m/s2]; `f0`, `f1` (n,) force of the devices on each level [N];
    `energy` dissipated so far [J], for effects that know it.
    """

    a0: float
    a1: float
    f0: Row
    f1: Row
    energy: float


def step(setup: Setup, loads: Loads, x0: Row, z0: Row, x1: Row, z1: Row, work: Row) -> None:
    """Advance a structure over one step with its effects.

    Parameters
    ----------
    setup, loads : the structure and its effects; what acts over the step
    x0, x1 : (2n,) state [m, m/s] at begin (kept) and end (filled)
    z0, z1 : (`state_size(n)`,) states of the effects at begin (kept) and end (filled)
    work : room for `work_size(n)` floats
    """
    n, held, ramp = setup.n, setup.held, setup.ramp
    isolated, stiffnesses, p, on = setup.isolated, setup.stiffnesses, setup.p, setup.on
    h, energy = setup.h, loads.energy
    free_step(n, setup.phi, held, ramp, x0, loads.a0, loads.a1, x1)
    for i in range(n):
        if loads.f0[i] != 0.0 or loads.f1[i] != 0.0:
            add_force(n, held, ramp, i, loads.f0[i], loads.f1[i], x1)
    if not setup.active:
        return
    size = 2 * n
    g0, g1 = work[0:n], work[n : 2 * n]
    free, middle = work[size : 2 * size], work[2 * size : 3 * size]
    for i in range(size):
        free[i] = x1[i]
    # Smooth forces go linearly from begin to end; a contact's is held over the step.
    contact = 0.0
    effect_forces(n, isolated, stiffnesses, x0, h, energy, 0.0, z0, p, on, g0)
    for i in range(n):
        g1[i] = g0[i]
    for _ in range(SWEEPS):
        for i in range(size):
            x1[i] = free[i]
        for i in range(n):
            add_force(n, held, ramp, i, g0[i], g1[i], x1)
        contact = balance_contact(setup, energy, x0, z0, contact, x1, z1, middle)
        effect_forces(n, isolated, stiffnesses, x1, h, energy, contact, z1, p, on, g1)
    for i in range(size):
        middle[i] = 0.5 * (x0[i] + x1[i])
    force = 0.5 * (g0[0] + g1[0]) + contact
    advance_effects(n, isolated, stiffnesses, middle, h, energy, contact, force, z0, p, on, z1)


def balance_contact(
    setup: Setup, energy: float, x0: Row, z0: Row, guess: float, x1: Row, z1: Row, middle: Row
) -> float:
    """Add to x1 the contacts' force on the first level that goes with it; return that force [N].

    It is that of the middle of the step; where a contact closes, that of its end (the middle's
    would create energy); where one sticks, what brings the level to rest (Moreau's time stepping).
    The more force, the less motion into the contact: so the balance has one solution, found by
    regula falsi (Illinois) at any stiffness.

    Parameters
    ----------
    setup, energy, x0, z0
        As in `step`; the energy [J] is that of `Loads`.
    guess : force that is tried first [N]
    x1 : (2n,) state at the end without the contacts [m, m/s], changed in place
    z1 : (`state_size(n)`,) states of the effects at the end, filled
    middle : (2n,) room to work
    """
    n, held, ramp, h = setup.n, setup.held, setup.ramp, setup.h
    isolated, stiffnesses, p, on = setup.isolated, setup.stiffnesses, setup.p, setup.on
    closed = contact_force(n, isolated, stiffnesses, x0, h, energy, 0.0, z0, p, on) != 0.0
    part = 0.5 if closed else 1.0
    gain = held[n * (n + 1)]
    tried, low, at_low, high, at_high, last = guess, 0.0, 0.0, 0.0, 0.0, 0
    add_force(n, held, ramp, 0, tried, tried, x1)
    for _ in range(MOST_TRIALS):
        for i in range(2 * n):
            middle[i] = x0[i] + part * (x1[i] - x0[i])
        stick = tried - x1[n] / gain
        advance_effects(n, isolated, stiffnesses, middle, h, energy, stick, tried, z0, p, on, z1)
        found = contact_force(n, isolated, stiffnesses, middle, h, energy, stick, z1, p, on)
        excess = found - tried
        if abs(excess) <= 1e-10 * (1.0 + abs(found)):
            break
        new = found
        if excess > 0.0:
            at_high *= 0.5 if last > 0 else 1.0
            low, at_low, last = tried, excess, 1
        else:
            at_low *= 0.5 if last < 0 else 1.0
            high, at_high, last = tried, excess, -1
        if at_low > 0.0 and at_high < 0.0:
            new = (low * at_high - high * at_low) / (at_high - at_low)
        add_force(n, held, ramp, 0, new - tried, new - tried, x1)
        tried = new
    return tried


def resting_forces(
    n: int, isolated: bool, stiffnesses: Row, x: Row, z: Row, p: Row, on: Row, forces: Row
) -> None:
    """Fill `forces` with what the effects but contacts exert at a state.

    Parameters
    ----------
    n, isolated, stiffnesses, p, on
        As in `step`.
    x, z : (2n,) state [m, m/s] and (`state_size(n)`,) states of the effects, kept
    forces : (n,) filled [N]
    """
    effect_forces(n, isolated, stiffnesses, x, inf, 0.0, 0.0, z, p, on, forces)


def resting_contact(
    n: int, isolated: bool, stiffnesses: Row, x: Row, stick: float, z: Row, p: Row, on: Row
) -> float:
    """Return the contacts' force on the first level at a state [N].

    Parameters
    ----------
    n, isolated, stiffnesses, p, on
        As in `step`.
    x, z : (2n,) state [m, m/s] and (`state_size(n)`,) states of the effects, kept
    stick : force that would bring the level to rest [N]
    """
    return contact_force(n, isolated, stiffnesses, x, inf, 0.0, stick, z, p, on)  # type: ignore[no-any-return]


def pack(values: dict[str, float], slots: Slots) -> list[float]:
    """Return the flat parameters of all effects; missing ones take their defaults."""
    p = [0.0] * slots.p_size
    for effect in slots.effects:
        for name, parameter in effect.parameters.items():
            key = effect.name + "." + name
            p[slots.parameters[key]] = values.get(key, parameter.value)
    return p


def state_size(n: int, slots: Slots) -> int:
    """Return how many states the effects have: those of the first level, then each level's own."""
    return slots.z_size * (n + 1)


def start_states(n: int, values: dict[str, float], slots: Slots) -> list[float]:
    """Return the states of n levels at the start; `values` names start values, "EFFECT.STATE_0"."""
    return [values.get(name + "_0", 0.0) for name in slots.states] * (n + 1)


def work_size(n: int) -> int:
    """Return how many floats `step` needs as room to work."""
    return 6 * n
