"""Values that cannot be, references that do not exist, and when a set value takes effect."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from functools import partial

from ...core.finding import Finding
from ...fmu.description import Value, Variable
from ...fmu.library import FatalAnswerError, Handle, UnexpectedError
from ..bench import GOOD, Bench, Values, good, not_finite, some, status_name
from ..probe import Probe, failed, noted, passed, unless_single
from .order import forbidden

_MOST_INPUTS = 12


def _no_inputs(bench: Bench) -> Finding | None:
    return None if bench.inputs else passed("not tried: there is no real input")


def _strange_input(bench: Bench, value: float) -> Finding:
    """Set each real input to `value` in mid-run and step on; the host must live."""
    if finding := _no_inputs(bench):
        return finding
    answers: list[str] = []
    instance = bench.instance()
    try:
        for v in bench.inputs[:_MOST_INPUTS]:
            answers.append(_answer(bench, instance, v, value))
            good(instance.reset(), f"Reset after {v.name} = {value}")
    except FatalAnswerError as error:
        return noted(f"refused, but with Fatal by {error}: no instance is usable any more")
    if bench.plan.repeatable:
        difference = bench.differs(bench.whole_run(instance), bench.reference())
        if difference:
            return failed(f"fmi2Reset does not clear it: {difference}", rule="standard")
    silent = [a for a in answers if a.endswith("OK")]
    if silent:
        return noted(f"accepted without a message: {some(silent)}")
    return passed(some(answers))


def _answer(bench: Bench, instance: Handle, v: Variable, value: float) -> str:
    bench.ready(instance, drive=False)
    bench.run(instance, 0, 2, drive=False)
    status = instance.set("Real", [v.reference], [value])
    if status in GOOD:
        status = instance.step(bench.time(2), bench.plan.step)
    if status not in GOOD:
        return f"{v.name}: {status_name(status)}"
    spoilt = not_finite(bench.observed, bench.read(instance))
    return f"{v.name}: {'outputs not finite, ' if spoilt else ''}OK"


_STRANGE = (
    "No clause on inputs that are no numbers. The host must survive, and FMI 2.0 section 2.1.6 "
    "demands that fmi2Reset clears it; a value accepted without a message is a note."
)


for _name, _words, _value in (
    ("NaN", "NaN, a step, a reset", math.nan),
    ("infinite", "infinity, a step", math.inf),
    ("huge", "1e300, a step, a reset", 1e300),
):

    @Probe(
        f"{_name} input",
        rule="robustness",
        tried=f"each real input set to {_words}",
        standard=_STRANGE,
    )
    def strange_input(bench: Bench, value: float = _value) -> Finding:
        """Feed what is no number, or a number whose square overflows."""
        return _strange_input(bench, value)


def _unused(bench: Bench) -> list[int]:
    """Return references that no variable has: one far off, and the largest there is."""
    used = {v.reference for v in bench.plan.about.variables.values()}
    far = next(r for r in itertools.count(1_000_000) if r not in used)
    unused = [r for r in (far, 2**32 - 1) if r not in used]
    return unused if unless_single(bench.plan) is None else unused[:1]


def _bad_reference(bench: Bench, act: Callable[[Handle, int], int]) -> Finding:
    for reference in _unused(bench):
        instance = bench.under_way()
        finding = forbidden(bench, partial(act, instance, reference), instance)
        if finding.level != "pass":
            break
    return finding


_REFERENCE = (
    "FMI 2.0 section 2.1.7: references are those of modelDescription.xml; the answer to another "
    "one is left open, Error being the status for it."
)


_ACTS: tuple[tuple[str, str, Callable[[Handle, int], int]], ...] = (
    ("reading", "Get", lambda instance, r: instance.get("Real", [r])[0]),
    ("setting", "Set", lambda instance, r: instance.set("Real", [r], [0.0])),
)

for _name, _verb, _act in _ACTS:

    @Probe(
        f"{_name} what is not there",
        rule="robustness",
        tried=f"fmi2{_verb}Real with value references that no variable has",
        standard=_REFERENCE,
    )
    def unknown(bench: Bench, act: Callable[[Handle, int], int] = _act) -> Finding:
        """Get or set unknown references."""
        return _bad_reference(bench, act)


@Probe(
    "empty lists",
    rule="robustness",
    tried="fmi2GetReal ... fmi2SetString with no variable at all",
    standard="FMI 2.0 section 2.1.7: nvr is the number of references; none is not excluded, and "
    "tools do it",
)
def empty_lists(bench: Bench) -> Finding:
    """Get and set nothing."""
    instance = bench.ready()
    odd = []
    for kind in ("Real", "Integer", "Boolean", "String"):
        for verb, status in (
            ("Get", instance.get(kind, [])[0]),
            ("Set", instance.set(kind, [], [])),
        ):
            if status not in GOOD:
                odd.append(f"fmi2{verb}{kind}: {status_name(status)}")
    if odd:
        return noted(f"refused: {some(odd)}")
    return passed("answered OK")


@Probe(
    "set values stay",
    tried="inputs set in mid-run and read back before and after a step",
    standard="FMI 2.0 section 2.1.7: a variable that was set has that value until it is set again",
)
def set_values_stay(bench: Bench) -> Finding:
    """Read back what was set."""
    if finding := _no_inputs(bench):
        return finding
    instance = bench.under_way()
    if bench.plan.driven:
        bench.move(instance, 7)
    wanted = bench.read(instance, bench.inputs)
    if bench.plan.driven:
        wanted = [bench.driven(i, 7) for i in range(len(bench.inputs))]
    for when in ("before", "after"):
        if when == "after":
            bench.step(instance, bench.time(2), bench.plan.step)
        found = bench.read(instance, bench.inputs)
        wrong = [
            f"{v.name} is {a!r}, not {b!r}"
            for v, a, b in zip(bench.inputs, found, wanted, strict=True)
            if a != b
        ]
        if wrong:
            return failed(f"{when} the step {some(wrong)}")
    return passed(f"{len(bench.inputs)} inputs keep their values")


@Probe(
    "direct dependencies",
    tried="each real input moved between two steps, outputs read at once",
    standard="FMI 2.0 section 2.2.8: an output depends directly on the inputs that its "
    "dependencies list, and on no other; without the attribute on all of them",
)
def direct_dependencies(bench: Bench) -> Finding:
    """See which outputs follow an input without a step, against ModelStructure."""
    if finding := _no_inputs(bench):
        return finding
    outputs = bench.plan.variables("output")
    instance = bench.ready()
    bench.run(instance, 0, min(7, bench.plan.steps))
    wrong: list[str] = []
    seen: set[tuple[str, str]] = set()
    before = bench.read(instance, outputs)
    for i, v in enumerate(bench.inputs):
        old = bench.read(instance, [v])[0]
        good(instance.set("Real", [v.reference], [bench.driven(i, 3.7)]), f"SetReal of {v.name}")
        after = bench.read(instance, outputs)
        good(instance.set("Real", [v.reference], [old]), f"SetReal of {v.name}")
        for output, a, b in zip(outputs, before, after, strict=True):
            if a != b:
                seen.add((output.name, v.name))
                if output.dependencies is not None and v.name not in output.dependencies:
                    wrong.append(f"{output.name} follows {v.name}")
        before = bench.read(instance, outputs)
    if wrong:
        return failed(f"not listed: {some(wrong)}")
    silent = [o.name for o in outputs if o.dependencies is None]
    if silent:
        return noted(
            f"{len(silent)} outputs list no dependencies, so tools see an algebraic loop wherever "
            f"they close one: {some(silent)}"
        )
    return passed(f"{len(seen)} direct dependencies seen, all listed")


@Probe(
    "parameters in initialisation",
    tried="real parameters changed by 1 % before entering initialisation mode, and inside it",
    standard="FMI 2.0 sections 2.1.7 and 4.2.4: a variable with initial = exact may be set until "
    "initialisation mode is left; when makes no difference",
    unless=unless_single,
)
def parameters_in_initialisation(bench: Bench) -> Finding:
    """Run with parameters set early and late; both runs are the same."""
    changes = _one_percent(bench)
    if not changes:
        return passed("not tried: there is no real parameter with a start other than 0")
    runs: list[list[Values]] = []
    for late in (False, True):
        try:
            runs.append(_run_with(bench, changes, late))
        except UnexpectedError as error:
            if not late:
                return noted(f"the changed values make no run: {error}")
            return failed(f"set in initialisation mode: {error}; set before it they run")
    difference = bench.differs(runs[1], runs[0])
    if difference and bench.plan.repeatable:
        return failed(f"set in initialisation mode, {difference}")
    return passed(f"{len(changes)} parameters, the same run either way")


def _one_percent(bench: Bench) -> list[tuple[int, Value]]:
    changes: list[tuple[int, Value]] = []
    for v in bench.plan.variables("parameter", "Real"):
        value = 1.01 * float(v.start or 0.0)
        inside = (v.minimum is None or value >= v.minimum) and (
            v.maximum is None or value <= v.maximum
        )
        if value and math.isfinite(value) and inside:
            changes.append((v.reference, value))
    return changes


def _run_with(bench: Bench, changes: list[tuple[int, Value]], late: bool) -> list[Values]:
    references, values = [r for r, _ in changes], [x for _, x in changes]
    instance = bench.instance()
    if not late:
        good(instance.set("Real", references, values), "SetReal of parameters")
    bench.entered(instance)
    if late:
        good(instance.set("Real", references, values), "SetReal of parameters")
    if bench.plan.driven:
        bench.move(instance, 0)
    good(instance.leave(), "ExitInitializationMode")
    rows = [bench.read(instance), *bench.run(instance)]
    instance.free()
    return rows
