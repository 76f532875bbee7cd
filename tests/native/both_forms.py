"""Drives a component in Python and its native FMU side by side through the same calls."""

from __future__ import annotations

import math
import random
import tempfile
from pathlib import Path
from typing import Any

from bristle.conformance.native import BlackBox, Instance, Library
from bristle.fmu.archive import extract, library_member
from bristle.fmu.description import Description, read_description
from bristle.fmu.slave import Slave

KINDS = {float: "Real", int: "Integer", bool: "Boolean", str: "String"}


class Native:
    """A native FMU, loaded; `messages` holds what its instances log."""

    def __init__(self, path: Path, folder: Path | None = None) -> None:
        self.about: Description = read_description(path)
        self.folder = extract(path, folder or Path(tempfile.mkdtemp()))
        file = self.folder / library_member(self.about.identifier)
        self.library = Library(file, BlackBox(Path(tempfile.mkdtemp()) / "box"))
        self.messages = self.library.messages

    def instance(self, name: str = "one") -> Instance:
        resources = (self.folder / "resources").as_uri()
        made = self.library.instantiate(name, self.about.guid, resources, logging=True)
        assert made is not None
        return made


class Both:
    """One component twice: as a Python object and as an instance of its native FMU."""

    def __init__(self, slave: Slave, native: Native) -> None:
        self.slave, self.native = slave, native
        slave.instance_name = "one"
        self.one = native.instance()
        self.reals = [v for v in native.about.of("output") if v.kind == "Real"]
        native.messages.clear()

    def set(self, **values: Any) -> None:
        """Set variables by name; "__" stands for a dot."""
        for name, value in values.items():
            index = self.slave._index[name.replace("__", ".")]
            kind = KINDS[type(self.slave._values[index])]
            getattr(self.slave, f"set_{kind.lower()}")([index], [value])
            self.one.set(kind, [index], [value])

    def begin(self, time: float = 0.0) -> None:
        """Initialise both."""
        self.slave.setup_experiment(time)
        self.slave.enter_initialization_mode()
        self.slave.exit_initialization_mode()
        self.one.setup(time, None)
        self.one.enter()
        self.one.leave()

    def step(self, time: float, dt: float) -> tuple[bool, int]:
        """Step both; return whether Python's went well, and the native one's status."""
        return self.slave.do_step(time, dt), self.one.step(time, dt)

    def outputs(self) -> tuple[list[float], list[float]]:
        """Return the Real outputs of both."""
        references = [v.reference for v in self.reals]
        return self.slave.get_real(references), self.one.get("Real", references)[1]

    def logs(self) -> tuple[list[str], list[str]]:
        """Return what both have logged."""
        mine = [entry.msg for entry in self.slave.log_queue]
        return mine, [text for _, _, _, text in self.native.messages]

    def random_run(self, seed: int, steps: int = 200, scale: float = 0.1) -> float:
        """Return the largest difference over a run, in shares of each output's peak.

        Inputs move at random and are shown before and after each step, whose length changes.
        """
        draw = random.Random(seed)
        inputs = self.native.about.of("input")
        rows, time = [], 0.0
        phase = [draw.random() * 6.0 for _ in inputs]
        for k in range(steps):
            for v, shift in zip(inputs, phase, strict=True):
                size = scale * (40.0 if v.unit in ("V", "A", "1", "N") else 1.0)
                size = 0.05 * scale if v.unit == "m" else size
                value = size * math.sin(0.05 * k + shift) + 0.01 * size * draw.gauss(0.0, 1.0)
                self.set(**{v.name: value + float(v.start or 0.0)})
            rows.append(self.outputs())
            dt = draw.choice((0.002, 0.002, 0.001, 0.0005))
            good, status = self.step(time, dt)
            assert good
            assert status == 0, status
            time += dt
            rows.append(self.outputs())
        worst = 0.0
        for k in range(len(self.reals)):
            mine, other = ([row[side][k] for row in rows] for side in (0, 1))
            peak = max(map(abs, mine)) or 1.0
            worst = max(worst, max(abs(a - b) for a, b in zip(mine, other, strict=True)) / peak)
        return worst
