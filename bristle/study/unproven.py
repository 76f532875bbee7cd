"""What improves the prediction and is not proven: folds of the training runs choose it.

A verdict names an effect where held-out runs prove it. Where they prove none, another law, several
effects together, or a parameter that depends on a label may still predict better. What is taken is
what lowers the error on the training runs left out of the fit; the held-out runs only judge it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, field, replace

import numpy as np

from ..core.arrays import Array
from ..diagnosis.by_label import Dependence, promising
from ..diagnosis.law_trials import LawTrial
from ..diagnosis.prepared import Prepared
from ..diagnosis.trials import LONG, SECONDS, Trial, missed_by, try_all
from ..identification.fit import refine
from ..identification.histories import counted, left
from ..identification.problem import Problem
from ..identification.search import in_threads
from ..learning.closure import errors_of, lowers
from ..model.model import Model
from ..physics.effect import EFFECTS
from ..user_code.load import defined

FOLDS = 3
"""Parts of the training runs that are left out in turn: whole runs, of a single one stretches."""

TRIED = 3
"""Laws, then effects, those that fit the training runs best, that folds compare at each step."""

MOST_SPENT = 200e6
"""Steps of dampers' forces, see `Effort`, from which on nothing further is compared. They are there
however long the verdict took: one that is unknown leaves the user nothing else."""

TOGETHER = 2
"""Dependences on labels that another law is compared with at once, at most."""

SWEEPS = 4
"""Jacobians of the fit to a fold's runs, which begins at the values of all."""

GAIN, BEYOND = 0.03, 1.0
"""Share of the error on the runs left out that a law or an effect takes at least, and by how many
standard errors over them: the rule of one, as in cross-validation, for nothing is proven by it."""


@dataclass(frozen=True)
class Unproven:
    """A model that predicts better: `law` the name of another law that it has, "" for the same.

    `written` are the texts of its effects that change a parameter by a label, by name; `cut` is
    whether something was not compared, because enough was spent.
    """

    model: Model
    law: str = ""
    written: Mapping[str, str] = field(default_factory=dict)
    cut: bool = False


@counted(MOST_SPENT, MOST_SPENT)
def unproven(
    prepared: Prepared,
    trials: Sequence[Trial],
    laws: Sequence[LawTrial],
    most: int,
    labels: bool = True,
) -> Unproven:
    """Return the model with the law and effects that lower its error on runs left out.

    What comes when enough was spent is not compared any more.

    Parameters
    ----------
    prepared : the runs, and the model that effects join
    trials : of that model with one effect more each, as far as they are known
    laws : all laws, fitted, where another one may be taken
    most : how many effects a model has at the most
    labels : whether parameters may depend on labels of the runs
    """

    def dependences(model: Model) -> list[Dependence]:
        return promising(problem, model) if labels else []

    missed = missed_by(prepared.before, prepared.searched)
    data = prepared.with_excess(missed) if missed > 0.0 else prepared
    problem = data.searched
    best, cut = Unproven(refine(prepared.before.model, problem, SWEEPS)), False
    errors = left_out_errors(best.model, problem)

    def gains(candidates: Sequence[Unproven], sweeps: int = 0) -> bool:
        """Take the candidate that lowers the error most, beyond chance; return whether one does.

        Each is refined before, by so many sweeps.
        """
        nonlocal best, errors, cut
        able: list[tuple[float, int, Model, list[Array]]] = []
        for k, one in enumerate(candidates):  # one by one, so that what is spent is told alike
            with _defined(one.written):
                look = 2 * SWEEPS * len(one.model.free()) * problem.steps_of(one.model)
                if look > left():  # nor could its fit be afforded
                    cut = True
                    continue
                model = refine(one.model, problem, sweeps) if sweeps else one.model
                found = left_out_errors(model, problem)
            if lowers(errors, found, GAIN, BEYOND):
                able.append((_mean_square(found), k, model, found))
        if not able:
            return False
        _, k, model, errors = min(able, key=lambda one: one[:2])
        written = {**best.written, **candidates[k].written}
        stay.enter_context(_defined(written))
        best = Unproven(refine(model, problem, LONG), candidates[k].law or best.law, written)
        return True

    with ExitStack() as stay:
        gains(_other_laws(laws, best.model, problem, dependences), LONG)
        while len(best.model.effects) < most and left() >= 0.0:
            texts = {one.name: one.text for one in dependences(best.model)}
            with _defined(texts):
                able = [] if texts else [one for one in trials if _joins(one, best.model)]
                if not able:
                    able = try_all(
                        best.model, problem, data.held_out, shown=data.shown, most=SECONDS
                    )
            if not labels:
                own = best.model.effects
                able = [
                    one
                    for one in able
                    if not any(EFFECTS[name].labels for name in one.effects if name not in own)
                ]
            able.sort(key=lambda one: one.train)
            tried = [
                Unproven(one.model, "", {n: texts[n] for n in one.effects if n in texts})
                for one in able[:TRIED]
            ]
            if not gains(tried):
                break
        model = _without_idle(best.model, prepared.before.model.effects, errors, problem)
    new = {
        name: text
        for name, text in best.written.items()
        if name in model.effects and name not in EFFECTS
    }
    return Unproven(model, best.law, new, cut or left() < 0.0)


