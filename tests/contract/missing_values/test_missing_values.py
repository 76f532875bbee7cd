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


@pytest.mark.parametrize("word", ["---", "OVER", "OL", "#VALUE!", "9.9E+37"])
def test_other_words_are_refused_with_their_line(tmp_path, capsys, word) -> None:
    assert main(made(tmp_path, word)) == 2
    said = capsys.readouterr().err
    assert "line 202: " in said
    assert not (tmp_path / "rig").exists()
