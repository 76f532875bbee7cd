"""Which laws go on through the search for effects, and which law with which effects it is.

A law that contains a spring explains a missing spring. So the law with the smallest error is no
answer by itself: laws that contain nothing go on as well, and what is judged is the pair of a law
and its effects, by held-out runs, the simpler pair where both explain them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ..physics.forms import CURVED, LINEAR_FORM, split_form
from ..physics.law import Law
from .decision import missing
from .law_trials import LawTrial
from .prepared import Prepared
from .rule import BENCH
from .site_diagnosis import SiteDiagnosis
from .trials import Trial, joinable, paired

HIDDEN = 0.03
"""Share of a law's excess that an effect leaves at most where what is left may be the part that a
richer law has: one that alone does as well, within `close`, has no larger one."""

EXPLAINING = ("none", "effect", "ambiguous")
"""The kinds of a finding that leave nothing unexplained."""


@dataclass(frozen=True)
class LawAndEffects:
    """A law with what it lacks: the law's row, what the search found, and what it began with."""

    row: LawTrial
    finding: SiteDiagnosis
    prepared: Prepared

    @property
    def after(self) -> Trial:
        """The trial of the law with its effects; without, where they are not known."""
        assert self.finding.after is not None
        return self.finding.after

    @property
    def fitted(self) -> int:
        """How many parameters are fitted."""
        model = self.after.model
        return len(model.free()) + self.prepared.problem.fits_zero(model)

    @property
    def explains(self) -> bool:
        """Whether the law with its effects leaves nothing unexplained."""
        return self.finding.kind in EXPLAINING

    def reach(self) -> Trial:
        """Return the trial of the law with what lowers its error most, beyond chance, or alone."""
        found = self.finding
        tried = (*found.trials, found.together) if found.together else found.trials
        gaining = [trial for trial in tried if missing(self.after, trial, BENCH)]
        return min((self.after, *gaining), key=lambda trial: trial.z)

    @property
    def order(self) -> tuple[int, int, float]:
        """What is simpler comes first: fewer parameters, fewer effects, a smaller error."""
        return self.fitted, len(self.finding.effects), self.after.z


def _apart(first: Trial, second: Trial) -> bool:
    """Return whether one model's loss is above another's beyond chance, or of other samples."""
    alike = len(first.losses) == len(second.losses)
    return not alike or paired(first.losses, second.losses, BENCH.chance) > 0.0


def serves_rest(other: Trial, best: Trial) -> bool:
    """Return whether a model's z is that of the many samples near rest, at the cost of all others.

    Only where the best model leaves more than noise: its plain error then says which one is wrong.
    """
    return best.z > BENCH.clean and other.rms > BENCH.most_rms * best.rms


def clearly_worse(other: Trial, best: Trial) -> bool:
    """Return whether a model errs more than another by enough, and beyond chance."""
    if serves_rest(other, best):
        return True
    if other.z <= best.z * (1.0 + BENCH.law_gain):
        return False
    return _apart(other, best)


def as_good(other: Trial, best: Trial) -> bool:
    """Return whether the data cannot distinguish a model from the best one."""
    if serves_rest(other, best):
        return False
    if other.z <= best.z * (1.0 + BENCH.close):
        return True
    return not _apart(other, best)


def best_of(trials: Sequence[Trial]) -> Trial:
    """Return the best of trials on held-out runs, by z.

    Where none explains the runs, a plain error of more than `most_rms` times the smallest one puts
    a trial out: it serves the many samples near rest at the cost of all others.
    """
    able = list(trials)
    if min(trial.z for trial in able) > BENCH.clean:
        least = min(trial.rms for trial in able)
        able = [trial for trial in able if trial.rms <= BENCH.most_rms * least]
    return min(able, key=lambda trial: trial.z)


