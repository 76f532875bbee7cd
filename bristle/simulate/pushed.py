"""What each damper of a coupled system pushes: a device of a structure, whose motion it feels.

`pushed_by` finds it out from names; `couple` and what it calls are flat functions on records, as
those of `layout`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from ..physics.building import Building
from ..physics.device import GROUND, Device
from ..physics.linear import Row

Port = tuple[str, str]

MOVES = 1e-9
"""Share of the largest eigenvalue below which forces move nothing: they act against each other."""

MOST_ROTATIONS = 50
"""Rounds of rotations after which the search for eigenvalues ends; some ten are enough."""


class Pushed(NamedTuple):
    """What a damper feels and pushes: the device, and the number of its structure.

    `holding` is the slot of the force that would hold it.
    """

    structure: int
    device: Device
    holding: int


def pushed_by(
    damper: str,
    buildings: Mapping[str, Building],
    source_of: Mapping[Port, Port],
    slots: Mapping[Port, int],
) -> Pushed | None:
    """Return what a damper both feels and pushes; None where it is not one and the same.

    Parameters
    ----------
    damper : name of the component
    buildings : those of the structures by the component's name, in their order
    source_of : each connected input to its output
    slots : where the signals are
    """
    name, felt = source_of.get((damper, "velocity"), ("", ""))
    if name not in buildings:
        return None
    building = buildings[name]
    moves = {f"{level}_velocity": (GROUND, i) for i, level in enumerate(building.levels())}
    moves |= {device.ports.velocity: device.levels for device in building.devices}
    first = building.device("")
    forces = dict.fromkeys((building.ports(first).force, "extra_force"), first)
    forces |= {device.ports.force: device for device in building.devices}
    for port, device in forces.items():
        pushes = source_of.get((name, port)) == (damper, "force")
        if pushes and device.levels == moves.get(felt):
            holding = building.ports(device).holding_force
            return Pushed(list(buildings).index(name), device, slots[name, holding])
    return None


def room(dampers: int) -> int:
    """Return how many floats `couple` needs as room to work, with so many dampers."""
    return dampers * dampers + 2 * dampers


def couple(dampers: Any, structures: Any, h: float, work: Row) -> None:
    """Fill in what dampers that stick hold of the structures that they push.

    Parameters
    ----------
    dampers, structures : arrays of records, laid out
    h : substep [s]
    work : (`room(m)`,) for m dampers, room to work
    """
    for i in range(len(dampers)):
        d = dampers[i]
        if d["on_structure"] >= 0:
            there = structures[d["on_structure"]]
            lower, upper = d["lower"], d["upper"]
            gain = velocity_per_force(there, lower, upper, lower, upper)
            d["sharing"] = sharing(dampers, structures, d["on_structure"], work)
            d["moving_mass"] = -h / (gain * d["sharing"])


def velocity_per_force(b: Any, lower: int, upper: int, below: int, above: int) -> float:
    """Return the velocity of a device's ends per force of another over a substep [m/(N.s)].

    Parameters
    ----------
    b : record of the structure
    lower, upper : levels that the device that moves connects
    below, above : levels that the one that pushes connects, or the same
    """
    n = b["n"]
    total = 0.0
    for i, along in ((lower, -1.0), (upper, 1.0)):
        for j, pushes in ((below, -1.0), (above, 1.0)):
            if i != GROUND and j != GROUND:
                total += along * pushes * b["held"][(n + i) * (n + 1) + j]
    return total


def sharing(dampers: Any, structures: Any, where: int, work: Row) -> float:
    """Return by how much dampers that stick together must each hold less than it would alone.

    What one holds moves the others' ends. All correct their forces at once, which is Richardson's
    iteration: it settles soonest at half the sum of its least and largest eigenvalue (Saad 2003,
    Iterative Methods for Sparse Linear Systems, example 4.1). At one place that is their number.

    Parameters
    ----------
    dampers, structures : as in `couple`
    where : number of the structure that they push
    work : as in `couple`
    """
    m = 0
    places = work[0 : len(dampers)]
    apart = False
    for i in range(len(dampers)):
        if dampers[i]["on_structure"] == where and dampers[i]["signed"]:
            places[m] = i
            first = dampers[int(places[0])]
            d = dampers[i]
            apart = apart or first["lower"] != d["lower"] or first["upper"] != d["upper"]
            m += 1
    if not apart:
        return max(1.0, float(m))
    b = structures[where]
    begin = 2 * len(dampers)
    values, matrix = work[len(dampers) : len(dampers) + m], work[begin : begin + m * m]
    for i in range(m):
        felt = dampers[int(places[i])]
        for j in range(m):
            pushed = dampers[int(places[j])]
            matrix[i * m + j] = -velocity_per_force(
                b, felt["lower"], felt["upper"], pushed["lower"], pushed["upper"]
            )
    for i in range(m):
        values[i] = matrix[i * m + i] ** 0.5
    for i in range(m):
        for j in range(m):
            matrix[i * m + j] /= values[i] * values[j]
    symmetric_eigenvalues(m, matrix, values)
    most: float = values[0]
    for i in range(m):
        most = max(most, values[i])
    least = most
    for i in range(m):
        if values[i] > MOVES * most:
            least = min(least, values[i])
    return max(1.0, 0.5 * (least + most))


def symmetric_eigenvalues(n: int, a: Row, values: Row) -> None:
    """Fill in the eigenvalues of a symmetric matrix, in no order.

    Jacobi's rotations, in rounds over all entries beside the diagonal (Golub and Van Loan 2013,
    Matrix Computations, section 8.5).

    Parameters
    ----------
    n : size
    a : (n, n) flat, destroyed
    values : (n,) filled
    """
    for _ in range(MOST_ROTATIONS):
        beside, whole = 0.0, 0.0
        for i in range(n):
            for j in range(n):
                whole += a[i * n + j] ** 2
                if i != j:
                    beside += a[i * n + j] ** 2
        if beside <= 1e-32 * whole:
            break
        for p in range(n - 1):
            for q in range(p + 1, n):
                rotate(n, a, p, q)
    for i in range(n):
        values[i] = a[i * n + i]


def rotate(n: int, a: Row, p: int, q: int) -> None:
    """Turn a symmetric matrix in place so that an entry becomes 0.

    Parameters
    ----------
    n : size
    a : (n, n) flat, changed in place
    p, q : row and column of the entry, p < q
    """
    if a[p * n + q] == 0.0:
        return
    theta = (a[q * n + q] - a[p * n + p]) / (2.0 * a[p * n + q])
    t = 1.0 / (abs(theta) + (theta * theta + 1.0) ** 0.5)
    if theta < 0.0:
        t = -t
    c = 1.0 / (t * t + 1.0) ** 0.5
    s = t * c
    for k in range(n):
        left, right = a[k * n + p], a[k * n + q]
        a[k * n + p], a[k * n + q] = c * left - s * right, s * left + c * right
    for k in range(n):
        left, right = a[p * n + k], a[q * n + k]
        a[p * n + k], a[q * n + k] = c * left - s * right, s * left + c * right
