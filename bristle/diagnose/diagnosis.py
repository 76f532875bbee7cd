"""A diagnosis: from measurements to a verdict, with the evidence for every claim."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..compare.where import Place
from ..data.derived import derived_velocity
from ..data.measurement import Measurement
from ..identify.fit import Model, Problem, identify, settled
from ..identify.prepare import SHORTEST, prepare
from ..identify.search_context import is_rough, refine
from ..physics.laws import DEFAULT
from .candidates import SECONDS, Trial, judge, try_all, try_members
from .decision import decide
from .experiments import Experiment, separating
from .limits import detectable, untestable
from .mended import mended
from .sensors import SensorFault, sensor_faults
from .unexplained import sentences, unexplained, where
from .unlike import MISFIT, groups, unlike
from .unseen import unseen_fault

Progress = Callable[[str], None]

STRONG = 0.12
"""Share of a residual's power along a coordinate (a correlation of 0.35) that is no accident."""

QUIETEST = 3.0
"""A force must exceed its noise by this factor for a verdict to mean anything."""


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
    law: str = DEFAULT,
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
    law : a damper's law, such as "bingham"
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
    say = progress or (lambda _text: None)
    say("looking for sensor faults")
    faults = sensor_faults([*train, *holdout])
    lacking = _lacking([*train, *holdout], faults)
    noise = _noise([*train, *holdout])
    if lacking:
        return Diagnosis("insufficient", (), " ".join(lacking), sensors=tuple(faults), noise=noise)
    say("smoothing the motion")
    left = [_left(mended(runs, faults)) for runs in (train, holdout)]
    if not all(left):
        told = " ".join(["No run has enough samples that are not clipped.", *_words(faults)])
        return Diagnosis("insufficient", (), told, sensors=tuple(faults), noise=noise)
    problem, held_out = (
        Problem([prepare(one, seed=seed + i) for i, one in enumerate(runs)])
        for runs, seed in zip(left, (0, 1000), strict=True)
    )
    say("fitting the present model")
    if values is None:
        base = identify(
            problem, law, tuple(effects), held=tuple(held), limits=dict(limits or {})
        ).model
    else:
        base = Model(law, tuple(effects), dict(values), tuple(held), dict(limits or {}))
        base = refine(base, problem)
    before = judge(base, problem, held_out)
    drive = "current" if train[0].has("current") and not train[0].has("voltage") else "voltage"
    unseen = unseen_fault(before, problem, held_out, drive)
    if unseen is not None:
        faults.append(unseen.fault)
        problem, held_out, before = unseen.train, unseen.held_out, unseen.trial
    redundant = any(
        run.has("displacement", "velocity") and not derived_velocity(run) for run in train
    )
    instruments = ("delay",) if redundant else ("delay", "velocity_sensor")
    found = _judged(before, problem, held_out, faults, noise, instruments, say)
    return _without_drive(_with_instrument(found), [*train, *holdout])


def _without_drive(found: Diagnosis, runs: Sequence[Measurement]) -> Diagnosis:
    """Return the diagnosis with the doubt that a drive which nobody recorded leaves."""
    driven = any(run.has("voltage") or run.has("current") for run in runs)
    if driven or found.kind != "unknown":
        return found
    doubt = "Neither voltage nor current was recorded: a drive that changed would look like this."
    return replace(found, words=f"{found.words} {doubt}")


