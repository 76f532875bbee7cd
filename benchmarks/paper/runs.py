"""Runs of stock scenarios for the paper's figures, and what a figure is drawn as."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from bristle.engine.run import run
from bristle.view.style import Page

if TYPE_CHECKING:
    import pandas as pd


@dataclass
class Runs:
    """Runs stock scenarios with overrides on one engine, and counts them."""

    engine: str = "compiled"
    done: Callable[[int], None] = lambda count: None
    count: int = 0

    def __call__(self, scenario: str, overrides: Mapping[str, object]) -> pd.DataFrame:
        """Return the frame of a run, as `bristle.run` does."""
        log = logging.getLogger("bristle")
        log.addFilter(_not_of_stroke)
        try:
            frame = run(scenario, overrides, engine=self.engine)
        finally:
            log.removeFilter(_not_of_stroke)
        self.count += 1
        self.done(self.count)
        return frame


def _not_of_stroke(record: logging.LogRecord) -> bool:
    """Let through what a run warns of, but not of the stroke: that the figures show themselves."""
    return "leaves the stroke" not in record.getMessage()


@dataclass(frozen=True)
class Drawing:
    """A drawn figure, and tables with the numbers in it, by what their file names end with."""

    page: Page
    tables: dict[str, pd.DataFrame] = field(default_factory=dict)
