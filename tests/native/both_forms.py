"""Drives a component in Python and its native FMU side by side through the same calls."""

from __future__ import annotations

import atexit
import importlib.util
import math
import random
import shutil
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from bristle.conformance.bench import BlackBox, ProbePlan, WatchedLibrary
from bristle.fmu.archive import extract
from bristle.fmu.build import plan
from bristle.fmu.description import read_description
from bristle.fmu.library import Handle, resources_of
from bristle.fmu.slave import Slave
from bristle.native.build import build
from bristle.native.entrance import component_of
from bristle.native.zig import here

KINDS = {float: "Real", int: "Integer", bool: "Boolean", str: "String"}
SIZES = {"m": 0.01, "m/s": 0.2, "m/s2": 3.0, "N": 8.0, "V": 5.0}
"""How far inputs move, by their unit."""

needs_zig = pytest.mark.skipif(
    importlib.util.find_spec("ziglang") is None, reason="ziglang compiles native FMUs, not there"
)


@cache
def folder() -> Path:
    path = Path(tempfile.mkdtemp(prefix="bristle-test-native-"))
    atexit.register(shutil.rmtree, path, ignore_errors=True)
    return path


@cache
def native(component: str) -> Native:
    """Return a built-in component's native FMU for this machine, loaded."""
    return Native(build(plan(component), folder(), [here()]))


class Native:
    """A native FMU, loaded; `messages` holds what its instances log."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.about = read_description(path)
        self.folder = extract(path, folder() / f"{path.parent.name}_{path.stem}_unpacked")
        about = ProbePlan(str(path), str(self.folder), str(folder()), 60.0, self.about)
        self.library = WatchedLibrary(about, BlackBox(folder() / "box"))
        self.messages = self.library.messages

    def instance(self, name: str = "one") -> Handle:
        resources = resources_of(self.folder, self.about.version)
        made = self.library.instantiate(name, self.about.guid, resources, logging=True)
        assert made is not None
        return made


class Both:
    """One component twice: as a Python object and as an instance of its native FMU."""

    def __init__(self, form: Native, slave: Slave, **values: Any) -> None:
        self.slave, self.native = slave, form
        slave.instance_name = "one"
        self.one = form.instance()
        self.reals = [v for v in form.about.of("output") if v.kind == "Real"]
        form.messages.clear()
        for name, value in values.items():
            self.set(name, value)

    def set(self, name: str, value: Any) -> int:
        """Set a variable of both; return the native one's status."""
        index = self.slave._index[name]
        kind = KINDS[type(self.slave._values[index])]
        getattr(self.slave, f"set_{kind.lower()}")([index], [value])
        return self.one.set(kind, [index], [value])

    def begin(self, time: float = 0.0) -> None:
        """Initialise both."""
        self.slave.setup_experiment(time)
        self.slave.enter_initialization_mode()
        self.slave.exit_initialization_mode()
        assert [self.one.setup(time, None), self.one.enter(), self.one.leave()] == [0, 0, 0]

    def step(self, time: float, dt: float) -> tuple[bool, int]:
        """Step both; return whether Python's went well, and the native one's status."""
        return self.slave.do_step(time, dt), self.one.step(time, dt)

    def shown(self) -> tuple[list[float], list[float]]:
        """Return the Real outputs of both."""
        references = [v.reference for v in self.reals]
        return self.slave.get_real(references), self.one.get("Real", references)[1]

    def faults(self) -> tuple[int, int]:
        """Return the output `fault` of both."""
        index = self.slave._index["fault"]
        return self.slave.get_integer([index])[0], int(self.one.get("Integer", [index])[1][0])

    def said(self) -> tuple[list[str], list[str]]:
        """Return what both have logged since the last time."""
        mine = [entry.msg for entry in self.slave.log_queue]
        other = [text for _, _, _, text in self.native.messages]
        self.slave.log_queue.clear()
        self.native.messages.clear()
        return mine, other

    def move(self, k: int, draw: random.Random) -> None:
        """Set all inputs to the values of step k: slow sines and some noise."""
        for i, v in enumerate(self.native.about.of("input")):
            size = SIZES.get(v.unit or "", 1.0)
            value = size * (math.sin(0.07 * k + 0.9 * i) + 0.01 * draw.gauss(0.0, 1.0))
            self.set(v.name, float(v.start or 0.0) + value)

    def largest_difference(self, steps: int = 150, seed: int = 1) -> float:
        """Return the largest difference of an output over a run, as a share of its peak.

        Inputs move before each step and outputs are read before and after it; the length of the
        step changes.
        """
        draw, time, rows = random.Random(seed), 0.0, [self.shown()]
        for k in range(steps):
            self.move(k, draw)
            rows.append(self.shown())
            dt = draw.choice((0.002, 0.002, 0.002, 0.001, 0.0005))
            assert self.step(time, dt) == (True, 0)
            rows.append(self.shown())
            time += dt
        worst = 0.0
        for k in range(len(self.reals)):
            mine, other = ([row[side][k] for row in rows] for side in (0, 1))
            assert all(map(math.isfinite, mine))
            peak = max(map(abs, mine)) or 1.0
            worst = max(worst, max(abs(a - b) for a, b in zip(mine, other, strict=True)) / peak)
        return worst

    def end(self) -> None:
        """Free the native instance."""
        self.one.free()


def both(component: str, **values: Any) -> Both:
    """Return both forms of a built-in component, parameters set; "__" stands for a dot."""
    given = {name.replace("__", "."): value for name, value in values.items()}
    return Both(native(component), component_of(plan(component)), **given)
