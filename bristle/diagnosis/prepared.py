"""What the diagnosis of a site begins with: its runs, freed of sensors' faults, and its model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from operator import is_
from pathlib import Path

import numpy as np

from ..core.finding import Finding
from ..core.text import percent, plain
from ..data.corrections import LIMITS, TIMING, Correction, set_right
from ..data.cut_off import beyond_range, ends_of
from ..data.decimate import in_time
from ..data.left_out import WAYS_OUT
from ..data.measurement import Measurement
from ..errors import StudyError
from ..identification.fit import refine
from ..identification.prepare import SHORTEST
from ..identification.problem import Problem, Run, zero_of
from ..identification.rig import Seeds
from ..model.model import Model
from ..physics.effect import effects_of
from .decision import TOLD, in_runs
from .effect_size import SizeSearch
from .rule import BENCH, DecisionRule
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

MANY = 60_000
"""Samples of the training runs from which on effects are searched on a part of them; moments at
which a model is evaluated there from which on it is at `COARSE` per sample."""

COARSE = 2
"""Moments per sample of decimated runs that suffice for a search: a law's force is then off by
about a thousandth of its RMS."""

ENOUGH, FEWEST = 30_000, 8
"""Samples, about, of that part, for a search takes as long as they are; its runs at the least."""

LASTS = 150.0
"""Seconds, about, of that part at the most: where samples are far apart a model with a joint takes
many steps from one to the next."""


@dataclass(frozen=True)
class Insufficient:
    """Why data carry no verdict, in sentences, with the faults of the sensors and the noise."""

    reasons: tuple[str, ...]
    faults: tuple[Finding, ...]
    noise: Mapping[str, float]


def refuse_lacking(folder: Path, lacking: Insufficient | None) -> None:
    """Raise StudyError where a study's runs carry no verdict, and nothing that rests on one."""
    if lacking is not None:
        raise StudyError(f"{folder}: {' '.join(lacking.reasons)}")


@dataclass(frozen=True)
class Prepared:
    """What the diagnosis of a site begins with: runs freed of sensors' faults, and its model.

    `before` is the present model, fitted to `problem` and judged on `held_out`; `shown` the
    channels whose instruments may still have an effect; `part` the part of the training runs that
    effects are searched on, None for all; `rule` the numbers that decide there. On a `bench` the
    motion can be chosen and runs are short: effects are ranked even where noise is all that is
    left, fits begin anew before runs are called contradictory, intervals are those of a refit, a
    run can be proposed, and every law is held against the samples.
    """

    before: Trial
    problem: Problem
    held_out: Problem
    faults: tuple[Finding, ...] = ()
    noise: Mapping[str, float] = field(default_factory=dict)
    shown: tuple[str, ...] = ()
    part: Problem | None = None
    rule: DecisionRule = BENCH
    bench: bool = True

    @property
    def searched(self) -> Problem:
        """The training runs, or the part of them, that effects are searched on."""
        return self.part or self.problem

    def with_excess(self, excess: float) -> Prepared:
        """Return the same runs with what no model explains counted beside the noise [N2]."""
        problem, held_out = (one.with_excess(excess) for one in (self.problem, self.held_out))
        part = None if self.part is None else self.part.with_excess(excess)
        return replace(self, problem=problem, held_out=held_out, part=part)

    @cached_property
    def freed(self) -> Prepared:
        """The same runs with the zero of the force fitted along with every model."""
        zero = zero_of(self.problem, self.before.model)[0]
        train, held_out = self.problem.with_free_zero(zero), self.held_out.with_free_zero(zero)
        before = judge(refine(self.before.model, train), train, held_out)
        part = self.part
        if part is not None:
            part = train if part is self.problem else part.with_free_zero(zero)
        return replace(self, before=before, problem=train, held_out=held_out, part=part)

    def known(self, model: Model) -> SizeSearch:
        """Return what sizes of effects beside a fitted model are found with."""
        deciding = sum(len(run.force) - run.skip for run in self.held_out.runs)
        expected = self.searched.expectation(model)
        return SizeSearch(self.searched, model, expected, deciding, self.rule, self.held_out)


