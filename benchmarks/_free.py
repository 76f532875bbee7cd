"""Which model the package arrives at where nobody names law, effect or curve: on training runs.

The same steps as `bristle study auto --law all --greedy --learn`. Every one is judged on a part of
the training runs, split off as `bristle study new` splits, so that runs held out see the end alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace

from bristle.data.measurement import Measurement
from bristle.diagnose.corrected import corrected
from bristle.diagnose.damper import look_at_damper
from bristle.diagnose.decision import missing
from bristle.diagnose.faults import SensorFault
from bristle.diagnose.law_free import diagnose_laws
from bristle.diagnose.learned.curve import Curve, effect_text
from bristle.diagnose.learned.fit import learn
from bristle.diagnose.opening import Insufficient, Opening, opening
from bristle.identify.model import Model, Problem
from bristle.identify.prepare import prepare
from bristle.identify.residuals import has_offset, zero_of
from bristle.identify.search_context import refine
from bristle.physics.laws import DEFAULT
from bristle.physics.user import defined
from bristle.study.inputs import runs_of

from ._floor import share_of

MOST = 4
"""Effects and curves that are added at the most, as in `study auto`."""


@dataclass(frozen=True)
class Found:
    """A model with its curves, and how the steps to it did on the part that judged them.

    `z` error / noise there; `faults` of the channels, as the training runs show them.
    """

    model: Model
    curves: tuple[Curve, ...]
    z: float
    faults: tuple[SensorFault, ...]
    free_zero: bool

    @property
    def words(self) -> str:
        """Law, effects and curves."""
        effects = [one for one in self.model.effects if not one.startswith(NAME)]
        return " + ".join([self.model.law, *effects, *(one.words() for one in self.curves)])


NAME = "learned_"
"""Begin of the names of curves."""


def steps(train: Sequence[Measurement]) -> tuple[Found, Found, Found]:
    """Return what training runs lead to: the bare law of least error, law with effects, all.

    Parameters
    ----------
    train : the training runs; a part of them judges the steps
    """
    split = runs_of(list(train), [])
    verdict = diagnose_laws(split.train, split.holdout, Model(DEFAULT))
    after = verdict.after
    if after is None:
        raise ValueError(f"the training runs carry no verdict: {verdict.words}")
    assert verdict.laws is not None
    bare = min((row.trial for row in verdict.laws.rows), key=lambda trial: trial.rms)
    law = Found(bare.model, (), bare.z, verdict.sensors, False)
    model = after.model
    with ExitStack() as stack:
        opened, model = _effects(split.train, split.holdout, model)
        free = _found(opened, ())
        curves: tuple[Curve, ...] = ()
        while len(opened.before.model.effects) < MOST:
            name = f"{NAME}{len(curves) + 1}"
            learned = learn(opened, name)
            if learned.refused or learned.curve is None or learned.after is None:
                break
            curves = (*curves, learned.curve)
            stack.enter_context(defined({name: effect_text(name, learned.curve, "a benchmark")}))
            opened = replace(
                opened, before=learned.after, problem=opened.problem.of(opened.problem.runs),
                held_out=opened.held_out.of(opened.held_out.runs), part=None,
            )  # fmt: skip
        return law, free, _found(opened, curves)


def _effects(
    train: Sequence[Measurement], judging: Sequence[Measurement], model: Model
) -> tuple[Opening, Model]:
    """Add effects as long as one is named, or lowers the error beyond chance; see `study auto`."""
    while True:
        opened = opening(train, judging, model, identified=True)
        if isinstance(opened, Insufficient):
            raise ValueError(" ".join(opened.reasons))
        if len(model.effects) >= MOST:
            return opened, model
        finding, looked = look_at_damper(opened)
        if finding.kind == "effect" and finding.model is not None:
            model = finding.model
            continue
        gaining = [one for one in finding.trials if missing(looked.before, one)]
        if finding.kind != "unknown" or not gaining:
            return looked, looked.before.model
        model = gaining[0].model


def _found(opened: Opening, curves: tuple[Curve, ...]) -> Found:
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
        model = refine(found.model, problem)
        zero = zero_of(problem, model)[0] if found.free_zero and not has_offset(model) else 0.0
        errors = [
            (run.force - judging.predict(model, run) - zero)[run.skip :] for run in judging.runs
        ]
        return share_of(errors, judging.runs)


def corrected_runs(
    found: Found, train: Sequence[Measurement], held: Sequence[Measurement]
) -> tuple[Problem, Problem]:
    """Return training and held-out runs without the faults that the training runs show."""
    problem, judging = (
        Problem([prepare(run) for run in corrected(part, found.faults)]) for part in (train, held)
    )
    problem.free_zero = found.free_zero
    return problem, judging
