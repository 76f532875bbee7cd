"""A building's masses and stiffnesses, as far as equilibrium has them.

The shear of a storey is the inertia above it, and must go with one line through drift and drift
rate at each storey; at the isolation layer it must go with the measured force besides. Masses that
are off leave what no line absorbs, and a load cell of another scale is, for equilibrium, nothing
but masses that are all off alike. So masses are moved first, as far as a file may be wrong. Without
a measured force only their ratios can be told.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..core.arrays import Array
from ..identification.building_motion import Response, shear
from ..identification.building_sites import (
    StructurePair,
    StructureProblem,
    damper_run,
    problems_of,
)
from ..identification.fit import Search
from ..identification.problem import noise_of
from ..identification.rig_fit import fit_line, line_columns
from ..identification.search import HUBER, weighed
from ..model.model import Model
from ..physics.building import Building
from ..physics.laws import LAWS, law_of_part
from .rule import BENCH, SITE
from .trials import judge

DEVIATIONS = 3.0
"""Standard deviations of a mass that the doubt about it amounts to."""

PASSES = 4
"""Weighted least squares in so many passes, by Huber's weights of the pass before."""


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

    def lines(self, building: Building) -> dict[str, StructurePair]:
        """Return the sites whose model is a line, with a building's masses."""
        found = problems_of(self.train, self.holdout, building, self.law, self.straight)
        return {site: pair for site, pair in found.items() if site != "damper"}


def suited_masses(shaken: Shaken, building: Building) -> Building:
    """Return a building with masses that make its sites lines, its own where they do not.

    Parameters
    ----------
    shaken : responses to fit to, and those that decide
    building : as its file has it
    """
    lines = shaken.lines(building)
    before = _excess(lines)
    if max(before.values(), default=0.0) <= SITE.least_excess:
        return building
    rows = _rows(shaken, building, lines)
    found, least = building, sum(before.values())
    clear = [site for site in lines if before[site] > SITE.excess(SITE.clean)]
    for one in (None, *clear):  # an effect of one site may look like masses; the others then tell
        able = [rows[site] for site in lines if site != one]
        shift = _shift(able, _determined(building.size, shaken.lowest, shaken.measured))
        if float(np.max(np.abs(shift / (1.0 + shift)))) > SITE.mass_doubt:
            continue
        moved = with_masses(building, shift)
        after = _excess(shaken.lines(moved))
        if _suit_better(before, after) and sum(after.values()) < least:
            found, least = moved, sum(after.values())
        if max(after.values()) <= SITE.excess(SITE.adequate):
            break
    return found


def _suit_better(before: Mapping[str, float], after: Mapping[str, float]) -> bool:
    """Return whether masses take half of what a line leaves, at one site, and add to none.

    An effect of one site leaves its excess there, whatever the masses are: that says nothing of
    what they do at the others.
    """
    noise = SITE.excess(SITE.adequate)
    if any(after[site] > max(noise, (1.0 + SITE.trace) * before[site]) for site in before):
        return False
    clear = [site for site in before if before[site] > SITE.excess(SITE.quiet)]
    return any(after[site] <= SITE.building_excess * before[site] for site in clear)


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
    changes = ", ".join(f"{name} {one:+.1%}" for name, one in zip(names, share, strict=True))
    if not measured:
        return [
            f"Equilibrium requires other masses than those in the building's file: {changes}, with "
            "their sum kept, which no run without a measured force shows. Weigh the building."
        ]
    return [
        f"Equilibrium requires other masses than those in the building's file: {changes}. A load "
        "cell whose gain is wrong by that much would look the same. Weigh the building, or check "
        "the cell."
    ]


def _excess(lines: Mapping[str, StructurePair]) -> dict[str, float]:
    """Return what lines leave beyond noise on held-out runs, by site."""
    found = {}
    for site, (train, held_out) in lines.items():
        line = fit_line(train, law_of_part(site).name).model
        found[site] = SITE.excess(judge(line, train, held_out).z)
    return found


