"""A curve learned inside the model: fitted with everything else, judged on runs not seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..core.progress import Count
from ..diagnosis.decision import missing
from ..diagnosis.prepared import Prepared
from ..diagnosis.rule import DecisionRule
from ..diagnosis.trials import Trial, judge
from ..identification.fit import intervals_of, refine
from ..identification.problem import Problem, robust_z
from ..identification.search import in_threads
from ..model.model import Model
from ..user_code.load import defined
from .curve import Curve
from .effect_file import effect_text
from .normal import Normal, Residual, residual_of
from .rule import LEARN
from .screen import FINE, Promise, distinct, promises
from .signals import RING, SLIP
from .surface import continued, surfaces

TRIED = 4
"""Curves that are fitted with everything else, of those that promise most."""

SURFACES = 2
"""Surfaces that are fitted beside them where no curve along one signal explains the error."""

AWAKE = 0.1
"""Smallest share of the command that a map leaves where its fit begins."""

SWEEPS = 12
"""Jacobians of such a fit, at the most."""


@dataclass(frozen=True)
class Fitted:
    """A curve fitted inside the model.

    `std` (k,) of its values, in its unit; `trial` how the model with it does; `loss` the mean
    squared residual of stretches of the training runs that a fit left out.
    """

    curve: Curve
    std: tuple[float, ...]
    trial: Trial
    loss: float


@dataclass(frozen=True)
class LearnedCurve:
    """What `learn` came to: the best curve, or why none is kept.

    `before` the trial without it; `best` None where none was fitted; `others` what else was fitted,
    best first; `refused` why it is not kept, "" where it is.
    """

    name: str
    before: Trial
    best: Fitted | None
    others: tuple[Fitted, ...] = ()
    refused: str = ""


def learn(
    prepared: Prepared, name: str, *, parts: Sequence[str] = (), along: Sequence[str] = ()
) -> LearnedCurve:
    """Learn what the model of an opening misses at its site.

    Parameters
    ----------
    prepared : runs and the fitted model, as a diagnosis begins with them
    name : of the effect that the curve becomes
    parts, along : names of `PARTS` and `ALONG` that are tried; empty for all
    """
    before, train = prepared.before, prepared.searched
    residual = residual_of(train, before.model)
    worth = (1.0 - prepared.rule.gain) ** 2 * Normal(residual).without_curve()
    promised = promises(residual, parts, along)
    if len(along) > 1:
        promised += surfaces(residual, parts, along)
        promised.sort(key=lambda one: LEARN.weighed(one.loss, one.curve))
    chosen = distinct([one for one in promised if one.loss <= worth], TRIED)
    if not chosen:
        why = "No curve lowers the error on stretches of the training runs that it has not seen."
        return LearnedCurve(name, before, None, (), why)
    fitted = _best_first(_fitted(chosen, name, before.model, prepared))
    if fitted[0].trial.train > prepared.rule.clean:
        model = with_law_of(before.model, fitted[0])
        surface = _explained(before, fitted[0], prepared.rule) < LEARN.enough
        tried = _second_look(residual_of(train, model), fitted, (parts, along), surface)
        more = _fitted(tried, name, model, prepared)
        fitted = _best_first([*fitted, *more])
    fitted[0] = _finer(fitted[0], name, prepared)
    refusals = [_refusal(before, one, prepared.rule) for one in fitted]
    place = refusals.index("") if "" in refusals else 0
    others = (*fitted[:place], *fitted[place + 1 :])
    return LearnedCurve(name, before, fitted[place], others, refusals[place])


def _best_first(fitted: Sequence[Fitted]) -> list[Fitted]:
    return sorted(fitted, key=lambda one: LEARN.weighed(one.loss, one.curve))


def with_law_of(base: Model, best: Fitted) -> Model:
    """Return a model with the law's values that were fitted together with a curve.

    Alone, the law has absorbed what it can of a large curve. A scan linear in a law so far off
    mistakes a factor of the whole force for one of a part of it; beside a curve that explains most
    of the error the law is nearer to the rig's.
    """
    values = {key: best.trial.model.value(key) for key in base.values}
    return replace(base, values=values)


def _second_look(
    residual: Residual, fitted: Sequence[Fitted], asked: tuple[Sequence[str], Sequence[str]],
    surface: bool) -> list[Promise]:  # fmt: skip
    """Return what promises most beside a law that was fitted together with a curve.

    Parameters
    ----------
    residual : of the model with that law
    fitted : the curves that were fitted before; their parts and signals are not tried again
    asked : names of the parts and signals that are tried
    surface : whether surfaces over two signals are tried as well
    """
    found = _not_yet(promises(residual, *asked), fitted, TRIED)
    if surface:
        found += _not_yet(surfaces(residual, *asked), fitted, SURFACES)
    return found


def _finer(best: Fitted, name: str, prepared: Prepared) -> Fitted:
    """Return a curve with twice the knots where it does better with them, else as it is.

    How many it has is what the scan makes of it; what depends steeply on a signal may need more.
    """
    curve = best.curve
    is_table = not curve.across and curve.part not in (SLIP, RING) and len(curve.knots) <= FINE
    if best.trial.train <= LEARN.coarse or not is_table:
        return best
    again = Promise(curve.finer(), best.loss)
    model = with_law_of(prepared.before.model, best)
    (found,) = _fitted([again], name, model, prepared)
    return found if found.loss <= LEARN.finer * best.loss else best


def _not_yet(found: Sequence[Promise], fitted: Sequence[Fitted], count: int) -> list[Promise]:
    """Return the best `count` promises of parts and signals that no curve was fitted to."""
    done = {one.curve.kind for one in fitted}
    return distinct([one for one in found if one.curve.kind not in done], count)


def _explained(before: Trial, one: Fitted, rule: DecisionRule) -> float:
    """Return the share of the excess z^2 - 1 on held-out runs that a curve explains."""
    return 1.0 - rule.excess(one.trial.z) / max(rule.excess(before.z), 1e-300)


def _refusal(before: Trial, best: Fitted, rule: DecisionRule) -> str:
    """Return why a curve is not kept; "" where it is."""
    why = ""
    if not missing(before, best.trial, rule):
        why = "does not lower the error on held-out runs beyond chance"
    elif _explained(before, best, rule) < LEARN.worth:
        why = "explains too little of the error on held-out runs"
    numbers = f"(z {before.z:.2f} before, {best.trial.z:.2f} with it)"
    return f"The best curve, {best.curve.words()}, {why} {numbers}." if why else ""


def _fitted(chosen: Sequence[Promise], name: str, base: Model, prepared: Prepared) -> list[Fitted]:
    """Return the curves fitted with everything else, from a model's values."""
    texts = {
        f"{name}_{k}": effect_text(f"{name}_{k}", one.curve, "a trial")
        for k, one in enumerate(chosen)
    }
    count = Count("fitting a curve", len(chosen))
    with defined(texts):
        train, held_out = (one.of(one.runs) for one in (prepared.searched, prepared.held_out))
        there = replace(prepared, problem=train, part=None, held_out=held_out)

        def fitted(one: tuple[str, Promise]) -> Fitted:
            own, promise = one
            found = _inside(promise.curve, own, base, there)
            count.done(promise.curve.words())
            return replace(found, trial=_renamed(found.trial, own, name))

        return in_threads(fitted, list(zip(texts, chosen, strict=True)))


