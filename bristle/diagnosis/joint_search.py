"""The verdict on a law and its effects together: every law fitted, those that survive searched."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..data.measurement import Measurement
from ..errors import RecordError
from ..identification.problem import Problem
from ..identification.rig import DAMPER
from ..model.model import Model
from ..physics.building import Building
from .by_label import with_labels
from .conclusion import conclude, insufficient
from .diagnosis import diagnose_lines, settled, with_evidence
from .law_choice import LawAndEffects, LawVerdict, choose, equivalents, search, simplest
from .law_trials import KeptFits, LawTrial, fitted_anew, not_finite, try_laws
from .prepared import Prepared, Progress, part_of, silent
from .rig_runs import RigRuns, runs_of_rig
from .rule import BENCH, DecisionRule
from .site import Trials, diagnose_damper, noise_is_all
from .trials import missed_by
from .verdict import Diagnosis


@with_labels
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
    runs = runs_of_rig(train, holdout, present, building, any_law=True, say=say)
    if runs.lacking is not None:
        return insufficient(runs.lacking)
    if runs.damper is None:
        raise RecordError(
            "no law of a damper can be sought: the runs have neither its force nor its command."
        )
    present, bends = runs.part(DAMPER), runs.bends
    findings = diagnose_lines(runs, say, profile=profile)
    if runs.damper[0].reconstructed:  # the building's numbers are asked for with a law at hand
        say("trying every law, with the building as its file has it")
        first = try_laws(*runs.damper, present, bends=bends)
        runs.suppose(simplest(first, rule).trial.model)
    runs.correct(findings)

    def searched(kept: KeptFits | None) -> _Sought:
        assert runs.damper is not None
        whole, held_out = runs.damper
        tried = (part_of(whole) if building is None else None) or whole
        say("trying every law")
        rows = try_laws(tried, held_out, present, bends=bends, kept=kept)
        by_law = TrialsByLaw(runs, say, in_part=tried is not whole)
        sought = _sought(rows, by_law, (tried, held_out), say, rule)
        runs.suppose(sought.chosen.row.trial.model)
        return sought

    sought = searched(kept)
    if runs.suit(sought.chosen.finding):
        sought = searched(None)  # what was kept was fitted to the force of the file's numbers
    prepared = sought.prepared
    found = settled(sought.chosen.finding, prepared, runs, findings)
    say(f"verdict on {sought.chosen.row.law}, {found.briefly}")
    findings[DAMPER] = with_evidence(found, prepared, profile=profile)
    laws = sought.verdict(named, runs.damper[0], present, rule)
    return replace(conclude(findings, runs.context(prepared)), laws=laws)


@dataclass(frozen=True)
class _Sought:
    """What the search for law and effects came to: `chosen` of `pairs`, and how all laws do."""

    chosen: LawAndEffects
    pairs: tuple[LawAndEffects, ...]
    rows: tuple[LawTrial, ...]

    @property
    def prepared(self) -> Prepared:
        """What the diagnosis with the chosen law began with."""
        assert self.chosen.prepared is not None
        return self.chosen.prepared

    def verdict(
        self, named: str, problem: Problem, present: Model, rule: DecisionRule
    ) -> LawVerdict:
        """Return what a verdict tells of the laws."""
        equal = equivalents(self.chosen, self.pairs, self.rows, rule)
        unfit = tuple(not_finite(problem, present))
        return LawVerdict(self.chosen.row, named, self.rows, self.pairs, tuple(equal), unfit)


def _sought(
    rows: tuple[LawTrial, ...],
    by_law: TrialsByLaw,
    runs: tuple[Problem, Problem],
    say: Progress,
    rule: DecisionRule,
) -> _Sought:
    """Search the effects that laws lack; return the pair that the runs ask for, and the others.

    Where no pair explains the runs, what the nearest one misses counts beside the noise for all.
    """
    pairs = search(rows, by_law, rule)
    nearest = min(pairs, key=lambda pair: pair.reach(rule).z)
    assert nearest.prepared is not None
    by_law.excess = missed_by(nearest.reach(rule), nearest.prepared.problem)
    if by_law.excess:
        say("what no law explains counts beside the noise")
        train, held_out = (one.with_excess(by_law.excess) for one in runs)
        rows = fitted_anew(rows, train, held_out)
        pairs = search(rows, by_law, rule)
    chosen = choose(pairs, rule)
    of_all = {row.law: row for row in (*rows, *(pair.row for pair in pairs))}
    ranked = sorted(of_all.values(), key=lambda row: row.trial.z)
    return _Sought(chosen, tuple(pairs), tuple(ranked))


class TrialsByLaw:
    """What laws lack, on one rig's runs: a second search for a law goes on where the first ended.

    Parameters
    ----------
    runs : of the rig
    say : called with a few words at each stage
    in_part : whether laws were tried on a part of the runs: one that is searched is fitted to all
    """

    def __init__(self, runs: RigRuns, say: Progress = silent, *, in_part: bool = False) -> None:
        self.runs, self.say, self.in_part = runs, say, in_part
        self.made: dict[str, Trials] = {}
        self.excess = 0.0  # N2, see `diagnose_damper`

    def __call__(self, row: LawTrial, pairs: bool) -> LawAndEffects:
        """Return what a law lacks: single effects alone, or pairs as well where none suffices."""
        made = self.made.get(row.law)
        if made is None:
            if self.in_part and self.runs.damper:
                self.say(f"fitting {row.law} to all runs")
                (row,) = fitted_anew([row], *self.runs.damper)
            prepared = self.runs.prepare(DAMPER, row.trial)
            assert prepared is not None
            if noise_is_all(prepared):
                return LawAndEffects(
                    row, *diagnose_damper(prepared, self.say, pairs=pairs, excess=0.0)
                )
            self.say(f"effects that {row.law} lacks (error / noise {row.trial.z:.2f})")
            made = Trials(prepared, self.say)
            self.made[row.law] = made
        elif pairs:
            self.say(f"two effects that {row.law} lacks")
        finding, prepared = diagnose_damper(
            made.prepared, self.say, made, pairs=pairs, excess=self.excess
        )
        return LawAndEffects(row, finding, prepared)
