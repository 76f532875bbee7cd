"""Closed forms fitted inside the model, in the place of a learned curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ...identify.fit import intervals_of
from ...identify.search_context import refine
from ...physics.user import defined
from ..candidates import Trial, judge
from ..decision import missing
from ..opening import Opening
from .closed import ClosedForm, formula_of
from .curve import Formula
from .effect_file import effect_text
from .fit import SWEEPS, LearnedCurve
from .rule import LEARN, LearnRule

CLOSED = 2
"""Closed forms that are fitted in the place of a curve, until one does as well."""


@dataclass(frozen=True)
class Closed:
    """A closed form in the place of a learned curve: `formula` with its fitted values, `trial`."""

    form: ClosedForm
    formula: Formula
    trial: Trial
    std: dict[str, float]


def close(
    opened: Opening, found: LearnedCurve, forms: Sequence[ClosedForm], rule: LearnRule = LEARN
) -> Closed | None:
    """Fit the closed forms that may name a curve in its place; return the first that does as well.

    Parameters
    ----------
    opened : runs and the fitted model, as a diagnosis begins with them
    found : the curve, with the name of its effect
    forms : fitted to the curve, the best first
    rule : the numbers that decide between curves
    """
    able = [one for one in forms if one.left <= rule.resembles][:CLOSED]
    return next(filter(None, (fit_closed(opened, found, one, rule) for one in able)), None)


def fit_closed(
    opened: Opening, found: LearnedCurve, form: ClosedForm, rule: LearnRule = LEARN
) -> Closed | None:
    """Fit a closed form in the place of a learned curve; None where it is clearly worse.

    It has fewer numbers, and holds between and beyond the knots: as good is good enough, and better
    where it follows the curve less closely.

    Parameters
    ----------
    opened : runs and the fitted model, as a diagnosis begins with them
    found : the curve, with the name of its effect
    form : fitted to the curve
    rule : the numbers that decide between curves
    """
    assert found.curve is not None
    assert found.after is not None
    formula = formula_of(form, found.curve)
    if not formula.parameters:
        return None
    text = effect_text(found.name, found.curve, "a trial", formula)
    base, values = found.after.model, dict(found.after.model.values)
    values = {k: v for k, v in values.items() if not k.startswith(f"{found.name}.curve[")}
    values |= {f"{found.name}.{n}": value for n, value, _ in formula.parameters}
    with defined({found.name: text}):
        train = opened.searched.of(opened.searched.runs)
        held_out = opened.held_out.of(opened.held_out.runs)
        model = refine(replace(base, values=values), train, SWEEPS)
        trial = judge(model, train, held_out)
        worst = (rule.as_good if form.left <= rule.follows else 1.0) * found.after.train
        if trial.train > worst or not missing(found.before, trial, opened.rule):
            return None
        std = intervals_of(train, model).std
        given = tuple(
            (n, model.value(f"{found.name}.{n}"), unit) for n, _, unit in formula.parameters
        )
        memory = {f"{found.name}.{n}": n for n, _ in found.curve.memory}
        own = {f"{found.name}.{n}": n for n, _, _ in formula.parameters} | memory
        own_std = {n: std.get(key, 0.0) for key, n in own.items()}
    return Closed(form, replace(formula, parameters=given), trial, own_std)
