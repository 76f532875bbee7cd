"""A building whose load cell low-passes and never rests: no z of what rests on its force."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from made import write
from scipy.signal import butter, sosfiltfilt
from shaken import building, friction, shake

from bristle.cli import main
from bristle.data.channels import channel_unit

HOUSE = building(1)
BEGIN, SAMPLES = 1000, 2500  # what is cut off is the rest before the shaking
CORNER, RATE = 60.0, 500.0  # Hz, of the filter and of the logger


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a study of such runs, its model identified."""
    folder = tmp_path_factory.mktemp("house")
    for seed in (1, 2, 3):
        random = np.random.default_rng(seed)
        clean = shake(HOUSE, seed, friction, samples=BEGIN + SAMPLES)
        columns = {}
        for name, values in clean.items():
            noise = 0.0 if name == "time" else 0.01 * float(np.std(values))
            columns[name] = (values + noise * random.standard_normal(len(values)))[BEGIN:]
        corner = butter(4, CORNER, fs=RATE, output="sos")
        columns["force"] = sosfiltfilt(corner, columns["force"])
        titled = {f"{name} [{channel_unit(name)}]": y for name, y in columns.items()}
        write(folder / f"run{seed}.csv", titled)
    masses = [HOUSE.M[i][i] for i in range(HOUSE.size)]
    (folder / "house.toml").write_text(
        'schema = 1\nname = "house"\nbase = "isolated"\ndamping_ratio = 0.02\n'
        f"masses = {masses}\nstiffnesses = {list(HOUSE.stiffnesses)}\n"
    )
    rig = folder / "rig"
    assert main([
        "study", "new", str(rig), "--rig", "structure", "--building", str(folder / "house.toml"),
        "--law", "tanh", "--data", str(folder / "run*.csv"),
    ]) == 0  # fmt: skip
    assert main(["identify", str(rig)]) == 0
    return rig


def test_the_verdict_has_a_z_where_the_noise_is_known_and_no_none_where_it_is_not(
    study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["diagnose", str(study)]) == 0
    told = " ".join(capsys.readouterr().out.split())
    verdict = json.loads((study / "verdict.json").read_text())
    assert (verdict["kind"], verdict["effects"]) == ("insufficient", [])
    found = {one["site"]: one for one in verdict["findings"]}
    assert found["storey1"]["kind"] == "none"
    assert found["storey1"]["z_holdout_before"] == pytest.approx(1.0, abs=0.1)
    for site in ("layer", "damper"):
        assert found[site]["kind"] == "insufficient"
        assert found[site]["z_holdout_before"] is None
    assert all(
        (row["z_holdout"] is None) == (row["site"] in ("layer", "damper"))
        for row in verdict["ranking"]
    )
    assert "% of the force is unexplained, noise included" in told
    assert "The noise of force is not known in run" in told
    assert "noise = ... in [channels.force]" in told
    assert "nan" not in told.lower()


@pytest.mark.slow  # a comparison and a report of a building
def test_compare_tells_no_z_of_these_sites(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", str(study)]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "the isolation layer" in told
    assert "no known noise for a statement" in told
    assert "too few samples" not in told
    assert "nan" not in told.lower()
    assert main(["report", str(study)]) == 0


@pytest.mark.parametrize(
    ("command", "what"),
    [("learn", "nothing can be learned"), ("plan", "no test can be planned")],
)
def test_commands_that_cannot_do_without_refuse_in_one_line(
    study: Path, capsys: pytest.CaptureFixture[str], command: str, what: str
) -> None:
    at = ["--at", "damper"] if command == "learn" else []
    assert main([command, str(study), *at]) == 2
    told = capsys.readouterr()
    (line,) = [one for one in told.err.splitlines() if what in one]
    assert "The noise of force is not known in run" in line
    assert "noise = ... in [channels.force]" in line
