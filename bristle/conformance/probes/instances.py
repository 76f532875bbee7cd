"""Instances after, beside and instead of each other, and the memory they leave."""

from __future__ import annotations

import mmap
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from ...core.finding import Finding
from ...fmu.archive import extract
from ...fmu.library import FatalAnswerError, Handle, UnexpectedError
from ..bench import GOOD, Bench, Values, good
from ..probe import Probe, failed, noted, passed, unless_single


@Probe(
    "reset",
    tried="a run, fmi2Reset in mid-run and after terminate, and the run again each time",
    standard="FMI 2.0 section 2.1.6: after fmi2Reset the FMU is in the state it has after "
    "fmi2Instantiate; all variables have their default values",
)
def reset(bench: Bench) -> Finding:
    """Hold an instance that was reset against a fresh one."""
    instance = bench.instance()
    changed = _disturb_parameters(bench, instance)
    with suppress(UnexpectedError):  # the changed parameters may make no run; reset mends that too
        bench.whole_run(instance)
    for situation in ("in mid-run", "after fmi2Terminate"):
        if situation != "in mid-run":
            good(instance.terminate(), "Terminate")
        good(instance.reset(), f"Reset {situation}")
        alike = f"equal to a fresh instance, twice ({changed} parameters changed before)"
        found = _judged(bench, bench.whole_run(instance), f"reset {situation}", alike)
        if found.level != "pass":
            break
    return found


def _disturb_parameters(bench: Bench, instance: Handle) -> int:
    """Change real parameters slightly where that is legal; return how many took it."""
    taken = 0
    for v in bench.plan.variables("parameter", "Real"):
        value = 1.01 * float(v.start or 0.0)
        low, high = v.minimum, v.maximum
        if (low is None or value >= low) and (high is None or value <= high):
            taken += instance.set("Real", [v.reference], [value]) in GOOD
    return taken


def _judged(bench: Bench, rows: list[Values], where: str, alike: str) -> Finding:
    """Judge a run by the reference: another one fails, or is noted where the FMU repeats none."""
    difference = bench.differs(rows, bench.reference())
    if not difference:
        return passed(alike)
    if bench.plan.repeatable:
        return failed(f"{where}: {difference}")
    return noted(f"cannot be judged, since no two runs are equal: {where}: {difference}")


@Probe(
    "many instances",
    tried="instantiate, initialise, three steps, terminate, free; again and again",
    standard="FMI 2.0 section 2.1.5: fmi2Instantiate returns a new instance each time; "
    "fmi2FreeInstance gives back everything",
    unless=unless_single,
)
def many_instances(bench: Bench) -> Finding:
    """Live many lives one after the other; the last run equals the first."""
    for _ in range(bench.plan.instances):
        _life(bench)
    many = f"{bench.plan.instances} instances"
    alike = f"{many}, the last run equals the first"
    return _judged(bench, bench.whole_run(), f"after {many}", alike)


@Probe(
    "two instances",
    tried="two live instances stepped in turn, the second with other inputs and parameters",
    standard="FMI 2.0 section 2.1.5: instances are independent of each other unless "
    "canBeInstantiatedOnlyOncePerProcess",
    unless=unless_single,
)
def two_instances(bench: Bench) -> Finding:
    """Let a second instance live beside the first, and hold the first against the reference."""
    first = bench.instance(name="first")
    second = bench.instance(name="second")
    _disturb_parameters(bench, second)
    bench.ready(first)
    try:
        bench.ready(second)
    except UnexpectedError:  # the changed parameters make no run
        second.free()
        second = bench.ready(bench.instance(name="third"))
    rows: list[Values] = [bench.read(first)]
    for k in range(bench.plan.steps):
        rows += bench.run(first, k, k + 1)
        if bench.plan.driven:
            bench.move(second, k + 11)
        second.step(bench.time(k), bench.plan.step)
    second.free()
    return _judged(bench, rows, "beside another instance", "the first runs as if it were alone")


