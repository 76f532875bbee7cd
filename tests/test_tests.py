"""The tests stand on what is public, and few of them on many packages at once."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

TESTS = Path(__file__).parent
PACKAGE = TESTS.parent / "bristle"
MOST_PACKAGES = 3
"""Packages that a test file imports from: its own and two others. Commands, errors, units and
consent do not count."""
WIDER = 88
"""Files that still import from more; this number only falls."""


@cache
def imports() -> list[tuple[str, str, str]]:
    """Return file, module and name of all that tests import from the package."""
    found = []
    for path in sorted(TESTS.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            for module, name in _of(node):
                if module.partition(".")[0] == "bristle":
                    found.append((path.relative_to(TESTS).as_posix(), module, name))
    return found


def _of(node: ast.AST) -> Iterator[tuple[str, str]]:
    if isinstance(node, ast.ImportFrom) and node.module and not node.level:
        yield from ((node.module, one.name) for one in node.names)
    elif isinstance(node, ast.Import):
        yield from ((one.name, "") for one in node.names)


def is_module(module: str, name: str) -> bool:
    place = PACKAGE.parent.joinpath(*module.split("."), name)
    return place.is_dir() or place.with_suffix(".py").is_file()


def test_no_test_imports_a_private_name() -> None:
    assert [
        (file, module, name)
        for file, module, name in imports()
        if name.startswith("_") and not name.startswith("__") and not is_module(module, name)
    ] == []


def test_few_test_files_stand_on_many_packages() -> None:
    used: dict[str, set[str]] = {}
    for file, module, name in imports():
        package = f"{module}.{name}.".split(".")[1]
        if package not in ("", "cli") and (PACKAGE / package).is_dir():
            used.setdefault(file, set()).add(package)
    wide = sorted(file for file, packages in used.items() if len(packages) > MOST_PACKAGES)
    assert len(wide) <= WIDER, "\n".join(wide)
