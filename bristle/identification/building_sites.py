"""A building's runs as problems that a model can be held against.

The damper's: the motion across it in, force out, measured or reconstructed from equilibrium. The
isolation layer's, where the force of a damper beside it is known: what else the base carries. Each
storey's: its shear against its drift, less the forces of the devices that act across it. In the
last two the model is a line, k x + c v, and effects of the structure add
to it; so they are judged by the same searches as a damper's effects in a damper's law.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple, Self

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..core.arrays import Array, Flags, Indices
from ..data.left_out import occurring
from ..data.measurement import Measurement
from ..errors import RecordError
from ..model.model import Model
from ..physics.building import GROUND, Building
from ..physics.drive import VOLTAGE
from ..physics.effect import EFFECTS, effects_of
from ..physics.laws import DEFAULT, base_and_variant
from ..physics.tuples import Inputs
from .building_motion import Response, responses, shear
from .equilibrium import reconstructed
from .histories import StructureForces
from .problem import Problem, Run, absorbed, of_one_site

SLIDING = 3.0
"""Where dry friction may act, slower samples than so many standard deviations are left out: the
base may be held there, and the force is then whatever holds it."""

ANY_LAW = ""
"""The name of a damper's law that is sought: samples count that every law tells."""

WHILE = 101
"""Samples over which the motion's error is about as large, for a line."""

BESIDE = 3
"""Samples on either side of such a one that are left out with it."""


@dataclass(frozen=True)
class StructureRun(Run):
    """A run of a building as one of its problems sees it.

    The arrays of `Run` hold the samples that count; `whole` is the run with all of them, for models
    with memory, and `keep` says which ones count.
    """

    whole: Run = field(kw_only=True, repr=False)
    keep: Indices = field(kw_only=True)

    @property
    def remembered(self) -> tuple[Run, Indices]:
        """The run with all samples, and which of them count."""
        return self.whole, self.keep

    def of(self, part: slice) -> Self:
        """Return the run with these of the samples that count; `whole` stays, for its history."""
        return replace(super().of(part), keep=self.keep[part])

    def first(self, seconds: float) -> Self:
        """Return the run as it is: of `whole` each sample is made, however few count."""
        return self

    def entire(self) -> StructureRun:
        """Return the run with all samples of `whole`, those at rest too."""
        own = {one.name: getattr(self.whole, one.name) for one in fields(Run)}
        return StructureRun(**own, whole=self.whole, keep=np.arange(len(self.whole.force)))


