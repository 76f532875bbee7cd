"""What the data check says: no loose cable at a switch, one mains, no coil where there is none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bristle.cli import main
from bristle.data.checks.recording import SpectralLine, of_one_mains
from bristle.data.noise import spikes_of

RATE = 500.0
T = np.arange(4000) / RATE
V = 0.05 * np.cos(9.0 * T)


def written(path: Path, columns: dict[str, np.ndarray]) -> Path:
    rows = (
        ",".join(f"{value:.5f}" for value in row) for row in zip(*columns.values(), strict=True)
    )
    path.write_text(",".join(columns) + "\n" + "\n".join(rows) + "\n")
    return path


def bench(**more: np.ndarray) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(3)
    force = 300.0 * np.tanh(V / 4e-3) + 900.0 * V + rng.normal(0.0, 1.0, T.size)
    return {"time [s]": T, "x [mm]": 1e3 * 0.05 / 9.0 * np.sin(9.0 * T), "F [N]": force} | {
        f"{name} [V]": y for name, y in more.items()
    }


def switched(undershoot: float) -> np.ndarray:
    """Return a command of two levels, with noise and one sample beyond them at each switch."""
    level = np.where((T // 0.1) % 2 > 0, 4.0, 1.0)
    at = np.flatnonzero(np.diff(level)) + 1
    level[at] += undershoot * np.sign(level[at] - level[at - 1])
    return level + np.random.default_rng(4).normal(0.0, 0.005, T.size)


@pytest.mark.parametrize("size", [0.6, 1.5, -1.5])
def test_a_switch_with_an_overshoot_is_no_loose_cable(tmp_path, capsys, size) -> None:
    file = written(tmp_path / "a.csv", bench(voltage=switched(size)))
    assert main(["study", "new", str(tmp_path / "rig"), "--data", str(file)]) == 0
    main(["study", "check", str(tmp_path / "rig")])
    said = " ".join(capsys.readouterr().out.split())
    assert "spike" not in said
    assert "loose cable" not in said


def test_a_spike_of_a_command_between_switches_is_still_one() -> None:
    command = switched(1.0)
    command[525] += 20.0
    found = spikes_of(T, {"voltage": command}, mask=False)
    assert [round(one.time, 3) for one in found] == [T[525]]


def test_a_rig_without_a_command_is_told_of_no_coil(tmp_path, capsys) -> None:
    file = written(tmp_path / "a.csv", bench())
    assert main(["study", "new", str(tmp_path / "rig"), "--data", str(file)]) == 0
    main(["study", "check", str(tmp_path / "rig")])
    said = " ".join(capsys.readouterr().out.lower().split())
    assert "no command was recorded" in said
    assert not [word for word in ("coil", "voltage", "drive", "current") if word in said]


def test_lines_of_both_mains_are_of_the_one_that_has_more() -> None:
    # 100 Hz folds 300 and 600 Hz of either mains; 50 Hz has the lower order and more lines.
    lines = [
        SpectralLine("force", 50.0, 1.0, 50.0, 1),
        SpectralLine("force", 150.0, 0.5, 50.0, 3),
        SpectralLine("velocity", 180.0, 0.2, 60.0, 3),
        SpectralLine("velocity", 300.0, 0.2, 60.0, 5),
    ]
    (found,) = of_one_mains([lines], [1e-3], [4000])
    assert [(one.mains, one.order) for one in found] == [(50.0, 1), (50.0, 3), (0.0, 0), (50.0, 6)]


def test_a_sign_that_the_study_turns_is_a_note_and_no_fault(tmp_path) -> None:
    from bristle.diagnosis.verdict import Diagnosis
    from bristle.study.steps import verdict_of
    from bristle.study.study import Study

    columns = bench()
    columns["F [N]"] = -columns["F [N]"]
    file = written(tmp_path / "a.csv", columns)
    assert main(["study", "new", str(tmp_path / "rig"), "--data", str(file)]) == 0
    verdict = verdict_of(Study(tmp_path / "rig"), Diagnosis("none", (), (), {}))
    assert not verdict["sensors"]
    assert any("study.toml reverses it" in note for note in verdict["notes"])


def test_a_friction_without_noise_is_not_blamed_on_the_load_cell_alone(tmp_path, capsys) -> None:
    turn = (0.75 * T + 0.25) % 1.0
    columns = {"time [s]": T, "x [mm]": 10.0 * np.abs(4.0 * turn - 2.0) - 10.0,
               "F [N]": np.where(turn < 0.5, -300.0, 300.0)}  # fmt: skip
    study = str(tmp_path / "rig")
    assert main(["study", "new", study, "--data", str(written(tmp_path / "a.csv", columns))]) == 0
    main(["study", "check", study])
    assert "or a friction without noise that nothing changes" in " ".join(
        capsys.readouterr().out.split()
    )


def test_a_line_of_300_hz_alone_is_of_either_mains(tmp_path, capsys) -> None:
    t = np.arange(8000) / 1000.0
    hum = 3.0 * np.sin(2.0 * np.pi * 300.0 * t)
    noise = np.random.default_rng(5).normal(0.0, 1.0, t.size)
    columns = {"time [s]": t, "x [mm]": 5.0 * np.sin(9.0 * t),
               "F [N]": 900.0 * np.cos(9.0 * t) + hum + noise}  # fmt: skip
    study = str(tmp_path / "rig")
    assert main(["study", "new", study, "--data", str(written(tmp_path / "a.csv", columns))]) == 0
    main(["study", "check", study])
    assert "(300 Hz of the mains of 50 or 60 Hz)" in " ".join(capsys.readouterr().out.split())
