"""No literal selects a law outside the rooms that may know one by name."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import bristle
from bristle.physics.laws import LAWS, law_names

ROOM = Path(bristle.__file__).parent
MAY_KNOW = ("physics", "paper", "example")
"""Rooms that hold the laws themselves, or the paper's."""

FILES = [
    path for path in sorted(ROOM.rglob("*.py")) if path.relative_to(ROOM).parts[0] not in MAY_KNOW
]


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOM)))
def test_nothing_selects_a_law_by_name(path: Path) -> None:
    names = {*LAWS, *law_names()}
    classes = {law.__name__ for law in LAWS.values()}
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and node.value in names:
            pytest.fail(f"line {node.lineno}: {node.value!r}")
        if isinstance(node, ast.Name) and node.id in classes:
            pytest.fail(f"line {node.lineno}: {node.id}")
