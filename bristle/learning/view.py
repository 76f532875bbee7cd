"""What was learned, in words and tables."""

from __future__ import annotations

from ..core.text import short_z
from ..view.blocks import Block, Table, Text, View, view_of
from .closure import LearnedClosure
from .result import LearnedEffect


@view_of(LearnedEffect)
def learned_view(found: LearnedEffect) -> View:
    """Return the view of a learned effect: what it is, what it explains, its files."""
    title, *rest = found.sentences()
    files: list[Block] = []
    if found.file is not None:
        files.append(Text(f"Effect: {found.file}. Picture: {found.picture}."))
    others = [
        [one.curve.words(), short_z(one.trial.z), short_z(one.trial.train)]
        for one in found.found.others
    ]
    header, note = ("also fitted", "z held out", "z train"), "z: error / noise; a true model has 1."
    table = [Table(header, others, (1, 2), note=note)] if others else []
    return View(title, (*map(Text, rest), *files), tuple(table))


@view_of(LearnedClosure)
def closure_view(found: LearnedClosure) -> View:
    """Return the view of a closure: what it is, what it lives on, where it is not supported."""
    title, *rest = found.sentences()
    rows = [[words, f"{100.0 * part:.0f} %"] for words, part in found.lives_on]
    table = [Table(("input", "goes without it"), rows, (1,))] if rows else []
    file = [] if found.file is None else [Text(f"File: {found.file}.")]
    return View(title, (*map(Text, rest), *file), tuple(table))
