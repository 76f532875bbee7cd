"""The next tests of a study: what they are for, what they are, and what they will show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from ..diagnose.bench import BenchRuns
from ..diagnose.opening import Opening
from ..diagnose.rule import BENCH
from ..errors import StudyError
from ..findings import command, unknown
from ..identify.model import Run
from ..physics.drive import DRIVES
from ..physics.effect import EFFECTS, plain_name
from ..progress import tell
from ..quantity import plain, short_z
from ..study.identification import as_model
from ..study.study import Study
from .folder import PlanFolder, PlannedRun, write_plan
from .goal import Measured, Purposes, Stated, stated
from .knowledge import Question
from .motions import Waveform
from .outcome import Outcome, outcomes
from .planned_test import Signals, Test
from .purposes import cost_of
from .questions import SizedRival, effects_beside, open_parts, rivals
from .rig_limits import RigLimits, limits_of_runs, with_given
from .search import Planner

MANY = 10
"""How many times as many tests as are planned are still told of."""

GAINED = 0.1
"""Share by which a plan must lower its figures on average; below that nothing is left to gain."""

DRAWS = 4
"""Draws of the motion's error that planned runs are judged with."""


@dataclass(frozen=True)
class Wish:
    """What a plan shall be for: None for a purpose that is not asked for, () for all it can be.

    Attributes
    ----------
    separate : tuple of str
        Rivals: effects, laws, or "none" for the model as it is.
    see : tuple of str
        Effects.
    sharpen : tuple of str
        Parameters of law and effects, or effects.
    learn : tuple of str
        Coordinates on which an unknown part may depend.
    """

    separate: tuple[str, ...] | None = None
    see: tuple[str, ...] | None = None
    sharpen: tuple[str, ...] | None = None
    learn: tuple[str, ...] | None = None

    @property
    def nothing(self) -> bool:
        """Whether no purpose is given."""
        return self == Wish()


@dataclass(frozen=True)
class Plan:
    """The next tests of a rig.

    Attributes
    ----------
    study : str
        The study's name, "" before the first measurement.
    tests : tuple of Test
        The tests, in order; those at odd places are held out.
    signals : tuple of Signals
        What each prescribes, at the controller's rate.
    outcomes : tuple of Outcome
        What they will show, beside what the runs at hand show.
    limits : RigLimits
        Within which they are.
    drive : str
        The channel of the command, "" where there is none.
    gain : float
        By what factor the figures become smaller on average.
    notes : tuple of str
        What weakens the plan, in sentences.
    """

    study: str
    tests: tuple[Test, ...]
    signals: tuple[Signals, ...] = field(repr=False)
    outcomes: tuple[Outcome, ...]
    limits: RigLimits
    drive: str
    gain: float
    notes: tuple[str, ...] = ()

    @property
    def worth(self) -> bool:
        """Whether the tests would show what the runs at hand do not."""
        return self.gain > 1.0 + GAINED

    def runs(self) -> list[PlannedRun]:
        """Return the runs as a plan's folder holds them."""
        drive = DRIVES.get(self.drive)
        out = []
        for k, (test, signals) in enumerate(zip(self.tests, self.signals, strict=True)):
            channels = {"displacement": signals.x}
            if drive is not None:
                channels[drive.name] = signals.V
            role = "holdout" if k % 2 else "train"
            about = test.words(signals, drive)
            out.append(PlannedRun(f"plan_{k + 1}", role, about, signals.time, channels))
        return out

    def sentences(self) -> list[str]:
        """Return the plan as an engineer would say it."""
        if not self.worth:
            return [
                *self.notes,
                *self._left_open(),
                "Nothing is left to gain: no test within these limits would show more.",
            ]
        return [
            *self.notes,
            *(f"{run.name} ({run.role}): {run.about}." for run in self.runs()),
            *self._left_open(),
        ]

    def _left_open(self) -> list[str]:
        """Return what the tests do not settle, and whether another one would."""
        out = []
        for one in self.outcomes:
            if one.settled:
                continue
            apart = (
                f"at best they differ by {plain(one.then, 2)} standard deviations{self._more(one)}."
            )
            if not one.beyond:
                out.append(f"{one.name}: not settled by these tests; --{one.purpose} it alone.")
            elif one.purpose == "separate":
                out.append(f"{one.name}: no test within these limits tells them apart; {apart}")
            else:
                out.append(
                    f"{one.name}: no test within these limits shows it; the model takes it up."
                )
        return out

    def _more(self, one: Outcome) -> str:
        """Return how many tests of this kind would tell rivals apart, "" where far too many."""
        gained = one.then**2 - one.now**2
        if one.purpose != "separate" or gained <= 0.0:
            return ""
        count = len(self.tests) * (BENCH.tells**2 - one.now**2) / gained
        return f"; about {ceil(count)} such tests would" if count <= MANY * len(self.tests) else ""

    def write(self, folder: Path | str) -> Path:
        """Write the tests as files for a controller, a picture each; return the folder.

        Raises
        ------
        StudyError
            If the folder is there already or cannot be written.
        """
        from .picture import plan_files

        path = Path(folder)
        write_plan(
            PlanFolder("bench", self.study, self.limits.rate, tuple(self.runs())), path,
            plan_files(self),
        )  # fmt: skip
        return path

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        return {
            "study": self.study, "gain": round(self.gain, 4), "worth": self.worth,
            "notes": list(self.notes),
            "runs": [
                {"name": run.name, "role": run.role, "about": run.about} for run in self.runs()
            ],
            "outcomes": [one.as_dict() for one in self.outcomes],
        }  # fmt: skip


