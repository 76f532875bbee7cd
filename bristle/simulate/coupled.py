"""Runs a scenario of built-in components as one coupled system; named columns come out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import RunError
from ..jit import compiled
from ..physics import damper, structure
from ..scenario.scenario import Scenario
from . import time_loop
from .layout import substeps_in
from .system import System

LONGEST_SUBSTEP = 2e-4
"""Longest substep [s]; half-sine peaks are then within 0.001 % of a tight integration."""
REFERENCE_SUBSTEP = 5e-5
"""The same [s] where the errors of other runs are told by this one: it must be better than they."""

Array = NDArray[Any]

_sample = time_loop.sample
_has_clocks = False


class StoppedError(RunError):
    """A run that had to stop; `columns` holds the rows before."""

    def __init__(self, text: str, columns: dict[str, Array]) -> None:
        super().__init__(text)
        self.columns = columns


def simulate(scenario: Scenario, longest: float = LONGEST_SUBSTEP) -> dict[str, Array]:
    """Return the columns of a run, time [s] first, then every output as `component.port`.

    Parameters
    ----------
    scenario : Scenario
        Of built-in components only.
    longest : float
        Longest substep [s].

    Returns
    -------
    dict
        Name to (steps + 1,) array in SI units; Integer outputs as int32.

    Raises
    ------
    ScenarioError
        Naming a component that cannot be compiled.
    StoppedError
        If a value stops being finite, or motion and forces do not agree; the text names the
        component and the time, `columns` holds the rows before.
    """
    system = System(scenario)
    rows, substeps = scenario.steps, substeps_of(scenario, system, longest)
    h = scenario.step / substeps
    table = np.zeros((rows + 1, len(system.outputs)))
    slots = np.array(list(system.outputs.values()), dtype=np.int64)
    filled, unsettled, _ = compiled_loop(bool(system.names["sampled"]))(
        (rows, substeps, h), system.sources(), system.coupled(h), system.sampled(h),
        system.start_values(), slots, table,
    )  # fmt: skip
    what = ""
    if unsettled >= 0:
        name = system.names["damper"][unsettled]
        what = f"{name} before t = {filled * scenario.step:.9g} s: force and motion do not agree"
    elif not np.isfinite(table[filled - 1]).all():
        filled -= 1
        wrong = [n for n, v in zip(system.outputs, table[filled], strict=True) if not isfinite(v)]
        component = wrong[0].partition(".")[0]
        others = f" (as are {', '.join(wrong[1:4])})" if wrong[1:] else ""
        when = f"at t = {filled * scenario.step:.9g} s"
        what = f"{component} {when}: {wrong[0]} is not finite{others}"
    columns = _columns(system, table[:filled], scenario.step)
    if what:
        raise StoppedError(
            f"{what}.\n  A shorter step or parameters within their bounds would be right.", columns
        )
    return columns


def _columns(system: System, table: Array, step: float) -> dict[str, Array]:
    columns: dict[str, Array] = {"time": np.arange(len(table)) * step}
    for j, name in enumerate(system.outputs):
        integer = system.kinds[name] == "Integer"
        columns[name] = table[:, j].astype(np.int32) if integer else table[:, j]
    return columns


def substeps_of(scenario: Scenario, system: System, longest: float = LONGEST_SUBSTEP) -> int:
    """Return into how many substeps a step is cut: at best so that instants fall on their ends.

    Parameters
    ----------
    scenario, system : what runs, and its numbers
    longest : longest substep [s]
    """
    return substeps_in(scenario.step, longest, system.periods())


def compiled_loop(clocked: bool = False) -> Callable[..., tuple[int, int, int]]:
    """Return the compiled time loop, with sampled components or without.

    The first call on a machine takes seconds, more of them with sampled components. A process that
    has the loop with them uses it for everything: it gives the same numbers.
    """
    global _has_clocks
    _has_clocks = _has_clocks or clocked
    return _compiled(damper.evaluate, structure.effect_forces, _has_clocks)


@contextmanager
def whole_loop() -> Iterator[tuple[Any, tuple[str, ...]]]:
    """Give the time loop with sampled components, and which of its callees become part of it."""
    before, time_loop.sample = time_loop.sample, _sample
    try:
        yield time_loop.integrate, time_loop.INLINE
    finally:
        time_loop.sample = before


@cache
def _compiled(
    evaluate: Any, effect_forces: Any, clocked: bool
) -> Callable[..., tuple[int, int, int]]:
    """Compile the loop as these generated functions are: there are new ones after a new effect."""
    time_loop.sample = _sample if clocked else time_loop.idle
    function: Callable[..., tuple[int, int, int]] = compiled(time_loop.integrate, time_loop.INLINE)
    return function
