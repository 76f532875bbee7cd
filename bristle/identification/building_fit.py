"""A building's stiffnesses and damping ratios from its response, its masses known.

Equilibrium above each storey is linear in them. Least squares would be biased: the drift that a
storey's shear is held against is the small difference of two noisy displacements. So the equations
are weighted with instruments, the response that the building found so far shows to the measured
excitation, which know nothing of the noise on drifts and accelerations (refined instrumental
variables: Young 1976, Automatica 12(3), 291-294; Soderstrom & Stoica 1983, Instrumental Variable
Methods for System Identification).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..core.arrays import Array, Flags
from ..core.text import plain
from ..data.measurement import Measurement
from ..errors import RecordError
from ..physics.building import Building, Device, from_data
from .building_motion import Response, responses
from .equilibrium import (
    SKIP,
    EquilibriumSystem,
    cross_products,
    equations_of,
    judged,
    loads_on,
    modes_of,
    ratios_of,
    stiffness_matrix,
)
from .search import z_scale

ROUNDS = 4
"""Rounds of instruments after the first, plain one."""

LOOSER = 64.0
"""Factor on the smoother's jerk: its corner at twice the frequency, for it would take a ten
thousandth off the drifts at the highest mode, as much as their standard deviation."""


MISFIT = 1.5
"""z above which what equilibrium leaves is not noise, and the answer says so."""

LOST = 0.5
"""Relative standard deviation above which a parameter is not told by the data."""


@dataclass(frozen=True)
class StructureFit:
    """A building as identified.

    `stiffnesses` (n,) N/m below each level, `damping_ratios` (n,) [1] of each mode, `frequencies`
    (n,) Hz, each with its standard deviation in `std_...`, infinite where the data do not tell it.
    `z` (n,) by level: RMS of what equilibrium leaves over the noise expected, `share` (n,) the same
    over the shear there; not a number where the damper's force is unknown.
    `building` carries the values; those in `unidentified` keep what was given.
    """

    building: Building
    stiffnesses: Array
    std_stiffnesses: Array
    damping_ratios: Array
    std_damping_ratios: Array
    frequencies: Array
    std_frequencies: Array
    z: Array
    share: Array
    unidentified: tuple[str, ...]
    notes: tuple[str, ...] = ()


class Equilibrium(NamedTuple):
    """What equilibrium leaves by level (n,): robustly in units of the noise, RMS over the shear."""

    z: Array
    share: Array


def identify_structure(measurements: list[Measurement], building: Building) -> StructureFit:
    """Return a building's stiffnesses and damping ratios from its response.

    If a damper's force was not measured, nothing can be said of a storey that it acts across alone:
    on the first level, of what is below.

    Parameters
    ----------
    measurements : one or more runs with the ground acceleration and every level's motion
    building : masses and start values; of matrices that are no chain only the storeys' springs move

    Raises
    ------
    RecordError
        If a channel is missing, the building has other levels than were measured, or a stiffness
        comes out negative.
    """
    runs = responses(measurements, building, draws=0, looser=LOOSER)
    unknown = _unknown(runs)
    if not equations_of(building.size, unknown).levels:
        raise RecordError(
            f"{measurements[0].name}: force was not measured, and {building.name!r} has no storey "
            "above the damper. Measure the damper's force."
        )
    free = np.ones(building.size, dtype=np.bool_)
    while True:
        ended = _rounds(runs, building, unknown, free)
        lost = _untold(ended, free)
        if not ended.positive and not lost.any() and ended.round > 0:
            lost[np.flatnonzero(free)[-1:]] = True  # the highest mode's ratio tells least
        if not lost.any():
            break
        free &= ~lost
    if not ended.positive:
        i = int(np.argmin(ended.stiffness))
        raise RecordError(
            f"{measurements[0].name}: the stiffness below {building.levels()[i]} comes out as "
            f"{plain(ended.stiffness[i], 4)} N/m. Check signs and units of its displacement and "
            "acceleration, and the masses of the building."
        )
    return _finish(runs, building, ended, unknown, free)


class _Ended(NamedTuple):
    """Where the rounds ended: `positive` False where a stiffness came out negative in `round`.

    `std_zeta` (n,) is zero for ratios that were held.
    """

    stiffness: Array
    zeta: Array
    covariance: Array
    std_zeta: Array
    system: EquilibriumSystem
    positive: bool
    round: int


def _rounds(
    runs: list[Response], building: Building, unknown: Device | None, free: Flags
) -> _Ended:
    """Return the stiffnesses and the ratios of the modes in `free`; the others stay as given."""
    stiffness, given = np.array(building.stiffnesses), ratios_of(building)
    zeta = given
    for round_ in range(1 + ROUNDS):
        sums = cross_products(runs, building, stiffness, zeta, unknown, plain=round_ == 0)
        system = EquilibriumSystem(building, runs, stiffness, unknown)
        theta, covariance = system.solve(sums, given, free)
        stiffness, zeta = system.split(theta, stiffness)
        positive = bool(np.all(stiffness > 0.0))
        if not positive:
            break
    m = len(system.told)
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))[m : m + system.n]
    return _Ended(stiffness, zeta, covariance, std, system, positive, round_)


def _untold(ended: _Ended, free: Flags) -> Flags:
    """Return which of the free ratios the data do not tell, (n,).

    Free, they would take whatever the others leave, and the instruments would follow them.
    """
    size = np.maximum(np.abs(ended.zeta), 1e-3)
    return free & ((ended.std_zeta > LOST * size) | (np.abs(ended.zeta) >= 1.0))


def _finish(
    runs: list[Response], building: Building, ended: _Ended, unknown: Device | None,
    free: Flags,
) -> StructureFit:  # fmt: skip
    """Return the fit with what is not identified put back and named."""
    stiffness, zeta, system = ended.stiffness.copy(), ended.zeta.copy(), ended.system
    n, told, covariance = building.size, system.told, ended.covariance
    m, std = len(told), np.sqrt(np.maximum(np.diag(covariance), 0.0))
    std_k = np.full(n, np.inf)
    std_k[told] = std[:m]
    identifiable = free & ~_modes_of_springs(building, stiffness, told)
    std_zeta = np.where(identifiable, ended.std_zeta, np.inf)
    given = np.array(building.stiffnesses)
    levels, lost, notes = building.levels(), [], []
    for i in range(n):
        if std_k[i] > LOST * stiffness[i]:
            lost.append(f"stiffness below {levels[i]}")
            stiffness[i], std_k[i] = given[i], np.inf
    before = ratios_of(building)
    for r in range(n):
        if not identifiable[r]:
            lost.append(f"damping ratio of mode {r + 1}")
            zeta[r] = before[r]
        elif zeta[r] < 0.0:
            notes.append(
                f"mode {r + 1} comes out with a damping ratio of {zeta[r]:.4f}; it is given 0"
            )
            zeta[r] = 0.0
    hidden = [levels[i] for i in range(n) if i not in told]
    if hidden:
        names = " and ".join(hidden)
        notes.append(
            f"the damper's force was not measured: values below {names} stay as given, and damping "
            "ratios hold for them"
        )
    modes = modes_of(building, stiffness)
    # d(omega^2)/dk_i = (shape_i - shape_{i-1})^2 (Nelson 1976, AIAA J. 14(9)).
    part = np.diff(modes.shapes, axis=0, prepend=np.zeros((1, n))) ** 2
    known = np.isfinite(std_k)
    cov = np.zeros((n, n))
    cov[np.ix_(told, told)] = covariance[:m, :m]
    cov *= np.outer(known, known)
    slope = part.T / (2.0 * modes.omega[:, None])
    std_omega = np.sqrt(np.maximum(np.einsum("ri,ij,rj->r", slope, cov, slope), 0.0))
    weighted = np.array(building.M) @ modes.shapes
    C = (weighted * (2.0 * zeta * modes.omega)) @ weighted.T
    freeze = [tuple(tuple(float(v) for v in row) for row in matrix) for matrix in (C,)]
    K = tuple(tuple(float(v) for v in row) for row in stiffness_matrix(building, stiffness))
    found = building._replace(C=freeze[0], K=K, stiffnesses=tuple(float(k) for k in stiffness))
    z, share = _left(runs, found, system)
    worst = int(np.nanargmax(z))
    if z[worst] > MISFIT:
        notes.append(
            f"equilibrium at {levels[worst]} leaves {plain(z[worst])} times the noise: the "
            "building is not linear there, or its masses are wrong, or displacements and "
            "accelerations contradict each other. The values are those of the nearest linear "
            "building, and the intervals are valid only for it"
        )
    return StructureFit(
        found, stiffness, std_k, zeta, std_zeta, modes.omega / (2.0 * np.pi),
        std_omega / (2.0 * np.pi), z, share, tuple(lost), tuple(notes),
    )  # fmt: skip


def equilibrium(measurements: list[Measurement], building: Building) -> Equilibrium:
    """Return what equilibrium leaves of runs, such as those that a building was not fitted to.

    Raises
    ------
    RecordError
        If a channel is missing, or the building has other levels than were measured.
    """
    runs = responses(measurements, building, draws=0, looser=LOOSER)
    unknown = _unknown(runs)
    return _left(
        runs, building, EquilibriumSystem(building, runs, np.array(building.stiffnesses), unknown)
    )


def _unknown(runs: list[Response]) -> Device | None:
    """Return the damper whose force was not measured in every run, None where there is none."""
    damped = any(run.damped for run in runs)
    told = all(run.force is not None for run in runs)
    return runs[0].device if damped and not told else None


def _modes_of_springs(building: Building, stiffness: Array, told: Sequence[int]) -> Flags:
    """Return the modes (n,) that springs which are not told hold most of, one for each spring.

    Their damping is as much that of the storeys there, which equilibrium does not show.
    """
    n = building.size
    found = np.zeros(n, dtype=np.bool_)
    modes = modes_of(building, stiffness)
    energy = np.diff(modes.shapes, axis=0, prepend=np.zeros((1, n))) ** 2 / modes.omega**2
    for i in (i for i in range(n) if i not in told):
        found[int(np.argmax(energy[i]))] = True
    return found


def _left(runs: list[Response], found: Building, system: EquilibriumSystem) -> Equilibrium:
    """Return what equilibrium leaves by level, offsets apart."""
    unknown = system.unknown
    C, K, M = (np.array(matrix) for matrix in (found.C, found.K, found.M))
    rest: list[list[Array]] = [[] for _ in range(found.size)]
    whole: list[list[Array]] = [[] for _ in range(found.size)]
    for run in runs:
        inertia = M @ run.a + loads_on(run, unknown)
        above, carried = (
            (system.equations.weights @ level)[:, SKIP:]
            for level in (inertia + C @ run.v + K @ run.x, inertia)
        )
        told = judged(run, unknown)[SKIP:]
        for row, i in enumerate(system.equations.levels):
            rest[i].append(above[row, told] - np.median(above[row, told]))
            whole[i].append(carried[row, told] - np.median(carried[row, told]))
    z, share = np.full(found.size, np.nan), np.full(found.size, np.nan)
    for row, i in enumerate(system.equations.levels):
        left = np.concatenate(rest[i])
        z[i] = z_scale(left / system.noise[row])
        share[i] = np.sqrt(np.mean(left**2) / np.mean(np.concatenate(whole[i]) ** 2))
    return Equilibrium(z, share)


# A building as identified, written as the file that everything else reads.


def building_text(fit: StructureFit, origin: Sequence[str] = ()) -> str:
    """Return the building file (schema 1) of an identified building, its intervals as comments.

    A chain of masses is written as masses, stiffnesses and modal damping ratios, anything else as
    its matrices. `origin` are lines that say where it comes from.
    """
    building = fit.building
    lines = [f"# {line}" for line in origin]
    lines += ["schema = 1", f"name = {json.dumps(building.name)}"]
    lines.append(f'base = "{"isolated" if building.isolated else "fixed"}"')
    if is_chain(building):
        masses = [row[i] for i, row in enumerate(building.M)]
        ratios = np.maximum(fit.damping_ratios, 0.0)
        lines += ["", f"masses = {_row(masses)}  # kg, as given", ""]
        lines += _with_intervals("stiffnesses", "N/m", building.stiffnesses, fit.std_stiffnesses)
        lines += ["", *_with_intervals("modal", "1", ratios, fit.std_damping_ratios)]
    else:
        lines += ["", "# kg, N s/m, N/m; stiffnesses and modal damping ratios as identified:"]
        lines += [
            f"# {line}" for line in _with_intervals("", "N/m", fit.stiffnesses, fit.std_stiffnesses)
        ]
        lines += [
            f"# {line}"
            for line in _with_intervals("", "1", fit.damping_ratios, fit.std_damping_ratios)
        ]
        for letter, matrix in (("M", building.M), ("C", building.C), ("K", building.K)):
            lines += ["", f"{letter} = [", *(f"  {_row(row)}," for row in matrix), "]"]
    for device in building.devices:
        names = ["ground", *building.levels()]
        ends = ", ".join(json.dumps(names[i + 1]) for i in device.levels)
        lines += ["", "[[devices]]", f"name = {json.dumps(device.name)}", f"between = [{ends}]"]
    text = "\n".join([*lines, ""])
    _check(text, building)
    return text


def is_chain(building: Building) -> bool:
    """Return whether a building is masses on springs, each between its neighbours."""
    M, K = np.array(building.M), np.array(building.K)
    loose = building._replace(K=tuple(tuple(0.0 for _ in row) for row in K))
    loose = loose._replace(stiffnesses=(0.0,) * building.size)
    chain = stiffness_matrix(loose, np.array(building.stiffnesses))
    diagonal = not np.any(M - np.diag(np.diag(M)))
    return diagonal and bool(np.allclose(K, chain, rtol=0.0, atol=1e-9 * np.abs(K).max()))


def _with_intervals(key: str, unit: str, values: Sequence[float] | Array, std: Array) -> list[str]:
    """Return the lines of a list, one value each, with half of its 95 % interval."""
    rows = [
        f"  {float(value)!r}, "
        + (
            f"# ± {1.96 * s:.2g} {unit}"
            if np.isfinite(s)
            else "# as given: the data do not identify it"
        )
        for value, s in zip(values, std, strict=True)
    ]
    return [f"{key} = [".removeprefix(" = "), *rows, "]"]


def _row(values: Sequence[float]) -> str:
    return f"[{', '.join(repr(float(value)) for value in values)}]"


def _check(text: str, building: Building) -> None:
    """Hold the line between what is written and what is read."""
    import tomllib

    read = from_data(tomllib.loads(text))
    assert read.devices == building.devices, "the file says otherwise"
    for ours, theirs in ((building.M, read.M), (building.C, read.C), (building.K, read.K)):
        size = np.abs(np.array(ours)).max()
        assert np.allclose(ours, theirs, rtol=0.0, atol=1e-6 * size), "the file says otherwise"
