"""Studies of buildings: an isolation that stiffens, and a brace between levels beside a tie."""

from __future__ import annotations

import json
from pathlib import Path

import braced
import pytest
import studies
from answers import Capture, asked, told

from bristle.cli import main


def test_the_layer_is_the_site_that_errs_and_its_spring_is_named(
    building_study: Path, capsys: Capture
) -> None:
    verdict = json.loads((building_study / "verdict.json").read_text())
    assert (verdict["kind"], verdict["effects"]) == ("effect", ["duffing"])
    assert verdict["sites"] == {"duffing": "layer"}
    compared = asked(capsys, "compare", building_study)
    assert compared["site"] == "layer"
    assert compared["quantity"] == "force of the isolation layer"
    fails = {one["site"]: one["fails"] for one in compared["sites"]}
    assert fails == {"layer": True, "storey1": False}
    assert compared["places"][0]["coordinate"] == "displacement"


def test_the_spring_that_is_added_has_the_true_value(building_study: Path, capsys: Capture) -> None:
    added = asked(capsys, "add", building_study, "duffing")
    k_3 = added["parameters"]["duffing.k_3"]
    shape = added["parameters"]["duffing.shape"]
    assert shape["value"] == pytest.approx(3.0, abs=0.3)
    # k_3 is the coefficient at 10 mm, whatever the exponent.
    at = k_3["value"] * 0.01**3
    assert at == pytest.approx(studies.STIFFENING * 0.01**3, rel=0.05)
    assert added["after"]["z_holdout"] == pytest.approx(1.0, abs=0.1)
    assert asked(capsys, "diagnose", building_study)["kind"] == "none"


def test_a_site_that_is_not_there_is_named(building_study: Path, capsys: Capture) -> None:
    assert "storey9" in told(capsys, "learn", building_study, "--at", "storey9", code=2)


def test_the_law_of_a_brace_is_found_between_its_levels(
    device_study: Path, capsys: Capture
) -> None:
    found = asked(capsys, "identify", device_study, "--dry-run")
    for name, value in braced.BRACE.items():
        known = found["parameters"][name]
        assert known["value"] == pytest.approx(value, rel=0.05), name
        assert abs(known["value"] - value) < 2.3 * known["interval95"], name
    compared = asked(capsys, "compare", device_study)
    assert compared["site"] == "damper"
    assert not any(one["fails"] for one in compared["sites"])


def test_a_brace_is_exported_at_its_place(
    device_study: Path, tmp_path: Path, capsys: Capture
) -> None:
    assert main(["export", str(device_study), "--out", str(tmp_path / "out")]) == 0
    scenario = tmp_path / "out" / "structure.toml"
    assert '"structure.brace_force" = "damper.force"' in scenario.read_text()
    assert "tie_measured.value" in scenario.read_text()
    capsys.readouterr()
    assert main(["check", str(scenario)]) == 0


def test_predictions_in_closed_loop_are_what_was_measured(
    device_study: Path, capsys: Capture
) -> None:
    found = asked(capsys, "predict", device_study, "--draws", "0")
    rows = found["responses"] if "responses" in found else found["rows"]
    assert rows
    for row in rows:
        assert row["predicted"] == pytest.approx(row["measured"], rel=0.02)


def test_the_building_is_identified_alone(device_study: Path, capsys: Capture) -> None:
    asked(capsys, "identify", device_study, "--structure", "--dry-run")
    text = told(capsys, "identify", device_study, "--structure", "--dry-run")
    assert text.startswith("tower: stiffness and damping of 3 levels, masses as given.")
    assert "equilibrium error" in text