def _inside(curve: Curve, own: str, base: Model, prepared: Prepared) -> Fitted:
    """Return a curve fitted inside a model, as the effect `own`.

    From what the scan says of it; where that leaves more error than no curve, from none.

    Parameters
    ----------
    curve : as the scan has it
    own : name of its effect, which is defined
    base : the model that the scan was made beside
    prepared : runs to fit to and those that decide, with the present model
    """
    train, present = prepared.problem, prepared.before.model
    entries = [f"{own}.{entry}" for entry in curve.entries]
    values = dict(zip(entries, begun(curve), strict=True))
    memory = {f"{own}.{n}": value for n, value in curve.memory}
    joined = replace(base, effects=(*base.effects, own))

    def fitted_from(values: dict[str, float], beside: Model) -> Model:
        laws = _laws(beside, train)
        starts = (replace(joined, values={**law, **memory, **values}) for law in laws)
        ends = [refine(start, train, SWEEPS) for start in starts]
        return min(ends, key=lambda end: robust_z(train, end))

    model = fitted_from(values, base)
    if robust_z(train, model) > robust_z(train, present):  # the scan, which is linear, misled it
        model = fitted_from(dict.fromkeys(entries, 0.0), present)
    std = intervals_of(train, model).std
    fitted = replace(
        curve, values=tuple(model.value(entry) for entry in entries),
        memory=tuple((n, model.value(f"{own}.{n}")) for n, _ in curve.memory),
    )  # fmt: skip
    if fitted.across:
        fitted = continued(fitted)
        model = replace(
            model, values={**model.values, **dict(zip(entries, fitted.values, strict=True))}
        )
    trial = judge(model, train, prepared.held_out)
    deviations = tuple(std.get(entry, 0.0) for entry in entries)
    return Fitted(fitted, deviations, trial, _left_out(train, model))


def begun(curve: Curve) -> tuple[float, ...]:
    """Return the values (k,) from which a fit of a curve begins, in its unit.

    A map of the command begins above zero: below it the damper sees none, whatever the value, and
    no small step leads back.
    """
    if curve.part != "command":
        return curve.values
    return tuple(
        value if k in curve.held else max(value, (AWAKE - 1.0) * max(knot, 0.0))
        for k, (knot, value) in enumerate(zip(curve.knots, curve.values, strict=True))
    )


def _laws(base: Model, train: Problem) -> list[dict[str, float]]:
    """Return the values of the law from which a fit begins.

    Without what is missing, a fit may have driven the part that falls with speed to a bound, from
    which no small step leads back: so it also begins anew at the size of the rig.
    """
    falling, over = base.law_class.falling()
    names = [name for name in (*falling, over) if name and name not in base.fixed]
    usual = {name: train.scaled(base.law, name) for name in names}
    return [base.values, {**base.values, **usual}] if usual else [base.values]


def _renamed(trial: Trial, own: str, name: str) -> Trial:
    """Return a trial whose model names an effect by another name."""
    model = trial.model
    values = {
        f"{name}{key[len(own) :]}" if key.startswith(f"{own}.") else key: value
        for key, value in model.values.items()
    }
    effects = tuple(name if effect == own else effect for effect in model.effects)
    return replace(trial, model=replace(model, effects=effects, values=values))


def _left_out(train: Problem, model: Model) -> float:
    """Return the mean squared residual of stretches that a step from a model's fit left out."""
    return Normal(residual_of(train, model)).without_curve()