class StructureProblem(Problem):
    """Runs of a building held against a damper's law or a linear law, with effects of both sites.

    Parameters
    ----------
    runs : list of StructureRun
    storey : int
        0 for the first level (the isolation layer, the damper), else the storey's number.
    reconstructed : bool
        Whether the damper's force is a result of equilibrium, not measured.
    beside : bool
        Whether it then is one unknown with what the isolation layer has beside the damper.
    damped : float
        Damping that the building has there already [N s/m]: a line may take that away and no more.
    """

    shaken = True

    def __init__(
        self,
        runs: Sequence[Run],
        storey: int = 0,
        reconstructed: bool = False,
        damped: float = float("inf"),
        beside: bool = True,
    ) -> None:
        super().__init__(list(runs))
        self.storey = storey
        self.reconstructed = reconstructed
        self.beside = beside
        self.damped = damped
        self._along: dict[tuple[str, ...], StructureForces] = {}

    def of(self, runs: list[Run]) -> StructureProblem:
        """Return the same problem for other runs."""
        made = super().of(runs)
        assert isinstance(made, StructureProblem)
        return made

    def _made_of(self, runs: list[Run]) -> StructureProblem:
        return StructureProblem(runs, self.storey, self.reconstructed, self.damped, self.beside)

    @property
    def joined_with_layer(self) -> bool:
        """Whether the force is that of the damper and the isolation layer together."""
        return self.reconstructed and self.beside

    def damper_effects(self, law: str) -> list[str]:
        """Return the effects of the damper, by a model's names, that these runs may tell.

        In a reconstructed force those that the isolation layer may have as well add up with the
        layer's, so that the layer's alone are tried.
        """
        return [
            effect.key("damper")
            for effect in effects_of("damper", law)
            if not absorbed(effect, law)
            and self.tells(effect)
            and not (self.joined_with_layer and "structure" in effect.sites)
        ]

    def along(self, effects: tuple[str, ...]) -> StructureForces:
        """Return what gives the forces of these effects along a motion, made at first use."""
        if effects not in self._along:
            self._along[effects] = StructureForces(list(effects), self.storey)
        return self._along[effects]

    def _expected(self, model: Model, run: Run, draws: int) -> tuple[Array, Array, Array]:
        bias, noise, spread = super()._expected(model, run, draws)
        if model.law_class.site != "structure" or len(spread) < 2:
            return bias, noise, spread
        # A line shows the motion's error as it is: without bias, and about as large for a while.
        # Of a dozen draws the mean of each sample is noise by itself, and so is its variance.
        spread = spread * np.sqrt(len(spread) / (len(spread) - 1))
        variance = uniform_filter1d(np.mean(spread**2, axis=0), WHILE)
        steady = np.sqrt(run.noise**2 + variance)
        if run.measured is not None:
            steady = np.where(run.measured, steady, noise)
        return np.zeros_like(bias), steady, spread

    def predict(self, model: Model, run: Run, draw: int | None = None) -> Array:
        """Return the model's force [N] at the samples of a run that count."""
        assert isinstance(run, StructureRun)
        structure = tuple(e for e in model.effects if EFFECTS[e].site == "structure")
        damper = tuple(e for e in model.effects if EFFECTS[e].site != "structure")
        law = model.law_class
        # A law without states is a function of the motion at each sample, others of its history,
        # as all are behind a filter.
        memory = bool(law.states) or any(
            EFFECTS[e].states or EFFECTS[e].site == "sensor" for e in model.effects
        )
        filtered = run.whole.finer is not None or run.whole.pulse is not None
        seen = run.whole if memory or filtered else run
        x, v, a, V, dt = seen.smoothed if draw is None else seen.drawn(draw)
        stiffness = 0.0
        if law.site == "structure":
            stiffness = model.value(law.stiffness)
            q = Inputs(x, v, a, V, dt, 0.0, 0.0, False)
            force = seen.seen(law.hooks()["force"](q, (), law.at(model.values)))
        else:
            force = super().predict(of_one_site(model, damper), seen, draw)
        if structure:
            own = of_one_site(model, structure)
            along = self.along(own.effects)
            force = force + seen.seen(along.force(x, v, dt, stiffness, own.values))
        return force if seen is run else force[run.keep]


StructurePair = tuple[StructureProblem, StructureProblem]
"""The runs of a site for training and those held out."""


def structure_run(
    name: str, dt: float, motion: tuple[Array, Array, Array, Array], force: Array, noise: float,
    draws: Array, keep: Flags | None = None, drawn: Array | None = None,
    left_out: Mapping[str, Flags] | None = None, untold: tuple[str, ...] = (),
) -> StructureRun:  # fmt: skip
    """Return a run of the samples that count; the first ones are the smoother's and skipped.

    Parameters
    ----------
    name, dt : name of the run, sampling step [s]
    motion : x, v, a, V, each (n,) [m, m/s, m/s2, V]
    force, noise : (n,) N, and its standard deviation [N]
    draws : (d, n, 4) draws of the error of x, v, a, V
    keep : (n,) which samples count; None for all
    drawn : (d, n) draws of the error of a force that follows from the motion [N]; None for none
    left_out : by reason (n,) True where a sample says nothing; None for nowhere
    untold : the channels of the force whose noise is not known
    """
    left_out = left_out or {}
    drawn = None if drawn is None or not len(drawn) else drawn
    whole = Run(
        name, dt, *motion, force, noise, draws, left_out=left_out, force_draws=drawn, untold=untold
    )
    if keep is None:
        index, skip = np.arange(len(force)), whole.skip
    else:
        index, skip = np.flatnonzero(keep & (np.arange(len(force)) >= whole.skip)), 0
    x, v, a, V = (part[index] for part in motion)
    return StructureRun(
        name, dt, x, v, a, V, force[index], noise, draws[:, index], skip, whole=whole, keep=index,
        left_out={reason: where[index] for reason, where in left_out.items()},
        force_draws=None if drawn is None else drawn[:, index], untold=untold,
    )  # fmt: skip


