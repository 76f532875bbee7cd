"""The decision where the force's noise is not known: by what effects gain on held-out runs.

No z can be told then, and nothing says how much of an error is noise. So an effect is named for the
part of the whole error that it takes, beyond chance, and "none" is not among the answers.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..identify.fit import Problem
from ..quantity import plain
from .candidates import Trial
from .decision import Decision
from .evidence import paired
from .rule import DecisionRule

NOT_KNOWN = (
    "The noise of the force is not known: it was low-passed and never rests. Give its standard "
    "deviation in study.toml, noise = ... in [channels.force], from a record at rest."
)


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

    able = sorted((one for one in trials if _gains(before, one, rule)), key=lambda trial: trial.rms)
    if not able:
        return Decision(
            "insufficient", (), before, 0.0,
            (
                f"No effect of the library lowers the error; {share(before)} of the force is "
                f"unexplained, noise included. {NOT_KNOWN}",
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
            (f"{gained} How much of the rest is noise cannot be told. {NOT_KNOWN}",),
        )  # fmt: skip
    rivals = [one.effects[-1] for one in able[1:] if _equals(best, one, rule)]
    names = (name, *rivals)[: rule.most_alternatives]
    kind = "ambiguous" if rivals else "effect"
    return Decision(kind, names, best, explained, (gained, NOT_KNOWN))


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
