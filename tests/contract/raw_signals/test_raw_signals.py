"""Titles: raw volts command nothing, and C is degrees Celsius where a temperature stands."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from bristle.cli import main

T = np.arange(800) / 200.0
X = 5.0 * np.sin(9.0 * T)
F = 300.0 * np.tanh(np.cos(9.0 * T) / 0.1) + 200.0 * np.cos(9.0 * T)
WARM = 24.0 + 2.0 * np.sin(T)
U = 2.0 + np.sin(2.0 * T)


def channels(tmp_path: Path, columns: dict[str, np.ndarray]) -> dict[str, str]:
    path = tmp_path / "run.csv"
    rows = (
        ",".join(f"{value:.4f}" for value in row) for row in zip(*columns.values(), strict=True)
    )
    path.write_text(",".join(columns) + "\n" + "\n".join(rows) + "\n", encoding="utf-8")
    assert main(["study", "new", str(tmp_path / "rig"), "--data", str(path)]) == 0
    read = tomllib.loads((tmp_path / "rig/study.toml").read_text())
    found = {name: f"{one['column']} in {one['unit']}" for name, one in read["channels"].items()}
    return found | {f"extra {name}": one["column"] for name, one in read.get("extra", {}).items()}


PLAIN = {"time": "Time (s) in s", "displacement": "Disp (mm) in mm", "force": "Force (N) in N"}


def test_raw_volts_beside_each_calibrated_column(tmp_path, capsys) -> None:
    found = channels(tmp_path, {
        "Time (s)": T, "Force (V)": F / 200.0, "Force (N)": F, "Disp (V)": X / 10.0,
        "Disp (mm)": X, "Temperature (V)": WARM / 25.0, "Temperature (C)": WARM,
    })  # fmt: skip
    assert found == PLAIN | {"temperature": "Temperature (C) in degC"}
    said = " ".join(capsys.readouterr().out.split())
    assert '"Temperature (V)" of "Temperature (C)"' in said
    assert "extra" not in said.lower()


@pytest.mark.parametrize(
    ("columns", "more"),
    [
        ({"AI0 (V)": F / 200.0, "AI1 (V)": X / 10.0}, {}),
        ({"Temperature (V)": WARM / 25.0}, {"extra temperature_2": "Temperature (V)"}),
        ({"Load cell (mV/V)": F / 300.0}, {}),
        ({"Druck [mA]": 4.0 + WARM / 7.0}, {"extra druck": "Druck [mA]"}),
        ({"AI0 (V)": F / 200.0, "Coil (V)": U}, {"voltage": "Coil (V) in V"}),
        ({"Öltemperatur [V]": WARM / 25.0, "Öltemperatur [°C]": WARM, "Strom [A]": U},
         {"current": "Strom [A] in A", "temperature": "Öltemperatur [°C] in degC"}),
        ({"Voltage (V)": U, "Current (A)": U / 4.0},
         {"voltage": "Voltage (V) in V", "current": "Current (A) in A"}),
        ({"Command level (V)": U}, {"voltage": "Command level (V) in V"}),
        ({"T_oil_C": WARM}, {"temperature": "T_oil_C in degC"}),
        ({"Force (V)": F / 200.0 + 0.02 * np.cos(700.0 * T)}, {}),
    ],
)  # fmt: skip
def test_what_commands_and_what_is_measured(tmp_path, columns, more) -> None:
    found = channels(tmp_path, {"Time (s)": T, "Disp (mm)": X, "Force (N)": F, **columns})
    assert found == PLAIN | more


@pytest.mark.parametrize(
    ("name", "doubted"),
    [("Ch1 (V)", True), ("AO0 (A)", True), ("Coil (V)", False), ("Setpoint (V)", False)],
)
def test_a_command_by_its_unit_alone_is_doubted(tmp_path, capsys, name, doubted) -> None:
    columns = {"Time (s)": T, "Disp (mm)": X, "Force (N)": F, name: U}
    found = channels(tmp_path, columns)
    assert name in (found.get("voltage", "") + found.get("current", ""))
    assert ("its name tells no command" in " ".join(capsys.readouterr().out.split())) is doubted


@pytest.mark.parametrize("title", ["Temperature (F)", "Oil temp [°F]", "T_degF"])
def test_degrees_fahrenheit(tmp_path, capsys, title) -> None:
    found = channels(tmp_path, {"Time (s)": T, "Disp (mm)": X, "Force (N)": F, title: 70.0 + WARM})
    assert found["temperature"] == f"{title} in degF"
    assert main(["study", "check", str(tmp_path / "rig")]) == 0
    mean = float(np.mean(38.0 + WARM)) / 1.8
    assert f"temperature: {mean:.1f} °C, the mean of the run" in " ".join(
        capsys.readouterr().out.split()
    )