def survivors(rows: Sequence[LawTrial]) -> list[LawTrial]:
    """Return the laws that go on through the search for effects.

    The best on held-out runs, and the simplest that is not clearly worse; the best of those that
    contain no effect, the one with a parabola only where a straight line is clearly worse. Then
    those of them that no simpler one surpasses, the smallest error first, up to `most_laws` of all
    these. Last, where they are not among them, the law with the smallest z even if its plain error
    puts it out, and the simplest of those that contain an effect and are not clearly worse. Of laws
    with an effect none goes on that a simpler one with the same parts equals.
    """
    rows = [
        row
        for row in rows
        if not (_holds(row) and any(_equals_with_less(other, row) for other in rows))
    ]
    ranked = sorted(rows, key=lambda row: row.trial.z)
    first = best_of([row.trial for row in rows])
    by_z = next(row for row in rows if row.trial is first)
    best = _formed(by_z, rows)
    plain = [row for row in ranked if not _holds(row)]
    straight = [row for row in plain if CURVED not in row.contains]
    others = [row for row in ranked if row is best or row is not by_z]
    level = [row for row in others if not clearly_worse(row.trial, best.trial)]
    picked = [best, *straight[:1], min(level, key=lambda row: (row.fitted, row.trial.z))]
    if straight and clearly_worse(straight[0].trial, plain[0].trial):
        picked.insert(1, plain[0])
    front = [row for row in straight if not _surpassed(row, straight)]
    usual = list({row.law: row for row in [*picked, *front]}.values())[: BENCH.most_laws]
    # What a law lacks may be why it fits the many samples near rest alone, or why one that contains
    # an effect does no better than one without.
    holding = sorted(filter(_holds, level), key=lambda row: row.fitted)
    hidden = [_formed(ranked[0], rows), *holding[:1]]
    return list({row.law: row for row in [*usual, *hidden]}.values())


def _surpassed(row: LawTrial, rows: Sequence[LawTrial]) -> bool:
    """Return whether a law of no more parameters has a smaller z."""
    return any(one.fitted <= row.fitted and one.trial.z < row.trial.z for one in rows)


def _holds(row: LawTrial) -> bool:
    """Return whether a law contains an effect; a parabola of the command is none."""
    return bool(set(row.contains) - {CURVED})


def _formed(best: LawTrial, rows: Sequence[LawTrial]) -> LawTrial:
    """Return the best law in the form of its command that its plain error asks for.

    Only where the law leaves many times the noise: the runs with the least noise then decide by z.
    """
    if best.trial.z <= BENCH.coarse:
        return best
    forms = [row for row in rows if _plain_name(row) == _plain_name(best)]
    least = min(forms, key=lambda row: row.trial.rms)
    return least if least.trial.rms < (1.0 - BENCH.law_gain) * best.trial.rms else best


def _plain_name(row: LawTrial) -> str:
    """Return the name of a law with its variant, without the form of its command."""
    return split_form(row.law)[0]


def simplest(rows: Sequence[LawTrial]) -> LawTrial:
    """Return the simplest law that the best one on held-out runs does not surpass."""
    best = best_of([row.trial for row in rows])
    level = [row for row in rows if as_good(row.trial, best)]
    return min(level, key=lambda row: (row.fitted, row.trial.z))


def search(
    rows: Sequence[LawTrial],
    lacking: Callable[[LawTrial, bool], LawAndEffects],
    enough: Callable[[LawTrial, bool], bool] = lambda _row, _pairs: False,
    promise: Callable[[LawAndEffects], float] = lambda pair: pair.reach().z,
) -> list[LawAndEffects]:
    """Return the pairs that decide; `lacking` searches the effects that a law lacks.

    Where noise is all that the best law leaves, the simplest that it does not surpass comes first:
    if that lacks nothing and contains no effect, no other is searched. Then come the simpler ones
    first: a law is left out where the runs are explained already by no more parameters than it
    would have with the smallest effect that can join it. Where no law with a single effect explains
    the runs so well that none could be clearly better, the best law that was left out is looked at
    as well, and after it two effects of each law, first of the one that promises most; once two
    explain the runs, no more of laws that began too far from that one. A law that a simpler one of
    its parts equals waits until effects nearly explain what that leaves.

    Parameters
    ----------
    rows : the laws tried
    lacking : called with a row, and whether to try two effects; returns what its law lacks
    enough : called as `lacking` is; returns whether so much was spent that this is not tried: what
        the best law lacks always is, and two effects of the law that promises most
    promise : called with what a law lacks alone; returns the z that two effects may leave
    """
    first, begun = simplest(rows), list[LawAndEffects]()
    if first.trial.z <= BENCH.complete:
        begun.append(lacking(first, True))
        if begun[0].finding.kind == "none" and not first.contains:
            return begun
    others = [row for row in survivors(rows) if row is not first or not begun]
    best = others[0] if others else None
    others.sort(key=lambda row: (row.fitted, row.trial.z))
    single = list(begun)

    def look(row: LawTrial, found: list[LawAndEffects], pairs: bool) -> None:
        if _waits(row, found) or not _could_be_simpler(row, found):
            return
        if (row is best and not pairs) or not enough(row, pairs):
            found.append(lacking(row, pairs))

    for row in others:
        look(row, single, False)
    if not _explained(single):
        # One law's missing effect may be what another law has: it then fits better alone.
        for row in _best_passed_over(rows, [*others, *(pair.row for pair in begun)]):
            look(row, single, False)
            others.append(row)
    if _explained(single):
        return single
    found, far = list(begun), float("inf")
    for pair in sorted(single[len(begun) :], key=promise):
        left = BENCH.excess(pair.reach().z)
        able = left <= far and _could_be_simpler(pair.row, found)
        if able and not (found and enough(pair.row, True)):
            pair = lacking(pair.row, True)
            far = min(far, BENCH.within * left) if pair.explains else far
        found.append(pair)
    known = {pair.row.law for pair in found}
    for row in others:
        if row.law not in known:
            look(row, found, True)
    return found


