"""Every registered law of a damper fitted to the same runs, and judged on the same others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import t as student

from ..core.progress import Count
from ..core.text import percent, short_z
from ..identification.error import ForceError, force_error
from ..identification.fit import Search, refine, with_rest
from ..identification.problem import Problem, steady, suited, without
from ..identification.search import in_threads, z_scale
from ..identification.starts import start_models
from ..model.model import Model, unfit
from ..physics.forms import LINEAR_FORM, QUADRATIC_FORM, choosable, joined_form, split_form
from ..physics.laws import base_and_variant, law_names
from .decision import NOISE
from .rule import BENCH
from .trials import End, KeptFits, Trial, judge

STARTS = 2
"""Starting points of each law."""

OUTSET = 4
"""Jacobians of the search from each of them; the one that came farthest goes on."""

JACOBIANS = 12
"""Jacobians of that search."""

FORM_ALONE = "its form alone explains"
"""What stands in the sentence about a law that leaves less than the model's."""

WITHIN = 0.95
"""Probability of the intervals over runs."""


@dataclass(frozen=True)
class LawTrial:
    """A law tried: fitted on the training runs, judged on the held-out ones.

    `law` is its name with variant and form, such as "lugre_standard[quadratic]"; `error_train` the
    error on the training runs; `z_runs` (r,) z of each held-out run.
    """

    law: str
    trial: Trial
    error_train: ForceError
    z_runs: tuple[float, ...]

    @property
    def fitted(self) -> int:
        """How many parameters are fitted."""
        return len(self.trial.model.free())

    @property
    def contains(self) -> tuple[str, ...]:
        """The kinds of effects that the law has in it."""
        return self.trial.model.law_class.contains

    def above(self, best: LawTrial) -> tuple[float, float]:
        """Return by how much z is above that of another law, and half the interval of that.

        Paired by held-out runs, of which two or more are needed: else the half is NaN.
        """
        apart = np.array(self.z_runs) - np.array(best.z_runs)
        if len(apart) < 2:
            return float(np.mean(apart)), float("nan")
        wide = float(student.ppf(0.5 + 0.5 * WITHIN, len(apart) - 1))
        return float(np.mean(apart)), wide * float(np.std(apart, ddof=1)) / float(len(apart)) ** 0.5

    def as_dict(self, best: LawTrial) -> dict[str, Any]:
        """Return what json can hold, the law compared with the best one."""
        plain, form, _ = split_form(self.law)
        above, half = self.above(best)
        return {
            "law": plain, "command": form or LINEAR_FORM, "fitted": self.fitted,
            "z_train": round(self.trial.train, 4), "z_holdout": round(self.trial.z, 4),
            "error_train": self.error_train.as_dict(),
            "error_holdout": self.trial.error.as_dict() if self.trial.error else None,
            "z_above_best": round(above, 4),
            "interval95": round(half, 4) if np.isfinite(half) else None,
        }  # fmt: skip


def try_laws(
    train: Problem, held_out: Problem, present: Model, *, bends: bool, kept: KeptFits | None = None
) -> tuple[LawTrial, ...]:
    """Return the trials of the laws that suit the runs, with variants, the best on held-out first.

    Laws that `not_finite` tells are left out.

    Parameters
    ----------
    train, held_out : runs to fit to, and those that decide
    present : the model as it is; each law has those of its effects that can join it
    bends : whether the command has levels enough for a parabola: laws whose form may be chosen
        are then tried with that, too
    kept : fits that are known already, and where those that are made go
    """
    unfit = not_finite(train, present)  # which compiles all before threads ask for it
    names = [name for name in suited(train, law_names()) if name not in unfit]
    count = Count("law", len(names))
    known: dict[str, float] = {}

    def tried(name: str) -> list[LawTrial]:
        fitted = _fitted(name, train, present, bends, kept)
        found = [_row(law, one, train, held_out) for law, one in fitted]
        known.update({row.law: row.trial.z for row in found})
        best = min(dict(known), key=lambda law: known[law])
        count.done(name, f"best so far {best}, z {short_z(known[best])} on held-out runs")
        return found

    rows = [row for rows in in_threads(tried, names) for row in rows]
    return tuple(sorted(rows, key=lambda row: row.trial.z))


def fitted_anew(
    rows: Sequence[LawTrial], train: Problem, held_out: Problem
) -> tuple[LawTrial, ...]:
    """Return laws fitted to these runs, by their weights, from where they ended before."""

    def again(row: LawTrial) -> LawTrial:
        return _row(row.law, refine(row.trial.model, train, JACOBIANS), train, held_out)

    return tuple(sorted(in_threads(again, rows), key=lambda row: row.trial.z))


