"""A diagnosis: from measurements to a verdict, with the evidence for every claim."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..compare.where import Place
from ..data.measurement import Measurement
from ..identify.fit import Model, multistart_refit
from ..identify.search_context import is_rough
from .candidates import Trial, judge
from .decision import Decision, decide
from .experiments import Experiment, separating
from .faults import SensorFault, instruments_of, words_of
from .inconsistent_runs import groups, inconsistent_runs
from .limits import detectable, untestable
from .opening import Insufficient, Opening, Progress, Trials, opening, silent
from .remaining_residual import remaining_residual, sentences
from .rule import BENCH, DecisionRule


@dataclass(frozen=True)
class Diagnosis:
    """The verdict on a model, and what it rests on.

    `kind`, `effects`, ... as in verdict.json; `before` the trial of the model as it was, refitted;
    `after` the one of the model that the verdict names; `trials` all single effects, best first.
    """

    kind: str
    effects: tuple[str, ...]
    words: str
    before: Trial | None = None
    after: Trial | None = None
    trials: tuple[Trial, ...] = ()
    sensors: tuple[SensorFault, ...] = ()
    untestable: tuple[str, ...] = ()
    detectable: float = float("nan")
    coordinate: str = ""
    places: tuple[Place, ...] = ()
    experiment: Experiment | None = None
    noise: Mapping[str, float] = field(default_factory=dict)
    explained: float = 0.0
    std: Mapping[str, float] = field(default_factory=dict)

    @property
    def values(self) -> dict[str, float]:
        """Values of the parameters by name [SI] of the model that the verdict names."""
        return {} if self.after is None else dict(self.after.model.values)

    def as_dict(self) -> dict[str, Any]:
        """Return the content of verdict.json."""
        before = self.before
        ranking = [
            {
                "effect": trial.effects[-1],
                "z_holdout": round(trial.z, 4),
                "gain": round(1.0 - trial.z / before.z, 4) if before else None,
                "refined": trial.refined,
            }
            for trial in self.trials
        ]
        answer: dict[str, Any] = {
            "schema": 1,
            "kind": self.kind,
            "effects": list(self.effects),
            "ranking": ranking,
            "noise_floor": {name: float(value) for name, value in self.noise.items()},
            "untestable": list(self.untestable),
            "sensors": [fault.as_dict() for fault in self.sensors],
            "words": self.words,
        }
        if before is not None:
            after = self.after or before
            answer["z_holdout_before"] = round(before.z, 4)
            answer["z_holdout_after"] = round(after.z, 4)
            answer["z_train_before"] = round(before.train, 4)
            answer["z_train_after"] = round(after.train, 4)
            answer["rms_holdout_before"] = before.rms
            answer["rms_holdout_after"] = after.rms
            answer["explained"] = round(self.explained, 4)
        if np.isfinite(self.detectable):
            answer["detectable"] = round(self.detectable, 5)
        if self.coordinate:
            answer["coordinate"] = self.coordinate
        if self.places:
            answer["organised"] = [
                {"coordinate": one.coordinate, "share": round(one.share, 4), "p": one.p}
                for one in self.places[:5]
            ]
        if self.experiment is not None:
            answer["separate_by"] = self.experiment.words()
        return answer


def diagnose(
    train: Sequence[Measurement],
    holdout: Sequence[Measurement],
    *,
    law: str = "lugre",
    effects: Sequence[str] = (),
    values: Mapping[str, float] | None = None,
    held: Sequence[str] = (),
    limits: Mapping[str, tuple[float, float]] | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Return which effect a damper's model misses on a test bench.

    Parameters
    ----------
    train, holdout : measurements to fit to, and those that decide
    law : {"bingham", "lugre"}
    effects : the effects that the model has already
    values : its parameters where they were identified before, by name in SI; else they are
        identified here
    held, limits : parameters that stay as they are, and a user's bounds; see `identify.Model`
    progress : called with a sentence at each stage

    Raises
    ------
    RecordError
        If a run lacks a channel that is needed, or is too short for a fit.
    """
    say = progress or silent
    present = Model(law, tuple(effects), dict(values or {}), tuple(held), dict(limits or {}))
    opened = opening(train, holdout, present, identified=values is not None, say=say)
    if isinstance(opened, Insufficient):
        told = " ".join(opened.reasons)
        return Diagnosis("insufficient", (), told, sensors=opened.faults, noise=opened.noise)
    found = _judged(opened, say)
    return _without_drive(_with_instrument(found), [*train, *holdout])


