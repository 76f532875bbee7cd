"""The decision where the force's noise is not known: by what effects gain on held-out runs.

No z can be told then, and nothing says how much of an error is noise. So an effect is named for the
part of the whole error that it takes, beyond chance, and "none" is not among the answers.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..compare.names import joined
from ..errors import StudyError
from ..identify.fit import Problem
from ..quantity import plain
from .candidates import Trial
from .decision import Decision, in_runs
from .evidence import paired
from .rule import DecisionRule


def decide_by_gains(
    before: Trial, trials: Sequence[Trial], held_out: Problem, rule: DecisionRule
) -> Decision:
    """Return the decision that gains over held-out runs lead to; see `decision.decide`.

    Parameters
    ----------
    before : the fitted model without a further effect
    trials : one per effect, any order
    held_out : the runs that decide
    rule : the numbers that decide
    """
    force = np.concatenate([run.force[run.skip :][run.judged] for run in held_out.runs])
    size = float(np.sqrt(np.mean(force**2)))

    def share(trial: Trial) -> str:
        return f"{plain(100.0 * trial.rms / size, 2)} %"

    not_known = noise_not_known(held_out)
    able = sorted((one for one in trials if _gains(before, one, rule)), key=lambda trial: trial.rms)
    if not able:
        return Decision(
            "insufficient", (), before, 0.0,
            (
                f"No effect of the library lowers the error; {share(before)} of the force is "
                f"unexplained, noise included. {not_known}",
            ),
        )  # fmt: skip
    best = able[0]
    name, explained = best.effects[-1], 1.0 - (best.rms / before.rms) ** 2
    gained = (
        f"With {name} the error on held-out runs falls from {share(before)} to {share(best)} of "
        "the force, noise included."
    )
    if explained < rule.part:
        return Decision(
            "insufficient", (), before, explained,
            (f"{gained} How much of the rest is noise cannot be told. {not_known}",),
        )  # fmt: skip
    rivals = [one.effects[-1] for one in able[1:] if _equals(best, one, rule)]
    names = (name, *rivals)[: rule.most_alternatives]
    kind = "ambiguous" if rivals else "effect"
    return Decision(kind, names, best, explained, (gained, not_known))


def noise_not_known(problem: Problem) -> str:
    """Return the sentence that says of which channels the noise is not known, and what to do."""
    blind = [run for run in problem.runs if run.untold]
    names = list(dict.fromkeys(name for run in blind for name in run.untold))
    where = in_runs([run.name for run in blind], sum(len(run.force) for run in blind))
    one = len(names) == 1
    return (
        f"The noise of {joined(names)} is not known {where}: {'it' if one else 'they'} "
        f"{'was' if one else 'were'} low-passed and never rest{'s' if one else ''}. Give "
        f"{'its standard deviation' if one else 'their standard deviations'} in study.toml, "
        f"noise = ... in {joined([f'[channels.{name}]' for name in names])}, from a record at rest."
    )


def refuse_unknown_noise(folder: Path, problem: Problem) -> None:
    """Raise StudyError where no test can be planned: how much one tells is a matter of noise."""
    if not problem.noise_known:
        raise StudyError(f"{folder}: no test can be planned. {noise_not_known(problem)}")


def _gains(before: Trial, after: Trial, rule: DecisionRule) -> bool:
    """Return whether an effect lowers the held-out error by enough, and beyond chance."""
    if after.rms > (1.0 - rule.gain) * before.rms:
        return False
    return paired(before.losses, after.losses, rule.chance).low > 0.0


def _equals(best: Trial, other: Trial, rule: DecisionRule) -> bool:
    """Return whether the runs cannot distinguish another effect from the best one."""
    if other.rms <= (1.0 + rule.close) * best.rms:
        return True
    return paired(other.losses, best.losses, rule.chance).low <= 0.0
