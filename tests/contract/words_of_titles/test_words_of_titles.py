"""Titles as instruments and people write them: the unit that is meant, or what is doubted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bristle.cli import main
from bristle.data.guess import guess_channels
from bristle.data.measurement import measurements_of
from bristle.data.read import read_table
from bristle.data.titles import title

G = 9.80665
T = np.arange(600) / 500.0
X, F = 12.0 * np.sin(10.0 * T), 1400.0 * np.tanh(4.0 * np.cos(10.0 * T)) + 30.0
A = -1.2 * np.sin(10.0 * T)  # m/s2


def made(folder: Path, titles: str, *columns: np.ndarray) -> Path:
    file = folder / "run.csv"
    rows = (";".join(f"{one:.8f}" for one in row) for row in zip(T, *columns, strict=True))
    file.write_text("\n".join([titles, *rows, ""]), encoding="utf-8")
    return file


@pytest.mark.parametrize(
    ("title", "size"),
    [("Acc (mg)", G / 1e3), ("acc_mg", G / 1e3), ("Acc [G]", G), ("Acc [mG]", G / 1e3),
     ("Acc [g_n]", G), ("Acc [ms^-2]", 1.0), ("Acc [mms-2]", 1e-3), ("Beschl. [mm/s²]", 1e-3)],
)  # fmt: skip
def test_accelerations(tmp_path: Path, title: str, size: float) -> None:
    file = made(tmp_path, f"t [s];x [mm];F [N];{title}", X, F, A / size)
    (run,) = measurements_of(read_table(file), estimate=False)
    np.testing.assert_allclose(run["acceleration"], A, atol=1e-4)


@pytest.mark.parametrize(
    ("title", "size"),
    [("Kraft [kp]", G), ("Load (tf)", 1e3 * G), ("Load (kg-f)", G), ("Force kN", 1e3),
     ("Force - kN", 1e3), ("Force=kN", 1e3), ("Force {kN}", 1e3), ("Force\uff3bkN\uff3d", 1e3),
     ("Force [kN] (filtered)", 1e3), ("Force [kN] CH3", 1e3), ("Siła [kN]", 1e3),
     ("Forza_kN_", 1e3), ("Сила (кН)", 1e3), ("力(kN)", 1e3)],
)  # fmt: skip
def test_forces(tmp_path: Path, title: str, size: float) -> None:
    file = made(tmp_path, f"t [s];Disp (micron);{title}", 1e3 * X, F / size)
    (run,) = measurements_of(read_table(file), estimate=False)
    np.testing.assert_allclose(run["force"], F, atol=0.2)
    np.testing.assert_allclose(run["displacement"], 1e-3 * X, atol=1e-6)


def test_a_supply_beside_a_command_is_doubted_and_a_temperature_is_known(tmp_path: Path) -> None:
    titles = "t [s];x [mm];F [N];Voltage supply [V];Current coil [A];Temp °C"
    table = read_table(
        made(tmp_path, titles, X, F, 0.0 * T + 12.0, np.sign(X) + 1.0, 0.0 * T + 21.0)
    )
    found = {one.channel: one for one in guess_channels(table)}
    assert "it never changes, as a supply" in found["voltage"].doubt
    assert found["current"].doubt == ""
    assert found["temperature"].unit == "degC"


@pytest.mark.parametrize(
    ("title", "said"),
    [("Force/10 [N]", '"/10" in it may be a factor'), ("Force [N] *10", '"*10" in it may be'),
     ("Force [1e3 N]", '"1e3" in it may be'), ("Force (N) x10", "may be a factor"),
     ("Force [N]·10³", '"·10³" in it may'), ("Force (N)*0.001", "may be a factor"),
     ("Force x10 [N]", "may be a factor"), ("Force [N] (kN)", "the title says N, and kN"),
     ("Load (kg)", 'no unit of it; a load cell shows kgf: --channel "force=Load (kg)@kgf"')],
)  # fmt: skip
def test_what_may_be_another_force_is_asked(tmp_path, capsys, title, said) -> None:
    file = made(tmp_path, f"t [s];x [mm];{title}", X, F)
    assert main(["study", "new", str(tmp_path / "rig"), "--data", str(file)]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("text", ["F_N [kN]", "x_m [kN]", "Load cell 25 N [kN]"])
def test_a_subscript_and_a_range_are_no_second_unit(text) -> None:
    assert title(0, text).stated == "kN"
