"""Builds whole scenarios as one FMU each, and steps them beside the coupled engine."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from both_forms import KINDS, Native, folder
from numpy.typing import NDArray

from bristle.engine.coupled import Coupled
from bristle.export.composite import export_composite
from bristle.fmu.library import Handle
from bristle.native.build import build
from bristle.native.zig import here
from bristle.system.scenario import load_scenario

Array = NDArray[np.float64]
Given = Callable[[float, float], Mapping[str, float]]


def built(
    scenario: str | Path, inputs: Iterable[str] = (), overrides: Mapping[str, Any] | None = None
) -> Path:
    """Return the FMU of a scenario, for this machine."""
    named = list(inputs)
    where = folder() / "_".join(["composite", *named, *map(str, overrides or {})])
    return export_composite(scenario, where, partial(build, platforms=[here()]), overrides, named)


@cache
def loaded(path: Path) -> Native:
    """Return an FMU's library, loaded once: its file must not be written anew meanwhile."""
    return Native(path)


class Composite:
    """An instance of a scenario's FMU."""

    def __init__(self, path: Path, **values: Any) -> None:
        self.form = loaded(path)
        self.form.messages.clear()
        self.one: Handle = self.form.instance()
        self.variables = self.form.about.variables
        self.reals = [v for v in self.form.about.of("output") if v.kind == "Real"]
        for name, value in values.items():
            self.set(name.replace("__", "."), value)

    def set(self, name: str, value: Any) -> int:
        kind = KINDS[type(value)]
        return self.one.set(kind, [self.variables[name].reference], [value])

    def get(self, name: str) -> Any:
        variable = self.variables[name]
        return self.one.get(variable.kind, [variable.reference])[1][0]

    def begin(self, time: float = 0.0) -> Composite:
        assert [self.one.setup(time, None), self.one.enter(), self.one.leave()] == [0, 0, 0]
        return self

    def shown(self) -> list[float]:
        return self.one.get("Real", [v.reference for v in self.reals])[1]

    def said(self) -> list[str]:
        return [text for _, _, _, text in self.form.messages]

    def rows(self, steps: int, dt: float, time: float = 0.0, given: Given | None = None) -> Array:
        """Return the outputs of so many steps; `given` sets inputs at each step's end."""
        found = [self.shown()]
        for k in range(steps):
            for name, value in (given(time + k * dt, dt) if given else {}).items():
                assert self.set(name, float(value)) == 0
            assert self.one.step(time + k * dt, dt) == 0, self.said()
            found.append(self.shown())
        return np.array(found)

    def difference(self, rows: Array, columns: Mapping[str, Array]) -> float:
        """Return the largest difference from a run's columns, as a share of the peak of each."""
        worst = 0.0
        for j, variable in enumerate(self.reals):
            right = columns[variable.name]
            peak = float(np.max(np.abs(right))) or 1.0
            worst = max(worst, float(np.max(np.abs(rows[:, j] - right[: len(rows)]))) / peak)
        return worst


def compared(
    scenario: str | Path, overrides: Mapping[str, Any] | None = None, stop: float | None = None
) -> float:
    """Return by how much an FMU's rows differ from those of the coupled engine."""
    more = {"run.stop": stop} if stop else {}
    run = load_scenario(scenario, {**(overrides or {}), **more})
    one = Composite(built(scenario, overrides=overrides)).begin()
    rows = one.rows(run.steps, run.step)
    one.one.free()
    return one.difference(rows, Coupled().run(run))