class _Rows(NamedTuple):
    """What a site tells of masses, in noises: columns of its line, of each mass, and the force."""

    line: Array
    masses: Array
    force: Array


def _rows(
    shaken: Shaken, building: Building, lines: Mapping[str, StructurePair]
) -> dict[str, _Rows]:
    """Return by site how its force follows its line (m, p), and each mass (m, n) by a deviation.

    An acceleration that is smoothed for want of an accelerometer holds more noise than a mass that
    is off: it would take that noise, and is left as the file has it.
    """
    n = building.size
    told = np.array([i > 0 or shaken.train[0].pulse is None for i in range(n)])
    unit = SITE.mass_doubt / DEVIATIONS
    moved = [with_masses(building, unit * np.eye(n)[j]) for j in range(n)]
    rows = {}
    for site, (train, _) in lines.items():
        law = law_of_part(site)
        expected = train.expectation(fit_line(train, law.name).model)
        weight = 1.0 / noise_of(train, expected)
        columns = [line_columns(run, LAWS[law.name])[run.skip :] for run in train.runs]
        here, above = train.force, _above(building, train)
        carried = _carried(shaken, building, train)
        slopes = [
            (here + _carried(shaken, one, train) - carried) * above / _above(one, train) - here
            for one in moved
        ]
        rows[site] = _Rows(
            np.concatenate(columns) * weight[:, None],
            np.stack(slopes, axis=1) * weight[:, None] * told,
            here * weight,
        )
    return rows


def _shift(sites: Sequence[_Rows], able: Array) -> Array:
    """Return by which share (n,) each mass is to move: least squares, with what the file knows.

    Robust, and what a line of a site misses anyhow counts as noise there: an effect is not to move
    masses.

    Parameters
    ----------
    sites : what tells of them
    able : basis (n, k) of the changes that equilibrium may tell
    """
    n = len(able)
    shift = np.zeros(n)
    for _ in range(PASSES):
        normal, gradient = np.eye(n), np.zeros(n)
        for line, masses, force in sites:
            now = force + masses @ shift
            left = np.abs(now - line @ np.linalg.lstsq(line, now, rcond=None)[0])
            spread = max(1.0, float(np.median(left)) / 0.6745)
            robust = np.sqrt(np.minimum(1.0, HUBER * spread / np.maximum(left, 1e-300))) / spread
            Q = np.linalg.qr(line * robust[:, None])[0]
            own, target = masses * robust[:, None], force * robust
            own = own - Q @ (Q.T @ own)  # what no line absorbs
            normal += own.T @ own
            gradient += own.T @ target
        shift = -able @ np.linalg.solve(able.T @ normal @ able, able.T @ gradient)
    return np.asarray(SITE.mass_doubt / DEVIATIONS * shift)


def _above(building: Building, problem: StructureProblem) -> float:
    """Return the mass that a storey carries [kg]: its residual is per mass, else it would shrink.

    Lighter masses would seem to suit better, for the noise is theirs. At the layer the damper's
    force says how large forces are: 1.
    """
    if not problem.storey:
        return 1.0
    return float(np.diag(np.array(building.M))[_level(building, problem) :].sum())


def _level(building: Building, problem: StructureProblem) -> int:
    """Return the level above a site's line."""
    return problem.storey - (not building.isolated) if problem.storey else 0


def _carried(shaken: Shaken, building: Building, problem: StructureProblem) -> Array:
    """Return what a building's masses carry below a site's level, as `Problem.force` has it."""
    level, parts = _level(building, problem), []
    for run in problem.runs:
        whole, keep = run.remembered
        # A run that does not move is left out, and names may be alike: the command is its own.
        response = next(one for one in shaken.train if one.V is whole.V)
        parts.append(shear(response, building, level)[0][keep][run.skip :])
    return np.concatenate(parts)


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


