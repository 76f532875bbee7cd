"""The verdict on a law and its effects together: every law fitted, those that survive searched."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf

from ..core.progress import tell
from ..data.run_labels import labels_of
from ..identification.fit import is_rough
from ..identification.histories import Effort, counted
from ..identification.rig import DAMPER
from ..model.model import Model
from .by_label import confirmed
from .law_choice import (
    LawAndEffects,
    LawVerdict,
    choose,
    equivalents,
    search,
    simplest,
    survivors,
)
from .law_trials import LawTrial, fitted_anew, not_finite, try_laws
from .prepared import Prepared
from .rig_runs import RigRuns
from .site import Trials, diagnose_damper, noise_is_all, with_zero_free
from .site_diagnosis import SiteDiagnosis
from .trials import KeptFits, Trial, missed_by, promised


def law_and_effects(
    runs: RigRuns,
    findings: dict[str, SiteDiagnosis],
    named: str,
    kept: KeptFits | None,
) -> tuple[SiteDiagnosis, Prepared, LawVerdict]:
    """Return what the law that a damper has misses, what its look began with, and how all laws do.

    Parameters
    ----------
    runs : of the rig, which show a damper
    findings : what the lines lack; what they tell of the rig is set right
    named, kept : as `diagnose_rig` takes them
    """
    present = runs.part(DAMPER)
    if runs.damper[0].reconstructed:  # the building's numbers are asked for with a law
        tell("trying every law, with the building as its file has it")
        first = try_laws(*runs.damper, present, bends=runs.bends)
        runs.suppose(simplest(first).trial.model)
    runs.correct(findings)
    chosen, laws = _searched(runs, present, named, kept)
    if runs.suit(chosen.finding):  # what was kept was fitted to the force of the file's numbers
        chosen, laws = _searched(runs, present, named, None)
    return chosen.finding, chosen.prepared, laws


def _searched(
    runs: RigRuns, present: Model, named: str, kept: KeptFits | None
) -> tuple[LawAndEffects, LawVerdict]:
    """Return the law that the runs ask for, with its effects, and how all laws do; suppose it.

    Where no pair explains the runs, what the nearest one misses counts beside the noise for all.
    The one that is chosen is looked at in full, on all runs: where it explains them no more, or
    another one then comes nearer, the next one is.
    """
    there = runs.in_part()
    tell("trying every law")
    rows = try_laws(*there.damper, present, bends=runs.bends, kept=kept)
    if kept:
        kept.stands(rows[0].law, rows[0].trial.effects, rows[0].trial.z)
    by_law = TrialsByLaw(there, kept)
    with counted(MOST_SPENT) as by_law.effort:
        pairs = search(rows, by_law, by_law.enough, by_law.promise)
        nearest = min(pairs, key=lambda pair: pair.reach().z)
        by_law.excess = missed_by(nearest.reach(), nearest.prepared.problem)
        if by_law.excess:
            tell("what no law explains counts beside the noise: fitting the laws anew")
            train, held_out = (one.with_excess(by_law.excess) for one in there.damper)
            rows = fitted_anew(rows, train, held_out)
            pairs = search(by_law.left_of(rows, pairs), by_law, by_law.enough)
    whole: dict[str, LawAndEffects] = {}
    while (found := choose(pairs)).row.law not in whole:
        chosen = by_law.settled(found, runs)
        chosen = replace(chosen, finding=confirmed(chosen.finding, chosen.prepared))
        whole[found.row.law] = chosen
        pairs = [chosen if pair is found else pair for pair in pairs]
        if chosen.explains:
            break
    else:
        chosen = found
    of_all = {row.law: row for row in (*rows, *(pair.row for pair in pairs))}
    ranked = tuple(sorted(of_all.values(), key=lambda row: row.trial.z))
    runs.suppose(chosen.row.trial.model)
    equal, unfit = equivalents(chosen, pairs, ranked), not_finite(there.damper[0], present)
    return chosen, LawVerdict(
        chosen.row, named, ranked, tuple(pairs), tuple(equal), tuple(unfit), by_law.not_tried
    )


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
    kept : where trials are kept, and told what comes nearest
    """

    def __init__(self, runs: RigRuns, kept: KeptFits | None = None) -> None:
        self.runs, self.kept = runs, kept
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
            if noise_is_all(prepared):
                return LawAndEffects(row, *diagnose_damper(prepared, pairs=pairs, excess=0.0))
            tell(f"effects that {row.law} lacks (error / noise {row.trial.z:.2f})")
            free = with_zero_free(prepared)
            if free is not prepared:
                self._shortened.add(row.law)
            made = self.made[row.law] = Trials(free, kept=self.kept, law=row.law)
        elif pairs:
            tell(f"two effects that {row.law} lacks")
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
            tell(f"fitting {law} to all runs")
            (row,) = fitted_anew([row], *runs.damper)
        prepared = runs.prepare(DAMPER, row.trial)
        # What explains nothing with the zero free explains no more without, but for a dependence on
        # a label, which the free zero may hide: else no search begins anew.
        anew = found.explains or labels_of([run.labels for run in prepared.problem.runs])
        earlier = None if shortened and anew else made
        again = Trials(prepared, earlier, made if shortened else None)
        # Where two effects explained nothing they are not sought once more.
        whole = self._lacking(row, again, found.explains and law in self._two)
        together = whole.finding.together or found.finding.together
        return replace(whole, finding=replace(whole.finding, together=together))

    def _lacking(self, row: LawTrial, made: Trials, pairs: bool) -> LawAndEffects:
        found = diagnose_damper(made.prepared, made, pairs=pairs, excess=self.excess)
        return LawAndEffects(row, *found)