def _judged(
    before: Trial,
    problem: Problem,
    held_out: Problem,
    faults: list[SensorFault],
    noise: dict[str, float],
    instruments: Sequence[str],
    say: Progress,
) -> Diagnosis:
    say("trying every effect inside the model")
    trials = try_all(before.model, problem, held_out, instruments=instruments)

    def grow(first: Trial) -> list[Trial]:
        say(f"no single effect suffices: adding a second one to {first.effects[-1]}")
        return try_all(first.model, problem, held_out, instruments=instruments, most=SECONDS)

    def reduce(pair: Trial) -> list[Trial]:
        return try_members(pair, before.model, problem, held_out)

    rest = where(before, held_out)
    strong = bool(rest) and rest[0].significant and rest[0].share > STRONG
    decision = decide(before, trials, grow, strong, reduce)
    expected = problem.expectation(before.model)
    visible = detectable(problem, expected)
    hidden = untestable(before.model, problem, expected, visible)
    kind, words = decision.kind, list(decision.reasons)
    if kind == "unknown" and before.train <= 1.1:
        kind = "insufficient"
        words.append(
            "The model fits the runs that it was fitted to: the others differ from them in "
            "something that no channel shows."
        )
    if kind == "none" and decision.best.train > MISFIT:
        kind, words = "insufficient", [unlike(decision.best.model, problem, held_out)]
    mixed = groups(before.model, problem, held_out) if kind == "unknown" else ""
    if mixed:
        kind, words = "insufficient", [mixed]
    experiment = None
    if kind == "class":
        members = [t.model for t in trials if set(t.effects) & set(decision.effects)]
        experiment = separating(members, problem)
    words += _words(faults)
    if kind == "none":
        words.append(f"An effect that leaves {visible:.2%} of the force would have been seen.")
    say("intervals")
    fitted = settled(problem, decision.best.model, 4)
    after = decision.best
    if is_rough(after.model):
        after = min(after, judge(fitted.model, problem, held_out), key=lambda one: one.z)
    told = {name: s for name, s in fitted.std.items() if name not in fitted.unidentified}
    coordinate = ""
    if kind == "unknown":
        coordinate, rest = unexplained(before, trials, rest, held_out)
        words += sentences(coordinate, rest)
    return Diagnosis(
        kind, decision.effects, " ".join(words), before, after, tuple(trials),
        tuple(faults), tuple(hidden), visible, coordinate, tuple(rest), experiment, noise,
        decision.explained, told,
    )  # fmt: skip


def _with_instrument(found: Diagnosis) -> Diagnosis:
    """Return the diagnosis with `velocity_sensor` named where the channels show its lag."""
    if not any(fault.fault in ("lag", "high-pass") for fault in found.sensors):
        return found
    if found.kind not in ("none", "effect"):
        return found
    return replace(found, kind="effect", effects=("velocity_sensor", *found.effects))


def _left(runs: Sequence[Measurement]) -> list[Measurement]:
    """Return the runs without those of which a fault has left too few samples."""
    return [
        run
        for run in runs
        if len(run.time) < SHORTEST or np.count_nonzero(run.told(*run.channels)) >= SHORTEST
    ]


def _words(faults: Sequence[SensorFault]) -> list[str]:
    return [fault.words for fault in faults]


def _noise(runs: Sequence[Measurement]) -> dict[str, float]:
    """Return the median noise of each channel over the runs, in SI."""
    names = dict.fromkeys(name for run in runs for name in run.noise)
    return {
        name: float(np.median([run.noise[name] for run in runs if name in run.noise]))
        for name in names
    }


def _lacking(runs: Sequence[Measurement], faults: Sequence[SensorFault]) -> list[str]:
    """Return what keeps these data from carrying a verdict, in sentences."""
    out = []
    force = np.concatenate([run["force"] for run in runs if run.has("force")] or [np.zeros(1)])
    spread = float(np.std(force))
    noise = float(np.median([run.noise.get("force", 0.0) for run in runs]))
    if spread <= 0.0:
        out.append("The force is constant: there is nothing to explain.")
    elif spread < QUIETEST * noise:
        out.append(
            f"The force's noise, {noise:.3g} N, is nearly the force itself, {spread:.3g} N RMS: "
            f"at least {QUIETEST:g} times are needed."
        )
    for channel in ("displacement", "velocity"):
        able = [run[channel] for run in runs if run.has(channel)]
        if able and float(np.ptp(np.concatenate(able))) == 0.0:
            out.append(f"The {channel} does not change: without motion no damper shows anything.")
    out += [fault.words for fault in faults if fault.fault == "unrelated"]
    cut = [fault for fault in faults if fault.channel == "force" and fault.fault == "clipping"]
    if cut:
        share = float(np.mean(np.abs(force) >= cut[0].value * (1.0 - 1e-9)))
        if share > 0.2:
            out.append(f"The force stands at the end of its range in {share:.0%} of the samples.")
    return out
