"""Engines, which run a system: by co-simulation of FMUs, or as one coupled system.

`engine.run.run` gives a frame from either. `engine.coupled` solves any system of built-in
components through numba, without coupling error: in each substep the forces are iterated until they
and the motion agree.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from ..errors import RunError

if TYPE_CHECKING:
    from ..system.model import System
    from .results import RunTable

OnRows = Callable[["RunTable"], None]
"""Takes the rows of a run that are new."""


class Engine(Protocol):
    """What runs a system."""

    @property
    def name(self) -> str:
        """What commands and results call it: "fmu" or "compiled"."""

    def refuses(self, system: System) -> str:
        """Return why it cannot run a system, "" if it can."""

    def run(self, system: System, on_rows: OnRows | None = None) -> RunTable:
        """Return every output at every step in SI, t = 0 included.

        Parameters
        ----------
        system : what runs
        on_rows : called with new rows as they come, all of them in the end

        Raises
        ------
        ScenarioError, FmuError, BuildError, RecordError
            If it cannot run the system.
        StoppedError
            If the run fails on its way.
        Interrupted
            If Ctrl-C stopped it between two steps.
        """


class StoppedError(RunError):
    """A run that had to stop; `table` holds the rows before."""

    def __init__(self, text: str, table: RunTable) -> None:
        super().__init__(text)
        self.table = table


class Interrupted(KeyboardInterrupt):
    """A run that Ctrl-C stopped between two steps; `table` holds the rows before.

    They are all of them where it was `whole`.
    """

    def __init__(self, table: RunTable, whole: bool) -> None:
        super().__init__("interrupted")
        self.table = table
        self.whole = whole