def _explained(found: Sequence[LawAndEffects]) -> bool:
    """Return whether a pair explains the runs so well that none could be clearly better."""
    return any(pair.explains and pair.after.z <= 1.0 + BENCH.law_gain for pair in found)


def _best_passed_over(rows: Sequence[LawTrial], looked: Sequence[LawTrial]) -> list[LawTrial]:
    """Return the best law of which no variant and no form was looked at, if any.

    That with the smallest z of those that no simpler one surpasses: what a small law lacks may be
    one effect, what a larger one lacks is more than its own parts.
    """
    searched = {_base(row) for row in looked}
    left = [row for row in rows if _base(row) not in searched]
    return sorted(left, key=lambda row: (_surpassed(row, rows), row.trial.z))[:1]


def _waits(row: LawTrial, found: Sequence[LawAndEffects]) -> bool:
    """Return whether a simpler law of the same parts equals a law, and its effects leave much."""
    return any(
        _equals_with_less(pair.row, row)
        and BENCH.excess(pair.reach().z) > HIDDEN * BENCH.excess(pair.row.trial.z)
        for pair in found
    )


def _equals_with_less(simpler: LawTrial, row: LawTrial) -> bool:
    """Return whether a law does as well as another that has the same parts with more parameters."""
    if _base(row) is _base(simpler) or {*_base(row).parts} != {*_base(simpler).parts}:
        return False
    level = simpler.trial.z <= (1.0 + BENCH.close) * row.trial.z
    level &= simpler.trial.rms <= (1.0 + BENCH.law_gain) * row.trial.rms
    return simpler.fitted < row.fitted and level


def _could_be_simpler(row: LawTrial, found: Sequence[LawAndEffects]) -> bool:
    """Return whether a law, with the smallest effect, could be simpler than what explains runs."""
    known = [pair.fitted for pair in found if pair.explains and pair.after.z <= BENCH.complete]
    model = row.trial.model
    joined = [replace(model, effects=(*model.effects, name)) for name in joinable(model)]
    least = min((len(one.free()) for one in joined), default=row.fitted)
    return not known or min(known) > least


def choose(pairs: Sequence[LawAndEffects]) -> LawAndEffects:
    """Return the pair of law and effects that the runs ask for.

    Of those that explain the runs and that the best one on held-out runs does not surpass, the
    simplest; where none explains them, the one that comes nearest with an effect or without. A
    pair that leaves more than noise explains most of what its own law leaves: a simpler one of
    another law, which began nearer and comes as near, is taken in its place.
    """
    best = best_of([pair.after for pair in pairs])
    level = [pair for pair in pairs if pair.explains and as_good(pair.after, best)]
    if not level:
        return _nearest(pairs)
    chosen = min(level, key=lambda pair: pair.order)
    if chosen.after.z > BENCH.adequate:
        nearest = _nearest(pairs)
        reached = nearest.reach()
        fewer = len(reached.model.free()) < len(chosen.after.model.free())
        if fewer and as_good(reached, chosen.after):
            return nearest
    return chosen


def _nearest(pairs: Sequence[LawAndEffects]) -> LawAndEffects:
    """Return the pair that comes nearest to the runs, the simplest of those that hardly differ.

    Where all leave many times the noise, effects that a simpler law needs to come as near are no
    less of a guess than the parts of a law that does so by itself: that one is taken.
    """
    reached = [pair.reach() for pair in pairs]
    least = best_of(reached)
    far = least.z > BENCH.coarse
    alike = [
        (far * len(one.effects), len(one.model.free()), one.z, k)
        for k, one in enumerate(reached)
        if one.z <= (1.0 + BENCH.law_gain) * least.z and not serves_rest(one, least)
    ]
    return pairs[min(alike)[-1]]