def _of(response: Response, run: StructureRun, on_first: bool = False) -> StructureRun:
    """Return a run with what is known of its measurement: command, labels, extra channels.

    And how it was seen, if it is a force on the first level that follows from equilibrium.
    """
    known: dict[str, Any] = {"drive": response.drive or VOLTAGE.name, "labels": response.labels}
    pulse = response.pulse if on_first else None
    whole = replace(run.whole, extra=response.extra, finer=response.finer, pulse=pulse, **known)
    extra = {
        name: replace(one, values=one.values[run.keep]) for name, one in response.extra.items()
    }
    return replace(run, whole=whole, extra=extra, **known)


def thinned(problem: StructureProblem, stride: int = 5) -> StructureProblem:
    """Return the problem with every so many samples: enough to choose among starts."""
    runs: list[Run] = []
    for run in problem.runs:
        assert isinstance(run, StructureRun)
        part = slice(run.skip, None, stride)
        runs.append(replace(run.of(part), skip=0))
    return problem.of([*runs])


def storey_run(response: Response, building: Building, level: int) -> StructureRun:
    """Return the shear below a level against the drift there.

    Where the damper acts across that storey its force must be known.
    """
    force, noise, drawn = shear(response, building, level)
    lower = level - 1
    x, v = response.x[level].copy(), response.v[level].copy()
    error = _error(response, level)
    if level:
        x -= response.x[lower]
        v -= response.v[lower]
        error[:, :, :3] -= _error(response, lower)[:, :, :3]
    if response.force is not None and response.device.crosses(level):
        force, noise = _less_damper(response, response.force, force, noise)
    motion = (x, v, response.a[level], response.V)
    made = structure_run(
        response.name, response.dt, motion, force, noise, error, drawn=drawn,
        left_out=_left_out(response, level, response.device.crosses(level)),
        untold=_untold(response, building, level),
    )  # fmt: skip
    return _of(response, made, level == 0)


def _left_out(response: Response, level: int, loaded: bool) -> dict[str, Flags]:
    """Return why a level's equilibrium is not known, by reason (n,) True where it is not.

    With the damper's force if it is `loaded`.
    """
    loaded = loaded and response.force is not None
    found = {
        reason: ~(known.equilibrium(level) & known.force if loaded else known.equilibrium(level))
        for reason, known in response.known_but.items()
    }
    return occurring(found)


def _untold(response: Response, building: Building, level: int) -> tuple[str, ...]:
    """Return the channels of a level's equilibrium whose noise is not known."""
    used = [f"{one}_acceleration_absolute" for one in building.levels()[level:]]
    used += [f"{one.device.name}_force" for one in response.others if one.device.crosses(level)]
    used += ["force"] if response.device.crosses(level) else []
    return tuple(name for name in used if name in response.untold)


def layer_run(response: Response, building: Building) -> StructureRun:
    """Return what the isolation layer carries beside the damper, against the base motion.

    Samples at which the base may be held are left out.
    """
    force, noise, drawn = shear(response, building, 0)
    if response.device.crosses(0):
        if response.force is None:
            raise RecordError(
                f"{response.name}: force was not measured, so the forces of isolation layer and "
                "damper cannot be separated."
            )
        force, noise = _less_damper(response, response.force, force, noise)
    x, v, a = response.x[0], response.v[0], response.a[0]
    made = structure_run(
        response.name, response.dt, (x, v, a, response.V), force, noise, _error(response, 0),
        sliding(response), drawn, _left_out(response, 0, response.device.crosses(0)),
        untold=_untold(response, building, 0),
    )  # fmt: skip
    return _of(response, made, True)


def _less_damper(response: Response, own: Array, force: Array, noise: float) -> tuple[Array, float]:
    """Return what is carried without the damper's `own` measured force (n,) [N], and its noise.

    Where no accelerometer shows its upper end, the inertia there holds its noise: they cancel.
    """
    shown = bool(response.accelerometer[response.device.upper])
    return force - own, float(np.hypot(noise, response.noise_force)) if shown else noise


def sliding(response: Response) -> Flags:
    """Return where the first level surely moves, and so do the samples beside, (n,)."""
    return moving(response.v[0], float(response.std[0, 1]), response.draws[0, :, :, 1])


def moving(v: Array, std: float, error: Array) -> Flags:
    """Return where a velocity (n,) surely is none, and so are the samples beside, (n,).

    Beside a stop or a start the velocity is smoothed over a bend, and less certain than elsewhere.

    Parameters
    ----------
    v, std : the velocity, and its standard deviation as a rule [m/s]
    error : (d, n) draws of its error, larger beside jumps of the acceleration
    """
    here = np.sqrt(np.mean(error**2, axis=0)) if len(error) else 0.0
    moves = np.abs(v) > SLIDING * np.maximum(std, here)
    at_rest = np.convolve(~moves, np.ones(2 * BESIDE + 1), mode="same") > 0.5
    return ~at_rest


