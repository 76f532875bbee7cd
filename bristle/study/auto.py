"""Identify, diagnose and add until a study's model is enough, by one call."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..core.interrupt import keeps
from ..core.progress import tell
from ..diagnosis import Diagnosis
from ..diagnosis.decision import missing
from ..diagnosis.trials import Trial
from ..learning.closure import LearnedClosure
from ..learning.result import LearnedEffect
from ..physics.effect import closures
from .changes import other_data
from .forms import law_or_all
from .history import Step
from .identified import Identified, is_identified
from .identify import identify_study
from .learn import learn_effect, learn_study_closure
from .steps import Say, add_effects, diagnose_study, identify_with, take_law, verdict_of
from .study import Study
from .study_file import ALL

MOST_EFFECTS = 4
"""Effects that `complete` adds at the most: a model that asks for more is the wrong model."""

ABREAST = 1.1
"""Effects whose z is up to this times the smallest are identified before one of them is added.

The search fits each effect from the law's values without it. Where the law is far from the rig,
that fit may end in a local minimum.
"""

MOST_ABREAST = 3
"""Largest number of effects that are identified before one of them is added."""


@dataclass(frozen=True)
class Completed:
    """What `complete` came to: the last diagnosis, and the steps that it made.

    `curves` are those learned where no effect of the library explained the error; `closure` what
    the network came to that was asked for in the end.
    """

    verdict: Diagnosis
    steps: tuple[Step, ...]
    curves: tuple[LearnedEffect, ...] = ()
    closure: LearnedClosure | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        return {
            "verdict": self.verdict.as_dict(),
            **({"learned": [one.as_dict() for one in self.curves]} if self.curves else {}),
            **({"closure": self.closure.as_dict()} if self.closure else {}),
            "steps": [
                {
                    "number": step.number, "what": step.what, "why": step.why,
                    "before": step.before, "after": step.after,
                }
                for step in self.steps
            ],
        }  # fmt: skip


def complete(
    study: Study,
    *,
    law: str | None = None,
    greedy: bool = False,
    curves: bool = False,
    closure: bool = False,
    say: Say = tell,
) -> Completed:
    """Identify, diagnose and add until the verdict is none, ambiguous, unknown or insufficient.

    Each step is in the history when it is made, each law that was fitted in `law_fits`, and
    `interrupt.keeps` says which: calling it again goes on there.

    Parameters
    ----------
    study : the folder, opened
    law : "all" first seeks the law together with its effects; another name is taken first; None
        seeks it where nobody chose one (`laws.law_or_all`)
    greedy : whether to go on where the verdict is unknown, by the effect that lowers the held-out
        error most, as long as one does so by enough and beyond chance; see `gaining`
    curves : whether to go on where the verdict is unknown, by learning a curve
    closure : whether to end with a closure where the verdict is unknown then; the verdict stays
    say : called with a few words at each stage
    """
    steps: list[Step] = []
    learned: list[LearnedEffect] = []

    def stepped(step: Step | None) -> None:
        if step is not None:
            steps.append(step)
            keeps(_kept(steps))

    free = _begun_free(study, law_or_all(study, law), say, stepped)
    while True:
        found = diagnose_study(study, law=ALL if free else study.model().law, say=say)
        keeps(_kept(steps))
        if free:
            found, free = _with_law_taken(study, found, stepped), False
        names, abreast = found.effects if found.kind == "effect" else (), list[Trial]()
        if greedy and found.kind == "unknown" and found.before is not None:
            abreast = gaining(found.before, found.trials)
        if found.kind == "unknown" and curves and not abreast:
            say("learning a curve")
            learned.append(learn_effect(study))
            names = (learned[-1].name,) if learned[-1].file is not None else ()
        names = names or tuple(trial.effects[-1] for trial in abreast[:1])
        if not names or len(study.model().effects) + len(names) > MOST_EFFECTS:
            network = None
            if closure and found.kind == "unknown" and not closures(study.model().effects):
                say("learning a closure")
                network = learn_study_closure(study)
                if network.file is not None:
                    say(f"adding {network.name}")
                    why = f"verdict: {found.kind}"
                    stepped(add_effects(study, (network.name,), why=why, found=found).step)
                    study.write_verdict(verdict_of(study, found))  # on the model without it
            return Completed(found, tuple(steps), tuple(learned), network)
        identified = None
        if len(abreast) > 1:
            names, identified = _best_identified(study, abreast, say)
        say("adding " + " and ".join(names))
        why = f"verdict: {found.kind}"
        added = add_effects(study, names, why=why, found=found, identified=identified)
        stepped(added.step)


_ON = "the same command goes on there, a search for effects that was under way begins anew."


def _kept(steps: Sequence[Step]) -> str:
    """Return what is kept where this ends now, behind a step or a verdict."""
    if not steps:
        return f"The verdict is kept in verdict.json: {_ON}"
    made = "1 step was made and is" if len(steps) == 1 else f"{len(steps)} steps were made and are"
    return f"{made} kept in the study's history: {_ON}"


def _begun_free(
    study: Study, law: str | None, say: Say, stepped: Callable[[Step | None], None]
) -> bool:
    """Return whether the law is to be sought; identify a model that is to keep it, where needed."""
    other = None if law in (ALL, study.model().law) else law
    stale = bool(other_data(study)) or not is_identified(study.model())
    if law != ALL and (other or stale):
        say("identifying the model")
        stepped(identify_study(study, law=other, table=False).step)
    return law == ALL


def gaining(before: Trial, trials: Sequence[Trial]) -> list[Trial]:
    """Return the effects, each alone, that lower an error about as much as the best one.

    Parameters
    ----------
    before : the trial of the model without them
    trials : with one effect more each, the smallest z first

    Returns
    -------
    list of Trial
        The best first, `MOST_ABREAST` at most; none where no effect lowers the error by enough and
        beyond chance.
    """
    able = [trial for trial in trials if missing(before, trial)]
    return [trial for trial in able if trial.z <= ABREAST * able[0].z][:MOST_ABREAST]


def _best_identified(
    study: Study, abreast: Sequence[Trial], say: Say
) -> tuple[tuple[str, ...], Identified]:
    """Return the effect that leaves the least z once identified, and that identification."""
    names = [trial.effects[-1:] for trial in abreast]
    say("these gain about alike and are identified: " + ", ".join(name for (name,) in names))
    found = [
        identify_with(study, name, trial.model.values)
        for name, trial in zip(names, abreast, strict=True)
    ]
    return min(zip(names, found, strict=True), key=lambda one: one[1].z)


def _with_law_taken(
    study: Study, found: Diagnosis, stepped: Callable[[Step | None], None]
) -> Diagnosis:
    """Take the law of a verdict; return the verdict as one on the model that the study then has."""
    taken = take_law(study, found)
    if taken is None or found.laws is None:
        return found
    stepped(taken.step)
    found = replace(found, laws=replace(found.laws, before=found.law))
    study.write_verdict(verdict_of(study, found))
    return found
