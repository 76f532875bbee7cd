"""View 8: design files of the page's numbers, what they weigh, and the closed loop of a solve."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made import write_runs
from page.served import page_on

from bristle.page import control_views
from bristle.page.orders import (
    FIELDS,
    content_of,
    design_name,
    names_of,
    order_of,
    values_of,
    write_design,
)
from bristle.page.requests import RequestError
from bristle.page.worker import answer
from bristle.study import Study, create_study
from bristle.synthesis import read_task
from bristle.view.html import unpack


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("designed")
    create_study(folder / "rig", write_runs(folder / "lab", 3, seconds=3.0), law="bingham")
    return folder


def test_the_numbers_of_the_form_are_those_of_the_task(home: Path) -> None:
    values = {"acceleration.gain": 3.0, "command.pole": 80.0, "noise": 0.02, "tau": 1.5}
    name = write_design(home / "rig", "hinf", values, "")
    file = home / "rig" / "design" / f"{name}.toml"
    task = read_task(file)
    assert (task.kind, task.tau, task.weights.noise) == ("hinf", 1.5, 0.02)
    assert task.weights.acceleration.numerator == (3.0 * 12.0,)
    assert task.weights.command.denominator == (1.0, 80.0)
    assert task.damper.law == "bingham"
    kept = values_of(tomllib.loads(file.read_text()))
    assert kept == {**{key: one.value for key, one in FIELDS.items()}, **values}
    assert content_of("hinf", values, "tower.toml")["building"] == "../tower.toml"


def test_every_solve_is_a_design_file_of_its_own(tmp_path: Path) -> None:
    made = [write_design(tmp_path, kind, {}, "") for kind in ("lpv", "hinf", "lpv")]
    assert made == names_of(tmp_path) == ["lpv_1", "hinf_2", "lpv_3"]


def test_bounds_hold_where_the_form_begins() -> None:
    assert all(one.low < one.value < one.high for one in FIELDS.values())


@pytest.mark.parametrize(
    ("kind", "values", "words"),
    [
        ("pid", {}, "kind"),
        (None, {}, "kind"),
        ("hinf", [], "NAME to number"),
        ("hinf", {"gain": 1.0}, "gain"),
        ("hinf", {"tau": "2"}, "tau"),
        ("hinf", {"tau": True}, "tau"),
        ("hinf", {"tau": float("nan")}, "tau"),
        ("hinf", {"noise": 0.0}, "0.001 to 1"),
    ],
)
def test_what_is_no_number_of_a_design_is_refused(kind: object, values: Any, words: str) -> None:
    with pytest.raises(RequestError, match=words):
        content_of(kind, values, "")


@pytest.mark.parametrize("name", ["", None, "hinf", "hinf_1.toml", "../hinf_1", "pid_1", "hinf_x"])
def test_what_is_no_name_of_a_design_is_refused(name: object) -> None:
    with pytest.raises(RequestError, match="hinf_1"):
        design_name(name)


def test_the_commands_are_those_of_a_terminal(home: Path) -> None:
    assert order_of("design", "rig", {"name": "lpv_3"}).shown == (
        "bristle design lpv rig/design/lpv_3.toml --out=rig/design/lpv_3.json"
    )


def test_weights_are_those_of_the_task(home: Path) -> None:
    asked = {"kind": "lpv", "values": {"acceleration.gain": 2.0, "acceleration.corner": 20.0}}
    shown = control_views.weights_view(home / "rig", asked)
    turn = 2.0 * np.pi * shown["frequency"]
    right = 2.0 * 20.0 / np.sqrt(turn**2 + 20.0**2)
    assert shown["acceleration_weight"] == pytest.approx(right, rel=1e-12)
    assert shown["warnings"] == []
    cheap = {"kind": "hinf", "values": {"command.gain": 0.05, "acceleration.gain": 20.0}}
    assert control_views.weights_view(home / "rig", cheap)["warnings"]


def test_a_study_of_another_device_is_refused(home: Path) -> None:
    study = Study(home / "rig")
    assert control_views.refused(study) == ""
    study.settings = replace(study.settings, device="brace")
    assert "brace" in control_views.refused(study)


def test_designs_are_written_over_http_and_shown_unsolved(home: Path) -> None:
    with page_on(home, start=False) as client:
        assert client.post("/api/studies/rig/design", {"kind": "pid"}).status == 400
        asked = {"kind": "lpv", "values": {"tau": 3.0}}
        made = client.post("/api/studies/rig/design", asked)
        assert made.status == 201
    name = made.json["name"]
    assert (home / "rig" / "design" / f"{name}.toml").is_file()
    told, body = answer("design", home / "rig", {})
    assert told["ok"], told
    shown = unpack(body)
    assert (shown["law"], shown["refused"]) == ("bingham", "")
    assert name not in {one["name"] for one in shown["solves"]}


def test_weights_are_drawn_before_the_study_has_a_folder_of_designs(tmp_path: Path) -> None:
    create_study(tmp_path / "new", write_runs(tmp_path / "lab", 3, seconds=3.0), law="bingham")
    assert not (tmp_path / "new" / "design").exists()
    shown = control_views.weights_view(tmp_path / "new", {"kind": "hinf", "values": {}})
    assert len(shown["frequency"]) == len(shown["command_weight"]) > 500
    assert control_views.design_view(tmp_path / "new", {})["solves"] == []


def test_a_solve_of_an_older_model_is_told_apart(home: Path, tmp_path: Path) -> None:
    name = write_design(home / "rig", "hinf", {}, "")
    file = home / "rig" / "design" / f"{name}.toml"
    found = {"facts": {"task": read_task(file).digest()}}
    assert not control_views._is_older(file, found)
    other = tmp_path / "rig" / "design" / file.name
    other.parent.mkdir(parents=True)
    other.write_text(file.read_text())
    assert control_views._is_older(other, found)  # its model is not there
    model = (home / "rig" / "model.toml").read_text()
    (tmp_path / "rig" / "model.toml").write_text(model.replace("value = 1.3", "value = 1.7", 1))
    assert "value = 1.7" in (tmp_path / "rig" / "model.toml").read_text()
    assert control_views._is_older(other, found)


@pytest.mark.slow  # designs by the page
@pytest.mark.parametrize("kind", ["hinf", "lpv"])
def test_a_solve_is_shown_as_its_answer_tells(home: Path, kind: str) -> None:
    with page_on(home) as client:
        made = client.post("/api/studies/rig/design", {"kind": kind, "values": {}}).json["name"]
        job = client.run("design", "rig", name=made)
        assert job["state"] == "done", job
        shown = unpack(client.get("/api/studies/rig/design").body)
    (solve,) = [one for one in shown["solves"] if one["name"] == made]
    told = json.loads((home / "rig" / "design" / f"{made}_answer.json").read_text())
    assert solve["gamma"] == told["facts"]["gamma"]
    assert solve["margins"]["modulus"] == told["margins"]["modulus"]
