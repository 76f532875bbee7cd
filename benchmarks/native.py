"""Native FMUs: how long their steps take, how large they are and how fast they are built.

    python -m benchmarks native           # a few minutes

Steps are timed by a host in C (`steps.c`): inputs set, doStep, outputs read. Their inputs move, and
the same steps are made several times from a reset on. A step's own time is that of its fastest
pass, since the machine does not interrupt the same step every time; the worst of these is the worst
step. Closed loops are timed in the project's master, in turn with FMUs in Python.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from bristle.errors import BuildError
from bristle.fmu import catalogue
from bristle.native.build import ensure
from bristle.native.zig import PLATFORMS
from bristle.physics.effect import effects_of
from bristle.physics.laws import laws_of
from bristle.system.scenario import load_scenario

from . import _hosts
from ._rows import Row, interleave, ratio_of
from .build import build_afresh
from .master import SCENARIO, STEPS, find_fmus, time_master

DAMPERS = ("LuGreDamper", "ModifiedBoucWenDamper")
"""The dampers whose times have goals."""
COUNT, PASSES = 100_000, 5
"""Steps of a pass after a thousand to warm up, and passes."""
REPETITIONS = 5
BUILD = """
import sys
from pathlib import Path

from bristle.fmu.build import plan
from bristle.fmu.catalogue import component_names
from bristle.native.build import build
from bristle.native.zig import PLATFORMS

names = component_names()
for name in names:
    build(plan(name), Path(sys.argv[1]), list(PLATFORMS.values()))
print(len(names))
"""


@dataclass(frozen=True)
class Steps:
    """Times of an FMU's steps [us].

    Attributes
    ----------
    median
        Of all steps.
    worst
        The slowest step, each counted as its fastest pass.
    seen
        The slowest step of all passes, interruptions by the machine included.
    clock
        What reading the clock takes, which all of them contain.
    """

    median: float
    worst: float
    seen: float
    clock: float

    def __str__(self) -> str:
        return (
            f"median {self.median:.2f} us, worst step {self.worst:.2f} us, with the machine's "
            f"interruptions {self.seen:.0f} us"
        )


def timer(folder: Path) -> Path | None:
    """Return the C host that times steps, compiled; None without a compiler, or not on Linux."""
    return _hosts.compiled(Path(__file__).with_name("steps.c"), folder)


def timed(program: Path, path: Path, switches: Sequence[str] = ()) -> Steps:
    """Return the times of a native FMU's steps in the C host, with these switches on."""
    found = _hosts.times_of_steps(program, path, switches, COUNT, PASSES)
    return Steps(*(1e-3 * number for number in found))


def run() -> list[Row]:
    """Return the figures of the dampers' steps, the closed loop, the archives and the build."""
    try:
        with tempfile.TemporaryDirectory(prefix="bristle-native-") as name:
            return [*_dampers(Path(name)), _loop(), *_archives(Path(name))]
    except BuildError as error:
        return [Row("native FMUs", f"not measured: {error}")]


def _dampers(folder: Path) -> Iterable[Row]:
    """Yield the times of the dampers' steps: without effects, and with each by itself."""
    program = timer(folder)
    if program is None:
        yield Row("steps of native FMUs", "not measured: no C compiler, or not on Linux")
        return
    law_of = {catalogue.component_of_law(law.name): law.name for law in laws_of("damper")}
    for damper in DAMPERS:
        path = ensure(damper)
        bare = timed(program, path)
        yield Row(
            f"{damper}, step in a C host, no effect", str(bare), "median <= 1 us", bare.median,
            f"reading the clock takes {bare.clock:.3f} us of each",
        )  # fmt: skip
        each = {
            effect.name: timed(program, path, [f"{effect.name}.on"])
            for effect in effects_of("damper", law_of[damper])
        }
        name = max(each, key=lambda one: each[one].median)
        slowest = max(each, key=lambda one: each[one].worst)
        yield Row(
            f"{damper}, step in a C host, slowest of {len(each)} effects: {name}",
            str(each[name]), "median <= 5 us", each[name].median / 5.0,
            f"the worst step of all effects is {each[slowest].worst:.2f} us, {slowest}",
        )  # fmt: skip


def _loop() -> Row:
    """Return the time of the closed loop with native FMUs over that with FMUs in Python."""
    scenario = load_scenario(SCENARIO)
    forms = {"native": find_fmus(scenario, ensure), "python": find_fmus(scenario)}
    times = interleave(
        {name: lambda fmus=fmus: time_master(scenario, fmus) for name, fmus in forms.items()},
        REPETITIONS,
    )
    ratio = ratio_of(times["native"], times["python"])
    return Row(
        f"closed loop of {len(scenario.components)} FMUs, {STEPS:,} steps, native / Python",
        f"{ratio:.3f} x; {times['native']} against {times['python']}", "<= 0.4 x", ratio / 0.4,
    )  # fmt: skip


def _archives(folder: Path) -> list[Row]:
    """Return the size of the archives for all platforms, and the time of building them."""
    first, count = build_afresh(BUILD, folder / "first")
    seconds, _ = build_afresh(BUILD, folder / "again")
    sizes = {path.stem: path.stat().st_size for path in (folder / "again").glob("*.fmu")}
    name = max(sizes, key=lambda one: sizes[one])
    of = f"{count} components for {len(PLATFORMS)} platforms"
    return [
        Row(f"largest archive of {of}: {name}", f"{sizes[name] / 1e6:.2f} MB", "<= 1 MB",
            sizes[name] / 1e6),
        Row(f"build of {of}, all parts in the cache", f"{seconds:.2f} s", "<= 5 s", seconds / 5.0,
            f"the build before, of whatever the cache lacked, took {first:.1f} s"),
    ]  # fmt: skip
