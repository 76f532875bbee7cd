"""The verdict on a law and its effects together: every law fitted, those that survive searched."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf

from ..data.measurement import Measurement
from ..data.run_labels import labels_of
from ..errors import RecordError
from ..identification.histories import Effort, counted
from ..identification.rig import DAMPER
from ..identification.start_grid import is_rough
from ..model.model import Model
from ..physics.building import Building
from .by_label import confirmed, with_labels
from .conclusion import conclude, insufficient
from .diagnosis import diagnose_lines, settled, with_evidence
from .law_choice import (
    LawAndEffects,
    LawVerdict,
    choose,
    equivalents,
    search,
    simplest,
    survivors,
)
from .law_trials import KeptFits, LawTrial, fitted_anew, not_finite, try_laws
from .prepared import Prepared, Progress, silent
from .rig_runs import RigRuns, runs_of_rig
from .site import Trials, diagnose_damper, noise_is_all, with_zero_free
from .trials import Trial, missed_by, promised
from .verdict import Diagnosis


@with_labels
def diagnose_laws(
    train: Sequence[Measurement],
    holdout: Sequence[Measurement],
    present: Model,
    building: Building | None = None,
    *,
    named: str = "",
    kept: KeptFits | None = None,
    say: Progress = silent,
) -> Diagnosis:
    """Return which law a damper has, and which effects that law misses.

    Parameters
    ----------
    train, holdout : measurements to fit to, and those that decide
    present : the model as it is; laws have those of its effects that can join them
    building : the building that the damper is in, None for a test bench
    named : the present law with its variant, "" where nobody chose one
    kept : fits of laws that are known already, and where those that are made go
    say : called with a few words at each stage

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
    findings = diagnose_lines(runs, say)
    if runs.damper[0].reconstructed:  # the building's numbers are asked for with a law at hand
        say("trying every law, with the building as its file has it")
        first = try_laws(*runs.damper, present, bends=bends)
        runs.suppose(simplest(first).trial.model)
    runs.correct(findings)

    def searched(kept: KeptFits | None) -> _Sought:
        there = runs.in_part()
        assert there.damper is not None
        say("trying every law")
        rows = try_laws(*there.damper, present, bends=bends, kept=kept)
        if kept:
            kept.stands(rows[0].law, rows[0].trial.effects, rows[0].trial.z)
        sought = _sought(rows, TrialsByLaw(there, say, kept), runs, say)
        runs.suppose(sought.chosen.row.trial.model)
        return sought

    sought = searched(kept)
    if runs.suit(sought.chosen.finding):
        sought = searched(None)  # what was kept was fitted to the force of the file's numbers
    prepared = sought.prepared
    say("whether runs contradict each other")
    found = settled(sought.chosen.finding, prepared, runs, findings)
    say(f"verdict on {sought.chosen.row.law}, {found.briefly}")
    findings[DAMPER] = with_evidence(found, prepared)
    laws = sought.verdict(named, present)
    return replace(conclude(findings, runs.context(prepared)), laws=laws)


@dataclass(frozen=True)
class _Sought:
    """What the search for law and effects came to: `chosen` of `pairs`, and how all laws do."""

    chosen: LawAndEffects
    pairs: tuple[LawAndEffects, ...]
    rows: tuple[LawTrial, ...]
    by_law: TrialsByLaw
    equivalents: tuple[tuple[str, tuple[str, ...], float], ...]

    @property
    def prepared(self) -> Prepared:
        """What the diagnosis with the chosen law began with."""
        assert self.chosen.prepared is not None
        return self.chosen.prepared

    def verdict(self, named: str, present: Model) -> LawVerdict:
        """Return what a verdict tells of the laws."""
        assert self.by_law.runs.damper is not None
        unfit = tuple(not_finite(self.by_law.runs.damper[0], present))
        return LawVerdict(
            self.chosen.row, named, self.rows, self.pairs, self.equivalents, unfit,
            self.by_law.not_tried,
        )  # fmt: skip


def _sought(
    rows: tuple[LawTrial, ...], by_law: TrialsByLaw, runs: RigRuns, say: Progress
) -> _Sought:
    """Search the effects that laws lack; return the pair that the runs ask for, and the others.

    Where no pair explains the runs, what the nearest one misses counts beside the noise for all.
    The one that is chosen is looked at in full, on all runs: where it explains them no more, or
    another one then comes nearer, the next one is.
    """
    with counted(MOST_SPENT) as by_law.effort:
        pairs = search(rows, by_law, by_law.enough, by_law.promise)
        nearest = min(pairs, key=lambda pair: pair.reach().z)
        assert nearest.prepared is not None
        assert by_law.runs.damper is not None
        by_law.excess = missed_by(nearest.reach(), nearest.prepared.problem)
        if by_law.excess:
            say("what no law explains counts beside the noise: fitting the laws anew")
            train, held_out = (one.with_excess(by_law.excess) for one in by_law.runs.damper)
            rows = fitted_anew(rows, train, held_out)
            pairs = search(by_law.left_of(rows, pairs), by_law, by_law.enough)
    whole: dict[str, LawAndEffects] = {}
    while (found := choose(pairs)).row.law not in whole:
        chosen = by_law.settled(found, runs)
        assert chosen.prepared is not None
        chosen = replace(chosen, finding=confirmed(chosen.finding, chosen.prepared))
        whole[found.row.law] = chosen
        pairs = [chosen if pair is found else pair for pair in pairs]
        if chosen.explains:
            break
    else:
        chosen = found
    of_all = {row.law: row for row in (*rows, *(pair.row for pair in pairs))}
    ranked = tuple(sorted(of_all.values(), key=lambda row: row.trial.z))
    equal = tuple(equivalents(chosen, pairs, ranked))
    return _Sought(chosen, tuple(pairs), ranked, by_law, equal)


