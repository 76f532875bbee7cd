"""Labels of runs: what cannot be told is said in one message, what can is named and carried."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from bristle.cli import main
from bristle.fmu.description import read_description

PRESSURES = (50, 100, 150, 100, 50, 150, 100, 200)
"""The last two runs are held out; the last one lies beyond the others."""


def lab(folder: Path, pressures: tuple[int, ...] = PRESSURES) -> str:
    """Write runs of a damper with 0.01 N of preload for each psi in their names."""
    folder.mkdir()
    t = np.arange(1500) / 500.0
    for k, pressure in enumerate(pressures):
        random = np.random.default_rng(k)
        w = 2.0 * np.pi * random.uniform(0.4, 4.0, 8)
        size, angle = 0.02 / w, w[:, None] * t + random.uniform(0.0, 6.28, (8, 1))
        x, v = size @ np.sin(angle), (size * w) @ np.cos(angle)
        V = np.repeat(random.choice([0.0, 2.0, 4.0], 10), len(t) // 10)
        force = (1.3 + 0.8 * V) * np.tanh(v / 0.01) + 60.0 * v + 60.0 * x + 0.01 * pressure
        columns = (
            t, 1e3 * x + 1e-3 * random.standard_normal(len(t)), V,
            force + 0.05 * random.standard_normal(len(t)),
        )  # fmt: skip
        role = "valid" if k >= len(pressures) - 2 else "train"
        np.savetxt(
            folder / f"{role}_{k}_{pressure}psi.csv", np.column_stack(columns), fmt="%.7g",
            delimiter=",", header="time [s],x [mm],U [V],F [N]", comments="",
        )  # fmt: skip
    return str(folder / "*.csv")


def made(folder: Path, data: str, *given: str) -> list[str]:
    """Return the arguments that make a study."""
    return ["study", "new", str(folder), "--data", data, "--law", "tanh", *given]


def said(capsys: pytest.CaptureFixture[str]) -> str:
    shown = capsys.readouterr()
    return " ".join((shown.out + shown.err).split())


def table(path: Path, names: list[str], **columns: list[str]) -> Path:
    rows = [",".join(["file", *columns])]
    rows += [",".join(one) for one in zip(names, *columns.values(), strict=True)]
    path.write_text("\n".join(rows) + "\n")
    return path


def test_a_table_whose_names_match_no_run_is_refused_once(tmp_path, capsys) -> None:
    data = lab(tmp_path / "lab", PRESSURES[:3])
    rows = table(tmp_path / "runs.csv", ["a.csv", "b.csv", "c.csv"], oil=["new", "old", "new"])
    assert main(made(tmp_path / "rig", data, "--runs", str(rows))) == 2
    text = said(capsys)
    assert "its 3 rows are of a.csv, b.csv, c.csv, and none of the 3 runs is called so:" in text
    assert not (tmp_path / "rig").exists()


def test_labels_that_tell_nothing_are_said_by_the_check(tmp_path, capsys) -> None:
    data = lab(tmp_path / "lab")
    names = sorted(path.name for path in (tmp_path / "lab").iterdir())
    eight = len(names)
    rows = table(
        tmp_path / "runs.csv", names,
        oil=["new"] * eight, day=[f"{k + 1}" for k in range(eight)],
        hose=["A"] * (eight - 1) + ["B"],
    )  # fmt: skip
    assert main(made(tmp_path / "rig", data, "--runs", str(rows))) == 0
    capsys.readouterr()
    assert main(["study", "check", str(tmp_path / "rig")]) == 0
    text = said(capsys)
    assert "oil is new in all 8 runs: nothing can be told from it." in text
    assert "day has another value in each of 8 runs, as their number has" in text
    held = "hose is A in all training runs, and B in valid_7_200psi, which is held out"
    assert held in text


@pytest.mark.slow  # a diagnosis by labels, and what it adds
def test_a_preload_that_depends_on_the_pressure_is_named_and_carried(tmp_path, capsys) -> None:
    rig = tmp_path / "rig"
    data = lab(tmp_path / "lab")
    assert main(made(rig, data, "--label", "pressure_psi={}psi")) == 0
    for one in (["identify"], ["diagnose"]):
        capsys.readouterr()
        assert main([*one, str(rig)]) == 0
    text = said(capsys)
    assert "Missing from the model: the dependence of f_0 on pressure." in text
    assert "(f_0) rises by 0.01 N per psi of pressure" in text
    assert "By fits without each of 8 runs in turn: slope 0.01" in text
    assert "Extrapolation: the training runs have pressure 50 psi to 150 psi, beyond which" in text
    verdict = json.loads((rig / "verdict.json").read_text())
    assert (verdict["kind"], verdict["effects"]) == ("effect", ["f_0_by_pressure_psi"])
    assert main(["add", str(rig), "f_0_by_pressure_psi"]) == 0
    capsys.readouterr()
    assert main(["export", str(rig)]) == 0
    assert "The FMU in FMPy confirms it: 0.05" in said(capsys)
    known = read_description(rig / "export" / "rig_damper.fmu").variables
    assert "f_0_by_pressure_psi.pressure_psi" in known