def plan_study(
    study: Study,
    wish: Wish | None = None,
    *,
    limits: Mapping[str, Any] | None = None,
    record: Waveform | None = None,
    seed: int = 1,
) -> Plan:
    """Return the next tests of a study of a damper on a bench.

    Parameters
    ----------
    study : Study
    wish : what they shall be for; None for what the verdict leaves open, or else all
    limits : of the rig, as arguments of `RigLimits`; what is not given is what the runs have done
    record : a recorded motion that may be scaled
    seed : of what is drawn

    Raises
    ------
    StudyError
        If the limits allow no test, or a purpose names what there is not.
    RecordError
        If a file cannot be read.
    """
    opened = _opened(study)
    runs = [*opened.problem.runs, *opened.held_out.runs]
    rig = with_given(limits_of_runs(runs), limits or {})
    wish = wish if wish is not None and not wish.nothing else default_wish(study)
    purposes = _purposes(wish, opened, rig, study.drive)
    measured = Measured(opened.problem.runs, opened.held_out.runs)
    found = stated(purposes, opened.searched, measured, max(opened.before.z, 1.0), seed)
    tell("looking at tests")
    planner = Planner(
        found.goal, rig, float(np.median([run.noise for run in runs])), _errors(runs[0]),
        1.0 / runs[0].dt, record, seed, runs[0].drive,
    )  # fmt: skip
    made = planned(study.name, found, planner, study.drive)
    return replace(made, notes=_notes(study, opened))


def _notes(study: Study, opened: Opening) -> tuple[str, ...]:
    """Return what weakens a plan: an error that an effect would take away first."""
    verdict, z = study.verdict() or {}, opened.before.z
    if verdict.get("kind") == "effect" and verdict["effects"]:
        named = [name for name in map(plain_name, verdict["effects"]) if name in EFFECTS]
        missing = [name for name in named if name not in opened.before.effects]
        if missing:
            add = command("add", study.folder, *missing)
            return (f"The model misses {', '.join(missing)}; a plan shows more after  {add} .",)
    if z > opened.rule.clean:
        return (f"The model errs by {short_z(z)} times the noise; the plan counts that as noise.",)
    return ()


def planned(name: str, found: Stated, planner: Planner, drive: str) -> Plan:
    """Return the plan that serves a goal."""
    goal, limits = found.goal, planner.limits
    tests = planner.plan()
    after = goal.with_tests(tests)[: goal.count]
    told = outcomes(found.purposes, found.asked, found.known, after)
    told = [one if one.settled else _or_beyond(one, found, planner) for one in told]
    costs = [cost_of(found.purposes.figures(one)) for one in (found.known, after)]
    gain = float(np.exp(costs[0] - costs[1]))
    return Plan(
        name, tuple(one.test for one in tests),
        tuple(one.test.signals(limits) for one in tests),
        tuple(told), limits, drive, gain,
    )  # fmt: skip


def _or_beyond(left: Outcome, found: Stated, planner: Planner) -> Outcome:
    """Return what a plan leaves open, with whether a test of its own would settle it."""
    for one in planner.looked_at():
        after = found.goal.with_tests([one, one])[: found.goal.count]
        told = outcomes(found.purposes, found.asked, found.known, after)
        if any(other.name == left.name and other.settled for other in told):
            return left
    return replace(left, beyond=True)


def _errors(run: Run) -> Any:
    """Return draws (d, n, 4) of the motion's error, that of the command left out."""
    out = run.draws[:DRAWS].copy()
    out[:, :, 3] = 0.0
    return out


def _opened(study: Study) -> Opening:
    """Return the model of a study with its runs."""
    study.usable_effects()
    model, runs = study.model(), study.runs()
    identified = any(value.origin == "identified" for value in model.flat().values())
    opened = BenchRuns(runs.train, runs.holdout, as_model(model), identified, tell).open_damper()
    if not isinstance(opened, Opening):
        raise StudyError(f"{study.folder}: {' '.join(opened.reasons)}")
    return opened


def default_wish(study: Study) -> Wish:
    """Return what a plan is for where nobody says: what the verdict leaves open, or else all."""
    verdict = study.verdict() or {}
    kind = verdict.get("kind", "")
    named = tuple(dict.fromkeys(map(plain_name, verdict.get("effects", ()))))
    if kind == "ambiguous" and len(named) > 1 and all(name in EFFECTS for name in named):
        return Wish(separate=named)
    if kind == "unknown":
        return Wish(sharpen=(), learn=())
    return Wish(see=(), sharpen=())


def _purposes(wish: Wish, opened: Opening, limits: RigLimits, drive: str) -> Purposes:
    """Return what a plan is for, with the models and effects that this takes."""
    model = opened.before.model
    effects: tuple[SizedRival, ...] = ()
    others: tuple[Question, ...] = ()
    parts = None
    if wish.see is not None:
        tell("looking at effects")
        effects = tuple(effects_beside(opened, wish.see))
    if wish.separate is not None:
        others = tuple(rivals(opened, wish.separate))
    if wish.learn is not None:
        parts = open_parts(model, limits, wish.learn, drive or "voltage")
    parameters = () if wish.sharpen is None else parameters_of(model.free(), wish.sharpen)
    return Purposes(model, effects, others, parameters, parts)


def parameters_of(free: Sequence[str], names: Sequence[str]) -> tuple[str, ...]:
    """Return the parameters that are meant by names of them or of effects; all where empty.

    Raises
    ------
    StudyError
        If a name is that of none.
    """
    out: list[str] = []
    for name in names:
        own = [one for one in free if one == name or one.startswith(f"{name}.")]
        if not own:
            raise StudyError(unknown("parameter", name, free))
        out += own
    return tuple(dict.fromkeys(out)) or tuple(free)
