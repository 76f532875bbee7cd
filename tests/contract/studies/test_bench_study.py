"""A bench with a hidden gas spring, from its runs to the next tests: what each command answers."""

from __future__ import annotations

import json
import re
import tomllib
from html import unescape
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from answers import Capture, asked, told

from bristle.cli import main

TRUE_K = 111.827  # N/m, of the gas spring that the runs hide


def test_the_verdict_names_what_is_hidden(bench_study: Path) -> None:
    verdict = json.loads((bench_study / "verdict.json").read_text())
    assert (verdict["kind"], verdict["effects"]) == ("effect", ["gas_spring"])
    assert verdict["sites"] == {"gas_spring": "damper"}
    assert verdict["sensors"] == []
    assert verdict["z_holdout_before"] > 5.0
    assert verdict["z_holdout_after"] == pytest.approx(1.0, abs=0.1)
    assert 0.0 < verdict["detectable"] < 0.05
    order = [row["z_holdout"] for row in verdict["ranking"]]
    assert order == sorted(order)
    (found,) = verdict["findings"]
    k = found["values"]["gas_spring.k"]
    assert abs(k["value"] - TRUE_K) < 4.0 * k["std"] < 0.05 * TRUE_K
    assert verdict["words"].startswith("Missing from the model: gas spring.")


def test_compare_judges_the_held_out_run_by_hand_alike(bench_study: Path, capsys: Capture) -> None:
    found = asked(capsys, "compare", bench_study)
    assert found["held_out"] is True
    (run,) = found["runs"]
    assert run["name"] == "holdout_1"
    error = run["error"]
    assert error["left_out"] == {"settling at the start": error["total"] - error["samples"]}
    force = pd.read_csv(bench_study / "data" / "holdout_1.csv")["force [N]"].to_numpy()
    assert error["total"] == len(force)
    assert error["signal_all"] == pytest.approx(np.sqrt(np.mean(force**2)), rel=1e-6)
    assert error["share"] == pytest.approx(error["rms"] / error["signal_counted"], rel=1e-9)
    assert found["places"][0]["coordinate"] == "displacement"
    assert Path(found["picture"]).read_bytes().startswith(b"\x89PNG")
    trained = asked(capsys, "compare", bench_study, "--role", "train")
    assert [one["name"] for one in trained["runs"]] == ["train_1", "train_2"]


def test_what_is_added_is_a_step_and_undo_takes_it_back(bench_study: Path, capsys: Capture) -> None:
    before = (bench_study / "model.toml").read_text()
    added = asked(capsys, "add", bench_study, "gas_spring")
    assert (added["step"], added["added"], added["effects"]) == (2, ["gas_spring"], ["gas_spring"])
    k = added["parameters"]["gas_spring.k"]
    assert abs(k["value"] - TRUE_K) < 2.0 * k["interval95"]
    kept = tomllib.loads((bench_study / "model.toml").read_text())
    std = kept["effects"]["gas_spring"]["parameters"]["k"]["std"]
    assert k["interval95"] == pytest.approx(1.96 * std, rel=1e-3)
    assert added["before"]["z_holdout"] > 5.0 * added["after"]["z_holdout"]
    assert added["after"]["z_holdout"] == pytest.approx(1.0, abs=0.1)
    compared = asked(capsys, "compare", bench_study)
    assert compared["z"] == pytest.approx(added["after"]["z_holdout"], rel=0.05)
    assert compared["total"]["error"] == added["error"]["holdout"]
    undone = asked(capsys, "undo", bench_study)
    assert (undone["undone"]["number"], undone["now"]["number"]) == (2, 1)
    assert (bench_study / "model.toml").read_text() == before


def test_a_refused_effect_leaves_the_model_as_it_was(bench_study: Path, capsys: Capture) -> None:
    before = (bench_study / "model.toml").read_bytes()
    assert 'Did you mean "gas_spring"?' in told(capsys, "add", bench_study, "gas_sprng", code=2)
    assert "cannot be joined" in told(
        capsys, "add", bench_study, "mount_compliance", "backlash", code=2
    )
    assert (bench_study / "model.toml").read_bytes() == before


def test_another_law_is_tried_and_not_kept(bench_study: Path, capsys: Capture) -> None:
    before = (bench_study / "model.toml").read_bytes()
    order = ("identify", bench_study, "--law", "tanh", "--dry-run")
    found = asked(capsys, *order)
    assert (found["law"], found["step"], found["noise_known"]) == ("tanh", None, True)
    assert found["parameters"]["k"]["value"] == pytest.approx(TRUE_K, rel=0.1)  # it has a spring
    assert found["after"]["z_holdout"] < found["before"]["z_holdout"]
    assert (bench_study / "model.toml").read_bytes() == before


def test_the_data_check_and_the_roles(bench_study: Path, capsys: Capture) -> None:
    checked = asked(capsys, "study", "check", bench_study)
    assert checked["ok"] is True
    assert {run["run"] for run in checked["runs"]} == {"train_1", "train_2", "holdout_1"}
    assert all(run["stroke"] > 0.0 and run["drive"] == "voltage" for run in checked["runs"])
    assert {row["run"]: row["role"] for row in asked(capsys, "study", "roles", bench_study)} == {
        "data/holdout_1.csv": "holdout", "data/train_1.csv": "train", "data/train_2.csv": "train",
    }  # fmt: skip


def test_auto_comes_to_the_same_model(bench_study: Path, capsys: Capture) -> None:
    asked(capsys, "undo", bench_study)
    learnt = asked(capsys, "study", "auto", bench_study, "--law", "bingham")
    assert learnt["verdict"]["kind"] == "none"
    assert "gas_spring" in (bench_study / "model.toml").read_text()


# A diagnosis: its screen beside its details.
@pytest.mark.parametrize("command", ["compare", pytest.param("diagnose", marks=pytest.mark.slow)])
def test_what_leaves_the_screen_is_in_the_details_and_in_the_report(
    command: str, bench_study: Path, capsys: Capture
) -> None:
    words = [command, str(bench_study), *(["--dry-run"] if command == "diagnose" else [])]
    capsys.readouterr()
    printed = []
    for more in ([], ["--details"]):
        assert main([*words, *more]) == 0
        printed.append(capsys.readouterr().out.splitlines())
    short, long = ([one for one in lines if not one.startswith("Picture:")] for lines in printed)
    assert short.pop() == f"Details:  --details, or bristle report {bench_study}"
    assert [line for line in short if line not in long] == []
    assert len(long) > len(short)
    found = asked(capsys, "report", bench_study)
    assert (found["verdict"], found["trouble"]) == ("effect", None)
    page = Path(found["report"]).read_text()
    assert "Missing from the model: gas spring." in page
    assert 'src="http' not in page
    text = "".join(unescape(re.sub("<[^>]+>", "", page)).split())
    tables = (re.sub("^    what .*?: ", "  ", line) for line in long if line.startswith("  "))
    cells = {one for line in tables for one in re.split(" {2,}", line)}
    assert sorted(one for one in cells if "".join(one.split()) not in text) == []
