"""Power that the coupling creates or loses: a cheap measure of its error, from the rows of a run.

Where one component gives a force and gets a velocity back, power goes through the pair of
connections. Both sides take it over a step with values that differ: the one that gets the force
holds it while it moves on, the one that gets the velocity holds that while its force changes. The
energy between the two books is made by the coupling alone.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ..component import SAMPLED
from ..fmu.description import Variable
from ..units import alike, parse
from .operations import Node, Port
from .results import Array, Table
from .schedule import held_inputs


class Bond(NamedTuple):
    """A force output with the input that takes it, and the velocity that comes back."""

    force: Port
    force_input: Port
    velocity: Port
    velocity_input: Port


def power_bonds(nodes: Sequence[Node], algorithm: str) -> list[Bond]:
    """Return the pairs of components that exchange one force for one velocity.

    None with "midpoint-iterated": there both sides hold means of the first pass, which no row
    keeps.
    """
    if algorithm == "midpoint-iterated":
        return []
    forces, velocities = list(_wires(nodes, "N")), list(_wires(nodes, "m/s"))
    found = []
    for source, target in forces:
        same = [f for f, t in forces if f[0] == source[0] and t[0] == target[0]]
        back = [(v, t) for v, t in velocities if v[0] == target[0] and t[0] == source[0]]
        if len(same) == len(back) == 1 and source[0] != target[0]:
            found.append(Bond(source, target, *back[0]))
    return found


def bond_names(nodes: Sequence[Node], algorithm: str) -> list[str]:
    """Return the power bonds as results name them: by the output of their force."""
    return [_column(nodes, bond.force) for bond in power_bonds(nodes, algorithm)]


def _wires(nodes: Sequence[Node], unit: str) -> Iterator[tuple[Port, Port]]:
    """Yield both ends of the connections of a unit, but for what is sampled or transformed."""
    for c, node in enumerate(nodes):
        for name, source in node.sources.items():
            variable = node.inputs[name]
            plain = variable.over_step != SAMPLED and name not in node.transformed
            if plain and _is_unit(variable, unit):
                yield source, (c, name)


def _is_unit(variable: Variable, unit: str) -> bool:
    found = variable.measure.unit if variable.measure else None
    return found is not None and alike(found, parse(unit))


def energy_residuals(
    nodes: Sequence[Node], algorithm: str, step: float, table: Table
) -> dict[str, float]:
    """Return how much energy the coupling makes or loses in each power bond.

    Parameters
    ----------
    nodes : sequence of Node
    algorithm : one of `scenario.parts.ALGORITHMS`
    step : length of a macro step [s]
    table : rows of the run

    Returns
    -------
    dict
        Output of the force to the largest energy [1] that the coupling has added or taken until any
        time, as a share of the largest that went through the bond; 0 where none did.
    """
    held = held_inputs(nodes) if algorithm == "midpoint" else set()
    residuals = {}
    for bond in power_bonds(nodes, algorithm):
        f, v = (_values(nodes, port, table) for port in (bond.force, bond.velocity))
        f_mean, v_mean = 0.5 * (f[1:] + f[:-1]), 0.5 * (v[1:] + v[:-1])
        f_taken = _taken(bond.force, bond.force_input, f, algorithm, held)
        v_taken = _taken(bond.velocity, bond.velocity_input, v, algorithm, held)
        made = step * np.cumsum(f_mean * v_taken - f_taken * v_mean)
        through = step * np.cumsum(f_mean * v_mean)
        most = float(np.abs(through).max(initial=0.0))
        residuals[_column(nodes, bond.force)] = (
            float(np.abs(made).max(initial=0.0)) / most if most > 0.0 else 0.0
        )
    return residuals


def _values(nodes: Sequence[Node], port: Port, table: Table) -> Array:
    values: Array = table.values[_column(nodes, port)]
    return values


def _column(nodes: Sequence[Node], port: Port) -> str:
    return f"{nodes[port[0]].name}.{port[1]}"


def _taken(source: Port, target: Port, u: Array, algorithm: str, held: Collection[Port]) -> Array:
    """Return what an input was over each step, given its source's values (rows,)."""
    stepped = source[0] < target[0] and algorithm != "jacobi"
    if target not in held:
        return u[1:] if stepped else u[:-1]
    if stepped:
        return 0.5 * (u[1:] + u[:-1])
    before = np.concatenate([u[:1], u[:-2]])  # of the first step nothing is known before
    return 1.5 * u[:-1] - 0.5 * before