def _without_drive(found: Diagnosis, runs: Sequence[Measurement]) -> Diagnosis:
    """Return the diagnosis with the doubt that a drive which nobody recorded leaves."""
    driven = any(run.has("voltage") or run.has("current") for run in runs)
    if driven or found.kind != "unknown":
        return found
    doubt = "Neither voltage nor current was recorded: a drive that changed would look like this."
    return replace(found, words=f"{found.words} {doubt}")


def is_organised(share: float, p: float, rule: DecisionRule = BENCH) -> bool:
    """Return whether a coordinate organises a residual strongly, and beyond chance.

    `share` of its power lies along the coordinate; `p` is the probability that chance does that.
    """
    return p <= rule.chance and share > rule.organised


def kind_of(decision: Decision, before: Trial, rule: DecisionRule = BENCH) -> str:
    """Return the kind of a verdict: a decision's, unless the runs contradict each other."""
    if decision.kind == "unknown" and before.train <= rule.trained:
        return "insufficient"
    if decision.kind == "none" and decision.best.train > rule.misfit:
        return "insufficient"
    return decision.kind


def _kind_and_words(
    decision: Decision, opened: Opening, rule: DecisionRule
) -> tuple[str, list[str]]:
    """Return a decision's kind and reasons, or how the runs contradict each other."""
    before, problem, held_out = opened.before, opened.problem, opened.held_out
    kind, words = kind_of(decision, before, rule), list(decision.reasons)
    if kind == "insufficient" and decision.kind == "unknown":
        words.append(
            "The model fits the runs that it was fitted to: the others differ from them in "
            "something that no channel shows."
        )
    if kind == "insufficient" and decision.kind == "none":
        words = [inconsistent_runs(decision.best.model, problem, held_out, rule)]
    mixed = groups(before.model, problem, held_out, rule) if kind == "unknown" else ""
    return ("insufficient", [mixed]) if mixed else (kind, words)


def _judged(opened: Opening, say: Progress, rule: DecisionRule = BENCH) -> Diagnosis:
    before, problem, held_out = opened.before, opened.problem, opened.held_out
    faults, noise = opened.faults, opened.noise
    made = Trials(opened, say)
    trials, rest = made.single, made.patterns
    organised = bool(rest) and is_organised(rest[0].share, rest[0].p, rule)
    decision = decide(before, trials, made.grow, organised, made.reduce, rule)
    expected = problem.expectation(before.model)
    visible = detectable(problem, expected, rule)
    hidden = untestable(before.model, problem, expected, visible, rule)
    kind, words = _kind_and_words(decision, opened, rule)
    experiment = None
    if kind == "class":
        members = [t.model for t in trials if set(t.effects) & set(decision.effects)]
        experiment = separating(members, problem)
    words += words_of(faults)
    if kind == "none":
        words.append(f"An effect that leaves {visible:.2%} of the force would have been seen.")
    say("intervals")
    fitted = multistart_refit(problem, decision.best.model, 4)
    after = decision.best
    if is_rough(after.model):
        after = min(after, judge(fitted.model, problem, held_out), key=lambda one: one.z)
    told = {name: s for name, s in fitted.std.items() if name not in fitted.unidentified}
    coordinate = ""
    if kind == "unknown":
        coordinate, rest = remaining_residual(before, trials, rest, held_out, rule)
        words += sentences(coordinate, rest, rule)
    return Diagnosis(
        kind, decision.effects, " ".join(words), before, after, tuple(trials),
        tuple(faults), tuple(hidden), visible, coordinate, tuple(rest), experiment, noise,
        decision.explained, told,
    )  # fmt: skip


def _with_instrument(found: Diagnosis) -> Diagnosis:
    """Return the diagnosis with the instrument named whose effect the channels show."""
    named = instruments_of(found.sensors)
    if not named or found.kind not in ("none", "effect"):
        return found
    return replace(found, kind="effect", effects=(*named, *found.effects))
