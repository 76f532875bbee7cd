"""What a result shows: a title, the answer, and the details, as blocks that every renderer takes.

A result knows nothing of pictures: `view.py` beside it registers a function result -> `View`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawn

    from .style import Page


class Text(NamedTuple):
    """A paragraph; `kind` "say" is the answer, "note" stands in a list, "soft" explains."""

    text: str
    kind: str = ""


class Table(NamedTuple):
    """Cells below a header; `numbers` are the columns set right, `strong` the rows in bold."""

    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    numbers: Collection[int] = ()
    title: str = ""
    strong: Collection[int] = ()
    note: str = ""


class Figure(NamedTuple):
    """A figure that is drawn where it is shown; `alt` says it to those who do not see it."""

    draw: Callable[[], Page | Drawn]
    alt: str
    caption: str = ""


class Formula(NamedTuple):
    """A formula as docstrings have it, and where its parameters have intervals, with them."""

    text: str
    exact: str = ""


class Next(NamedTuple):
    """A command that follows from a result, and what it does."""

    command: str
    why: str = ""


Block = Text | Table | Figure | Formula | Next


class View(NamedTuple):
    """A result as it is read: the title says the finding, `blocks` the answer, `details` the rest.

    `tone` is the colour of the answer: "green", "blue", "purple" or "red".
    """

    title: str
    blocks: tuple[Block, ...]
    details: tuple[Block, ...] = ()
    tone: str = ""

    def then(self, *blocks: Block) -> View:
        """Return the view with more blocks behind its answer."""
        return self._replace(blocks=(*self.blocks, *blocks))

    def every(self, kind: type[Shown]) -> Iterator[Shown]:
        """Yield the blocks of a kind, those of the answer first."""
        yield from (one for one in (*self.blocks, *self.details) if isinstance(one, kind))


Shown = TypeVar("Shown", Text, Table, Figure, Formula, Next)
Made = TypeVar("Made", bound=Callable[..., View])
VIEWS: dict[type, Callable[[Any], View]] = {}
"""What makes the view of each kind of result."""


def view_of(kind: type[Any]) -> Callable[[Made], Made]:
    """Register the function that follows as what makes the view of a kind of result."""

    def register(made: Made) -> Made:
        VIEWS[kind] = made
        return made

    return register