@dataclass(frozen=True)
class OtherLaw:
    """A law that leaves less than the model's, with the same effects: `share` of the excess."""

    law: str
    z: float
    share: float

    def sentence(self, *, added: bool = False) -> str:
        """Return how much of the error is the form of the law.

        Parameters
        ----------
        added : whether both laws have the effects of the verdict; otherwise the error is that of
            the present model, of which an effect may explain the same part
        """
        plain, form, _ = split_form(self.law)
        bent = f" with a {form} command" if form not in ("", LINEAR_FORM) else ""
        lead, rest = (
            ("With the same effects", "what then remains above the noise")
            if added
            else ("Without a further effect", "what is missing")
        )
        return (
            f"{lead}, the law {plain}{bent} leaves {short_z(self.z)} {NOISE}: {FORM_ALONE} "
            f"{percent(self.share, 0)} of {rest}."
        )

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        plain, form, _ = split_form(self.law)
        z, share = round(self.z, 4), round(self.share, 4)
        return {"law": plain, "command": form or LINEAR_FORM, "z_holdout": z, "explained": share}


def better_law(judged: Trial, laws: Sequence[LawTrial]) -> OtherLaw | None:
    """Return the law that leaves least in the place of a model's own; None where that does.

    Parameters
    ----------
    judged : the model
    laws : all laws with the model's effects, on the same runs
    """
    able = [one for one in laws if one.trial.rms <= BENCH.most_rms * judged.rms]
    best = min(able, key=lambda one: one.trial.z, default=None)
    if best is None or best.trial.z > (1.0 - BENCH.gain) * judged.z:
        return None
    return OtherLaw(best.law, best.trial.z, BENCH.explained(judged.z, best.trial.z))


def not_finite(problem: Problem, present: Model) -> list[str]:
    """Return the laws, a user's own as a rule, whose force is not a number where fits begin.

    Parameters
    ----------
    problem : the runs
    present : the model as it is
    """
    models = {name: _model(name, problem, present) for name in suited(problem, law_names())}
    return [name for name, model in models.items() if not _is_finite(model, problem)]


def _is_finite(model: Model, problem: Problem) -> bool:
    """Return whether the force is a number at the defaults, and with one linear parameter alone."""
    linear = model.law_class.linear()
    none = {**model.values, **dict.fromkeys(linear, 0.0)}
    alone = [replace(model, values={**none, name: 1.0}) for name in linear]
    return all(
        bool(np.isfinite(problem.predict(one, run)).all())
        for one in (model, *alone)
        for run in problem.runs
    )


def _fitted(
    name: str, train: Problem, present: Model, bends: bool, kept: KeptFits | None
) -> list[tuple[str, Model]]:
    """Return a law fitted to the training runs, and the same with a bent command where it may."""
    model = _model(name, train, present)
    bent = joined_form(name, QUADRATIC_FORM) if bends and choosable(model.law_class) else ""
    if kept is not None and (known := kept.found(name)):
        return [(law, end.model) for law, end in zip((name, bent), known, strict=False)]
    starts = start_models(train, model, STARTS)
    expected = train.expectation(starts[0])
    starts = with_rest(train, starts, expected)
    ends = [Search(train, one, expected, one.free()).run(OUTSET) for one in starts]
    best, _ = min(ends, key=lambda end: end[1].cost)
    fitted = [(name, refine(best, train, JACOBIANS))]
    if bent:
        begin = replace(
            _model(bent, train, present), values=fitted[0][1].values, fixed=fitted[0][1].fixed
        )
        if set(begin.effects) == set(model.effects):
            fitted.append((bent, refine(begin, train, JACOBIANS)))
    if kept is not None:
        kept.keep(name, [End(one, True) for _, one in fitted])
    return fitted


def _model(name: str, problem: Problem, present: Model) -> Model:
    """Return a law with the present effects that can join it, where its fit begins."""
    base, variant = base_and_variant(name)
    lost = unfit(base, present.effects)
    effects = tuple(one for one in present.effects if one not in lost)
    own = {name for name in present.values if name.partition(".")[0] in effects}
    values = problem.at_size(base.name, effects) | {name: present.values[name] for name in own}
    kept = {n for n in (*present.fixed, *present.limits) if n.partition(".")[0] in effects}
    model = Model(
        base.name, effects, {**values, **variant.values},
        tuple(n for n in present.fixed if n in kept),
        {n: pair for n, pair in present.limits.items() if n in kept},
    )  # fmt: skip
    return without(model, base.driven()) if steady(problem) else model


def _row(law: str, model: Model, train: Problem, held_out: Problem) -> LawTrial:
    expected = train.expectation(model), held_out.expectation(model)
    trial = replace(judge(model, train, held_out, expected), refined=True)
    z_runs = tuple(map(z_scale, held_out.by_run(trial.residual)))
    return LawTrial(law, trial, force_error([(train, model)]), z_runs)
