"""From measurements to trials at the damper: sensors' faults, the present model, every effect."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..core.finding import Finding
from ..core.text import plain
from ..data.corrections import LIMITS, TIMING, Correction, set_right
from ..data.cut_off import beyond_range, derived_velocity, ends_of
from ..data.decimate import in_time
from ..data.left_out import WAYS_OUT
from ..data.measurement import Measurement
from ..identification.building_sites import StructureProblem
from ..identification.fit import fit_from_starts
from ..identification.prepare import SHORTEST
from ..identification.problem import Model, Problem, Run
from ..identification.rig import DAMPER, Seeds, bench_rig
from ..identification.start_grid import refine
from ..physics.effect import effects_of
from .clocks import clock_faults
from .command_range import limited_drive
from .decision import TOLD, in_runs
from .effect_size import Known
from .model_faults import model_based_fault
from .rule import BENCH, DecisionRule
from .sensor_faults import sensor_faults
from .trials import Trial, judge

# Measurements as they would be without the faults of their sensors.

ORDER = {"bias": 1, "sign": 2, "gain": 3}
"""In which order faults are taken back: an offset is on what the instrument shows."""


def corrected(runs: Sequence[Measurement], faults: Sequence[Finding]) -> list[Measurement]:
    """Return the measurements as they would be without the faults, so that physics can be judged.

    Displacement is the reference of velocity. Clipped samples of a channel are lost, those of the
    others are not.
    """
    return [_corrected(run, faults) for run in runs]


def _corrected(run: Measurement, faults: Sequence[Finding]) -> Measurement:
    channels, cut, noise = dict(run.channels), dict(run.saturated), dict(run.noise)
    timing: list[Correction] = []
    for fault in sorted(faults, key=lambda one: ORDER.get(one.kind, 0)):
        if fault.channel not in channels or fault.run not in ("", run.name):
            continue
        values = channels[fault.channel]
        if fault.kind in TIMING:
            timing.append(Correction(fault.channel, fault.kind, fault.value))
        elif fault.kind == "sign":
            channels[fault.channel] = -values
        elif fault.kind == "gain":
            channels[fault.channel] = values / fault.value
            noise[fault.channel] = noise.get(fault.channel, 0.0) / abs(fault.value)
        elif fault.kind == "bias":
            channels[fault.channel] = values - fault.value
        elif fault.kind in LIMITS:
            limit = [Correction(fault.channel, fault.kind, fault.value)]
            channels |= set_right({fault.channel: values}, run.step, limit)
        elif fault.kind in ("lag", "high-pass", "derived"):
            del channels[fault.channel]  # displacement says the same, without it
        elif fault.kind == "clipping":
            cut[fault.channel] = beyond_range(values, noise.get(fault.channel, 0.0), fault.value)
    known = {name: replace(run, saturated=cut).valid(name) for name in channels}
    moved = in_time(channels, known, run.step, timing)
    for name in moved.between:
        noise[name] = noise.get(name, 0.0) * moved.noise_left(name)
    return replace(
        run, channels=moved.channels, lost={**run.lost, **moved.lost}, saturated=cut, noise=noise
    )


DRAWS = Seeds(train=0, holdout=1000, apart=1)
"""Draws of the motion's error of a diagnosis's own: what a fit was drawn from does not judge it."""

MANY = 150_000
"""Samples of the training runs from which on effects are searched on a part of them."""

ENOUGH, FEWEST = 75_000, 8
"""Samples, about, of that part, for a search takes as long as they are; and its runs."""

Progress = Callable[[str], None]


def silent(_text: str) -> None:
    """Say nothing."""


@dataclass(frozen=True)
class Insufficient:
    """Why data carry no verdict, in sentences, with the faults of the sensors and the noise."""

    reasons: tuple[str, ...]
    faults: tuple[Finding, ...]
    noise: Mapping[str, float]


@dataclass(frozen=True)
class Scope:
    """What a rig allows at each of its sites: a bench has one site, a building many and long runs.

    `rank_all`: effects are tried, and ranked, even where noise is all that the model leaves.
    `restart`: fits begin anew from several starts before runs are called contradictory, and
    intervals are those of a refit of so many sweeps, `sweeps`; 0 takes the fit as it is.
    `choose_motion`: the motion can be chosen, so that a run can be proposed.
    """

    rank_all: bool
    restart: bool
    sweeps: int
    choose_motion: bool


ON_BENCH = Scope(rank_all=True, restart=True, sweeps=4, choose_motion=True)
IN_BUILDING = Scope(rank_all=False, restart=False, sweeps=0, choose_motion=False)


@dataclass(frozen=True)
class Opening:
    """What the look at a site begins with: runs freed of sensors' faults, and its model.

    `before` is the present model, fitted to `problem` and judged on `held_out`; `shown` the
    channels whose instruments may still have an effect; `part` the part of the training runs that
    effects are searched on, None for all; `rule` the numbers that decide there.
    """

    before: Trial
    problem: Problem
    held_out: Problem
    faults: tuple[Finding, ...] = ()
    noise: Mapping[str, float] = field(default_factory=dict)
    shown: tuple[str, ...] = ()
    part: Problem | None = None
    rule: DecisionRule = BENCH
    scope: Scope = ON_BENCH

    @property
    def searched(self) -> Problem:
        """The training runs, or the part of them, that effects are searched on."""
        return self.part or self.problem

    def with_excess(self, excess: float) -> Opening:
        """Return the same runs with what no model explains counted beside the noise [N2]."""
        problem, held_out = (one.with_excess(excess) for one in (self.problem, self.held_out))
        part = None if self.part is None else self.part.with_excess(excess)
        return replace(self, problem=problem, held_out=held_out, part=part)

    def known(self, model: Model) -> Known:
        """Return what sizes of effects beside a fitted model are found with."""
        deciding = sum(len(run.force) - run.skip for run in self.held_out.runs)
        expected = self.searched.expectation(model)
        return Known(self.searched, model, expected, deciding, self.rule, self.held_out)


@dataclass(frozen=True)
class BenchData:
    """A bench's runs, freed of the faults that channels show of each other, and smoothed.

    `noise` is that of each channel, in SI; `shown` the channels whose instruments may still have an
    effect.
    """

    problem: Problem
    held_out: Problem
    faults: tuple[Finding, ...]
    noise: Mapping[str, float]
    shown: tuple[str, ...]


def bench_data(
    train: Sequence[Measurement],
    holdout: Sequence[Measurement],
    present: Model,
    say: Progress = silent,
) -> BenchData | Insufficient:
    """Return a bench's runs as every model is held against them, or why they carry no verdict.

    Parameters
    ----------
    train, holdout : runs to fit to, and those that decide
    present : the model as it is, whose effects must act on a bench
    say : is told what is being done
    """
    say("looking for sensor faults")
    faults = sensor_faults([*train, *holdout])
    lacking = _lacking([*train, *holdout], faults)
    noise = median_noise([*train, *holdout])
    if lacking:
        return Insufficient(tuple(lacking), tuple(faults), noise)
    say("smoothing the motion")
    whole = [corrected(runs, faults) for runs in (train, holdout)]
    left = [_left(runs) for runs in whole]
    if not all(left):
        empty = zip(("for training", "held out"), whole, left, strict=True)
        reasons = [_too_few(role, runs) for role, runs, kept in empty if not kept]
        return Insufficient((*reasons, *(fault.text for fault in faults)), tuple(faults), noise)
    problem, held_out = bench_rig(left[0], left[1], DRAWS).sites(present)[DAMPER].pair
    redundant = any(
        run.has("displacement", "velocity") and not derived_velocity(run) for run in train
    )
    channels = ("force",) if redundant else ("force", "velocity")
    return BenchData(problem, held_out, tuple(faults), noise, channels)


def opening(
    train: Sequence[Measurement],
    holdout: Sequence[Measurement],
    present: Model,
    *,
    identified: bool = False,
    say: Progress = silent,
) -> Opening | Insufficient:
    """Return what a diagnosis begins with, or why the data carry no verdict.

    Parameters
    ----------
    train, holdout : runs to fit to, and those that decide
    present : the model as it is
    identified : whether its values were fitted before: they are then refined, not sought anew
    say : is told what is being done
    """
    data = bench_data(train, holdout, present, say)
    if isinstance(data, Insufficient):
        return data
    say("fitting the present model")
    problem = data.problem
    if identified:
        base = refine(present, problem)
    else:
        base = fit_from_starts(problem, replace(present, values={})).model
    return opened_with(judge(base, problem, data.held_out), data)


def opened_with(before: Trial, data: BenchData) -> Opening:
    """Return what a diagnosis begins with: the runs freed of what a model shows of channels.

    Parameters
    ----------
    before : the trial of a model that was fitted to these runs
    data : the runs
    """
    problem, held_out, faults = data.problem, data.held_out, list(data.faults)
    shown = model_based_fault(before, problem, held_out, problem.runs[0].drive)
    if shown is not None:
        faults.append(shown.fault)
        problem, held_out, before = shown.train, shown.held_out, shown.trial
        if shown.fault.kind == "bias":  # found without the effects that are tried next
            problem, held_out = problem.with_free_zero(), held_out.with_free_zero()
            before = judge(before.model, problem, held_out)
    else:
        capped = limited_drive(before, problem, held_out, problem.runs[0].drive)
        if capped is not None:
            faults.append(capped.fault)
            problem, held_out, before = capped.train, capped.held_out, capped.trial
        apart = clock_faults(before, problem, held_out)
        if apart is not None:
            faults += apart.faults
            problem, held_out, before = apart.train, apart.held_out, apart.trial
    shown_by = (tuple(faults), data.noise, data.shown)
    return Opening(before, problem, held_out, *shown_by, part_of(problem))


def part_of(problem: Problem) -> Problem | None:
    """Return the part of the training runs that effects are searched on, None for all.

    Of many samples a part says nearly as much of which effect it is. It has the begins of runs, so
    that what builds up in them is there, spread evenly over levels of the command and speeds. The
    best effects are fitted to all runs.
    """
    runs = problem.runs
    if sum(len(run.force) for run in runs) <= MANY:
        return None

    def place(run: Run) -> tuple[float, float]:
        level = float(np.mean(np.abs(run.V))) / problem.size("V")
        return round(level, 1), float(np.std(run.v))

    ordered = sorted(runs, key=place)
    chosen = np.linspace(0, len(runs) - 1, min(FEWEST, len(runs))).round().astype(int)
    return problem.of([ordered[k].of(slice(ENOUGH // len(chosen))) for k in chosen])


def of_layer(model: Model, problem: Problem) -> list[str]:
    """Return the layer's effects that can join a damper's model: a reconstructed force has them."""
    if not (isinstance(problem, StructureProblem) and problem.joined_with_layer):
        return []
    able = [e.key("structure") for e in effects_of("structure") if "force" in e.hooks()]
    return [name for name in able if name not in model.effects]


def _left(runs: Sequence[Measurement]) -> list[Measurement]:
    """Return the runs without those of which a fault has left too few samples."""
    return [
        run
        for run in runs
        if len(run.time) < SHORTEST or np.count_nonzero(run.valid(*run.channels)) >= SHORTEST
    ]


def _too_few(role: str, runs: Sequence[Measurement]) -> str:
    """Return the sentence that no run of a role has samples enough: where, why, what to do."""
    told, ways = [], dict[str, None]()
    for run in runs:
        worst = min(run.channels, key=lambda name: np.count_nonzero(run.valid(name)))
        here = [worst] if np.count_nonzero(run.valid(worst)) < SHORTEST else list(run.channels)
        counts = {why: int(flags.sum()) for why, flags in run.left_out(*here).items()}
        left = np.count_nonzero(run.valid(*here))
        why = ", ".join(f"{count:,} {why}" for why, count in counts.items())
        told.append(
            f"{run.name}: of {', '.join(here)} {left:,} of {len(run.time):,} samples can be used "
            f"({why})"
        )
        ways |= dict.fromkeys(WAYS_OUT[why] for why in counts)
    more = [f"and {len(told) - TOLD} more runs"] if len(told) > TOLD else []
    where = "; ".join([*told[:TOLD], *more])
    return (
        f"No run {role} has the {SHORTEST} samples that a fit needs. {where}. To change it: "
        f"{'; '.join(ways)}."
    )


def lacking_in_building(
    recorded: Sequence[Measurement],
    right: Sequence[Sequence[Measurement]],
    faults: tuple[Finding, ...],
    noise: Mapping[str, float],
) -> Insufficient | None:
    """Return why a building's runs carry no verdict: too little of the damper's force is left.

    Parameters
    ----------
    recorded : all runs, as they were measured
    right : those for training and those held out, freed of faults
    faults, noise : what was found of the channels
    """
    reasons = _saturated(recorded, faults)
    for role, runs in zip(("for training", "held out"), right, strict=True):
        force = [replace(r, channels={"force": r["force"]}) for r in runs if r.has("force")]
        if force and not _left(force):
            reasons.append(_too_few(role, force))
    return (
        Insufficient((*reasons, *(fault.text for fault in faults)), faults, noise)
        if reasons
        else None
    )


def _where(runs: Sequence[Measurement], names: Sequence[str] = ()) -> str:
    """Return which runs something is in, by name or all, and how many samples they have."""
    own = [run for run in runs if run.name in names] or list(runs)
    return in_runs([run.name for run in own], sum(len(run.time) for run in own))


def median_noise(runs: Sequence[Measurement]) -> dict[str, float]:
    """Return the median noise of each channel over the runs, in SI."""
    names = dict.fromkeys(name for run in runs for name in run.noise)
    return {
        name: float(np.median([run.noise[name] for run in runs if name in run.noise]))
        for name in names
    }


def _lacking(
    runs: Sequence[Measurement], faults: Sequence[Finding], rule: DecisionRule = BENCH
) -> list[str]:
    """Return what keeps these data from carrying a verdict, in sentences."""
    out = []
    force = np.concatenate([run["force"] for run in runs if run.has("force")] or [np.zeros(1)])
    spread = float(np.std(force))
    noise = float(np.median([run.noise.get("force", 0.0) for run in runs]))
    where = _where(runs)
    if spread <= 0.0:
        out.append(
            f"The force is constant ({plain(float(force[0]))} N) {where}: there is nothing to "
            "explain. Look at its column and unit:  bristle study channels ; or measure it."
        )
    elif spread < rule.quietest * noise:
        out.append(
            f"The force's noise, {plain(noise)} N, is nearly the force itself, {plain(spread)} N "
            f"RMS, {where}: the force must be at least {rule.quietest:g} times its noise. Measure "
            "with larger motions or a quieter load cell, or give the noise in study.toml if it is "
            "less."
        )
    for channel in ("displacement", "velocity"):
        able = [run[channel] for run in runs if run.has(channel)]
        if able and float(np.ptp(np.concatenate(able))) == 0.0:
            out.append(
                f"The {channel} does not change {where}: without motion no damper shows anything. "
                "Look at its column:  bristle study channels ; or measure with motion."
            )
    out += [
        f"{fault.text} That is so {where}. Look at the two columns:  bristle study channels ; or "
        "leave one of them out."
        for fault in faults
        if fault.kind == "unrelated"
    ]
    return [*out, *_saturated(runs, faults, rule)]


def _saturated(
    runs: Sequence[Measurement], faults: Sequence[Finding], rule: DecisionRule = BENCH
) -> list[str]:
    """Return that the force is too often at the ends of its range, in a sentence."""
    cut = [fault for fault in faults if fault.channel == "force" and fault.kind == "clipping"]
    there = [run for run in runs if run.has("force")]
    total = sum(len(run.time) for run in there)
    if not cut:
        return []
    # Of each run at its own ends: ranges may differ between runs.
    at_ends = [np.isin(run["force"], ends_of(run, "force")) for run in there]
    count = sum(int(np.count_nonzero(one)) for one in at_ends)
    if count <= rule.cut * total:
        return []
    return [
        f"The force is saturated in {count:,} of {total:,} samples ({count / total:.0%}) "
        f"{_where(runs, cut[0].runs)}; {rule.cut:.0%} is the most. Measure with a wider range, or "
        "leave these runs out."
    ]