@Probe(
    "two libraries",
    rule="robustness",
    tried="the same FMU unpacked and loaded a second time from another folder",
    standard="No clause on copies; each is a legal FMU of its own unless "
    "canBeInstantiatedOnlyOncePerProcess.",
    unless=unless_single,
)
def two_libraries(bench: Bench) -> Finding:
    """Run a copy from another folder, then the FMU itself beside it."""
    copy = Path(bench.plan.work) / "copy"
    extract(bench.plan.fmu, copy)
    other = Bench(replace(bench.plan, folder=str(copy)), bench.box)
    return _beside(bench, other, companion_first=True)


for _when, _tried, _why in (
    (
        "before", "another FMU loaded and running in the same process, then this one",
        "a co-simulation has several FMUs in one process, so no FMU may take what another one "
        "needs (module names, symbols, settings of the process).",
    ),
    (
        "after", "this FMU running, then another one loaded and run in the same process",
        "an FMU that comes later must not change one that is already running.",
    ),
):  # fmt: skip

    @Probe(
        f"another FMU {_when}",
        rule="robustness",
        tried=_tried,
        standard=f"No clause; {_why}",
        unless=lambda plan: None if plan.beside else "there is no other FMU at hand",
    )
    def another(bench: Bench, first: bool = _when == "before") -> Finding:
        """Load the companion first, or second."""
        assert bench.plan.beside is not None
        return _beside(bench, Bench(bench.plan.beside, bench.box), companion_first=first)


def _beside(bench: Bench, other: Bench, *, companion_first: bool) -> Finding:
    """Step two FMUs in turn and hold this one against its reference."""
    if companion_first:
        companion = other.ready(drive=False)
    mine = bench.ready()
    if not companion_first:
        companion = other.ready(drive=False)
    rows = [bench.read(mine)]
    for k in range(bench.plan.steps):
        if k < 10:
            try:
                other.run(companion, k, k + 1, drive=False)
            except UnexpectedError as error:
                return failed(f"the other FMU, {other.plan.about.name}: {error}")
        rows += bench.run(mine, k, k + 1)
    companion.free()
    name = "its copy" if other.plan.fmu == bench.plan.fmu else other.plan.about.name
    return _judged(bench, rows, f"beside {name}", f"runs beside {name} exactly as alone")


@Probe(
    "bare interpreter",
    rule="robustness",
    tried="a run in an interpreter without installed packages",
    standard="No clause. For FMUs that contain Python code: what they import beyond the standard "
    "library is missing elsewhere, although needsExecutionTool is not claimed.",
    unless=lambda plan: (
        "needsExecutionTool is claimed"
        if plan.claims("needsExecutionTool") and not plan.ours
        else None
    ),
    bare=True,
)
def bare_interpreter(bench: Bench) -> Finding:
    """Run where nothing but the standard library can be imported."""
    try:
        rows = bench.whole_run()
    except UnexpectedError as error:
        return noted(f"needs something that is installed here: {error}")
    except FatalAnswerError as error:
        return noted(f"needs something that is installed here: {error} answered Fatal")
    alike = "needs nothing that is installed here"
    return _judged(bench, rows, "without installed packages", alike)


@Probe(
    "memory",
    rule="robustness",
    tried="resident memory over instantiate, three steps, free",
    standard="FMI 2.0 section 2.1.5: fmi2FreeInstance frees all memory. A few kilobytes may be the "
    "allocator's, so growth is a note.",
    unless=unless_single,
)
def memory(bench: Bench) -> Finding:
    """Measure growth per life once the first lives have warmed up."""
    if not Path("/proc/self/statm").exists():
        return noted("not measured: this platform does not report it")
    lives = max(3, bench.plan.instances)
    for _ in range(lives // 2):
        _life(bench)
    before = _resident()
    for _ in range(lives):
        _life(bench)
    growth = (_resident() - before) / lives / 1024
    seen = f"{growth:.0f} KiB per instance over {lives} instances"
    return noted(seen) if growth > 64 else passed(seen)


def _life(bench: Bench) -> None:
    instance = bench.ready()
    bench.run(instance, 0, min(3, bench.plan.steps))
    good(instance.terminate(), "Terminate")
    instance.free()


def _resident() -> float:
    """Return the resident memory of this process in bytes."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * mmap.PAGESIZE
