"""`bristle learn --closure`: what it says, what it writes, what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from answers import Capture, asked, told
from made import write

from bristle.cli import main

STEP = 0.004  # s


def measured(path: Path, seed: int, samples: int = 1500) -> None:
    """Write a run of a damper whose friction follows motion and command late."""
    draw = np.random.default_rng(seed)
    t = STEP * np.arange(samples)
    w = 2.0 * np.pi * draw.uniform(0.4, 4.0, 8)
    angle = w[:, None] * t + draw.uniform(0.0, 6.0, 8)[:, None]
    size = 0.06 / w
    x, v = size @ np.sin(angle), (size * w) @ np.cos(angle)
    V = np.repeat(draw.choice([0.0, 2.0, 4.0], 10), len(t) // 10)
    goal = np.tanh(v / 0.03) * (2.0 + 1.5 * V) - 250.0 * x * (v > 0.0)
    late, now = np.empty(len(t)), 0.0
    for k in range(len(t)):
        now = goal[k] + (now - goal[k]) * np.exp(-STEP / 0.02)
        late[k] = now
    force = 60.0 * v + late + 0.03 * draw.standard_normal(len(t))
    titles = ("time [s]", "displacement [m]", "velocity [m/s]", "voltage [V]", "force [N]")
    write(path, dict(zip(titles, (t, x, v, V, force), strict=True)))


def made(folder: Path, train: int, samples: int = 1500) -> Path:
    """Return an identified study with so many runs for training and one held out."""
    names = [*(f"train_{k}" for k in range(1, train + 1)), "holdout_1"]
    for seed, name in enumerate(names):
        measured(folder / f"{name}.csv", seed, samples)
    data = [str(folder / f"{name}.csv") for name in names]
    assert main(["study", "new", str(folder / "rig"), "--law", "bingham", "--data", *data]) == 0
    return folder / "rig"


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    rig = made(tmp_path_factory.mktemp("closure"), 3)
    assert main(["identify", str(rig)]) == 0
    return rig


@pytest.mark.slow  # 7 s, most of them to compile it: tests/learning/test_closure.py has one
def test_it_is_learned_and_called_no_effect(rig: Path, capsys: Capture) -> None:
    found = asked(capsys, "learn", rig, "--closure")
    assert found["kept"] is True
    assert found["error_after"] < 0.7 * found["error_before"]
    assert 0.0 < found["share"] < 1.0
    assert (rig / "effects" / "closure_1.py").is_file()
    said = " ".join(found["sentences"])
    assert "It is no effect of physics" in said
    assert "it fades to zero there" in said
    kept = json.loads((rig / "reports" / "closure_1.json").read_text())
    assert kept["sentences"] == found["sentences"]


@pytest.mark.slow  # a closure is trained and compiled, then the diagnosis has to leave it out
def test_a_verdict_is_on_the_model_without_it(tmp_path: Path, capsys: Capture) -> None:
    rig = made(tmp_path, 3)
    told(capsys, "identify", rig)
    told(capsys, "learn", rig, "--closure", "--name", "network")
    assert asked(capsys, "add", rig, "network")["added"] == ["network"]
    verdict = asked(capsys, "diagnose", rig, "--law", "bingham")
    assert verdict["kind"] != "none"
    assert "network" not in verdict["effects"]
    assert any("without network" in note for note in verdict["notes"])


def test_a_single_run_that_hardly_turns_is_refused(tmp_path: Path, capsys: Capture) -> None:
    rig = made(tmp_path, 1, samples=300)
    why = told(capsys, "learn", rig, "--closure", code=2)
    assert "one run is for training (train_1), and its motion turns" in why
    assert "Add runs" in why
    assert not (rig / "effects" / "closure_1.py").exists()


@pytest.mark.slow  # a building is identified, a closure trained and two responses predicted
def test_in_a_building_the_response_is_nearer_with_it(tmp_path: Path, capsys: Capture) -> None:
    tower = tmp_path / "tower"
    told(capsys, "example", "building", tower, "--effect", "worn_bore", "--seed", "1")
    told(capsys, "identify", tower)
    found = asked(capsys, "learn", tower, "--closure")
    assert found["error_after"] < 0.5 * found["error_before"]
    told(capsys, "add", tower, found["name"])
    rows = asked(capsys, "predict", tower, "--draws", "0")["rows"]
    for kind in ("peak", "rms"):
        before, after = (
            np.median([abs(row[error]) for row in rows if row["kind"] == kind])
            for error in ("error_before", "error")
        )
        assert after < 0.5 * before, kind


@pytest.mark.slow  # a building without load cell is identified before the refusal
def test_in_a_building_whose_damper_has_no_load_cell_it_is_refused(
    tmp_path: Path, capsys: Capture
) -> None:
    tower = tmp_path / "tower"
    told(capsys, "example", "building", tower, "--effect", "worn_bore", "--no-load-cell")
    told(capsys, "identify", tower)
    assert "whose force was not measured" in told(capsys, "learn", tower, "--closure", code=2)


def test_what_chooses_a_curve_does_not_go_with_it(rig: Path, capsys: Capture) -> None:
    for words in (("--along", "displacement"), ("--as", "force"), ("--at", "damper"), ("--table",)):
        why = told(capsys, "learn", rig, "--closure", *words, code=2)
        assert f"{words[0]} chooses a curve" in why