def device_moves(response: Response) -> bool:
    """Return whether the ends of the damper surely move against each other anywhere in a run."""
    across = motion_across(response)
    return bool(moving(across.v, across.std, across.error[:, :, 1]).any())


def damper_run(
    response: Response, building: Building, law: str, linear_storeys: bool = True
) -> StructureRun:
    """Return the damper's motion and force, measured or from equilibrium.

    Where a law's friction jumps with direction samples at which it may hold its ends together are
    left out; so they are where the isolation layer, whose friction may do that, has a share.

    Parameters
    ----------
    response : the run, its motion smoothed
    building : whose equilibrium gives the force where it was not measured
    law : name of the damper's law
    linear_storeys : whether storeys are linear, as a level's own equilibrium needs
    """
    x, v, a, std, error = motion_across(response)
    motion = (x, v, a, response.V)
    drawn = None
    if response.force is not None:
        force, noise = response.force, response.noise_force
        untold = tuple(name for name in response.untold if name == "force")
    else:
        untold = _untold(response, building, response.device.upper)
        found = reconstructed(response, building, linear_storeys)
        force, noise, drawn = found.force, found.noise, found.error
        if len(drawn):
            noise = found.white
    shared = response.force is None and response.device.on_first and building.isolated
    keep = moving(v, std, error[:, :, 1]) if shared or blind_at_rest(law) else None
    made = structure_run(
        response.name, response.dt, motion, force, noise, error, keep, drawn,
        _left_out_across(response), untold,
    )  # fmt: skip
    return _of(response, made, response.force is None)


def _left_out_across(response: Response) -> dict[str, Flags]:
    """Return why the damper's force or the motion of its ends is not known, by reason (n,)."""
    ends = [level for level in response.device.levels if level != GROUND]
    found = {}
    for reason, known in response.known_but.items():
        shown = known.equilibrium() if response.force is None else known.force
        found[reason] = np.asarray(~(known.motion[ends].all(axis=0) & shown), dtype=np.bool_)
    return occurring(found)


class AcrossDamper(NamedTuple):
    """The motion across a damper.

    `x`, `v`, `a` (n,) of its upper end relative to the lower one [m, m/s, m/s2]; `std` of the
    velocity [m/s]; `error` (d, n, 4) draws of the error of x, v, a and V.
    """

    x: Array
    v: Array
    a: Array
    std: float
    error: Array


def motion_across(response: Response) -> AcrossDamper:
    """Return the motion across a building's damper; see `identification.building_motion`."""
    lower, upper = response.device.levels
    x, v, std = response.x[upper], response.v[upper], float(response.std[upper, 1])
    error = _error(response, upper)
    if lower == GROUND:
        return AcrossDamper(x, v, response.a[upper] - response.ground, std, error)
    a, own = response.a[upper] - response.a[lower], response.across
    if own is not None:
        x, v, std = own.x, own.v, float(own.std[1])
        error[:, :, :3] = own.draws
    else:
        x, v = x - response.x[lower], v - response.v[lower]
        std = float(np.hypot(std, response.std[lower, 1]))
        error[:, :, :3] = response.draws[upper] - response.draws[lower]
    if response.accelerometer[upper] and response.accelerometer[lower]:
        white = float(np.hypot(response.noise_a[upper], response.noise_a[lower]))
        generator = np.random.default_rng(upper + 100)
        error[:, :, 2] = white * generator.standard_normal(error.shape[:2])
    return AcrossDamper(x, v, a, std, error)


def blind_at_rest(law: str) -> bool:
    """Return whether a law tells nothing where it may hold its ends together: it has a sign there.

    Of laws that are to be compared, ANY_LAW, one may.
    """
    return law == ANY_LAW or base_and_variant(law)[0].has("sign")


def _error(response: Response, level: int) -> Array:
    """Return draws (d, n, 4) of the error of x, v, a and V of a level."""
    count, n = response.draws.shape[1:3]
    error = np.zeros((count, n, 4))
    error[:, :, :3] = response.draws[level]
    a, V = response.white[level]
    if a is not None:
        error[:, :, 2] = float(np.hypot(response.noise_a[level], response.noise_ground)) * a
    error[:, :, 3] = response.V_left * V
    return error


