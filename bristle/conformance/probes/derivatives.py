"""Derivatives of inputs, on FMUs that claim to interpolate: taken, forgotten by a reset, saved."""

from __future__ import annotations

from ctypes import c_void_p

from ...core.finding import Finding
from ...fmu.library import Handle
from ..bench import Bench, ProbePlan, Values, finite, good
from ..probe import Probe, passed, unless_claimed
from .order import forbidden

_FLAG = "canInterpolateInputs"
_NO_CALL = "FMI 3.0 has no call for derivatives of inputs, but intermediate updates of their values"


def _unless(plan: ProbePlan) -> str | None:
    if reason := unless_claimed(_FLAG)(plan):
        return reason
    return None if plan.variables("input", "Real") else "there is no real input"


def _smooth(bench: Bench) -> list[int]:
    """Return the places of the inputs that are continuous: the others have no derivative."""
    return [i for i, v in enumerate(bench.inputs) if v.variability == "continuous"]


def _ramp(bench: Bench, instance: Handle, k: int, share: float) -> None:
    """Set a share of the derivatives that bring the inputs to their values of step k + 1."""
    for i in _smooth(bench):
        v, change = bench.inputs[i], bench.driven(i, k + 1) - bench.driven(i, k)
        status = instance.input_derivative(v.reference, share * change / bench.plan.step)
        good(status, f"SetRealInputDerivatives of {v.name}")


def _run(bench: Bench, instance: Handle, share: float, first: int, last: int) -> list[Values]:
    rows = []
    for k in range(first, last):
        bench.move(instance, k)
        _ramp(bench, instance, k, share)
        bench.step(instance, bench.time(k), bench.plan.step)
        rows.append(bench.read(instance))
    return rows


@Probe(
    "input derivatives",
    tried="runs with derivatives of 0 and of moving inputs; a reset after them; a state copied "
    "behind them and set back",
    standard=f"FMI 2.0 sections 4.2.1 and 4.3.1, with {_FLAG}: inputs go on by their derivatives "
    "from the beginning of a step. By 0 they stay; fmi2Reset and a copied state hold for them too.",
    unless=_unless,
    only_fmi2=_NO_CALL,
)
def input_derivatives(bench: Bench) -> Finding:
    """Let inputs stay, move, be reset and be replayed."""
    half, steps, judge = bench.plan.steps // 2, bench.plan.steps, bench.plan.repeatable
    if not bench.plan.driven:
        return passed("not tried: it cannot follow moving inputs (see driven run)")
    instance = bench.ready()
    rows = [bench.read(instance), *_run(bench, instance, 0.0, 0, steps)]
    if judge:
        bench.same(rows, bench.reference(), "by derivatives of 0: ")
    good(instance.reset(), "Reset")
    bench.ready(instance)
    rows = _run(bench, instance, 1.0, 0, half)
    for k, row in enumerate(rows, 1):
        finite(bench.observed, row, f"not finite at t = {bench.time(k):g} s")
    if bench.plan.claims("canGetAndSetFMUstate"):
        _replay(bench, instance)
    good(instance.reset(), "Reset")
    if judge:
        rows = bench.whole_run(instance)
        bench.same(rows, bench.reference(), "fmi2Reset does not clear them: ")
    return passed(f"{len(_smooth(bench))} inputs moved by them; zero, a reset and a state hold")


def _replay(bench: Bench, instance: Handle) -> None:
    """Make a step again by the derivatives in a copied state, and hold it against the first."""
    half, state = bench.plan.steps // 2, c_void_p()
    bench.move(instance, half)
    _ramp(bench, instance, half, 1.0)
    good(instance.save(state), "GetFMUstate")
    bench.step(instance, bench.time(half), bench.plan.step)
    wanted = bench.read(instance)
    _ramp(bench, instance, half, -1.0)
    good(instance.restore(state), "SetFMUstate")
    bench.step(instance, bench.time(half), bench.plan.step)
    found = bench.read(instance)
    good(instance.forget(state), "FreeFMUstate")
    bench.same([found], [wanted], "by derivatives behind a copied state: ", half + 1)


@Probe(
    "input derivative of order 0",
    rule="robustness",
    tried="fmi2SetRealInputDerivatives with the order 0, which is that of the value",
    standard="FMI 2.0 section 4.2.1: 1 is the first derivative, 0 is not allowed; the answer is "
    "left open, Error being the status for it",
    unless=_unless,
    only_fmi2=_NO_CALL,
)
def order_zero(bench: Bench) -> Finding:
    """Set the derivative of order 0 of an input."""
    instance = bench.under_way()
    reference = bench.inputs[0].reference
    return forbidden(bench, lambda: instance.input_derivative(reference, 1.0, 0), instance)
