"""A building's masses as equilibrium has them, where its file knows them to a few per cent only.

The shear of a storey is the inertia above it, and must go with one line through drift and drift
rate at each storey; at the isolation layer it must go with the measured force besides. Masses that
are off leave what no line absorbs, and a load cell of another scale is, for equilibrium, nothing
but masses that are all off alike. So masses are moved first, as far as a file may be wrong. Without
a measured force only their ratios can be told.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..identify.line import fit_line, line_columns
from ..identify.response import Response
from ..identify.structure import StructureProblem, problems_of
from ..physics.building import Building
from ..physics.laws import LAWS, law_of_part
from .candidates import judge
from .rule import SITE, DecisionRule

Array = NDArray[np.float64]
DEVIATIONS = 3.0
"""Standard deviations of a mass that the doubt about it amounts to."""

Pair = tuple[StructureProblem, StructureProblem]


@dataclass(frozen=True)
class Shaken:
    """Responses of a building to fit to and to decide on, as its damper's law asks for them."""

    train: list[Response]
    holdout: list[Response]
    law: str
    straight: bool

    @property
    def measured(self) -> bool:
        """Whether the damper's force was measured in every run."""
        return all(run.force is not None for run in (*self.train, *self.holdout))

    @property
    def lowest(self) -> int:
        """The lowest level whose equilibrium with all above has no unknown force."""
        run = self.train[0]
        hidden = run.damped and not self.measured and run.device.crosses(0)
        return run.device.upper + 1 if hidden else 0

    def lines(self, building: Building) -> dict[str, Pair]:
        """Return the sites whose model is a line, with a building's masses."""
        found = problems_of(self.train, self.holdout, building, self.law, self.straight)
        return {site: pair for site, pair in found.items() if site != "damper"}


def suited_masses(shaken: Shaken, building: Building, rule: DecisionRule = SITE) -> Building:
    """Return a building with masses that make its sites lines, its own where they do not.

    Parameters
    ----------
    shaken : responses to fit to, and those that decide
    building : as its file has it
    rule : how far masses may move, and how much that must explain
    """
    lines = shaken.lines(building)
    before = _excess(lines, rule)
    if before <= rule.least_excess * len(lines):
        return building
    shift = _shift(shaken, building, lines, rule)
    if float(np.max(np.abs(shift / (1.0 + shift)))) > rule.mass_doubt:
        return building
    moved = with_masses(building, shift)
    return moved if _excess(shaken.lines(moved), rule) <= rule.moved * before else building


def with_masses(building: Building, shift: Array) -> Building:
    """Return a building whose masses are changed by shares (n,), what couples them likewise."""
    root = np.sqrt(1.0 + shift)
    M = np.array(building.M) * np.outer(root, root)
    return building._replace(M=tuple(map(tuple, M.tolist())))


def text_of_masses(before: Building, after: Building, measured: bool = True) -> list[str]:
    """Return the sentence about masses that were moved, in a list; none where none was.

    Parameters
    ----------
    before, after : the building as its file has it, and with masses that suit equilibrium
    measured : whether the damper's force was measured
    """
    if after is before:
        return []
    names = before.levels()
    share = [after.M[i][i] / before.M[i][i] - 1.0 for i in range(before.size)]
    told = ", ".join(f"{name} {one:+.1%}" for name, one in zip(names, share, strict=True))
    if not measured:
        return [
            f"Equilibrium requires other masses than those in the building's file: {told}, with "
            "their sum kept, which no run without a measured force shows. Weigh the building."
        ]
    return [
        f"Equilibrium requires other masses than those in the building's file: {told}. A load "
        "cell whose gain is wrong by that much would look the same. Weigh the building, or check "
        "the cell."
    ]


def _excess(lines: Mapping[str, Pair], rule: DecisionRule) -> float:
    """Return what lines leave beyond noise on held-out runs, summed over the sites."""
    total = 0.0
    for site, (train, held_out) in lines.items():
        line = fit_line(train, law_of_part(site).name).model
        total += rule.excess(judge(line, train, held_out).z)
    return total


def _shift(
    shaken: Shaken, building: Building, lines: Mapping[str, Pair], rule: DecisionRule
) -> Array:
    """Return by which share (n,) each mass is to move: least squares, with what the file knows."""
    n = building.size
    unit = rule.mass_doubt / DEVIATIONS
    able = _determined(n, shaken.lowest, shaken.measured)
    moved = [with_masses(building, unit * np.eye(n)[j]) for j in range(n)]
    others = [shaken.lines(one) for one in moved]
    normal, gradient = np.eye(n), np.zeros(n)
    for site, (train, _) in lines.items():
        law = law_of_part(site)
        expected = train.expectation(fit_line(train, law.name).model)
        weight = np.concatenate(
            [1.0 / e[1][run.skip :] for e, run in zip(expected, train.runs, strict=True)]
        )
        columns = [line_columns(run, LAWS[law.name])[run.skip :] for run in train.runs]
        Q = np.linalg.qr(np.concatenate(columns) * weight[:, None])[0]
        here = _target(train)

        def left(values: Array, Q: Array = Q, weight: Array = weight) -> Array:
            """Return what no line absorbs of forces (m,), over the noise."""
            scaled = values * weight
            return np.asarray(scaled - Q @ (Q.T @ scaled))

        above = _above(building, train)
        slopes = np.stack(
            [
                left(_target(other[site][0]) * above / _above(one, train) - here)
                for one, other in zip(moved, others, strict=True)
            ],
            axis=1,
        )
        normal += slopes.T @ slopes
        gradient += slopes.T @ left(here)
    return np.asarray(-unit * able @ np.linalg.solve(able.T @ normal @ able, able.T @ gradient))


def _above(building: Building, problem: StructureProblem) -> float:
    """Return the mass that a storey carries [kg]: its residual is per mass, else it would shrink.

    Lighter masses would seem to suit better, for the noise is theirs. At the layer the damper's
    force says how large forces are: 1.
    """
    if not problem.storey:
        return 1.0
    level = problem.storey - (not building.isolated)
    return float(np.diag(np.array(building.M))[level:].sum())


def _determined(n: int, lowest: int, measured: bool) -> Array:
    """Return a basis (n, k) of the changes of n masses that equilibrium may tell.

    Without a measured force the masses above the lowest line and all stiffnesses may be larger
    alike: what lines leave would only shrink with them.
    """
    if measured:
        return np.eye(n)
    moved = np.zeros((n, n - lowest))
    moved[lowest:] = np.eye(n - lowest) - 1.0 / (n - lowest)
    return np.asarray(np.linalg.svd(moved)[0][:, : n - lowest - 1])


def _target(problem: StructureProblem) -> Array:
    """Return the forces that a line is fitted to, all runs one after the other."""
    return np.concatenate([run.force[run.skip :] for run in problem.runs])