def structure_problems(
    train: list[Measurement], holdout: list[Measurement], building: Building, law: str = DEFAULT
) -> dict[str, StructurePair]:
    """Return the problems of a building's runs, each for training and held-out runs.

    Parameters
    ----------
    train, holdout : measurements to fit to, and those that decide
    building : that was measured
    law : name of the damper's law

    Returns
    -------
    dict
        "storey1", "storey2", ...; "layer", where the base is isolated and moves; both where the
        damper acts across them only if its force was measured in every run; "damper", where a
        voltage, a current or the force was measured, or the building's file has its place.

    Raises
    ------
    RecordError
        If a channel is missing, or the building has other levels than were measured, or a law of
        dry friction is asked for and the base moves in no run.
    """
    found = responses([*train, *holdout], building)
    return problems_of(found[: len(train)], found[len(train) :], building, law)


def problems_of(
    train: list[Response], holdout: list[Response], building: Building, law: str = DEFAULT,
    linear_storeys: bool = True,
) -> dict[str, StructurePair]:  # fmt: skip
    """Return the problems of responses; see `structure_problems`.

    Parameters
    ----------
    train, holdout : responses to fit to, and those that decide
    building, law, linear_storeys : see `damper_run`; the law may be ANY_LAW
    """
    both = (train, holdout)
    everything = [*train, *holdout]
    measured = all(r.force is not None for r in everything)
    damped = measured or any(r.damped for r in everything)
    device = everything[0].device
    problems = {}
    for level in range(building.size):
        storey = level if building.isolated else level + 1
        if storey == 0 or (device.crosses(level) and damped and not measured):
            continue
        problems[f"storey{storey}"] = tuple(line_problem(part, building, level) for part in both)
    if building.isolated and (measured or not damped or not device.crosses(0)):
        parts = [_moving([layer_run(_unloaded(r), building) for r in part]) for part in both]
        if all(moving or not part for moving, part in zip(parts, both, strict=True)):
            problems["layer"] = tuple(layer_problem(p, building) for p in parts)
    if damped:
        able = [[r for r in part if device_moves(r)] or part for part in both]  # for every law
        made = [[damper_run(r, building, law, linear_storeys) for r in part] for part in able]
        end = "base" if device.on_first else "damper"
        parts = [_moving(part, needed=end) for part in made]
        beside = device.on_first
        problems["damper"] = tuple(
            StructureProblem(p, 0, not measured, beside=beside) for p in parts
        )
    return problems  # type: ignore[return-value]


def _moving(runs: list[StructureRun], needed: str = "") -> list[StructureRun]:
    """Return the runs with samples that count: what is `needed` moves; a RecordError if in none."""
    able = [run for run in runs if len(run.force)]
    if needed and runs and not able:
        raise RecordError(
            f"{', '.join(run.name for run in runs)}: the {needed} does not move beyond the "
            "noise of its velocity. Add a run with a stronger ground motion."
        )
    return able


def layer_problem(runs: Sequence[Run], building: Building) -> StructureProblem:
    """Return runs of the isolation layer as a problem."""
    return StructureProblem(runs, damped=damping_below(building, 0))


def line_problem(responses: Sequence[Response], building: Building, level: int) -> StructureProblem:
    """Return what a building carries below a level beside its devices, as a problem.

    Parameters
    ----------
    responses : the runs, their motion smoothed
    building : its masses and damping
    level : 0 for the isolation layer of an isolated building, or the level above a storey
    """
    if building.isolated and not level:
        return layer_problem([layer_run(one, building) for one in responses], building)
    runs = [storey_run(one, building, level) for one in responses]
    storey = level if building.isolated else level + 1
    return StructureProblem(runs, storey, damped=damping_below(building, level))


def damping_below(building: Building, level: int) -> float:
    """Return what a building's damping resists a drift rate below a level with [N s/m].

    All levels above move as one then: the storey's own damping, and that of the mass above.
    """
    C = np.array(building.C)
    return max(float(C[level:, level:].sum()), 0.0)


def _unloaded(response: Response) -> Response:
    """Return a response without a damper as one whose damper's force is zero."""
    if response.force is not None:
        return response
    return replace(response, force=np.zeros_like(response.ground))
