"""A rig that nothing commands: its laws are tried, and nothing speaks of a command."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from made import write

from bristle.cli import main
from bristle.study.study import Study

WORDS = re.compile(r"\b(volt|voltage|volts|coil|drive|driven|command|commanded)\b|N/V|\(m\.V\)")
T = np.arange(1500) / 500.0


def orifice(k: int) -> tuple[np.ndarray, np.ndarray]:
    """Return motion [mm] and force [N] of a damper with a fractional power of the speed."""
    rng, w = np.random.default_rng(k), 2.0 * np.pi * (0.8 + 0.5 * k)
    rise = np.minimum(T / 0.5, 1.0) ** 2
    x = 0.008 * rise * (np.sin(w * T) + 0.4 * np.sin(2.7 * w * T + k))
    v = np.gradient(x, T)
    force = 20.0 * np.abs(v / 0.1) ** 0.45 * np.sign(v)
    noisy = force + 0.1 * rng.standard_normal(T.size)
    return 1e3 * (x + 2e-6 * rng.standard_normal(T.size)), noisy


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("without")
    files = []
    for k in (1, 2, 3):
        x, force = orifice(k)
        columns = {"time [s]": T, "displacement [mm]": x, "force [N]": force}
        files.append(str(write(folder / f"run_{k}.csv", columns)))
    assert main(["study", "new", str(folder / "rig"), "--data", *files]) == 0
    return folder / "rig"


def said_by(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    capsys.readouterr()
    assert main([*arguments]) == 0
    shown = capsys.readouterr()
    return shown.out + shown.err


def test_it_is_said_once_and_then_no_more(rig: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = [str(path) for path in sorted((rig / "data").glob("*.csv"))]
    said = said_by(capsys, "study", "new", str(rig.parent / "again"), "--data", *files)
    assert "no command was recorded" in " ".join(said.lower().split())
    check = said_by(capsys, "study", "check", str(rig))
    fit = said_by(capsys, "identify", str(rig), "--law", "bingham", "--starts", "1")
    assert not WORDS.findall(check), check
    assert not WORDS.findall(fit), fit


def test_the_law_that_made_the_force_is_found(
    rig: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = said_by(capsys, "diagnose", str(rig), "--law", "all")
    assert not WORDS.findall(said), said
    verdict = Study(rig).verdict()
    assert verdict is not None
    assert verdict["law"] == "fluid_viscous"
    tried = {row["law"] for row in verdict["laws"]}
    assert {"fluid_viscous", "friction_damper", "isolator", "shock_absorber", "dahl"} <= tried
