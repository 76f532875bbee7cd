"""View 9: the command of a comparison of controllers, and what is shown of its answer."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest
from made import write_runs
from page.served import page_on
from studies import house_study

from bristle.page import control_views
from bristle.page.orders import order_of
from bristle.page.requests import RequestError
from bristle.study import create_study
from bristle.view.html import unpack

MOTION = {"record": "el_centro_1940_ns", "peak": 0.2}
ASKED: dict[str, Any] = {
    "number": 1, "motions": [MOTION], "controllers": ["Skyhook"], "designs": [], "damper": "rig",
    "building": "", "device": "", "members": 0, "limit": False,
}  # fmt: skip
SHORT = "time [s],acceleration [m/s2]\n" + "".join(
    f"{0.02 * k:.2f},{(-1) ** (k // 12) * 0.5}\n" for k in range(60)
)


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("compared")
    create_study(folder / "rig", write_runs(folder / "lab", 3, seconds=3.0), law="bingham")
    return folder


def test_the_command_is_that_of_a_terminal() -> None:
    assert order_of("controllers", "rig", ASKED).shown == (
        "bristle controllers --motions el_centro_1940_ns,peak=0.2g --controller Skyhook "
        "--damper=rig --out=rig/comparisons/1"
    )
    more = {
        "motions": [MOTION, {"record": "uploads/record-1/my shake.csv", "peak": None}],
        "designs": ["hinf_2"], "building": "tower/tower.toml", "device": "brace", "damper": "",
        "members": 5, "limit": True, "number": 3,
    }  # fmt: skip
    assert order_of("controllers", "rig", ASKED | more).words == (
        "controllers", "--building=tower/tower.toml", "--device=brace",
        "--motions", "el_centro_1940_ns,peak=0.2g", "uploads/record-1/my shake.csv",
        "--controller", "Skyhook", "rig/design/hinf_2.json", "--ensemble=5", "--limit",
        "--out=rig/comparisons/3",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"motions": []}, "1 to 12"),
        ({"motions": [MOTION] * 13}, "1 to 12"),
        ({"motions": "el_centro_1940_ns"}, "a list"),
        ({"motions": ["el_centro_1940_ns"]}, "with its peak"),
        ({"motions": [{"record": "../x.csv"}]}, "a name is right"),
        ({"motions": [{"record": "uploads/../x.csv"}]}, "batch"),
        ({"motions": [{"record": "--out=/tmp/x"}]}, "a name is right"),
        ({"motions": [MOTION | {"peak": 0}]}, "above 0"),
        ({"motions": [MOTION | {"peak": 3.1}]}, "to 3 g"),
        ({"motions": [MOTION | {"peak": float("nan")}]}, "number in g"),
        ({"motions": [MOTION | {"peak": True}]}, "number in g"),
        ({"controllers": []}, "one or more"),
        ({"controllers": ["../my.py"]}, "a name is right"),
        ({"designs": ["../hinf_1"]}, "hinf_1"),
        ({"building": "../tower.toml"}, "the building"),
        ({"building": "/tower.toml"}, "the building"),
        ({"building": 3}, "STUDY/FILE"),
        ({"building": "a/b.toml", "device": "-x"}, "device"),
        ({"damper": "../rig"}, "the damper"),
        ({"members": -1}, "0 to 200"),
        ({"members": 2.5}, "whole number"),
        ({"number": 0}, "1 to 9999"),
        ({"number": "1/../../x"}, "1 to 9999"),
    ],
)
def test_what_cannot_be_compared_is_refused(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(RequestError, match=words):
        order_of("controllers", "rig", ASKED | wrong)


@pytest.mark.slow  # a whole comparison of controllers by the page
def test_a_comparison_is_run_and_shown(home: Path) -> None:
    with page_on(home, start=False) as client:
        assert client.ask("PUT", "/api/uploads/record-1/shake.csv", SHORT.encode()).status == 201
        bad = client.post(
            "/api/jobs", {"what": "controllers", "study": "rig", "options": {"number": 1}}
        )
        assert bad.status == 400
        assert "motions" in bad.error
        asked = ASKED | {"motions": [{"record": "uploads/record-1/shake.csv", "peak": 0.1}]}
        job = client.run("controllers", "rig", 300.0, **asked)
        assert job["state"] == "done", job
        failed = client.run("controllers", "rig", **ASKED | {"controllers": ["Pid"], "number": 2})
        assert failed["state"] == "failed"
        assert 'no controller is named "Pid"' in failed["error"]
        shown = unpack(client.get("/api/studies/rig/controllers").body)
        name = shown["comparisons"][0]["files"][-1]
        assert client.get(f"/api/studies/rig/file?name={name}").status == 200
    assert shown["next"] == 3  # what failed has a folder too
    (found,) = shown["comparisons"]
    told = json.loads((home / "rig" / "comparisons" / "1" / "answer.json").read_text())
    assert found["verdict"] == told["verdict"]
    assert "Skyhook has the lowest peak acceleration of floor2" in found["verdict"][0]
    (table,) = found["tables"]
    assert all(len(row) == len(found["header"]) for row in table["rows"])
    assert table["rows"][table["lowest"]][0].startswith("Skyhook")
    assert "comparisons/1/report.html" in found["files"]
    assert found["command"].endswith("--damper rig --out rig/comparisons/1")
    assert "uploads/record-1/shake.csv" in {one["name"] for one in shown["records"]}
    assert {"LqgClipped", "Skyhook"} <= set(shown["controllers"])
    assert not found["older"]
    after = (home / "rig" / "comparisons" / "1" / "answer.json").stat().st_mtime + 10.0
    os.utime(home / "rig" / "model.toml", (after, after))
    assert control_views.controllers_view(home / "rig", {})["comparisons"][0]["older"]


def test_buildings_are_those_of_the_studies(home: Path, tmp_path: Path) -> None:
    assert control_views.controllers_view(home / "rig", {})["buildings"] == []
    house = house_study(tmp_path)
    create_study(tmp_path / "bench", write_runs(tmp_path / "lab", 3, seconds=3.0), law="bingham")
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "study.toml").write_text("= no TOML")
    for name in ("rig", "bench"):
        (found,) = control_views.controllers_view(tmp_path / name, {})["buildings"]
        assert found == {"file": f"rig/{house.model().building}", "study": "rig", "device": ""}
        assert (tmp_path / found["file"]).is_file()
    asked = ASKED | {"building": found["file"]}
    assert f"--building={found['file']}" in order_of("controllers", "rig", asked).words
