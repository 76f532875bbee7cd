"""The verdict on a law and its effects together: every law fitted, those that survive searched."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..data.channels import DRIVE
from ..data.checks.levels import tells_a_bend
from ..data.measurement import Measurement
from ..identify.model import Model
from ..identify.rig import DAMPER
from .conclusion import About, conclude
from .damper import look_at_damper
from .detail import detailed
from .inconsistent_runs import contradicted
from .law_choice import Pair, choose, equivalents, search
from .law_trials import LawTrial, not_finite, try_laws
from .law_verdict import LawVerdict
from .opening import (
    BenchData,
    Insufficient,
    Progress,
    Trials,
    bench_data,
    opened_with,
    silent,
)
from .rule import BENCH, DecisionRule
from .verdict import Diagnosis


def diagnose_laws(
    train: Sequence[Measurement],
    holdout: Sequence[Measurement],
    present: Model,
    *,
    named: str = "",
    say: Progress = silent,
    rule: DecisionRule = BENCH,
) -> Diagnosis:
    """Return which law a damper on a test bench has, and which effects that law misses.

    Parameters
    ----------
    train, holdout : measurements to fit to, and those that decide
    present : the model as it is; laws have those of its effects that can join them
    named : the present law with its variant, "" where nobody chose one
    say : called with a few words at each stage
    rule : the numbers that decide

    Raises
    ------
    RecordError
        If a run lacks a channel that is needed, or is too short for a fit.
    """
    data = bench_data(train, holdout, present, say)
    if isinstance(data, Insufficient):
        return Diagnosis("insufficient", (), data.reasons, sensors=data.faults, noise=data.noise)
    say("trying every law")
    rows = try_laws(data.problem, data.held_out, present, bends=tells_a_bend(train))
    pairs = search(rows, Looks(data, say), rule)
    chosen = choose(pairs, rule)
    assert chosen.opened is not None
    say(f"intervals of {chosen.row.law}")
    finding = detailed(contradicted(chosen.finding, chosen.opened), chosen.opened)
    driven = any(run.has(name) for run in (*train, *holdout) for name in DRIVE)
    about = About(sensors=chosen.opened.faults, noise=data.noise, driven=driven)
    laws = LawVerdict(
        chosen.row, named, rows, tuple(pairs), tuple(equivalents(chosen, pairs, rows, rule)),
        tuple(not_finite(data.problem, present)),
    )  # fmt: skip
    return replace(conclude({DAMPER: finding}, about), laws=laws)


class Looks:
    """What laws lack, on one bench's runs: a second look at a law takes up where the first ended.

    Parameters
    ----------
    data : the runs
    say : called with a few words at each stage
    """

    def __init__(self, data: BenchData, say: Progress = silent) -> None:
        self.data, self.say = data, say
        self.made: dict[str, Trials] = {}

    def __call__(self, row: LawTrial, pairs: bool) -> Pair:
        """Return what a law lacks: single effects alone, or pairs as well where none suffices."""
        made = self.made.get(row.law)
        if made is None:
            self.say(f"effects that {row.law} lacks (error / noise {row.trial.z:.2f})")
            made = Trials(opened_with(row.trial, self.data), self.say)
            self.made[row.law] = made
        elif pairs:
            self.say(f"two effects that {row.law} lacks")
        finding, opened = look_at_damper(made.opened, self.say, made, pairs=pairs)
        return Pair(row, finding, opened)
