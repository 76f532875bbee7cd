"""Runs a scenario of built-in components as one coupled system; named columns come out."""

from __future__ import annotations

from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import RunError
from ..jit import compiled
from ..physics.codegen import Functions, Link
from ..scenario.scenario import Scenario
from . import time_loop
from .layout import substeps_in
from .system import System

LONGEST_SUBSTEP = 2e-4
"""Longest substep [s]; half-sine peaks are then within 0.001 % of a tight integration."""
REFERENCE_SUBSTEP = 5e-5
"""The same [s] where the errors of other runs are told by this one: it must be better than they."""

Array = NDArray[Any]


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
    loop = linked(system.dampers, system.structures)(time_loop.integrate)
    filled, unsettled, _ = compiled(loop, time_loop.INLINE)(
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


def linked(*sets: Functions, **more: Any) -> Link:
    """Return what lets the time loop call these functions, and puts other globals in place.

    A controller inverts a law of the library, whatever the dampers are.
    """
    made = {name: function for one in sets for name, function in one.made.items()}
    return Link({**made, **more}, [time_loop.take_command])
