"""Calls that the standard forbids the environment, and steps of unusual length.

What an FMU must answer to a forbidden call is left open by FMI 2.0: refusing it with Error (or
Discard) passes, answering OK is a note. Dying of it fails, since statuses exist to refuse with;
and a later instance must be unharmed.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from ...core.finding import Finding
from ...fmu.description import Variable
from ...fmu.library import FatalAnswerError, Handle
from ..bench import GOOD, Bench, finite, good, not_finite, some, status_name
from ..probe import Probe, failed, noted, passed, unless_claimed, unless_single

_ORDER = (
    "FMI 2.0 section 4.2.4: the environment must not; the answer is left open, Error being the "
    "status for it."
)


def forbidden(bench: Bench, act: Callable[[], int], instance: Handle) -> Finding:
    """Judge the answer to a forbidden call, and whether a later instance is unharmed."""
    try:
        status = act()
    except FatalAnswerError as error:
        return noted(f"refused, but with Fatal by {error}: no instance is usable any more")
    instance.free()
    harm = ""
    if unless_single(bench.plan) is None and bench.plan.repeatable:
        harm = bench.differs(bench.whole_run(), bench.reference())
    if harm:
        return failed(f"answered {status_name(status)}, and a new instance is harmed: {harm}")
    if status in GOOD:
        return noted(f"answered {status_name(status)} as if it were allowed; no harm seen")
    return passed(f"refused with {status_name(status)}")


@Probe(
    "wrong guid",
    rule="robustness",
    tried="fmi2Instantiate with a guid that is not the FMU's",
    standard="FMI 2.0 section 2.1.5: the guid is there to check that modelDescription.xml and code "
    "belong together; refusing is not demanded",
)
def wrong_guid(bench: Bench) -> Finding:
    """Instantiate under another guid."""
    other = "{00000000-0000-0000-0000-000000000000}"
    instance = bench.library.instantiate("bench", other, bench.plan.resources)
    if instance is None:
        return passed("refused")
    return forbidden(bench, lambda: 0, instance)


def _terminated(bench: Bench) -> Handle:
    instance = bench.under_way()
    good(instance.terminate(), "Terminate")
    return instance


_Begin = Callable[[Bench], Handle]
_Call = Callable[[Handle, Bench], int]


def _step(instance: Handle, bench: Bench) -> int:
    return instance.step(bench.plan.start, bench.plan.step)


def _third(instance: Handle, bench: Bench) -> int:
    return instance.step(bench.time(2), bench.plan.step)


_CALLS: tuple[tuple[str, str, _Begin, _Call], ...] = (
    (
        "step before initialisation", "fmi2DoStep right after fmi2Instantiate",
        Bench.instance, _step,
    ),
    (
        "step in initialisation",
        "fmi2DoStep between entering and leaving initialisation mode", Bench.entered, _step,
    ),
    ("step after terminate", "fmi2DoStep after fmi2Terminate", _terminated, _third),
    (
        "initialise twice", "fmi2EnterInitializationMode in mid-run",
        Bench.under_way, lambda instance, _: instance.enter(),
    ),
    (
        "leave what was not entered", "fmi2ExitInitializationMode right after fmi2Instantiate",
        Bench.instance, lambda instance, _: instance.leave(),
    ),
)  # fmt: skip
"""Forbidden calls: name, what is tried, what makes the instance, the call."""

for _name, _words, _begin, _call in _CALLS:

    @Probe(_name, rule="robustness", tried=_words, standard=_ORDER)
    def out_of_order(bench: Bench, begin: _Begin = _begin, call: _Call = _call) -> Finding:
        """Make a call where it has no place."""
        instance = begin(bench)
        return forbidden(bench, lambda: call(instance, bench), instance)


def _fixed(bench: Bench) -> Variable | None:
    fixed = [v for v in bench.plan.variables("parameter") if v.variability in (None, "fixed")]
    return next((v for v in fixed if v.kind == "Real"), fixed[0] if fixed else None)


@Probe(
    "fixed parameter in mid-run",
    rule="robustness",
    tried="setting a fixed parameter after a step",
    standard="FMI 2.0 section 2.2.7: a fixed variable does not change after initialisation, so it "
    "must not be set; the answer is left open",
)
def fixed_parameter(bench: Bench) -> Finding:
    """Set a fixed parameter to another value in step mode."""
    v = _fixed(bench)
    if v is None:
        return passed("not tried: there is no fixed parameter")
    instance = bench.under_way()
    value = v.start if v.start is not None else 0
    if isinstance(value, float) and not isinstance(value, bool):
        value = 1.01 * value
    return forbidden(bench, lambda: instance.set(v.kind, [v.reference], [value]), instance)


@Probe(
    "setting an output",
    rule="robustness",
    tried="fmi2SetReal on an output in mid-run",
    standard=_ORDER,
)
def set_output(bench: Bench) -> Finding:
    """Set a real output."""
    outputs = bench.plan.variables("output", "Real")
    if not outputs:
        return passed("not tried: there is no real output")
    instance = bench.under_way()
    reference = [outputs[0].reference]
    return forbidden(bench, lambda: instance.set("Real", reference, [12.5]), instance)


@Probe(
    "step past the stop time",
    rule="robustness",
    tried="fmi2DoStep beyond the stop time of fmi2SetupExperiment",
    standard="FMI 2.0 section 2.1.6: the FMU has to answer Error. Hardly a tool relies on it, and "
    "many cannot answer it, so going on is a note.",
)
def step_past_stop(bench: Bench) -> Finding:
    """Define a stop time after two steps, and take a third."""
    plan = bench.plan
    instance = bench.entered(stop=bench.time(2))
    good(instance.leave(), "ExitInitializationMode")
    bench.run(instance, 0, 2)
    return forbidden(bench, lambda: instance.step(bench.time(2), plan.step), instance)


_STEP = (
    "FMI 2.0 section 4.2.2: the communication step is greater than zero; the answer to another one "
    "is left open"
)


def _odd_step(bench: Bench, step: float) -> Finding:
    instance = bench.under_way()
    bad: list[str] = []

    def act() -> int:
        status = instance.step(bench.time(2), step)
        if status in GOOD:
            bad.extend(not_finite(bench.observed, bench.read(instance)))
        return status

    finding = forbidden(bench, act, instance)
    if bad and finding.level == "note":
        return noted(f"{finding.text}; outputs are no longer finite: {some(bad)}")
    return finding


for _name, _words, _share in (
    ("zero", "a step of 0", 0.0),
    ("negative", "a negative step", -1.0),
    ("NaN", "a step that is not a number", math.nan),
    ("infinite", "an infinite step", math.inf),
):

    @Probe(f"{_name} step", rule="robustness", tried=f"fmi2DoStep with {_words}", standard=_STEP)
    def odd_step(bench: Bench, share: float = _share) -> Finding:
        """Take a step of a length that is none; an endless one must end all the same."""
        return _odd_step(bench, share * bench.plan.step)


_VARIABLE = "canHandleVariableCommunicationStepSize"


@Probe(
    "variable steps",
    tried="steps of 1, 1/2, 1/4, 1 and 3/4 of the default, in turn",
    standard=f"FMI 2.0 section 4.3.1: {_VARIABLE} promises that steps may differ",
    unless=unless_claimed(_VARIABLE),
)
def variable_steps(bench: Bench) -> Finding:
    """Step with changing lengths."""
    instance, at = bench.ready(), 0.0
    for k in range(bench.plan.steps):
        if bench.plan.driven:
            bench.move(instance, k)
        part = (1.0, 0.5, 0.25, 1.0, 0.75)[k % 5]
        bench.step(instance, bench.time(at), part * bench.plan.step)
        at += part
        finite(bench.observed, bench.read(instance), f"not finite at t = {bench.time(at):g} s")
    return passed(f"{bench.plan.steps} steps accepted")


@Probe(
    "split steps",
    tried="each step as two halves",
    standard=f"FMI 2.0 section 4.3.1: {_VARIABLE} promises that shorter steps are taken; FMI 2.0 "
    "section 4.2.2: an FMU integrates exactly to the end of each. It does not limit the change.",
    unless=unless_claimed(_VARIABLE),
)
def split_steps(bench: Bench) -> Finding:
    """Halve each step with inputs held, and say how far the outputs move."""
    instance = bench.ready()
    rows = [bench.read(instance)]
    half = bench.plan.step / 2
    for k in range(bench.plan.steps):
        if bench.plan.driven:
            bench.move(instance, k)
        bench.step(instance, bench.time(k), half)
        bench.step(instance, bench.time(k) + half, half)
        rows.append(bench.read(instance))
    finite(bench.observed, rows[-1], "not finite after two halves")
    name, change = _largest_change(bench, rows)
    if change > 1e-6:
        return noted(f"accepted; {name} moves by {100 * change:.2g} % of its largest value")
    return passed("accepted; the outputs do not depend on it (1e-6)")


def _largest_change(bench: Bench, rows: list[list[float | int | bool | str]]) -> tuple[str, float]:
    """Return the real output that differs most from the reference, relative to its peak."""
    worst = ("", 0.0)
    reference = bench.reference()
    for i, v in enumerate(bench.observed):
        if v.kind != "Real":
            continue
        wanted = [float(row[i]) for row in reference]
        scale = max(map(abs, wanted)) or 1.0
        change = max(abs(float(row[i]) - w) for row, w in zip(rows, wanted, strict=True)) / scale
        worst = max(worst, (v.name, change), key=lambda pair: pair[1])
    return worst