def _defined(texts: Mapping[str, str]) -> AbstractContextManager[None]:
    """Define those of the effects that are not defined yet: a verdict names dependences, too."""
    return defined({name: text for name, text in texts.items() if name not in EFFECTS})


def _other_laws(
    laws: Sequence[LawTrial],
    model: Model,
    problem: Problem,
    dependences: Callable[[Model], list[Dependence]],
) -> list[Unproven]:
    """Return the laws that fit the training runs best, each with what its parameters owe labels.

    Where a label parts the runs, a law without it tells little of what the law can do: the
    model's own is among them with it.
    """
    others = [(row.law, row.trial.model) for row in laws if row.trial.model.law != model.law]
    able = []
    for law, own in [("", model), *others] if others else []:
        gain = max((one.gain for one in dependences(own)), default=0.0)
        if law or gain > 0.0:
            rest = _mean_square(errors_of(own, problem)) * (1.0 - gain)
            able.append((rest, gain > 0.0, Unproven(own, law)))
    able.sort(key=lambda one: one[0])
    closer = []
    for rest, labelled, one in able[: 2 * TRIED]:
        if labelled:
            one = _with_labels(one, problem)
            with _defined(one.written):
                rest = _mean_square(errors_of(one.model, problem))
        closer.append((rest, one))
    closer.sort(key=lambda one: one[0])
    return [one for _, one in closer[:TRIED]]


def _with_labels(law: Unproven, problem: Problem) -> Unproven:
    """Return a law with the dependences on labels that promise most, one after the other.

    A yield force and the way to it may both go with a label: one alone then gains little.
    """
    model, written = law.model, dict[str, str]()
    with ExitStack() as stay:
        for _ in range(TOGETHER):
            worth = promising(problem, model)[:1]
            if not worth:
                break
            written[worth[0].name] = worth[0].text
            stay.enter_context(_defined({worth[0].name: worth[0].text}))
            model = refine(model.with_effect(worth[0].name), problem, SWEEPS)
    return Unproven(model, law.law, written)


def _without_idle(
    model: Model, proven: Sequence[str], errors: list[Array], problem: Problem
) -> Model:
    """Return a model without the effects that lower its error on runs left out no more.

    An effect that was taken first may be idle beside those that came later.
    """
    added = [name for name in model.effects if name not in proven]
    for name in added[:-1]:  # the last one was just found to lower the error
        fewer = refine(model.only([n for n in model.effects if n != name]), problem, LONG)
        found = left_out_errors(fewer, problem)
        if not lowers(found, errors, GAIN, BEYOND):
            model, errors = fewer, found
    return model


def _joins(trial: Trial, model: Model) -> bool:
    """Return whether a trial is of a model with one effect more, that is known still."""
    new = {*trial.effects} - {*model.effects}
    added = len(new) == 1 and len(trial.effects) == len(model.effects) + 1
    return trial.model.law == model.law and added and new <= {*EFFECTS}


def _mean_square(errors: Sequence[Array]) -> float:
    return float(np.mean(np.concatenate([*errors]) ** 2))


def left_out_errors(model: Model, problem: Problem) -> list[Array]:
    """Return the errors [N] of a model on each fold, fitted to the others."""

    def errors(fold: tuple[Problem, Problem]) -> list[Array]:
        others, own = fold
        return errors_of(refine(_blind(model, others), others, SWEEPS), own)

    return [error for part in in_threads(errors, [*folds(problem)]) for error in part]


def _blind(model: Model, problem: Problem) -> Model:
    """Return a model that knows no more of labels than its runs tell.

    A dependence begins at none, and stays there where the runs have one level of its label alone.
    """
    values, fixed = {**model.values}, [*model.fixed]
    for name in model.effects:
        effect = EFFECTS[name]
        if not (effect.changes and effect.labels and effect.amount in effect.parameters):
            continue
        own = f"{name}.{effect.amount}"
        values[own] = 0.0
        if all(
            len({run.labels[one] for run in problem.runs}) < 2 for one in effect.labels.values()
        ):
            fixed.append(own)
    return replace(model, values=values, fixed=tuple(fixed))


def folds(problem: Problem) -> Iterator[tuple[Problem, Problem]]:
    """Yield the runs without each fold, and that fold."""
    runs = problem.runs
    for k in range(FOLDS):
        if len(runs) == 1:
            run, n = runs[0], len(runs[0].force)
            own = np.arange(n) * FOLDS // n == k
            without, alone = (
                [replace(run, left_out={**run.left_out, "fold": out})] for out in (own, ~own)
            )
        else:
            without = [run for j, run in enumerate(runs) if j % FOLDS != k]
            alone = [run for j, run in enumerate(runs) if j % FOLDS == k]
        if without and alone:
            yield problem.of(without), problem.of(alone)
