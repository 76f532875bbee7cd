"""How user scripts end that load FMUs: each in a process of its own, its exit code and messages.

    python -m benchmarks exits --scripts 200            # a quarter of an hour
    python -m benchmarks exits --scripts 200 --harsh    # where damaged memory always aborts
    python -m benchmarks exits --show 7                 # one of the scripts

A script is made of parts that the seed draws: runs on both engines in either order, threads, pools,
threads that are still stepping as the script ends, pandas, figures, FMUs loaded with FMPy that are
freed, reset or left to the end, exceptions on the way, Ctrl-C, and the ways to end. Each part steps
FMUs in Python or, two times in five, native ones. Each script should end with 0 and say nothing.

`--harsh` turns off malloc's per-thread cache, so that freed memory is in one of malloc's lists, and
loads a library that takes memory as the process ends. There a damaged list always aborts.
"""

# Longer than 300 lines: a third of it is the text of the scripts' parts.

from __future__ import annotations

import argparse
import importlib.util
import os
import random
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import bristle
from bristle.core.files import fmus_folder
from bristle.fmu.build import ensure
from bristle.native import zig
from bristle.native.build import ensure as ensure_native

from . import _hosts
from ._rows import Row

ROOT = Path(__file__).resolve().parent.parent
FEW = 6
"""Scripts that the table of all benchmarks runs."""
LIMIT = 300.0
"""Seconds after which a script counts as hung."""
DIVISION = "# --"
NATIVE = 0.4 if importlib.util.find_spec("ziglang") else 0.0
"""Share of the parts that step native FMUs, which zig compiles."""

HEAD = """
import sys
import bristle
import fmpy
from fmpy.fmi2 import FMU2Slave

SHORT = {"run.stop": 0.1}

def load(name):
    folder = str(fmpy.extract(f"{FMUS[form]}/{name}.fmu"))
    about = fmpy.read_model_description(folder)
    fmu = FMU2Slave(
        guid=about.guid, modelIdentifier=about.coSimulation.modelIdentifier,
        unzipDirectory=folder, instanceName=name,
    )
    fmu.instantiate()
    begin(fmu)
    return fmu

def begin(fmu):
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    for k in range(20):
        fmu.doStep(0.01 * k, 0.01)
"""

ENGINES = (
    """
results = bristle.run("bench_sine_bingham", SHORT, fmus=form)
""",
    """
results = bristle.run("bench_sine_bingham", SHORT, engine="compiled")
""",
)

PARTS = {
    "pandas": """
import pandas as pd
table = pd.DataFrame(bristle.run("bench_sine_lugre", SHORT, fmus=form))
table = table.rolling(5).mean().describe()
""",
    "figure": """
import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt
bristle.run("bench_sine_bingham", SHORT, fmus=form).plot().savefig("figure.png")
plt.close("all")
""",
    "threads": """
import threading
workers = [
    threading.Thread(target=bristle.run, args=("bench_sine_bingham", SHORT), kwargs={"fmus": its})
    for its in ("python", form)
]
[worker.start() for worker in workers]
[worker.join() for worker in workers]
""",
    "pool": """
from concurrent.futures import ThreadPoolExecutor
with ThreadPoolExecutor(3) as pool:
    jobs = [("fmu", 1.0, form), ("compiled", 2.0, "python"), ("fmu", 3.0, "python"),
            ("fmu", 4.0, form)]
    peaks = list(pool.map(lambda job: bristle.run(
        "bench_sine_bingham", {**SHORT, "damper.f_c": job[1]}, engine=job[0], fmus=job[2]
    ).abs().max(), jobs))
""",
    "daemon": """
import threading
stepped = load("LuGreDamper")
def step_on():
    for k in range(10**9):
        stepped.doStep(0.2 + 0.01 * k, 0.01)
threading.Thread(target=step_on, daemon=True).start()
""",
    "freed": """
fmu = load("LuGreDamper")
fmu.terminate()
fmu.freeInstance()
""",
    "freed at once": """
fmu = load("BinghamDamper")
fmu.freeInstance()
""",
    "reset": """
fmu = load("LuGreDamper")
fmu.reset()
begin(fmu)
fmu.freeInstance()
""",
    "kept": """
kept = [load("ConstantVoltage"), load("LuGreDamper")]
""",
    "kept in a class": """
class Bench:
    fmus = {name: load(name) for name in ("BinghamDamper", "PrescribedMotion")}
    def __del__(self):
        self.fmus.clear()
bench = Bench()
""",
    "exception": """
try:
    bristle.run("bench_sine_bingham", {**SHORT, "damper.f_c": float("nan")}, fmus=form)
except bristle.BristleError as error:
    caught = error
""",
    "exception with an FMU": """
def careless():
    fmu = load("BinghamDamper")
    raise RuntimeError("in the middle")
try:
    careless()
except RuntimeError as error:
    caught_too = error
""",
    "bad step": """
fmu = load("LuGreDamper")
try:
    fmu.doStep(0.2, -1.0)
except Exception as error:
    caught_then = error
""",
    "interrupted": """
import os, signal, threading
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
try:
    while True:
        bristle.run("bench_sine_lugre", {"run.stop": 2.0}, fmus=form)
except KeyboardInterrupt as error:
    interrupt = error
""",
    "simulate_fmu": """
table = fmpy.simulate_fmu(f"{FMUS[form]}/ConstantVoltage.fmu", stop_time=0.1, step_size=0.01)
""",
}

