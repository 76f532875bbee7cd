"""Where nothing was measured: codes such as -9999 are missing, other words are refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bristle.cli import main
from bristle.study.study import Study

T = np.arange(900) / 200.0
X = 8.0 * np.sin(9.0 * T)
F = 1.5 * np.tanh(14.4 * np.cos(9.0 * T)) + 0.65 * np.cos(9.0 * T)
LOST = (200, 201, 430)


def made(tmp_path: Path, word: str) -> list[str]:
    texts = [word if k in LOST else f"{value:.4f}" for k, value in enumerate(F)]
    rows = (f"{t:.4f},{x:.4f},{text}" for t, x, text in zip(T, X, texts, strict=True))
    file = tmp_path / "run.csv"
    file.write_text("\n".join(["Time [s],Disp [mm],Force [kN]", *rows, ""]))
    return ["study", "new", str(tmp_path / "rig"), "--data", str(file)]


@pytest.mark.parametrize("word", ["-9999", "-9999.0", "99999", "-7999", "", "#N/A", "INF", "NaN"])
def test_what_is_missing_is_marked_and_said(tmp_path, capsys, word) -> None:
    assert main(made(tmp_path, word)) == 0
    code = word.lstrip("-").replace(".", "").isdigit()
    assert ("in 3 places, and else within" in " ".join(capsys.readouterr().out.split())) is code
    (run,) = Study(tmp_path / "rig").read()
    np.testing.assert_allclose(run["force"], 1e3 * F, atol=25.0)
    assert any("3 samples (0.33 %) were missing" in note for note in run.notes)


def test_a_mark_within_the_range_is_missing_where_the_signal_jumps_to_it(tmp_path, capsys) -> None:
    newtons = 1e3 * F
    marked = np.where(np.isin(np.arange(900), np.arange(40, 900, 45)), -999.25, newtons)
    for name, y in (("marked", marked), ("passes", np.round(newtons * 4.0) / 4.0)):
        file = tmp_path / f"{name}.csv"
        rows = (f"{t:.4f},{x:.4f},{f:.6g}" for t, x, f in zip(T, X, y, strict=True))
        file.write_text("\n".join(["Time [s],Disp [mm],Force [N]", *rows, ""]))
        assert main(["study", "new", str(tmp_path / name), "--data", str(file)]) == 0
        said = "is -999.25 in 20 places" in " ".join(capsys.readouterr().out.split())
        assert said is (name == "marked")
        (run,) = Study(tmp_path / name).read()
        np.testing.assert_allclose(run["force"], newtons, atol=250.0)


def test_a_force_without_a_number_is_named(tmp_path, capsys) -> None:
    file = tmp_path / "run.csv"
    rows = (f"{t:.4f},{x:.4f},nan" for t, x in zip(T, X, strict=True))
    file.write_text("\n".join(["Time [s],Disp [mm],Force [kN]", *rows, ""]))
    assert main(["study", "new", str(tmp_path / "rig"), "--data", str(file)]) == 2
    assert '"Force [kN]" holds no number at all' in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize("word", ["---", "OVER", "OL", "#VALUE!", "9.9E+37"])
def test_other_words_are_refused_with_their_line(tmp_path, capsys, word) -> None:
    assert main(made(tmp_path, word)) == 2
    said = capsys.readouterr().err
    assert "line 202: " in said
    assert not (tmp_path / "rig").exists()