# How well a building is known, where its numbers make the damper's force.
#
# Without a load cell the force is what equilibrium leaves: inertia, less the springs. A stiffness
# that is 2 % off in the building's file then acts like a linear spring beside the damper, a mass
# like a fluid's. So the file's numbers are taken as a laboratory knows them, and move within that
# together with the law; what they cannot absorb is left for the effects.
#
# The first level's mass stays: the scale of all forces is not told by motion, and a residual
# shrinks with it. By how much all that stands on it is heavier and stiffer alike is therefore a
# number of its own; the storeys' stiffnesses beside that are told by their lines.

TURNS, SETTLED = 3, 0.1
"""How often law and building are fitted in turn at most, and the step that ends it, in standard
deviations: they depend on each other but weakly."""

LEAST_CHANGE = 0.005
"""Change of a number, as a share, from which it is reported."""


def within_prior(
    model: Model, responses: Sequence[Response], building: Building, law: str, straight: bool = True
) -> Building:
    """Return the building whose numbers, within what is known of them, suit the runs best.

    Parameters
    ----------
    model : the damper's law, fitted to the force that the building as it is makes
    responses : the training runs
    building : the building as its file has it
    law, straight : see `identification.building_sites.damper_run`
    """
    slopes = _slopes(responses, building, law, straight)
    shift = np.zeros(2 * building.size)
    for _ in range(TURNS):
        now = moved(building, shift)
        problem = StructureProblem(
            [damper_run(one, now, law, straight) for one in responses], 0, reconstructed=True
        )
        step, model = _step(problem, model, slopes, shift)
        shift = np.clip(shift + step, -BENCH.farthest, BENCH.farthest)
        if float(np.max(np.abs(step))) < SETTLED:
            break
    return moved(building, shift)


def moved(building: Building, shift: Array) -> Building:
    """Return a building with its numbers (2 n,) moved, in standard deviations.

    Stiffnesses (n,), masses above the first level (n - 1,), and by how much all masses and
    stiffnesses above it are larger alike.
    """
    n, first = building.size, building.stiffnesses[0]
    alike = 1.0 + BENCH.mass_doubt / DEVIATIONS * float(shift[-1])
    upper = np.append(0.0, np.full(n - 1, alike - 1.0))
    M = np.array(with_masses(building, upper).M)
    K, stiffnesses = alike * np.array(building.K), np.array(building.stiffnesses) * (1.0 + upper)
    K[0, 0] -= (alike - 1.0) * first
    for i in range(n):
        more = BENCH.stiffness_known * shift[i] * stiffnesses[i]
        across = np.eye(n)[i] - (np.eye(n)[i - 1] if i else 0.0)
        K += more * np.outer(across, across)
        stiffnesses[i] += more
        if i:
            M[i, i] *= 1.0 + BENCH.mass_known * shift[n + i - 1]
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
    responses: Sequence[Response], building: Building, law: str, straight: bool
) -> list[list[Array]]:
    """Return, per number and run, what a standard deviation of it adds to the force (n,) [N]."""
    here = [damper_run(one, building, law, straight) for one in responses]
    slopes = []
    for unit in np.eye(2 * building.size):
        other = moved(building, unit)
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
    sigma = noise_of(problem, expected)
    U = np.stack([np.concatenate(one) / sigma for one in slopes], axis=1)
    normal, gradient = weighed(np.hstack([J, U]), r)
    p = J.shape[1]
    normal[p:, p:] += np.eye(len(shift))
    gradient[p:] += shift
    step, free = np.zeros(len(gradient)), np.ones(len(gradient), dtype=np.bool_)
    size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    for _ in range(p + 1):
        own = (normal / np.outer(size, size))[np.ix_(free, free)]
        step[:] = 0.0
        step[free] = -np.linalg.lstsq(own, (gradient / size)[free], rcond=1e-10)[0] / size[free]
        # What a parameter at its bound cannot do, the numbers do.
        beyond = (search.start <= search.low) & (step[:p] < 0.0)
        beyond |= (search.start >= search.high) & (step[:p] > 0.0)
        if not beyond.any():
            break
        free[:p] &= ~beyond
    theta = np.clip(search.start + step[:p], search.low, search.high)
    return step[p:], search.at(theta)