ENDS = (
    "",
    "\nsys.exit()\n",
    "\nsys.exit(0)\n",
    '\nif __name__ == "__main__":\n    raise SystemExit\n',
    "\nimport atexit\natexit.register(lambda: results.sum())\n",
)
LOADED = ("BinghamDamper", "ConstantVoltage", "LuGreDamper", "PrescribedMotion")


@dataclass(frozen=True)
class End:
    """How a script ended: its number, exit code (None: it hung), and what it said."""

    number: int
    code: int | None
    said: str

    @property
    def good(self) -> bool:
        """Whether it ended with 0."""
        return self.code == 0

    def __str__(self) -> str:
        last = self.said.strip().splitlines()[-1:] or ["without a word"]
        code = "hung" if self.code is None else f"exit {self.code}"
        return f"script {self.number}: {code}, {last[0][:120]}"


def script(number: int) -> str:
    """Return the text of a script."""
    draw = random.Random(number)
    engines = [*ENGINES, draw.choice(ENGINES)]
    draw.shuffle(engines)
    names = draw.sample(sorted(PARTS), draw.randint(1, 4))
    blocks = [*engines, *(PARTS[name] for name in names)]
    draw.shuffle(blocks)
    end = draw.choice(ENDS)
    blocks = [_with_form(block, draw) for block in blocks]
    folders = {"python": str(fmus_folder()), "native": str(zig.folder() / "fmus")}
    head = HEAD.replace("import fmpy\n", f"import fmpy\n\nFMUS = {folders!r}\n", 1)
    return head + f"\n{DIVISION} parts: {', '.join(names)}".join(["", *blocks]) + end


def _with_form(block: str, draw: random.Random) -> str:
    """Return a part with the form of the FMUs that it steps; one that steps none as it is."""
    form = "native" if draw.random() < NATIVE else "python"
    return f'\nform = "{form}"{block}' if "form" in block or "load(" in block else block


def run_script(number: int, library: Path | None = None) -> End:
    """Run a script in a folder of its own.

    Parameters
    ----------
    number : int
    library : path, optional
        A library that the script loads last and that finds damaged memory, see `harsh_library`.
    """
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    text = script(number)
    if library is not None:
        environment["GLIBC_TUNABLES"] = "glibc.malloc.tcache_count=0"
        text = f"import atexit, ctypes\natexit.register(ctypes.CDLL, {str(library)!r})\n{text}"
    with tempfile.TemporaryDirectory(prefix="bristle-exits-") as folder:
        file = Path(folder, "script.py")
        file.write_text(text, encoding="utf-8")
        try:
            done = subprocess.run(
                [sys.executable, str(file)],
                cwd=folder, env=environment, capture_output=True, text=True, timeout=LIMIT,
            )  # fmt: skip
        except subprocess.TimeoutExpired as error:
            return End(number, None, str(error.stderr or ""))
    return End(number, done.returncode, done.stderr)


def harsh_library(folder: Path) -> Path | None:
    """Return the library that finds damaged memory, compiled; None where that cannot be done."""
    source = Path(__file__).with_name("late.c")
    return _hosts.made_in_c(source, folder / "late.so", "-shared", "-fPIC", "-O0")


def count(numbers: range, harsh: bool = False, show: bool = False) -> list[End]:
    """Run scripts one after the other; return how they ended."""
    for name in LOADED:
        ensure(name)
        if NATIVE:
            ensure_native(name)
    bristle.run("bench_sine_bingham", {"run.stop": 0.1}, engine="compiled")  # compiled once
    with tempfile.TemporaryDirectory(prefix="bristle-exits-") as folder:
        library = harsh_library(Path(folder)) if harsh else None
        if harsh and library is None:
            raise SystemExit("--harsh needs Linux and a C compiler.")
        ends = []
        for number in numbers:
            ends.append(run_script(number, library))
            if show and not ends[-1].good:
                print(ends[-1], file=sys.stderr, flush=True)
    return ends


def rows(ends: list[End], harsh: bool = False) -> list[Row]:
    """Return the figure: how many scripts ended with 0."""
    good = sum(end.good for end in ends)
    codes = Counter(end.code for end in ends if not end.good)
    noisy = sum(bool(end.said.strip()) for end in ends if end.good)
    said = f"; exit codes of the others: {dict(codes)}" if codes else ""
    name = "scripts with FMUs that end with 0" + (", damaged memory aborts" if harsh else "")
    measured = f"{good} of {len(ends)}{said}" + (f"; {noisy} with a message" if noisy else "")
    native = sum('form = "native"' in script(end.number) for end in ends)
    note = f"{native} of them step native FMUs"
    return [Row(name, measured, f"{len(ends)} of {len(ends)}", len(ends) / max(good, 0.5), note)]


def run() -> list[Row]:
    """Return the figure for a few scripts."""
    return rows(count(range(FEW)))


def main(given: list[str]) -> int:
    """Run as many scripts as are asked for; return 1 if one does not end with 0."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks exits", description=__doc__)
    parser.add_argument("--scripts", type=int, default=200, metavar="N", help="how many")
    parser.add_argument(
        "--first", type=int, default=0, metavar="NUMBER", help="number of the first"
    )
    parser.add_argument("--harsh", action="store_true", help="let damaged memory abort")
    parser.add_argument("--show", type=int, metavar="NUMBER", help="print a script")
    chosen = parser.parse_args(given)
    if chosen.show is not None:
        print(script(chosen.show))
        return 0
    ends = count(range(chosen.first, chosen.first + chosen.scripts), chosen.harsh, show=True)
    for row in rows(ends, chosen.harsh):
        print(f"{row.name}: {row.measured}; {row.note}")
    return int(not all(end.good for end in ends))