def equivalents(
    chosen: LawAndEffects, pairs: Sequence[LawAndEffects], rows: Sequence[LawTrial]
) -> list[tuple[str, tuple[str, ...], float]]:
    """Return what explains the runs as well as the pair chosen: law, effects, z on held-out runs.

    A law that was not searched counts without an effect. What only gives the chosen law more to
    fit, a parabola or the part that a variant lacks, is not told: it always does as well.

    Parameters
    ----------
    chosen : what the verdict is about
    pairs : the laws whose effects were searched
    rows : the laws tried
    """
    if not chosen.explains:
        return []
    rows = [row for row in rows if _base(row) != _base(chosen.row)]
    pairs = [pair for pair in pairs if _base(pair.row) != _base(chosen.row)]
    out: dict[tuple[str, tuple[str, ...]], float] = {}
    for pair in pairs:
        effects = pair.finding.effects if pair.finding.kind == "effect" else ()
        sure = pair.finding.kind in ("none", "effect")
        if pair is not chosen and sure and as_good(pair.after, chosen.after):
            out[pair.row.law, effects] = pair.after.z
    searched = {pair.row.law for pair in pairs}
    for row in rows:
        if row.law not in searched and as_good(row.trial, chosen.after):
            out.setdefault((row.law, ()), row.trial.z)
    return [(law, effects, z) for (law, effects), z in sorted(out.items(), key=lambda i: i[1])]


def _base(row: LawTrial) -> type[Law]:
    return row.trial.model.law_class.base


# What a verdict says of laws: which one the runs prefer, how the others do, what is as good.


@dataclass(frozen=True)
class LawVerdict:
    """The law of a verdict, where laws and effects were sought together.

    `row` is the law chosen; `before` the law that the model had, "" where nobody chose one; `rows`
    all laws tried, the best first; `pairs` those whose effects were searched; `equivalents` what
    explains the runs as well: law, effects, z on held-out runs; `left_out` the laws whose force is
    not a number on these runs; `not_tried` the laws for which two effects were not tried (True), or
    none (False), because enough had been searched.
    """

    row: LawTrial
    before: str
    rows: tuple[LawTrial, ...]
    pairs: tuple[LawAndEffects, ...]
    equivalents: tuple[tuple[str, tuple[str, ...], float], ...] = ()
    left_out: tuple[str, ...] = ()
    not_tried: Mapping[str, bool] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The law's name, with its variant and form."""
        return self.row.law

    def as_dict(self) -> dict[str, Any]:
        """Return what verdict.json holds of laws."""
        plain, form, _ = split_form(self.name)
        return {
            "law": plain, "command": form or LINEAR_FORM, "law_before": self.before,
            "laws": rows_of(self.rows, self.pairs),
            "equivalent": [
                {**_named(law), "effects": list(effects), "z_holdout": round(z, 4)}
                for law, effects, z in self.equivalents
            ],
            **({"laws_left_out": list(self.left_out)} if self.left_out else {}),
            **({"not_tried": self._not_tried()} if self.not_tried else {}),
        }  # fmt: skip

    def _not_tried(self) -> dict[str, list[str]]:
        """Return the laws of which effects, and two effects, were not tried."""
        two = [law for law, own in self.not_tried.items() if own]
        return {"effects": [law for law in self.not_tried if law not in two], "two_effects": two}


def rows_of(
    rows: tuple[LawTrial, ...], pairs: tuple[LawAndEffects, ...] = ()
) -> list[dict[str, Any]]:
    """Return laws tried as json can hold them, with what each lacks where that was searched."""
    searched = {pair.row.law: pair for pair in pairs}
    out = []
    for row in rows:
        shown = row.as_dict(rows[0])
        if pair := searched.get(row.law):
            shown |= {
                "kind": pair.finding.kind, "effects": list(pair.finding.effects),
                "z_with_effects": round(pair.after.z, 4), "fitted_with_effects": pair.fitted,
            }  # fmt: skip
            nearest = pair.reach()
            if pair.finding.kind == "unknown" and nearest.z < pair.after.z:
                shown |= {"nearest": list(nearest.effects), "z_nearest": round(nearest.z, 4)}
        out.append(shown)
    return out


def _named(law: str) -> dict[str, str]:
    plain, form, _ = split_form(law)
    return {"law": plain, "command": form or LINEAR_FORM}
