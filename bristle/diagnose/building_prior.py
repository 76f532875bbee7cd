"""How well a building is known, where its numbers make the damper's force.

Without a load cell the force is what equilibrium leaves: inertia, less the springs. A stiffness
that is 2 % off in the building's file then acts like a linear spring beside the damper, a mass like
a fluid's. So the file's numbers are taken as a laboratory knows them, and move within that together
with the law; what they cannot absorb is left for the effects.

The first level's mass stays: the scale of all forces is not told by motion, and a residual shrinks
with it. By how much all that stands on it is heavier and stiffer alike is therefore a number of its
own; the storeys' stiffnesses beside that are told by their lines.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..identify.fit import Model
from ..identify.response import Response
from ..identify.search import HUBER
from ..identify.search_context import Search
from ..identify.structure import StructureProblem, damper_run
from ..physics.building import Building
from .masses import DEVIATIONS, with_masses
from .rule import BENCH, DecisionRule

Array = NDArray[np.float64]

TURNS, SETTLED = 3, 0.1
"""How often law and building are fitted in turn at most, and the step that ends it, in standard
deviations: they depend on each other but weakly."""

LEAST_CHANGE = 0.005
"""Change of a number, as a share, from which it is reported."""


def within_prior(
    model: Model,
    responses: Sequence[Response],
    building: Building,
    law: str,
    straight: bool = True,
    rule: DecisionRule = BENCH,
) -> Building:
    """Return the building whose numbers, within what is known of them, suit the runs best.

    Parameters
    ----------
    model : the damper's law, fitted to the force that the building as it is makes
    responses : the training runs
    building : the building as its file has it
    law, straight : see `identify.structure.damper_run`
    rule : how well a building's numbers are known, and how far they may move
    """
    slopes = _slopes(responses, building, law, straight, rule)
    shift = np.zeros(2 * building.size)
    for _ in range(TURNS):
        now = moved(building, shift, rule)
        problem = StructureProblem(
            [damper_run(one, now, law, straight) for one in responses], 0, reconstructed=True
        )
        step, model = _step(problem, model, slopes, shift)
        shift = np.clip(shift + step, -rule.farthest, rule.farthest)
        if float(np.max(np.abs(step))) < SETTLED:
            break
    return moved(building, shift, rule)


def moved(building: Building, shift: Array, rule: DecisionRule = BENCH) -> Building:
    """Return a building with its numbers (2 n,) moved, in standard deviations.

    Stiffnesses (n,), masses above the first level (n - 1,), and by how much all masses and
    stiffnesses above it are larger alike.
    """
    n, first = building.size, building.stiffnesses[0]
    alike = 1.0 + rule.mass_doubt / DEVIATIONS * float(shift[-1])
    upper = np.append(0.0, np.full(n - 1, alike - 1.0))
    M = np.array(with_masses(building, upper).M)
    K, stiffnesses = alike * np.array(building.K), np.array(building.stiffnesses) * (1.0 + upper)
    K[0, 0] -= (alike - 1.0) * first
    for i in range(n):
        more = rule.stiffness_known * shift[i] * stiffnesses[i]
        across = np.eye(n)[i] - (np.eye(n)[i - 1] if i else 0.0)
        K += more * np.outer(across, across)
        stiffnesses[i] += more
        if i:
            M[i, i] *= 1.0 + rule.mass_known * shift[n + i - 1]
    return building._replace(
        M=tuple(map(tuple, M.tolist())), K=tuple(map(tuple, K.tolist())),
        stiffnesses=tuple(stiffnesses.tolist()),
    )  # fmt: skip


def with_storeys(building: Building, lines: Mapping[int, Model]) -> Building:
    """Return a building whose storeys are as their lines have them, in stiffness and in damping.

    Parameters
    ----------
    building : as its file has it
    lines : by level, the line fitted to the shear of the storey below it
    """
    C, K = np.array(building.C), np.array(building.K)
    stiffnesses = list(building.stiffnesses)
    for level, line in lines.items():
        across = np.eye(building.size)[level]
        across = across - (np.eye(building.size)[level - 1] if level else 0.0)
        both = np.outer(across, across)
        K += (line.value("k") - stiffnesses[level]) * both
        C += line.value("c") * both
        stiffnesses[level] = line.value("k")
    return building._replace(
        C=tuple(map(tuple, C.tolist())), K=tuple(map(tuple, K.tolist())),
        stiffnesses=tuple(stiffnesses),
    )  # fmt: skip


def moved_numbers(before: Building, after: Building) -> list[str]:
    """Return sentences about the numbers that a building's file has otherwise."""
    names = before.levels()
    below = ["isolation" if before.isolated else "storey 1"]
    below += [f"storey {k + (not before.isolated)}" for k in range(1, before.size)]
    pairs = [
        (f"stiffness of {where}", a, b)
        for where, a, b in zip(below, before.stiffnesses, after.stiffnesses, strict=True)
    ]
    pairs += [(f"mass of {name}", before.M[i][i], after.M[i][i]) for i, name in enumerate(names)]
    changed = [
        f"{what} {b / a - 1.0:+.1%}" for what, a, b in pairs if abs(b / a - 1.0) > LEAST_CHANGE
    ]
    if not changed:
        return []
    return [
        "The force is reconstructed from the building's numbers, adjusted within the accuracy of "
        f"a laboratory: {', '.join(changed)}. A spring or a mass of that size at the damper "
        "would look the same. If these values are right, put them into the building's file."
    ]


def _slopes(
    responses: Sequence[Response],
    building: Building,
    law: str,
    straight: bool,
    rule: DecisionRule,
) -> list[list[Array]]:
    """Return, per number and run, what a standard deviation of it adds to the force (n,) [N]."""
    here = [damper_run(one, building, law, straight) for one in responses]
    slopes = []
    for unit in np.eye(2 * building.size):
        other = moved(building, unit, rule)
        there = [damper_run(one, other, law, straight) for one in responses]
        slopes.append([(b.force - a.force)[a.skip :] for a, b in zip(here, there, strict=True)])
    return slopes


def _step(
    problem: StructureProblem, model: Model, slopes: list[list[Array]], shift: Array
) -> tuple[Array, Model]:
    """Return the step of the building's numbers, and the model stepped along with it."""
    expected = problem.expectation(model)
    search = Search(problem, model, expected, model.free())
    r, J = search.residuals(search.start), search.sensitivities()
    sigma = np.concatenate(
        [s[run.skip :] for run, (_, s, _) in zip(problem.runs, expected, strict=True)]
    )
    U = np.stack([np.concatenate(one) / sigma for one in slopes], axis=1)
    whole = np.hstack([J, U])
    weight = np.minimum(1.0, HUBER / np.maximum(np.abs(r), 1e-12))
    normal, gradient = (whole * weight[:, None]).T @ whole, (whole * weight[:, None]).T @ r
    p = J.shape[1]
    normal[p:, p:] += np.eye(len(shift))
    gradient[p:] += shift
    size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    step = -np.linalg.lstsq(normal / np.outer(size, size), gradient / size, rcond=1e-10)[0] / size
    theta = np.clip(search.start + step[:p], search.low, search.high)
    return step[p:], search.at(theta)
