"""The controller file: it comes back as it was, and nothing else is taken for one."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from bristle.component import controller_file as file
from bristle.component.controller_file import Controller, parse_controller, read_controller
from bristle.errors import DesignError
from bristle.physics.building import paper_building


@pytest.fixture
def small() -> Controller:
    return Controller(
        kind="lpv",
        title="small",
        n=1,
        rows=2,
        v_top=0.3,
        sample_period=0.002,
        A=[0.9, 1.0 / 3.0],
        B=[0.1, 0.2],
        W=[0.0, 1e-300],
        C=[1.0, -2.0],
        facts={"gamma": 8.7, "building": "base-isolated two-storey model"},
        design={"kind": "lpv"},
        building=file.building_digest(paper_building()),
    )


def test_comes_back_as_it_was(small: Controller, tmp_path: Path) -> None:
    path = tmp_path / "controller.json"
    small.save(path)
    assert read_controller(path) == small
    assert small.command_unit == "V"
    assert small._replace(kind="hinf").command_unit == "N"


def change(**values: Any) -> Callable[[dict[str, Any]], None]:
    return lambda content: content.update(values)


def drop(name: str) -> Callable[[dict[str, Any]], None]:
    return lambda content: content.pop(name)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (change(A=[0.9, 0.3333]), "does not match its digest"),
        (change(sample_period=0.001), "does not match its digest"),
        (change(building="0" * 16), "does not match its digest"),
        (change(title="other"), "does not match its digest"),
        (change(digest="0" * 16), "does not match its digest"),
        (change(schema=2), "schema 1"),
        (change(colour="red"), "not a controller file"),
        (drop("W"), "not a controller file"),
    ],
)
def test_an_edited_file_is_refused(
    small: Controller, edit: Callable[[dict[str, Any]], None], message: str
) -> None:
    content = json.loads(small.text())
    edit(content)
    with pytest.raises(DesignError, match=message):
        parse_controller(json.dumps(content), "controller.json")


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999"])
def test_numbers_that_are_not_finite_are_refused(small: Controller, number: str) -> None:
    text = small.text().replace("0.9", number)
    with pytest.raises(DesignError, match=r"not a finite number|not finite"):
        parse_controller(text)


def test_numbers_that_are_not_finite_are_not_written(small: Controller, tmp_path: Path) -> None:
    path = tmp_path / "controller.json"
    with pytest.raises(DesignError, match="not finite"):
        small._replace(A=[float("nan"), 0.0]).save(path)
    assert not path.exists()


@pytest.mark.parametrize(
    "wrong",
    [
        {"A": [0.9]},
        {"C": [1.0, "2"]},
        {"rows": 0},
        {"kind": "pid"},
        {"sample_period": 0.0},
        {"v_top": 0.0},
    ],
)
def test_a_whole_file_that_is_no_controller_is_refused(
    small: Controller, wrong: dict[str, Any]
) -> None:
    text = small._replace(**wrong).text()  # with a digest that matches
    with pytest.raises(DesignError):
        parse_controller(text)


@pytest.mark.parametrize("text", ["", "{", "[]", "null", "3", "[" * 100_000])
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(DesignError, match="not a controller file"):
        parse_controller(text)


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    with pytest.raises(DesignError, match=r"missing\.json: cannot be read"):
        read_controller(tmp_path / "missing.json")
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(DesignError, match=r"binary\.json: not a text"):
        read_controller(tmp_path / "binary.json")


def test_a_file_that_cannot_be_written_is_named(small: Controller, tmp_path: Path) -> None:
    with pytest.raises(DesignError, match="cannot be written"):
        small.save(tmp_path / "missing" / "controller.json")


def test_another_building_is_refused(small: Controller) -> None:
    building = paper_building()
    small.check_building(building)
    small.check_building(building._replace(name="a copy"))
    with pytest.raises(DesignError, match="designed for the building"):
        small.check_building(building.with_attached_mass(0.01), "controller.json")
