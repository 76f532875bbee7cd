"""The verdict on a law and its effects together: every law fitted, those that survive searched."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ..data.channels import DRIVE
from ..data.checks.runs import tells_a_bend
from ..data.measurement import Measurement
from ..errors import RecordError
from ..identification.problem import Model, Problem
from ..identification.rig import DAMPER
from ..physics.building import Building
from .conclusion import About, conclude
from .diagnosis import detailed, look_at_lines
from .inconsistent_runs import contradicted
from .law_choice import LawVerdict, Pair, choose, equivalents, search, simplest
from .law_trials import KeptFits, LawTrial, not_finite, try_laws, weighed_anew
from .prepared import Insufficient, Opening, Progress, bench_data, opened_with, silent
from .rig_runs import BuildingRuns
from .rule import BENCH, DecisionRule
from .site import Trials, look_at_damper, noise_is_all
from .trials import Trial, missed_by
from .verdict import Diagnosis


def diagnose_laws(
    train: Sequence[Measurement],
    holdout: Sequence[Measurement],
    present: Model,
    building: Building | None = None,
    *,
    named: str = "",
    profile: bool = False,
    kept: KeptFits | None = None,
    say: Progress = silent,
    rule: DecisionRule = BENCH,
) -> Diagnosis:
    """Return which law a damper has, and which effects that law misses.

    Parameters
    ----------
    train, holdout : measurements to fit to, and those that decide
    present : the model as it is; laws have those of its effects that can join them
    building : the building that the damper is in, None for a test bench
    named : the present law with its variant, "" where nobody chose one
    profile : whether the model is fitted again at every limit of an effect
    kept : fits of laws that are known already, and where those that are made go
    say : called with a few words at each stage
    rule : the numbers that decide

    Raises
    ------
    RecordError
        If a run lacks a channel that is needed, is too short for a fit, or no run shows a damper.
    """
    if building is not None:
        runs = BuildingRuns(train, holdout, present, building, say, free=True)
        if runs.lacking is None:
            wish = (named, profile)
            return _in_building(runs, tells_a_bend(train), wish, kept, say, rule)
    lacking = None if building is None else runs.lacking
    data = lacking or bench_data(train, holdout, present, say)
    if isinstance(data, Insufficient):
        return Diagnosis("insufficient", (), data.reasons, sensors=data.faults, noise=data.noise)
    say("trying every law")
    bends = tells_a_bend(train)
    rows = try_laws(data.problem, data.held_out, present, bends=bends, kept=kept)
    looks = Looks(lambda trial: opened_with(trial, data), say)
    sought = _sought(rows, looks, (data.problem, data.held_out), say, rule)
    finding = contradicted(sought.chosen.finding, sought.opened)
    finding = detailed(finding, sought.opened, profile=profile)
    driven = any(run.has(name) for run in (*train, *holdout) for name in DRIVE)
    about = About(sensors=sought.opened.faults, noise=data.noise, driven=driven)
    laws = sought.verdict(named, data.problem, present, rule)
    return replace(conclude({DAMPER: finding}, about), laws=laws)


def _in_building(
    runs: BuildingRuns, bends: bool, wish: tuple[str, bool], kept: KeptFits | None, say: Progress,
    rule: DecisionRule,
) -> Diagnosis:  # fmt: skip
    """Return the law of a building's damper and what it misses, beside what other sites miss.

    `wish` is the present law by name, and whether limits are profiled.
    """
    named, profile = wish
    if runs.damper is None:
        raise RecordError(
            "no law of a damper can be sought: the runs have neither its force nor its command."
        )
    present = runs.part(DAMPER)
    findings = look_at_lines(runs, say, profile=profile)
    if runs.damper[0].reconstructed:  # the building's numbers are asked for with a law at hand
        say("trying every law, with the building as its file has it")
        first = try_laws(*runs.damper, present, bends=bends)
        runs.suppose(simplest(first, rule).trial.model)
    runs.correct(findings)

    def searched(kept: KeptFits | None) -> _Sought:
        assert runs.damper is not None
        say("trying every law")
        rows = try_laws(*runs.damper, present, bends=bends, kept=kept)
        sought = _sought(rows, Looks(runs.opened_with, say), runs.damper, say, rule)
        runs.suppose(sought.chosen.row.trial.model)
        return sought

    sought = searched(kept)
    if runs.suited_to(sought.chosen.finding):
        sought = searched(None)  # what was kept was fitted to the force of the file's numbers
    found = sought.chosen.finding
    excused = runs.excused(found, findings)
    settled = excused if excused is not found else contradicted(found, sought.opened)
    findings[DAMPER] = detailed(settled, sought.opened, profile=profile)
    laws = sought.verdict(named, runs.damper[0], present, rule)
    return replace(conclude(findings, runs.about()), laws=laws)


@dataclass(frozen=True)
class _Sought:
    """What the search for law and effects came to: `chosen` of `pairs`, and how all laws do."""

    chosen: Pair
    pairs: tuple[Pair, ...]
    rows: tuple[LawTrial, ...]

    @property
    def opened(self) -> Opening:
        """What the look at the chosen law began with."""
        assert self.chosen.opened is not None
        return self.chosen.opened

    def verdict(
        self, named: str, problem: Problem, present: Model, rule: DecisionRule
    ) -> LawVerdict:
        """Return what a verdict tells of the laws."""
        equal = equivalents(self.chosen, self.pairs, self.rows, rule)
        unfit = tuple(not_finite(problem, present))
        return LawVerdict(self.chosen.row, named, self.rows, self.pairs, tuple(equal), unfit)


def _sought(
    rows: tuple[LawTrial, ...],
    looks: Looks,
    runs: tuple[Problem, Problem],
    say: Progress,
    rule: DecisionRule,
) -> _Sought:
    """Search the effects that laws lack; return the pair that the runs ask for, and the others.

    Where no pair explains the runs, what the nearest one misses counts beside the noise for all.
    """
    pairs = search(rows, looks, rule)
    nearest = min(pairs, key=lambda pair: pair.reach(rule).z)
    assert nearest.opened is not None
    looks.excess = missed_by(nearest.reach(rule), nearest.opened.problem)
    if looks.excess:
        say("what no law explains counts beside the noise")
        train, held_out = (one.with_excess(looks.excess) for one in runs)
        rows = weighed_anew(rows, train, held_out)
        pairs = search(rows, looks, rule)
    chosen = choose(pairs, rule)
    say(f"intervals of {chosen.row.law}")
    return _Sought(chosen, tuple(pairs), rows)


class Looks:
    """What laws lack, on one rig's runs: a second look at a law takes up where the first ended.

    Parameters
    ----------
    opened_with : the trial of a law to what a look at the damper begins with
    say : called with a few words at each stage
    """

    def __init__(self, opened_with: Callable[[Trial], Opening], say: Progress = silent) -> None:
        self.opened_with, self.say = opened_with, say
        self.made: dict[str, Trials] = {}
        self.excess = 0.0  # N2, see `look_at_damper`

    def __call__(self, row: LawTrial, pairs: bool) -> Pair:
        """Return what a law lacks: single effects alone, or pairs as well where none suffices."""
        made = self.made.get(row.law)
        if made is None:
            opened = self.opened_with(row.trial)
            if noise_is_all(opened):
                return Pair(row, *look_at_damper(opened, self.say, pairs=pairs, excess=0.0))
            self.say(f"effects that {row.law} lacks (error / noise {row.trial.z:.2f})")
            made = Trials(opened, self.say)
            self.made[row.law] = made
        elif pairs:
            self.say(f"two effects that {row.law} lacks")
        finding, opened = look_at_damper(
            made.opened, self.say, made, pairs=pairs, excess=self.excess
        )
        return Pair(row, finding, opened)
