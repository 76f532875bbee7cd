"""Legal runs: load, initialise, step, read, and the run that others are held against."""

from __future__ import annotations

import math
import time

from ...core.finding import Finding
from ...fmu.description import Value
from ...fmu.library import DISCARD
from ..bench import Bench, finite, good, not_finite, some
from ..probe import Probe, failed, noted, passed

_MOST_STEPS = 20_000


@Probe(
    "library",
    tried="loading the binary, its functions, fmi2GetVersion, fmi2GetTypesPlatform",
    standard='FMI 2.0 sections 2.1.2 and 2.1.4: the version is "2.0", the types platform '
    '"default"; the functions of co-simulation are exported under their plain names',
    fmi3="FMI 3.0: the version begins with 3.0; the functions of co-simulation are exported, under "
    "their plain names, for all types",
    needs="file",
)
def library(bench: Bench) -> Finding:
    """Load the library and look at what it exports."""
    loaded = bench.library
    required, optional = loaded.missing()
    if required:
        return failed(f"functions that are missing: {some(required)}")
    wanted, version = bench.plan.about.version, loaded.call(f"{loaded.prefix}GetVersion")
    if version is None or not version.startswith(wanted.encode()):
        return failed(f"version {version!r} instead of {wanted}")
    platform = loaded.call("fmi2GetTypesPlatform") if wanted == "2.0" else b"default"
    if platform != b"default":
        return failed(f"version {version!r}, types platform {platform!r}")
    if optional:
        return noted(f"loads; optional functions that are missing: {some(optional)}")
    return passed(f"loads; all functions exported, version {wanted}")


@Probe(
    "legal run",
    tried="the default experiment with inputs left at their start values",
    standard="FMI 2.0 section 4.2.4: set up, initialise, step, read, terminate, free, each "
    "answered OK or Warning; a number that is not finite is no value of an output",
    needs="library",
)
def legal_run(bench: Bench) -> Finding:
    """Run to the end of the default experiment, or as far as the time limit lets us."""
    plan, began = bench.plan, time.monotonic()
    instance = bench.ready(drive=False, stop=plan.stop is not None)
    made = time.monotonic() - began
    total = max(1, round((plan.end - plan.start) / plan.step))
    deadline = began + 0.4 * plan.timeout
    for done in range(min(total, _MOST_STEPS)):
        status = instance.step(bench.time(done), plan.step)
        if status == DISCARD and done and instance.wants_to_end():
            judged = failed if plan.ours else noted  # ours end a run by a fault only
            seen = f"the FMU ended the run itself at t = {bench.time(done):g} s"
            bench.pace["most_steps"] = done
            return judged(f"{seen} (Discard, and fmi2Terminated is true)")
        good(status, f"DoStep at t = {bench.time(done):g} s")
        where = f"not finite at t = {bench.time(done + 1):g} s"
        finite(bench.observed, bench.read(instance), where)
        if time.monotonic() > deadline:
            break
    per_step = (time.monotonic() - began - made) / (done + 1)
    good(instance.terminate(), "Terminate")
    bench.read(instance)
    instance.free()
    bench.pace.update(per_step=per_step, per_instance=made)
    return passed(f"{done + 1} of {total} steps of {plan.step:g} s, {1e6 * per_step:.0f} us each")


@Probe(
    "outputs at the start",
    tried="reading every variable in initialisation mode and after it, before the first step",
    standard="FMI 2.0 sections 2.1.7 and 4.2.4: outputs are computed when initialisation ends, and "
    "may be read from then on; a number that is not finite is no value",
    needs="library",
)
def outputs_at_start(bench: Bench) -> Finding:
    """Read everything at t = 0."""
    plan = bench.plan
    everything = list(plan.about.variables.values())
    instance = bench.entered()
    bench.read(instance, everything)
    good(instance.leave(), "ExitInitializationMode")
    values = bench.read(instance, everything)
    outputs = plan.variables("output")
    finite(outputs, bench.read(instance, outputs), "outputs that are not finite")
    if bad := not_finite(everything, values):
        return noted(f"outputs are finite, other variables are not: {some(bad)}")
    return passed(f"{len(outputs)} outputs finite, all {len(everything)} variables readable")


@Probe(
    "start values in the code",
    tried="reading inputs and parameters that nobody has set, against modelDescription.xml",
    standard="FMI 2.0 section 2.2.7: start is the value that the variable has in the code, unless "
    "the environment sets another",
    needs="library",
)
def starts_in_code(bench: Bench) -> Finding:
    """Compare the XML's start values with the binary's."""
    plan = bench.plan
    given = [v for c in ("parameter", "input") for v in plan.about.of(c) if v.start is not None]
    instance = bench.entered()
    values = bench.read(instance, given)
    wrong = [
        f"{v.name} is {x!r}, not {v.start!r}"
        for v, x in zip(given, values, strict=True)
        if not _agree(x, v.start)
    ]
    if wrong:
        return failed(f"{len(wrong)} differ: {some(wrong)}")
    return passed(f"{len(given)} start values are those of the file")


def _agree(found: Value, given: Value | None) -> bool:
    """Return whether a value is the one of the file, which may be printed with fewer digits."""
    if isinstance(found, float) and isinstance(given, float):
        return math.isclose(found, given, rel_tol=1e-6) or (found != found and given != given)
    return found == given


@Probe(
    "driven run",
    tried="legal steps while every real input moves about its start value",
    standard="FMI 2.0 section 4.2.1: inputs may be set before every step",
    needs="library",
)
def driven_run(bench: Bench) -> Finding:
    """Make the reference that later probes are held against."""
    rows = bench.whole_run()
    bench.keep(rows)
    for k, row in enumerate(rows):
        finite(bench.observed, row, f"not finite at t = {bench.time(k):g} s")
    moved = "inputs moving" if bench.plan.driven and bench.inputs else "inputs at rest"
    return passed(f"{bench.plan.steps} steps with {moved}")


@Probe(
    "repeatable",
    tried="the same run in another process",
    standard="No clause. Reset, replay and any comparison of two runs rest on it.",
)
def repeatable(bench: Bench) -> Finding:
    """Compare a fresh process with the reference."""
    if difference := bench.differs(bench.whole_run(), bench.reference()):
        return noted(f"not repeatable: {difference}")
    return passed(f"equal {bench.equal}")
