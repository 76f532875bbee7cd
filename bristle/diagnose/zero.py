"""The zero of a load cell beside an effect: both are fitted together.

A constant force is no effect by itself: the load cell's zero explains it as well as a preload, and
needs nothing of the damper. Fitted alone, though, it absorbs part of what an effect does, and an
effect fitted without it asks for a second one that has a constant force. So where a constant is
left beside what was found, or was absorbed by a second effect, everything is tried once more with
the zero free.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..identify.model import Model, Problem
from ..identify.residuals import has_offset, zero_of
from ..identify.search_context import refine
from ..identify.structure import StructureProblem
from .candidates import judge
from .decision import Decision, missing
from .faults import SensorFault
from .opening import Opening
from .rule import SENSOR, DecisionRule


def free_zero(opened: Opening, decision: Decision, rule: DecisionRule = SENSOR) -> Opening | None:
    """Return what a diagnosis begins with where the zero of the force is to be fitted along.

    Parameters
    ----------
    opened : runs and the present model, the zero taken as right
    decision : what followed from that
    rule : the numbers that decide

    Returns
    -------
    Opening or None
        None where a zero would explain nothing: no constant is left, or a single effect that has
        one says more than a zero would.
    """
    problem = opened.problem
    known = problem.free_zero or _reconstructed(problem)
    if known or decision.kind in ("none", "insufficient"):
        return None
    if has_offset(opened.before.model) or not _significant(problem, opened.before.model, rule):
        return None
    if not has_offset(decision.best.model):
        if not _significant(problem, decision.best.model, rule):
            return None
        return _freed(opened)
    freed = _freed(opened)
    alone = len(decision.effects) == 1
    return None if alone and missing(freed.before, decision.best) else freed


def zero_fault(
    problem: Problem, decision: Decision, rule: DecisionRule = SENSOR
) -> SensorFault | None:
    """Return the zero of the force beside what was decided with the zero free, None without one."""
    model = decision.best.model
    if decision.kind in ("unknown", "insufficient") or has_offset(model):
        return None
    if not _significant(problem, model, rule):
        return None
    return _fault(*zero_of(problem, model), decision, problem.runs[0].drive)


def renewed_zero(opened: Opening, decision: Decision) -> tuple[SensorFault, ...]:
    """Return the zero that was found before any effect as it is beside what was decided.

    Nothing where there was none, or where an effect has a constant force of its own.
    """
    first = [one for one in opened.faults if (one.channel, one.fault) == ("force", "bias")]
    model = decision.best.model
    if not first or not opened.problem.free_zero or has_offset(model):
        return ()
    more, std = zero_of(opened.problem, model)
    drive = opened.problem.runs[0].drive
    return (_fault(first[0].value + more, std, decision, drive),)


def _fault(zero: float, std: float, decision: Decision, drive: str) -> SensorFault:
    beside = f" beside {' and '.join(decision.effects)}" if decision.kind == "effect" else ""
    return SensorFault(
        "force", "bias", zero, std,
        f"Force shows {zero:.3g} N{beside} whatever the motion and the {drive}: the zero of the "
        "load cell is off. A static preload on the rod would look the same.",
    )  # fmt: skip


def _significant(problem: Problem, model: Model, rule: DecisionRule) -> bool:
    """Return whether a model leaves a constant force that is large enough to matter."""
    zero, std = zero_of(problem, model)
    force = np.concatenate([run.force for run in problem.runs])
    least = rule.least_bias * float(np.sqrt(np.mean(force**2)))
    return abs(zero) > max(rule.sure * std, least)


def _freed(opened: Opening) -> Opening:
    """Return what a diagnosis begins with, the zero of the force fitted along."""
    train, held_out = opened.problem.with_free_zero(), opened.held_out.with_free_zero()
    before = judge(refine(opened.before.model, train), train, held_out)
    part = opened.part
    if part is not None:
        part = train if part is opened.problem else part.with_free_zero()
    return replace(opened, before=before, problem=train, held_out=held_out, part=part)


def _reconstructed(problem: Problem) -> bool:
    """Return whether no load cell made the force."""
    return isinstance(problem, StructureProblem) and problem.reconstructed
