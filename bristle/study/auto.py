"""Identify, diagnose and add until a study's model is enough, by one call."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..core.interrupt import keeps
from ..core.progress import tell
from ..diagnosis import Diagnosis
from ..diagnosis.prepared import Prepared
from ..errors import StudyError
from ..identification.histories import compile_ahead, counted, left
from ..learning.closure import LearnedClosure
from ..learning.result import LearnedEffect
from ..physics.effect import EFFECTS, closures
from .forms import law_or_all
from .history import Step
from .identify import identify_study, is_identified
from .learn import learn_effect, learn_study_closure, opened_at, promise_of
from .steps import (
    add_effects,
    add_unproven,
    diagnose_study,
    take_law,
    verdict_of,
    write_effects,
)
from .study import Study, other_data
from .study_file import ALL
from .unproven import unproven

LEFT = 0.5
"""Share of the error on held-out runs that a step leaves at most for a verdict to be made anew."""

MOST_SPENT = 700e6
"""Steps of dampers' forces, see `Effort`, that all verdicts and steps may take together: about
three minutes. A verdict is made anew where twice what the first one took is left."""

NOT_COMPARED = "Further effects were not compared, because the search had taken long enough."

MOST_EFFECTS = 4
"""Effects that `complete` adds at the most: a model that asks for more is the wrong model."""


@dataclass(frozen=True)
class Completed:
    """What `complete` came to: the last diagnosis, and the steps that it made.

    `curves` are those learned where no effect of the library explained the error; `unproven` the
    steps that improve the prediction by what no verdict proves, `refuted` why the one that
    training runs chose was not made, or that not all was compared; `anew` whether the verdict is on
    the model with the first of them; `closure` what the network came to that was asked for in the
    end, `no_closure` why these runs carry none; `promise` what one that was not asked for may leave
    of the error, on left-out parts of the training runs.
    """

    verdict: Diagnosis
    steps: tuple[Step, ...]
    curves: tuple[LearnedEffect, ...] = ()
    unproven: tuple[Step, ...] = ()
    refuted: str = ""
    anew: bool = False
    closure: LearnedClosure | None = None
    no_closure: str = ""
    promise: float = 1.0

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        return {
            "verdict": self.verdict.as_dict(),
            **({"learned": [one.as_dict() for one in self.curves]} if self.curves else {}),
            **({"unproven": [one.what for one in self.unproven]} if self.unproven else {}),
            **({"closure": self.closure.as_dict()} if self.closure else {}),
            **({"closure_may_leave": self.promise} if self.promise < 1.0 else {}),
            "steps": [
                {
                    "number": step.number, "what": step.what, "why": step.why,
                    "before": step.before, "after": step.after,
                }
                for step in self.steps
            ],
        }  # fmt: skip


@counted(MOST_SPENT)
def complete(
    study: Study,
    *,
    law: str | None = None,
    proven: bool = False,
    curves: bool = False,
    closure: bool = False,
) -> Completed:
    """Identify, diagnose and add until the verdict is none, ambiguous, unknown or insufficient.

    Each step is in the history when it is made, each law that was fitted in `law_fits`, and
    `interrupt.keeps` says which: calling it again goes on there.

    Parameters
    ----------
    study : the folder, opened
    law : "all" first seeks the law together with its effects; another name is taken first; None
        seeks it where nobody chose one (`laws.law_or_all`)
    proven : whether to leave out effects that only improve the prediction; else, where the verdict
        proves none in the end, those are added that folds of the training runs choose
    curves : whether to go on where the verdict is unknown, by learning a curve
    closure : whether to end with a closure where the verdict leaves an error; the verdict stays
    """
    steps: list[Step] = []
    learned: list[LearnedEffect] = []
    gained: list[Step] = []

    def stepped(step: Step | None) -> None:
        if step is not None:
            steps.append(step)
            keeps(_kept(steps))

    free = _begun_free(study, law_or_all(study, law), stepped)
    begun, took, anew, opened = left(), 0.0, False, None
    while True:
        model = study.model()
        adds = MOST_EFFECTS - len(model.effects)
        found = diagnose_study(study, law=ALL if free else model.law, adds=adds)
        keeps(_kept(steps))
        took = took or begun - left()
        if free:
            found, free = _with_law_taken(study, found, stepped), False
        names = found.effects if found.kind == "effect" else ()
        if found.kind == "unknown" and curves:
            tell("learning a curve")
            learned.append(learn_effect(study))
            names = (learned[-1].name,) if learned[-1].file is not None else ()
        cut = NOT_COMPARED if found.kind == "effect" and left() < 0.0 else ""
        if not names or cut or len(study.model().effects) + len(names) > MOST_EFFECTS:
            done = Completed(found, (), tuple(learned), tuple(gained), cut, anew)
            if _open(found) and not proven and not study.settings.has_building:
                step, refuted, opened = _gained(study, found, stepped)
                if step is not None:
                    opened = None  # the model is another one
                    gained.append(step)
                    if gained == [step] and halves(step) and left() >= 2.0 * took:
                        anew = True
                        continue  # a verdict on a model that errs twice as much tells little
                done = replace(done, unproven=tuple(gained), refuted=refuted)
            lacks_one = _open(found) and not closures(study.model().effects)
            if lacks_one and closure:
                try:
                    done = replace(done, closure=_closed(study, found, stepped))
                except StudyError as refused:  # the verdict and the steps stand without one
                    done = replace(done, no_closure=str(refused))
            elif lacks_one and not study.settings.has_building:
                done = replace(done, promise=promise_of(study, opened))
            return replace(done, steps=tuple(steps))
        tell("adding " + " and ".join(names))
        stepped(add_effects(study, names, why=f"verdict: {found.kind}", found=found).step)


def _open(found: Diagnosis) -> bool:
    """Return whether a verdict leaves an error that more of a model may lower, proven or not."""
    judged = all(one.after is not None for one in found.findings.values())
    return found.kind in ("unknown", "ambiguous") or (judged and not found.noise_known)


def halves(step: Step) -> bool:
    """Return whether a step halves the error on held-out runs: the verdict is made anew."""
    before, after = (one.get("error_share_holdout") for one in (step.before, step.after))
    return bool(before and after and after <= LEFT * before)


def _gained(
    study: Study, found: Diagnosis, stepped: Callable[[Step | None], None]
) -> tuple[Step | None, str, Prepared]:
    """Add what improves the prediction and is not proven.

    Return the step, why there is none or not all was compared, and what the look began with.
    """
    before = fitted = study.model()
    known = found.before.model if found.before is not None else before
    if (known.law, known.effects) == (before.law, before.effects):
        fitted = replace(before, values={**before.values, **known.values})
    opened = opened_at(study, "", fitted)[1]
    tell("effects that improve the prediction")
    laws = found.laws.rows if found.laws is not None and not before.effects else ()
    refuted = ""
    for labels in (True, False):  # a law of a label may fail at a level that no training run had
        best = unproven(opened, found.trials, laws, MOST_EFFECTS, labels)
        names = tuple(one for one in best.model.effects if one not in before.effects)
        cut = NOT_COMPARED if best.cut else ""
        if not names and not best.law:
            return None, " ".join(filter(None, (refuted, cut))), opened
        write_effects(study, best.written)
        tell("adding " + " and ".join([*names, *([best.law] if best.law else [])]))
        step, why_not = add_unproven(study, best.law, names, best.model.values, found)
        stepped(step)
        refuted = refuted or why_not
        if step is not None or not any(EFFECTS[name].labels for name in names):
            break
    return step, " ".join(filter(None, (refuted, cut))), opened


def _closed(
    study: Study, found: Diagnosis, stepped: Callable[[Step | None], None]
) -> LearnedClosure:
    """Learn a closure and add it where it is kept."""
    tell("learning a closure")
    network = learn_study_closure(study)
    if network.file is not None:
        tell(f"adding {network.name}")
        why = f"verdict: {found.kind}"
        step = add_effects(study, (network.name,), why=why).step  # beside the present values
        stepped(step)
        parts = (step.before, step.after) if step is not None else ()
        falls = tuple(one["error_share_holdout"] for one in parts if "error_share_holdout" in one)
        network = replace(network, falls=falls if len(falls) == len(parts) else ())
        study.write_verdict(verdict_of(study, found))  # on the model without it
    return network


_ON = "the same command goes on there, a search for effects that was under way begins anew."


def _kept(steps: Sequence[Step]) -> str:
    """Return what is kept where this ends now, behind a step or a verdict."""
    if not steps:
        return f"The verdict is kept in verdict.json: {_ON}"
    made = "1 step was made and is" if len(steps) == 1 else f"{len(steps)} steps were made and are"
    return f"{made} kept in the study's history: {_ON}"


def _begun_free(study: Study, law: str | None, stepped: Callable[[Step | None], None]) -> bool:
    """Return whether the law is to be sought; identify a model that is to keep it, where needed."""
    other = None if law in (ALL, study.model().law) else law
    stale = bool(other_data(study)) or not is_identified(study.model())
    if law != ALL and (other or stale):
        study.usable_effects()
        compile_ahead()  # all that the verdict needs, while the model is identified
        tell("identifying the model")
        stepped(identify_study(study, law=other).step)
    return law == ALL


def _with_law_taken(
    study: Study, found: Diagnosis, stepped: Callable[[Step | None], None]
) -> Diagnosis:
    """Take the law of a verdict; return the verdict as one on the model that the study then has."""
    taken = take_law(study, found)
    if taken is None or found.laws is None:
        return found
    stepped(taken.step)
    # The error is that of the model which the study keeps, fitted by its own weights.
    found = replace(found, laws=replace(found.laws, before=found.law), error=taken.errors.at)
    study.write_verdict(verdict_of(study, found))
    return found
