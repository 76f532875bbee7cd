"""Imports point one way; what FMUs carry is plain; the text holds no path of somebody's machine."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from bristle.fmu.build import _library_files

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "bristle"

# Each layer imports from those above it in this list, or from beside it, never from below.
LAYERS = (
    {"errors", "resources", "interrupt", "progress"},
    {"units"},
    {"physics", "control"},
    {"fmu", "records", "design"},
    {"results", "cosim"},
    {"compiled", "output"},
    {"identify"},
    {"compare"},
    {"diagnose"},
    {"study"},
    {"run"},
    {"ensemble", "optimise"},
    {"report"},
    {"cli"},
)
PLAIN = ("physics", "control", "units", "errors")
"""What imports the standard library alone."""

SKIPPED = {".git", "fmus", "__pycache__", "build", "dist", "results", "node_modules", "site"}
TEXTS = {".py", ".toml", ".md", ".yml", ".yaml", ".cfg", ".txt", ".json", ".c", ".cff", ".sh"}


def sources(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*.py")) if folder.is_dir() else [folder.with_suffix(".py")]


def imported(path: Path, *, types: bool = False) -> Iterator[str]:
    """Yield the full names of imported modules; those for type checkers alone only with `types`."""
    inside = PACKAGE in path.parents
    package = [PACKAGE.name, *path.relative_to(PACKAGE).parts[:-1]] if inside else []
    tree = ast.parse(path.read_text(encoding="utf-8"))
    checked = {
        id(node)
        for block in ast.walk(tree)
        if isinstance(block, ast.If) and "TYPE_CHECKING" in ast.unparse(block.test)
        for statement in block.body
        for node in ast.walk(statement)
    }
    for node in ast.walk(tree):
        if id(node) in checked and not types:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            stem = ".".join([*base, *(node.module or "").split(".")]).strip(".")
            if stem == PACKAGE.name:  # from . import units
                yield from (f"{stem}.{alias.name}" for alias in node.names)
            else:
                yield stem


def unit_of(name: str) -> str | None:
    """Return the part of the package that a module belongs to, None outside it."""
    parts = name.split(".")
    return parts[1] if parts[0] == PACKAGE.name and len(parts) > 1 else None


def graph() -> dict[str, set[str]]:
    """Return which part of the package imports which."""
    edges: dict[str, set[str]] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        part = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
        if part != "__init__":
            found = {unit_of(name) for name in imported(path)}
            edges.setdefault(part, set()).update(found - {None, part, "__version__"})
    return edges


def test_imports_follow_the_layers() -> None:
    rank = {part: i for i, layer in enumerate(LAYERS) for part in layer}
    upward = [
        f"{part} imports {other}"
        for part, others in graph().items()
        for other in others
        if part in rank and other in rank and rank[other] > rank[part]
    ]
    assert not upward


def test_no_parts_of_the_package_import_each_other() -> None:
    edges = graph()

    def reach(part: str, seen: set[str]) -> set[str]:
        for other in edges.get(part, set()) - seen:
            seen.add(other)
            reach(other, seen)
        return seen

    assert not [part for part in edges if part in reach(part, set())]


@pytest.mark.parametrize("part", PLAIN)
def test_the_laws_import_the_standard_library_alone(part: str) -> None:
    for path in sources(PACKAGE / part):
        for name in imported(path, types=True):
            if unit_of(name):
                assert unit_of(name) in PLAIN, f"{path.name} imports {name}"
            else:
                assert name.split(".")[0] in sys.stdlib_module_names, f"{path.name} imports {name}"


def test_what_fmus_carry_imports_pythonfmu_and_the_standard_library() -> None:
    for name, _ in _library_files():
        for module in imported(PACKAGE / name, types=True):
            inside = module.removeprefix(PACKAGE.name + ".")
            bundled = [file.removesuffix(".py").replace("/", ".") for file, _ in _library_files()]
            if inside != module:
                assert any(
                    file.removesuffix(".__init__") == inside or file == inside for file in bundled
                ), f"{name} imports {module}, which FMUs do not carry"
            else:
                assert module.split(".")[0] in {*sys.stdlib_module_names, "pythonfmu"}, name


@pytest.mark.parametrize("path", sorted((ROOT / "components").glob("*.py")), ids=lambda p: p.stem)
def test_components_lean_on_what_fmus_carry(path: Path) -> None:
    files = [name.removesuffix(".py").replace("/", ".") for name, _ in _library_files()]
    carried = {f"{PACKAGE.name}.{file}" for file in files}
    for name in imported(path):
        assert name in carried or name.split(".")[0] in sys.stdlib_module_names, name


def test_what_fmus_carry_is_python_3_9() -> None:
    carried = [path for _, path in _library_files()] + sorted((ROOT / "components").glob("*.py"))
    assert len(carried) > 20
    for path in carried:
        ast.parse(path.read_text(encoding="utf-8"), str(path), feature_version=(3, 9))


def test_the_grammar_check_sees_what_3_9_lacks() -> None:
    with pytest.raises(SyntaxError):
        ast.parse("match x:\n    case 1:\n        pass\n", feature_version=(3, 9))


def texts() -> list[Path]:
    return [
        path
        for path in sorted(ROOT.rglob("*"))
        if path.is_file()
        and (path.suffix in TEXTS or path.parent.name == ".ci")
        and not any(
            part in SKIPPED or (part.startswith(".") and part not in (".ci", ".github"))
            for part in path.relative_to(ROOT).parts[:-1]
        )
    ]


def test_the_project_names_no_path_of_a_machine() -> None:
    folders = "home|root|Users|work|opt|mnt|srv"
    absolute = re.compile(rf"(?<![\w.:/*~{{}}<>-])/({folders})/\w|[A-Z]:\\\\?Users")
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()[:80]}"
        for path in texts()
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if absolute.search(line)
    ]
    assert not found


def test_the_texts_are_there() -> None:
    names = {path.relative_to(ROOT).as_posix() for path in texts()}
    assert {"README.md", "pyproject.toml", "bristle/units.py", "tests/test_imports.py"} <= names