def part_of(problem: Problem) -> Problem | None:
    """Return the part of the training runs that effects are searched on, None for all.

    Of many samples a part says nearly as much of which effect it is. It has the begins of runs, so
    that what builds up in them is there, spread evenly over levels of the command and speeds. Of
    decimated runs models are evaluated at fewer moments. The best effects are fitted to all runs.
    """
    runs = problem.runs
    if sum(len(run.smoothed.x) for run in runs) > MANY:
        runs = [run.coarser(COARSE) for run in runs]
    if sum(len(run.force) for run in runs) <= MANY:
        return None if all(map(is_, runs, problem.runs)) else problem.of(runs)

    def place(run: Run) -> tuple[float, float]:
        level = float(np.mean(np.abs(run.V))) / problem.size("V")
        return round(level, 1), float(np.std(run.v))

    ordered = sorted(runs, key=place)
    samples = sum(len(run.force) for run in runs)
    seconds = sum(len(run.force) * run.dt for run in runs)
    whole = int(len(runs) * min(ENOUGH / samples, LASTS / seconds))
    count = min(max(FEWEST, whole), len(runs))
    chosen = np.linspace(0, len(runs) - 1, count).round().astype(int)
    begins = [ordered[k].first(LASTS / count) for k in chosen]
    return problem.of([run.of(slice(ENOUGH // count)) for run in begins])


def of_layer(model: Model, problem: Problem) -> list[str]:
    """Return the layer's effects that can join a damper's model: a reconstructed force has them."""
    if not problem.joined_with_layer:
        return []
    able = [e.key("structure") for e in effects_of("structure") if "force" in e.hooks()]
    return [name for name in able if name not in model.effects]


def with_samples(runs: Sequence[Measurement]) -> list[Measurement]:
    """Return the runs without those of which a fault has left too few samples."""
    return [
        run
        for run in runs
        if len(run.time) < SHORTEST or np.count_nonzero(run.valid(*run.channels)) >= SHORTEST
    ]


def too_few(role: str, runs: Sequence[Measurement]) -> str:
    """Return the sentence that no run of a role has samples enough: where, why, what to do."""
    texts, ways = [], dict[str, None]()
    for run in runs:
        worst = min(run.channels, key=lambda name: np.count_nonzero(run.valid(name)))
        here = [worst] if np.count_nonzero(run.valid(worst)) < SHORTEST else list(run.channels)
        counts = {why: int(flags.sum()) for why, flags in run.left_out(*here).items()}
        left = np.count_nonzero(run.valid(*here))
        why = ", ".join(f"{count:,} {why}" for why, count in counts.items())
        texts.append(
            f"{run.name}: of {', '.join(here)} {left:,} of {len(run.time):,} samples can be used "
            f"({why})"
        )
        ways |= dict.fromkeys(WAYS_OUT[why] for why in counts)
    more = [f"and {len(texts) - TOLD} more runs"] if len(texts) > TOLD else []
    where = "; ".join([*texts[:TOLD], *more])
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
        if force and not with_samples(force):
            reasons.append(too_few(role, force))
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


def lacking_on_bench(runs: Sequence[Measurement], faults: Sequence[Finding]) -> list[str]:
    """Return what keeps the runs of a bench from carrying a verdict, in sentences."""
    out = []
    force = np.concatenate([run["force"] for run in runs if run.has("force")] or [np.zeros(1)])
    spread = float(np.std(force))
    noise = float(np.median([run.noise.get("force", 0.0) for run in runs]))
    where = _where(runs)
    if spread <= 0.0:
        out.append(
            f"The force is constant ({plain(float(force[0]))} N) {where}: there is nothing to "
            "explain. Look at its column and unit (bristle study channels), or measure it."
        )
    elif spread < BENCH.quietest * noise:
        out.append(
            f"The force's noise, {plain(noise)} N, is nearly the force itself, {plain(spread)} N "
            f"RMS, {where}: the force must be at least {BENCH.quietest:g} times its noise. Measure "
            "with larger motions or a quieter load cell, or give the noise in study.toml if it is "
            "less."
        )
    for channel in ("displacement", "velocity"):
        able = [run[channel] for run in runs if run.has(channel)]
        if able and float(np.ptp(np.concatenate(able))) == 0.0:
            out.append(
                f"The {channel} does not change {where}: without motion no damper shows anything. "
                "Look at its column (bristle study channels), or measure with motion."
            )
    out += [
        f"{fault.text} That is so {where}. Look at the two columns (bristle study channels), "
        "or leave one of them out."
        for fault in faults
        if fault.kind == "unrelated"
    ]
    return [*out, *_saturated(runs, faults)]


def _saturated(runs: Sequence[Measurement], faults: Sequence[Finding]) -> list[str]:
    """Return that the force is too often at the ends of its range, in a sentence."""
    cut = [fault for fault in faults if fault.channel == "force" and fault.kind == "clipping"]
    there = [run for run in runs if run.has("force")]
    total = sum(len(run.time) for run in there)
    if not cut:
        return []
    # Of each run at its own ends: ranges may differ between runs.
    at_ends = [np.isin(run["force"], ends_of(run, "force")) for run in there]
    count = sum(int(np.count_nonzero(one)) for one in at_ends)
    if count <= BENCH.cut * total:
        return []
    return [
        f"The force is saturated in {count:,} of {total:,} samples ({percent(count / total, 0)}) "
        f"{_where(runs, cut[0].runs)}; {percent(BENCH.cut, 0)} is the most. Measure "
        "with a wider range, or leave these runs out."
    ]
