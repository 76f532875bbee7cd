"""No text in the package selects an effect or a law by name: class data of its own file does."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from bristle.physics.effect import EFFECTS
from bristle.physics.laws import LAWS, law_names

PACKAGE = Path(__file__).resolve().parents[2] / "bristle"
EXEMPT = ("physics", "paper", "examples")
"""Where laws and effects are at home, where a published model is rebuilt, where one is hidden."""

KINDS = {
    "effects": set(EFFECTS),
    "laws": {*law_names("damper"), *law_names("structure")},
}
ELSEWHERE = {
    ("comparison/predictions.py", "temperature"): "a label of a run",
    ("data/channels.py", "temperature"): "a label of a run",
    ("data/corrections.py", "delay"): "a fault of a channel that can be set right",
    ("data/checks/motion.py", "delay"): "a kind of finding: a channel that comes late",
    ("diagnosis/clocks.py", "delay"): "a kind of sensor fault",
    ("data/decimate.py", "delay"): "a kind of sensor fault",
    ("diagnosis/sensor_faults.py", "delay"): "a kind of sensor fault",
    ("diagnosis/load_cell.py", "delay"): "a kind of sensor fault",
    ("diagnosis/model_faults.py", "delay"): "a kind of sensor fault",
    ("diagnosis/rig_runs.py", "delay"): "a kind of sensor fault",
    ("component/sensors.py", "delay"): "a property of an instrument",
    ("controller_comparison/runs.py", "delay"): "a property of an instrument",
    ("cli/controllers.py", "delay"): "an option: a property of an instrument",
    ("engine/records.py", "delay"): "a field of the engine's record: a source's parameter",
}
"""Files in which such a word means something else, and what."""


@cache
def trees() -> list[tuple[str, ast.Module]]:
    """Return file and content of each module that is to know no name."""
    paths = [(path, path.relative_to(PACKAGE)) for path in sorted(PACKAGE.rglob("*.py"))]
    return [
        (file.as_posix(), ast.parse(path.read_text(encoding="utf-8")))
        for path, file in paths
        if file.parts[0] not in EXEMPT
    ]


def literals(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield line and name of each string that is one, or the start of a parameter's full name."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            name, dot, rest = node.value.partition(".")
            if name.isidentifier() and (not dot or not rest or rest.isidentifier()):
                yield node.lineno, name


def classes(tree: ast.Module, names: set[str]) -> Iterator[tuple[int, str]]:
    """Yield line and name of each use of a class by one of these names."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and node.id in names:
            yield node.lineno, node.id


def selections(names: set[str]) -> list[tuple[str, int, str]]:
    """Return file, line and name of all strings in the package that are one of these names."""
    return [
        (file, line, name)
        for file, tree in trees()
        for line, name in literals(tree)
        if name in names
    ]


@pytest.mark.parametrize("kind", ["effects", "laws"])
def test_no_literal_selects_by_name(kind: str) -> None:
    found = selections(KINDS[kind])
    assert not [place for place in found if (place[0], place[2]) not in ELSEWHERE]


def test_no_class_of_a_law_or_effect_is_named() -> None:
    own = {one.__name__ for one in (*EFFECTS.values(), *LAWS.values())}
    assert not [(file, *place) for file, tree in trees() for place in classes(tree, own)]


def test_every_exemption_is_needed() -> None:
    found = {(file, name) for file, _, name in selections(set(EFFECTS))}
    assert set(ELSEWHERE) <= found


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ('x = "delay"', ["delay"]),
        ('x = {"delay.time": 1.0}', ["delay"]),
        ('x = name.startswith("delay.")', ["delay"]),
        ('x = f"delay.{name}"', ["delay"]),
        ('"""A delay. It is late."""', []),
    ],
)
def test_a_name_is_seen_in_each_way_of_writing_it(text: str, names: list[str]) -> None:
    assert [name for _, name in literals(ast.parse(text))] == names
