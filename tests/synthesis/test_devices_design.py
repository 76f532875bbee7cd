"""Designs for a damper at any level of a building, with passive dampers at others."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bristle.errors import DesignError, PhysicsError
from bristle.physics.building import Building, from_data, paper_building
from bristle.synthesis import Task, design
from bristle.synthesis.plant import Share, structure

TOWER: dict[str, Any] = {
    "schema": 1,
    "name": "tower",
    "masses": [2.0, 1.5, 1.0],
    "stiffnesses": [1057.0, 2500.0, 2000.0],
    "damping_ratio": 0.02,
    "devices": [{"name": "brace", "at": "storey1"}, {"name": "second", "at": "isolation"}],
}


def tower() -> Building:
    return from_data(TOWER)


def test_the_plant_pushes_and_shows_the_device_that_is_named() -> None:
    building = tower()
    s = structure(building, 30.0, 200.0, building.device("brace"))
    b = np.array([-1.0, 1.0, 0.0])
    M, C, K = (np.array(matrix) for matrix in building[1:4])
    K, C = K + 200.0 * np.outer(b, b), C + 30.0 * np.outer(b, b)
    omega = 1j * 2.0 * np.pi * np.array([0.7, 3.0, 11.0])
    for w in omega:
        q = np.linalg.solve(w**2 * M + w * C + K, np.column_stack([-b, -M.sum(axis=1)]))
        found = s.C @ np.linalg.solve(w * np.eye(6) - s.A, s.B) + s.D
        expected = np.array([w**2 * q[2] + [0.0, 1.0], b @ q, w * (b @ q)])
        assert found == pytest.approx(expected, rel=1e-9)


def test_a_device_at_the_isolation_is_the_damper_on_the_first_level() -> None:
    building = tower()
    for a, b in zip(
        structure(building, 3.0, 5.0),
        structure(building, 3.0, 5.0, building.device("second")),
        strict=True,
    ):
        assert np.array_equal(a, b)


def test_passive_dampers_are_in_the_plant() -> None:
    task = Task(
        "lqg", building=tower(), device="brace",
        passive={"damper": Share(80.0, 650.0), "second": Share(damping=20.0)},
    )  # fmt: skip
    found, plain = task.plant_building, tower()
    damping, stiffness = np.subtract(found.C, plain.C), np.subtract(found.K, plain.K)
    assert damping == pytest.approx(np.diag([100.0, 0.0, 0.0]))
    assert stiffness == pytest.approx(np.diag([650.0, 0.0, 0.0]), abs=1e-9)
    assert task.data()["passive"]["second"] == {"damping": 20.0, "stiffness": 0.0}


@pytest.mark.parametrize("kind", ["lqg", "hinf"])
def test_a_design_for_a_brace_is_verified(kind: str, tmp_path: Path) -> None:
    (tmp_path / "tower.toml").write_text(
        "schema = 1\nmasses = [2.0, 1.5, 1.0]\nstiffnesses = [1057.0, 2500.0, 2000.0]\n"
        'damping_ratio = 0.02\n[[devices]]\nname = "brace"\nat = "storey1"\n',
        encoding="utf-8",
    )
    file = tmp_path / "design.toml"
    file.write_text(
        f'schema = 1\nkind = "{kind}"\nbuilding = "tower.toml"\ndevice = "brace"\n'
        "[passive]\ndamper = { damping = 80.0, stiffness = 650.0 }\n",
        encoding="utf-8",
    )
    result = design(file)
    assert result.task.place.name == "brace"
    assert result.controller.design["device"] == "brace"
    if kind == "hinf":  # the norm of the plant of this damper, computed anew
        assert result.facts["norm"] < result.facts["open_loop_norm"]


def test_a_task_without_devices_has_the_digest_of_before() -> None:
    assert Task("hinf").digest() == "55a2d7e38fe8dd11"
    assert paper_building().devices == ()


@pytest.mark.parametrize(
    ("more", "error", "text"),
    [
        ({"device": "tie"}, PhysicsError, "no device 'tie'; there are brace, second"),
        ({"passive": {"tie": Share()}}, PhysicsError, "no device 'tie'"),
        ({"passive": {"damper": Share()}}, DesignError, "passive: damper is what is commanded"),
        ({"passive": {"brace": Share(-1.0)}}, DesignError, "brace.damping = -1.0"),
        ({"passive": {"brace": Share(float("nan"))}}, DesignError, "must not be negative"),
    ],
)
def test_what_a_task_may_not_say(more: dict[str, Any], error: type, text: str) -> None:
    with pytest.raises(error, match=text):
        Task("lqg", building=tower(), **more)


def test_a_passive_share_is_a_table_of_two_numbers() -> None:
    for share, text in (
        (3.0, "damper is 3.0: expected a table"), ({"mass": 1.0}, "no key .mass."),
        ({"damping": "x"}, "not a number"),
    ):  # fmt: skip
        with pytest.raises(DesignError, match=text):
            design({"kind": "lqg", "passive": {"damper": share}})
