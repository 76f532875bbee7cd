"""What a function is for stands in its docstring; one with many arguments lists them."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "bristle"

MANY = 4
"""Arguments from which on a docstring needs the section Parameters."""

HOOKS = ("bristle/physics/laws/", "bristle/physics/effects/")
"""Hooks of laws and effects all take (q, z, p): `physics.law` and `physics.effect` explain them."""

SECTION = re.compile(r"^Parameters\n-{10}$", re.MULTILINE)

Function = tuple[str, ast.ClassDef | None, ast.FunctionDef | ast.AsyncFunctionDef]


@cache
def modules() -> dict[str, ast.Module]:
    """Return the parsed files of the package by their path."""
    return {
        path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
        for path in sorted(PACKAGE.rglob("*.py"))
    }


def public_functions(
    where: str, node: ast.Module | ast.ClassDef, inside: ast.ClassDef | None = None
) -> Iterator[Function]:
    """Yield functions and methods without a leading underscore, outside private classes."""
    kinds = (ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    for part in node.body:
        if not isinstance(part, kinds) or part.name.startswith("_"):
            continue
        name = f"{where} {part.name}"
        if isinstance(part, ast.ClassDef):
            yield from public_functions(name, part, part)
        else:
            yield name, inside, part


@cache
def of_package() -> list[Function]:
    found = [
        function
        for where, module in modules().items()
        if not where.startswith(HOOKS)
        for function in public_functions(where, module)
    ]
    assert len(found) > 1000  # the package was found
    return found


def arguments(function: ast.FunctionDef | ast.AsyncFunctionDef) -> list[str]:
    """Return the names of a function's arguments, `self` and `cls` left out."""
    given = function.args
    every = [*given.posonlyargs, *given.args, *given.kwonlyargs]
    return [one.arg for one in every if one.arg not in ("self", "cls")]


def test_functions_with_many_arguments_list_them():
    missing = []
    for name, _, function in of_package():
        text = ast.get_docstring(function) or ""
        names = arguments(function)
        if len(names) < MANY:
            continue
        if not SECTION.search(text):
            missing.append(f"{name}: no section Parameters")
        unnamed = [one for one in names if not re.search(rf"\b{one}\b", text)]
        if unnamed:
            missing.append(f"{name}: not a word on {', '.join(unnamed)}")
    assert not missing, "\n".join(missing)


def test_public_functions_have_a_docstring():
    """A method that overrides a documented one of the package needs none of its own."""
    classes = {
        node.name: node
        for module in modules().values()
        for node in ast.walk(module)
        if isinstance(node, ast.ClassDef)
    }

    def documented(owner: ast.ClassDef | None, name: str) -> bool:
        if owner is None:
            return False
        own = [
            part
            for part in owner.body
            if isinstance(part, ast.FunctionDef) and part.name == name and ast.get_docstring(part)
        ]
        bases = [classes.get(ast.unparse(base)) for base in owner.bases]
        return bool(own) or any(documented(base, name) for base in bases)

    missing = [
        name
        for name, owner, function in of_package()
        if not ast.get_docstring(function) and not documented(owner, function.name)
    ]
    assert not missing, "\n".join(missing)
