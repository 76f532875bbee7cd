"""Which model the package arrives at where nobody names law, effect or curve: on training runs.

The same steps as `bristle study auto --law all --learn --closure`. Every one is judged on
a part of the training runs, split off as `bristle study new` splits, so that runs held out see the
end alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace

from bristle.core.finding import Finding
from bristle.core.progress import tell
from bristle.data.measurement import Measurement
from bristle.diagnosis.joint_search import TrialsByLaw
from bristle.diagnosis.law_choice import choose, search
from bristle.diagnosis.law_trials import LawTrial, try_laws
from bristle.diagnosis.prepared import Prepared, corrected
from bristle.diagnosis.rig_runs import BenchRuns
from bristle.diagnosis.site import diagnose_damper
from bristle.diagnosis.site_diagnosis import SiteDiagnosis
from bristle.diagnosis.trials import Trial, judge
from bristle.identification.prepare import prepare
from bristle.identification.problem import Problem, has_offset, zero_of
from bristle.identification.rig import DAMPER, Site
from bristle.identification.rig_fit import fit_site
from bristle.learning.closure import learn_closure, trained_beside
from bristle.learning.closure_file import closure_text
from bristle.learning.curve import Curve
from bristle.learning.effect_file import effect_text
from bristle.learning.fit import learn
from bristle.model.model import Model
from bristle.physics.laws import DEFAULT
from bristle.study.auto import MOST_EFFECTS
from bristle.study.identify import FitTask
from bristle.study.inputs import runs_of
from bristle.study.runs import Runs
from bristle.study.unproven import unproven
from bristle.user_code.load import define, defined

from ._floor import errors_of, share_of


@dataclass(frozen=True)
class Found:
    """A model with its curves, and how the steps to it did on the part that judged them.

    `z` error / noise there; `faults` of the channels, as the training runs show them; `closed`
    whether a closure lowered the error on that part beyond its scatter.
    """

    model: Model
    curves: tuple[Curve, ...]
    z: float
    faults: tuple[Finding, ...]
    free_zero: bool
    closed: bool = False

    @property
    def words(self) -> str:
        """Law, effects and curves."""
        effects = [one for one in self.model.effects if not one.startswith(NAME)]
        closure = ["a closure"] if self.closed else []
        return " + ".join(
            [self.model.law, *effects, *(one.words() for one in self.curves), *closure]
        )


NAME = "learned_"
"""Begin of the names of curves."""

CLOSURE = "closure_1"


def bare_laws(train: Sequence[Measurement]) -> list[Found]:
    """Return the laws, that of least plain error on the part of training runs that judges first.

    Raises
    ------
    ValueError
        If the training runs carry no verdict.
    """
    _, data, rows = _laws(train)
    ranked = sorted((row.trial for row in rows), key=lambda trial: trial.rms)
    return [Found(one.model, (), one.z, data.faults, False) for one in ranked]


def steps(train: Sequence[Measurement]) -> tuple[Found, Found, Found]:
    """Return the models that training runs lead to: law with effects, with curves, with a closure.

    Parameters
    ----------
    train : the training runs; a part of them judges the steps

    Raises
    ------
    ValueError
        If the training runs carry no verdict.
    """
    split, data, rows = _laws(train)

    by_law = TrialsByLaw(data)
    chosen = by_law.settled(choose(search(rows, by_law)), data)
    finding, opened = _with_effects(split, chosen.finding, chosen.prepared)
    free = _found(_with_unproven(opened, finding.trials, rows), ())
    return (free, *_with_curves(opened))


def _laws(train: Sequence[Measurement]) -> tuple[Runs, BenchRuns, tuple[LawTrial, ...]]:
    """Return training runs split in two, prepared, and the trials of all laws on them."""
    split = runs_of(list(train), [])
    data = BenchRuns(split.train, split.holdout, Model(DEFAULT))
    if data.lacking is not None:
        raise ValueError(str(data.lacking))
    tell("trying every law")
    return split, data, try_laws(*data.damper, Model(DEFAULT), bends=data.bends)


def _with_effects(
    split: Runs, finding: SiteDiagnosis, opened: Prepared
) -> tuple[SiteDiagnosis, Prepared]:
    """Add effects as long as one is named; see `study auto`."""
    while finding.kind == "effect" and finding.model is not None:
        tell(f"{finding.model.law} + {' + '.join(finding.model.effects)}")
        model = _identified(finding.model, opened.problem)
        again = BenchRuns(split.train, split.holdout, model, identified=True).prepare(DAMPER)
        opened = again
        if len(model.effects) >= MOST_EFFECTS:
            break
        finding, opened = diagnose_damper(opened)
    return finding, opened


def _with_unproven(
    opened: Prepared, trials: Sequence[Trial] = (), laws: Sequence[LawTrial] = ()
) -> Prepared:
    """Add what improves the prediction on parts left out."""
    if opened.before.z <= opened.rule.clean:
        return opened
    found = unproven(opened, trials, laws if not opened.before.effects else (), MOST_EFFECTS)
    for name, text in found.written.items():
        define(name, text)  # for this job's process
    model = _identified(found.model, opened.problem)
    return replace(opened, before=judge(model, opened.problem, opened.held_out))


def _with_curves(opened: Prepared) -> tuple[Found, Found]:
    """Learn curves as long as one lowers the error beyond chance and the model is not full.

    Then a closure: the second one has it, where it is kept.
    """
    curves: tuple[Curve, ...] = ()
    with ExitStack() as stack:
        while len(opened.before.model.effects) < MOST_EFFECTS:
            name = f"{NAME}{len(curves) + 1}"
            tell(f"{name} (z {opened.before.z:.2f})")
            learned = learn(opened, name)
            if learned.refused or learned.best is None:
                break
            curve = learned.best.curve
            curves = (*curves, curve)
            stack.enter_context(defined({name: effect_text(name, curve, "a benchmark")}))
            opened = replace(
                opened, before=learned.best.trial, problem=opened.problem.of(opened.problem.runs),
                held_out=opened.held_out.of(opened.held_out.runs), part=None,
            )  # fmt: skip
        opened = _with_unproven(opened)
        found = _found(opened, curves)
        tell("a closure")
        return found, replace(found, closed=not learn_closure(opened, CLOSURE, names=False).refused)


def _found(opened: Prepared, curves: tuple[Curve, ...]) -> Found:
    before = opened.before
    return Found(before.model, curves, before.z, opened.faults, opened.problem.free_zero)


def opened_once(found: Found, train: Sequence[Measurement], held: Sequence[Measurement]) -> float:
    """Return the error of a model on held-out runs, fitted to all training runs [1].

    Parameters
    ----------
    found : the model, its values those of a part of the training runs
    train, held : the runs that it is fitted to, and those that judge it
    """
    texts = {
        f"{NAME}{k}": effect_text(f"{NAME}{k}", curve, "a benchmark")
        for k, curve in enumerate(found.curves, 1)
    }
    with defined(texts):
        problem, judging = corrected_runs(found, train, held)
        model = _identified(found.model, problem)
        zero = zero_of(problem, model)[0] if found.free_zero and not has_offset(model) else 0.0
        if found.closed:
            return with_closure(model, problem, judging, zero)
        return share_of(errors_of(model, judging, zero), judging.runs)


def with_closure(model: Model, problem: Problem, judging: Problem, zero: float = 0.0) -> float:
    """Return the error of a model on held-out runs, with a closure where training folds want one.

    Parameters
    ----------
    model : fitted to the training runs
    problem, judging : the runs that the closure is trained on, and those that judge it
    zero : of the force [N]
    """
    found = trained_beside(problem, model)
    if found is None:
        return share_of(errors_of(model, judging, zero), judging.runs)
    closure, beside, _ = found
    with defined({CLOSURE: closure_text(CLOSURE, closure, "a benchmark")}):
        joined = replace(beside, effects=(*beside.effects, CLOSURE))
        return share_of(errors_of(joined, judging, zero), judging.runs)


def _identified(model: Model, problem: Problem) -> Model:
    """Return a model fitted as `bristle identify` and `bristle add` do.

    From several starts and from the model's own values, which the search for effects came to and
    which may be a local minimum: the least cost on these runs counts.
    """
    site = Site(DAMPER, lambda _: problem)
    return fit_site(model, site, {DAMPER: site}, FitTask.starts, model.values).model


def corrected_runs(
    found: Found, train: Sequence[Measurement], held: Sequence[Measurement]
) -> tuple[Problem, Problem]:
    """Return training and held-out runs without the faults that the training runs show."""
    problem, judging = (
        Problem([prepare(run) for run in corrected(part, found.faults)]) for part in (train, held)
    )
    problem.free_zero = found.free_zero
    return problem, judging
