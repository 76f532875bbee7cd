"""Imports point one way; what FMUs carry is plain; the text holds no path of somebody's machine."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from bristle.fmu.build import library_files

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "bristle"

# A base, two columns that do not see each other, and a roof over both. Within each of them a layer
# imports from those before it in its list, never from beside it or from behind it.
BASE = (
    {"errors", "version"},
    {"units"},
    {"physics"},
    {"core"},
    {"component", "trust", "view"},
    {"data", "user_code"},
    {"model"},
)
SIMULATE = (
    {"fmu"},
    {"native", "synthesis", "conformance"},
    {"system"},
    {"engine"},
    {"campaign", "optimal_control", "export"},
    {"controller_comparison"},
)
MEASURE = ({"identification"}, {"comparison"}, {"diagnosis"}, {"learning"})
ROOF = (
    {"study"}, {"prediction"}, {"planning"}, {"examples"}, {"report"}, {"page"}, {"cli"},
)  # fmt: skip
STOREYS: tuple[tuple[tuple[set[str], ...], ...], ...] = ((BASE,), (SIMULATE, MEASURE), (ROOF,))
PLAIN = ("physics", "component", "units", "errors")
"""What imports the standard library alone."""

SKIPPED = {".git", "fmus", "__pycache__", "build", "dist", "results", "node_modules", "site"}
TEXTS = {".py", ".toml", ".md", ".yml", ".yaml", ".cfg", ".txt", ".json", ".c", ".cff", ".sh"}


def sources(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*.py")) if folder.is_dir() else [folder.with_suffix(".py")]


def imported(path: Path, *, types: bool = False) -> Iterator[str]:
    """Yield the full names of imported modules; those for type checkers alone only with `types`."""
    package = list(path.relative_to(ROOT).parts[:-1])
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
            for alias in node.names:  # from . import units; from ..physics import damper
                name = f"{stem}.{alias.name}"
                yield name if is_module(name) else stem


def is_module(name: str) -> bool:
    """Return whether a full name is that of a module or package of ours."""
    path = ROOT.joinpath(*name.split("."))
    return path.with_suffix(".py").is_file() or (path / "__init__.py").is_file()


def unit_of(name: str) -> str | None:
    """Return the part of the package that a module belongs to, None outside it."""
    parts = name.split(".")
    return parts[1] if parts[0] == PACKAGE.name and len(parts) > 1 else None


@cache
def modules(folder: Path = PACKAGE) -> dict[str, set[str]]:
    """Return which module of a package imports which others of it, by full names."""
    edges: dict[str, set[str]] = {}
    for path in sorted(folder.rglob("*.py")):
        parts = path.relative_to(folder.parent).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        edges[name] = {other for other in imported(path) if other != name}
    return {name: others & set(edges) for name, others in edges.items()}


def graph() -> dict[str, set[str]]:
    """Return which part of the package imports which."""
    edges: dict[str, set[str]] = {}
    for name, others in modules().items():
        part = unit_of(name)
        if part:
            found = {unit_of(other) for other in others}
            edges.setdefault(part, set()).update({other for other in found if other} - {part})
    return edges


def places() -> dict[str, tuple[int, int, int]]:
    """Return where each part is: its storey, its column there, its layer in the column."""
    return {
        part: (storey, column, layer)
        for storey, columns in enumerate(STOREYS)
        for column, layers in enumerate(columns)
        for layer, parts in enumerate(layers)
        for part in parts
    }


def in_circles(edges: dict[str, set[str]]) -> list[str]:
    """Return the nodes from which a way leads back to themselves."""

    def reach(name: str, seen: set[str]) -> set[str]:
        for other in edges.get(name, set()) - seen:
            seen.add(other)
            reach(other, seen)
        return seen

    return [name for name in edges if name in reach(name, set())]


def may_import(here: tuple[int, int, int], there: tuple[int, int, int]) -> bool:
    return there[0] < here[0] or (here[:2] == there[:2] and there[2] < here[2])


def test_every_part_has_its_place() -> None:
    assert set(graph()) - {"__init__"} == set(places())


def test_imports_follow_the_map() -> None:
    place = places()
    wrong = [
        f"{name} imports {other}"
        for name, others in modules().items()
        for other in others
        if (here := unit_of(name)) and (there := unit_of(other)) and here != there
        if not may_import(place[here], place[there])
    ]
    assert not wrong


def test_columns_do_not_see_each_other() -> None:
    place = places()
    assert not may_import(place["identification"], place["engine"])
    assert not may_import(place["campaign"], place["identification"])
    assert may_import(place["study"], place["campaign"])
    assert may_import(place["fmu"], place["physics"])


def test_runs_commands_and_pages_alone_ask_for_native_fmus() -> None:
    asking = {part for part, others in graph().items() if "native" in others}
    assert asking <= {"engine", "cli", "export"}


def test_no_modules_import_each_other() -> None:
    assert not in_circles(modules())
    assert in_circles({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == ["a", "b", "c"]


def test_the_benchmarks_import_in_no_circle() -> None:
    assert not in_circles(modules(ROOT / "benchmarks"))


@pytest.mark.parametrize("part", PLAIN)
def test_the_laws_import_the_standard_library_alone(part: str) -> None:
    for path in sources(PACKAGE / part):
        for name in imported(path, types=True):
            if unit_of(name):
                assert unit_of(name) in PLAIN, f"{path.name} imports {name}"
            else:
                assert name.split(".")[0] in sys.stdlib_module_names, f"{path.name} imports {name}"


def test_what_fmus_carry_imports_pythonfmu_and_the_standard_library() -> None:
    for name, _ in library_files():
        for module in imported(PACKAGE / name, types=True):
            inside = module.removeprefix(PACKAGE.name + ".")
            bundled = [file.removesuffix(".py").replace("/", ".") for file, _ in library_files()]
            if inside != module:
                assert any(
                    file.removesuffix(".__init__") == inside or file == inside for file in bundled
                ), f"{name} imports {module}, which FMUs do not carry"
            else:
                assert module.split(".")[0] in {*sys.stdlib_module_names, "pythonfmu"}, name


@pytest.mark.parametrize("path", sorted((ROOT / "components").glob("*.py")), ids=lambda p: p.stem)
def test_components_lean_on_what_fmus_carry(path: Path) -> None:
    names = [name.removesuffix(".py") for name, _ in library_files()]
    files = [name.removesuffix("/__init__").replace("/", ".") for name in names]
    carried = {f"{PACKAGE.name}.{file}" for file in files}
    for name in imported(path):
        assert name in carried or name.split(".")[0] in sys.stdlib_module_names, name


def test_what_fmus_carry_is_python_3_9() -> None:
    carried = [path for _, path in library_files()] + sorted((ROOT / "components").glob("*.py"))
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