MOST_SPENT = 250e6
"""Steps of dampers' forces, those of the laws alone not counted, from which on no further law is
searched for its effects, and none for two: half a minute to a minute."""


FAR = 1.4
"""Multiple of the smallest z that a law reached from which on it is not looked at again then."""


class TrialsByLaw:
    """What laws lack, on one rig's runs: a second search for a law goes on where the first ended.

    Parameters
    ----------
    runs : of the rig
    say : called with a few words at each stage
    kept : where trials are kept, and told what comes nearest
    """

    def __init__(self, runs: RigRuns, say: Progress = silent, kept: KeptFits | None = None) -> None:
        self.runs, self.say, self.kept = runs, say, kept
        self._nearest: Trial | None = None
        self.made: dict[str, Trials] = {}
        self.excess = 0.0  # N2, see `diagnose_damper`
        self.effort = Effort()
        self.not_tried: dict[str, bool] = {}
        self._two: set[str] = set()
        self._shortened: set[str] = set()

    def left_of(
        self, rows: Sequence[LawTrial], pairs: Sequence[LawAndEffects]
    ) -> Sequence[LawTrial]:
        """Return the laws for a second search: where enough was spent, those that came near."""
        if not self.effort.spent:
            return rows
        more = [row.law for row in survivors(rows) if row.law not in self.made]
        self.not_tried |= dict.fromkeys(more, False)
        for made in self.made.values():
            made.closed = True
        reached = {pair.row.law: pair.reach().z for pair in pairs}
        near = FAR * min(reached.values())
        return [row for row in rows if reached.get(row.law, inf) <= near]

    def enough(self, row: LawTrial, pairs: bool) -> bool:
        """Return whether so much was spent that this is not tried of a law; see `search`."""
        if not self.effort.spent or row.law in (self._two if pairs else self.made):
            return False
        self.not_tried[row.law] = row.law in self.made
        return True

    def promise(self, pair: LawAndEffects) -> float:
        """Return the z that two effects may leave of a law; one where it takes long to tell."""
        made, first = self.made.get(pair.row.law), pair.reach()
        if made is None or first is pair.row.trial or is_rough(first.model):
            return first.z
        return promised(first, made.prepared.searched, made.prepared.shown)

    def __call__(self, row: LawTrial, pairs: bool) -> LawAndEffects:
        """Return what a law lacks: single effects alone, or pairs as well where none suffices."""
        made = self.made.get(row.law)
        if made is None or not made.closed:
            self.not_tried.pop(row.law, None)
            self._two |= {row.law} if pairs else set()
        if made is None:
            prepared = self.runs.prepare(DAMPER, row.trial)
            assert prepared is not None
            if noise_is_all(prepared):
                return LawAndEffects(
                    row, *diagnose_damper(prepared, self.say, pairs=pairs, excess=0.0)
                )
            self.say(f"effects that {row.law} lacks (error / noise {row.trial.z:.2f})")
            free = with_zero_free(prepared)
            if free is not prepared:
                self._shortened.add(row.law)
            ends = self.kept.ends_of(row.law) if self.kept else None
            made = self.made[row.law] = Trials(free, self.say, ends=ends)
        elif pairs:
            self.say(f"two effects that {row.law} lacks")
            if self.effort.spent and any(is_rough(one.model) for one in made.single[:2]):
                self.not_tried[row.law] = True  # behind a joint
        found = self._lacking(row, made, pairs)
        reached = found.reach()
        if self.kept and (self._nearest is None or reached.z < self._nearest.z):
            self._nearest = reached
            self.kept.stands(row.law, reached.effects, reached.z)
        return found

    def settled(self, found: LawAndEffects, runs: RigRuns) -> LawAndEffects:
        """Return what a law lacks on all runs of the rig, every search begun where one ended.

        Itself where nothing was left out: neither runs, nor the look at the force with its zero
        taken as right.
        """
        law, made = found.row.law, self.made.get(found.row.law)
        shortened = law in self._shortened
        if made is not None:
            made.closed = False
        if made is None or (self.runs is runs and not shortened):
            return found
        row = found.row
        if self.runs is not runs:
            assert runs.damper is not None
            self.say(f"fitting {law} to all runs")
            (row,) = fitted_anew([row], *runs.damper)
        prepared = runs.prepare(DAMPER, row.trial)
        assert prepared is not None
        # What explains nothing with the zero free explains no more without, but for a dependence on
        # a label, which the free zero may hide: else no search begins anew.
        anew = found.explains or labels_of([run.labels for run in prepared.problem.runs])
        earlier = None if shortened and anew else made
        again = Trials(prepared, self.say, earlier, made if shortened else None)
        # Where two effects explained nothing they are not sought once more.
        whole = self._lacking(row, again, found.explains and law in self._two)
        together = whole.finding.together or found.finding.together
        return replace(whole, finding=replace(whole.finding, together=together))

    def _lacking(self, row: LawTrial, made: Trials, pairs: bool) -> LawAndEffects:
        found = diagnose_damper(made.prepared, self.say, made, pairs=pairs, excess=self.excess)
        return LawAndEffects(row, *found)
