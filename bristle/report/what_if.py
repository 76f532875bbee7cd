"""What if: a study's damper with sliders, computed in the page by the functions of the commands."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ..prediction.export import write_editable
from ..view import html

if TYPE_CHECKING:
    from ..export.web import Shown
    from ..study.study import Study


class Movable(NamedTuple):
    """A study's scenario as a page runs it: its file, what the page shows, run and notes."""

    scenario: Path
    shown: Shown
    run: str
    notes: tuple[str, ...]


@contextmanager
def movable(study: Study) -> Iterator[Movable]:
    """Yield the scenario of a study's damper whose numbers a page can move, in a folder that goes.

    Raises
    ------
    StudyError, RecordError
        If the model or its run cannot be read.
    """
    from ..export.web import Shown

    with tempfile.TemporaryDirectory() as folder:
        found = write_editable(study, Path(folder))
        measured = {"damper.force": "measured.value"} if found.force else {}
        shown = Shown([f"damper.{name}" for name in found.numbers], measured)
        yield Movable(found.scenario, shown, found.run, found.notes)


def what_if_section(study: Study) -> str:
    """Return the section of a report whose sliders move the numbers of the model.

    Raises
    ------
    BuildError
        If zig is not installed.
    ScenarioError, StudyError, RecordError
        If the study has no model, or its scenario cannot be compiled.
    """
    from ..export.web import body, described
    from ..export.web_module import PageNumbers, module

    with movable(study) as found:
        numbers = PageNumbers(found.scenario)
        description = described(numbers, shown=found.shown)
    return html.section(
        f"What if: the model in {found.run}, with other numbers",
        body(module(numbers.system), description),
        html.items(found.notes),
    )
