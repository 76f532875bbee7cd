"""How instances end, what they log, and what their capability flags promise."""

from __future__ import annotations

from pathlib import Path

from ...core.finding import Finding
from ..bench import Bench, good, some
from ..probe import Probe, failed, noted, passed, unless_single


@Probe(
    "terminate and free",
    tried="a run, fmi2Terminate, outputs read, fmi2FreeInstance, unloading, end of the process",
    standard="FMI 2.0 sections 2.1.6 and 4.2.4: final values may be read after fmi2Terminate; "
    "fmi2FreeInstance unloads and gives back everything",
)
def terminate_and_free(bench: Bench) -> Finding:
    """End as a tool ends, and see what is left behind."""
    instance = bench.ready()
    rows = bench.run(instance)
    good(instance.terminate(), "Terminate")
    difference = bench.differs([bench.read(instance)], rows[-1:], bench.plan.steps)
    instance.free()
    bench.library.close()
    if difference:
        return noted(f"ends cleanly, but after fmi2Terminate {difference}")
    left = [p.name for p in Path.cwd().iterdir()]
    if left:
        return noted(f"ends cleanly, and leaves files in the working folder: {some(left)}")
    return passed("ends cleanly; outputs can be read to the end")


@Probe(
    "free without terminate",
    tried="fmi2FreeInstance after fmi2Instantiate, in initialisation mode and in mid-run",
    standard="FMI 2.0 section 4.2.4: fmi2FreeInstance is allowed in each of these states",
)
def free_without_terminate(bench: Bench) -> Finding:
    """Free instances early; one life is left for an FMU that allows one only."""
    plan = bench.plan
    if unless_single(plan) is None:
        bench.instance().free()
        bench.entered().free()
    instance = bench.under_way()
    instance.free()
    return passed("freed")


@Probe(
    "free nothing",
    tried="fmi2FreeInstance with a null pointer",
    standard="FMI 2.0 section 2.1.5: a null pointer is ignored",
)
def free_nothing(bench: Bench) -> Finding:
    """Free a null pointer, then run."""
    bench.library.call(f"{bench.library.prefix}FreeInstance", None)
    bench.whole_run()
    return passed("ignored")


@Probe(
    "logging",
    tried="a run with loggingOn, fmi2SetDebugLogging for all and for each category",
    standard="FMI 2.0 section 2.1.5: the logger gets the instance's name, a status, a category of "
    "LogCategories and a text; without loggingOn debug messages stay away",
)
def logging(bench: Bench) -> Finding:
    """Collect messages and look at their form."""
    instance = bench.instance(logging=True)
    for category in bench.plan.categories:
        good(instance.debug_logging(True, [category]), f"SetDebugLogging(true, {category})")
    good(instance.debug_logging(True), "SetDebugLogging(true, none named, so all)")
    bench.whole_run(instance)
    good(instance.debug_logging(False), "SetDebugLogging(false)")
    good(instance.terminate(), "Terminate")
    instance.free()
    library = bench.library
    if library.bad_messages:
        return failed(f"{library.bad_messages} messages without name, status or text")
    strange = {name for name, *_ in library.messages} - {"bench"}
    if strange:
        return failed(f"messages in the name of {some(sorted(strange))} instead of bench")
    other = {kind for *_, kind, _ in library.messages} - set(bench.plan.categories)
    if other:
        return noted(f"categories that LogCategories does not list: {some(sorted(other))}")
    return passed(f"{len(library.messages)} messages, all well formed")


@Probe(
    "claimed capabilities",
    tried="the calls behind capability flags: input and output derivatives, directional derivative",
    standard="FMI 2.0 section 4.3.1: a flag that is set promises that the call works",
    unless=lambda plan: None if _promises(plan.about.capabilities) else "none of them is claimed",
)
def claimed_capabilities(bench: Bench) -> Finding:
    """Call what is claimed, after one step."""
    instance, plan = bench.ready(), bench.plan
    bench.run(instance, 0, 1)
    outputs = plan.variables("output", "Real")
    tried = []
    if plan.claims("canInterpolateInputs") and bench.inputs:
        status = instance.input_derivative(bench.inputs[0].reference, 0.0)
        good(status, "SetRealInputDerivatives")
        tried.append("input derivatives")
    if _order(plan.about.capabilities) > 0 and outputs:
        good(instance.output_derivative(outputs[0].reference)[0], "GetRealOutputDerivatives")
        tried.append("output derivatives")
    if plan.claims("providesDirectionalDerivative") and bench.inputs and outputs:
        knowns = [v.reference for v in bench.inputs]
        status, _ = instance.derivatives([v.reference for v in outputs], knowns)
        good(status, "GetDirectionalDerivative")
        tried.append("directional derivative")
    return passed(f"answered: {some(tried) or 'nothing to ask, no real input or output'}")


def _order(flags: dict[str, str]) -> int:
    text = flags.get("maxOutputDerivativeOrder", "0")
    return int(text) if text.isdecimal() else 0


def _promises(flags: dict[str, str]) -> bool:
    names = ("canInterpolateInputs", "providesDirectionalDerivative")
    return _order(flags) > 0 or any(flags.get(n) in ("true", "1") for n in names)
