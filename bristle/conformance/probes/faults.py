"""bristle's own rule for faults, on FMUs that follow it: a refusal and the output `fault`.

A fault is logged in one line; outputs hold their last finite values; `fault` says which it is;
every further step is refused, until reset or until an earlier state is set back. The answer is
Discard from FMUs that run in Python, which can give no other, and Error from native ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from ctypes import c_void_p
from operator import methodcaller

from ...core.finding import Finding
from ...fmu.library import DISCARD, ERROR, Handle, UnexpectedError
from ..bench import GOOD, Bench, good, not_finite, status_name
from ..probe import Probe, failed, passed

INPUT, STEP, ORDER, PARAMETER = 1, 2, 3, 5
_RULE = (
    "bristle's rule, since this is a bristle FMU (FMI leaves it open): one line of log, a refusal, "
    "fault = {}, outputs finite, until reset or an earlier state"
)


def _check(bench: Bench, instance: Handle, code: int, what: str) -> None:
    """Raise UnexpectedError unless the instance shows a fault as the rule says."""
    outputs = bench.plan.variables("output")
    values = bench.read(instance, outputs)
    bad = not_finite(outputs, values)
    fault = dict(zip((v.name for v in outputs), values, strict=True))["fault"]
    if fault != code or bad:
        raise UnexpectedError(f"{what}: fault = {fault}, outputs {bad or 'finite'}")


def _refused(status: int, what: str) -> None:
    """Raise UnexpectedError unless a call was refused."""
    if status not in (DISCARD, ERROR):
        raise UnexpectedError(f"{what}: answered {status_name(status)}")


def _faulted(bench: Bench, act: Callable[[Handle], int], code: int, what: str) -> Handle:
    """Return an instance after two steps, a fault and a step that must be refused."""
    instance = bench.instance(logging=True)
    bench.ready(instance)
    bench.run(instance, 0, 2)
    before = len(bench.library.messages)
    _refused(act(instance), what)
    _check(bench, instance, code, what)
    bench.move(instance, 3)
    _refused(instance.step(bench.time(3), bench.plan.step), f"the step after {what}")
    _check(bench, instance, code, f"the step after {what}")
    lines = len(bench.library.messages) - before
    if lines != 1:
        raise UnexpectedError(f"{what}: {lines} lines in the log")
    return instance


def _mended(bench: Bench, instance: Handle, what: str) -> None:
    good(instance.reset(), f"Reset after {what}")
    bench.same(bench.whole_run(instance), bench.reference(), f"reset after {what}: ")
    instance.free()


def _feed(bench: Bench, setting: Callable[[Handle], int], what: str) -> None:
    """Set what is not finite and step on: a fault, mended by a reset."""

    def act(instance: Handle) -> int:
        status = setting(instance)
        return instance.step(bench.time(2), bench.plan.step) if status in GOOD else status

    _mended(bench, _faulted(bench, act, INPUT, what), what)


@Probe(
    "fault: input",
    tried="each real input, and its derivative where that is taken, set to NaN and to infinity, a "
    "step, another step, reset",
    standard=_RULE.format(INPUT),
    rule="bristle",
)
def fault_input(bench: Bench) -> Finding:
    """Feed what is not finite."""
    for v in bench.inputs:
        for value in (math.nan, math.inf, -math.inf):
            what = f"{v.name} = {value}"
            _feed(bench, methodcaller("set", "Real", [v.reference], [value]), what)
            if bench.plan.claims("canInterpolateInputs"):
                slope = methodcaller("input_derivative", v.reference, value)
                _feed(bench, slope, f"derivative of {what}")
    return passed(f"{len(bench.inputs)} inputs, three values each")


@Probe(
    "fault: step",
    tried="steps of 0, -h, NaN and infinity, another step, reset",
    standard=_RULE.format(STEP),
    rule="bristle",
)
def fault_step(bench: Bench) -> Finding:
    """Step by what is no step."""
    for step in (0.0, -bench.plan.step, math.nan, math.inf):

        def act(instance: Handle, step: float = step) -> int:
            return instance.step(bench.time(2), step)

        _mended(bench, _faulted(bench, act, STEP, f"a step of {step}"), f"a step of {step}")
    return passed("four steps that are none")


@Probe(
    "fault: order",
    tried="fmi2DoStep before initialisation, inside it and after fmi2Terminate",
    standard=_RULE.format(ORDER),
    rule="bristle",
)
def fault_order(bench: Bench) -> Finding:
    """Step where stepping is not allowed."""
    plan = bench.plan
    for when in ("before initialisation", "in initialisation", "after terminate"):
        instance = bench.instance()
        if when == "after terminate":
            bench.ready(instance)
            bench.run(instance, 0, 2)
            good(instance.terminate(), "Terminate")
        if when == "in initialisation":
            bench.entered(instance)
        _refused(instance.step(plan.start, plan.step), f"a step {when}")
        _check(bench, instance, ORDER, f"a step {when}")
        _mended(bench, instance, f"a step {when}")
    return passed("three steps out of order")


@Probe(
    "fault: parameter",
    tried="each real parameter set to NaN before initialisation, one step, reset",
    standard=_RULE.format(PARAMETER) + "; real outputs are 0 from initialisation on",
    rule="bristle",
)
def fault_parameter(bench: Bench) -> Finding:
    """Initialise with a parameter that is not finite."""
    parameters = bench.plan.variables("parameter", "Real")
    for v in parameters:
        what = f"{v.name} = nan"
        instance = bench.instance()
        good(instance.set("Real", [v.reference], [math.nan]), f"SetReal of {v.name}")
        bench.ready(instance)
        _check(bench, instance, PARAMETER, what)
        reals = bench.plan.variables("output", "Real")
        if any(bench.read(instance, reals)):
            return failed(f"{what}: real outputs are not 0")
        _refused(instance.step(bench.time(0), bench.plan.step), f"the first step with {what}")
        _mended(bench, instance, what)
    return passed(f"{len(parameters)} parameters")


@Probe(
    "fault: earlier state",
    tried="a state copied, a fault, the state set back, on to the end",
    standard=_RULE.format("0 again"),
    rule="bristle",
)
def fault_earlier_state(bench: Bench) -> Finding:
    """Go back before the fault and run on."""
    half = bench.plan.steps // 2
    instance = bench.ready()
    rows = [bench.read(instance), *bench.run(instance, 0, half)]
    state = c_void_p()
    good(instance.save(state), "GetFMUstate")
    _refused(instance.step(bench.time(half), math.nan), "a step of NaN")
    good(instance.restore(state), "SetFMUstate")
    rows += bench.run(instance, half)
    bench.same(rows, bench.reference())
    return passed("the run continues without a trace of the fault")
