"""`bristle design`: a controller file, a picture, the numbers; and refusals that leave nothing."""

from __future__ import annotations

import json
import warnings
from math import inf
from pathlib import Path

import control
import numpy as np
import pytest
from numpy.typing import NDArray

from bristle.cli import main
from bristle.control.controller import read_controller
from bristle.design import Result, Task, design
from bristle.design.margins import facts_of, grid_rows, margins
from bristle.design.plant import Plant, StateSpace
from bristle.fmu.build import plan
from bristle.report.singular import draw_design


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the current folder, empty but for design files."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_hinf.toml").write_text('schema = 1\nkind = "hinf"\ntitle = "mine"\n')
    (tmp_path / "my_lpv.toml").write_text(
        'schema = 1\nkind = "lpv"\n[scheduling]\nrows = 61\ngrid = [0.0, 0.02, 0.08, 0.3]\n'
    )
    return tmp_path


def test_hinf_tells_gamma_norm_poles_and_margins(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["design", "hinf", "my_hinf.toml"]) == 0
    said = capsys.readouterr().out
    for words in ("gamma 6.01", "no controller below 4.900", "closed-loop norm", "-5.06", "phase"):
        assert words in said
    assert sorted(path.name for path in here.iterdir()) == [
        "my_hinf.json", "my_hinf.png", "my_hinf.toml", "my_lpv.toml",
    ]  # fmt: skip
    assert read_controller("my_hinf.json").title == "mine"
    assert (here / "my_hinf.png").read_bytes()[:4] == b"\x89PNG"
    assert plan("ClippedOptimal", controller=Path("my_hinf.json")).files["hinf.json"]


def test_lpv_as_json_goes_where_it_is_told(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "deep").mkdir()
    assert main(["design", "lpv", "my_lpv.toml", "--out", "deep/mine.json", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["rows"] == 61
    assert len(told["facts"]["norms"]) == 4
    assert max(told["facts"]["norms"]) <= told["facts"]["gamma"]
    assert [Path(name).name for name in told["files"]] == ["mine.json", "mine.png"]
    assert sorted(path.name for path in (here / "deep").iterdir()) == ["mine.json", "mine.png"]
    assert [entry["speed"] for entry in told["margins"]["speeds"]] == [0.0, 0.02, 0.08, 0.3]
    assert 0.0 < told["margins"]["modulus"] <= 1.0


@pytest.mark.parametrize(
    ("arguments", "text", "words"),
    [
        (["hinf", "gone.toml"], None, "gone.toml: cannot be read"),
        (["lpv", "my_hinf.toml"], None, "bristle design hinf"),
        (["hinf", "bad.toml"], 'kind = "hinf"\n[weights]\nnoise = 0.0', "singular"),
        (["hinf", "bad.toml"], 'kind = "hinf"\nsample_period = 0.0', "must be positive"),
        (["hinf", "bad.toml"], 'kind = "hinf"\nsample_period = 0.2', "too long for the first mode"),
        (["hinf", "bad.toml"], 'kind = "hinf"\ntau = 1.0', "unstable|too fast"),
        (["hinf", "bad.toml"], 'kind = "hinf"\n[damper]\nv_max = 0.0', "nothing to control"),
        (["lpv", "bad.toml"], 'kind = "lpv"\n[scheduling]\ngrid = [0.0]', "give two"),
        (["lpv", "bad.toml"], 'kind = "lpv"\n[scheduling]\ngrid = [0.0, 0.2, 0.1]', "must rise"),
        (["hinf", "my_hinf.toml", "--out", "my_hinf.toml"], None, "named FILE.json"),
        (["hinf", "my_hinf.toml", "--out", "gone/my.json"], None, "cannot be written"),
    ],
)
def test_a_refusal_has_exit_code_2_one_message_and_no_file(
    arguments: list[str], text: str | None, words: str, here: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    if text is not None:
        (here / "bad.toml").write_text("schema = 1\n" + text)
    before = {path.name: path.read_bytes() for path in here.iterdir()}
    assert main(["design", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("DesignError: ")
    assert any(word in err for word in words.split("|"))
    assert {path.name: path.read_bytes() for path in here.iterdir()} == before


# -- margins


@pytest.fixture(scope="module")
def hinf() -> Result:
    return design(Task("hinf"))


def test_margins_are_those_of_python_control(hinf: Result) -> None:
    plant, K = hinf.plants[0], hinf.bank.at(0)
    loop = -1 * control.ss(plant.A, plant.B2, plant.C2, plant.D22) * control.ss(*K)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # its polynomials overflow
        gain, phase, modulus, *_ = control.stability_margins(loop)
    found = margins(plant, K)
    assert found.gain_up == pytest.approx(gain, rel=1e-3)
    assert found.phase == pytest.approx(phase, rel=1e-3)
    assert found.modulus == pytest.approx(modulus, rel=1e-4)


@pytest.mark.parametrize("side", ["gain_up", "phase"])
def test_a_loop_at_its_margin_is_at_the_edge_of_stability(hinf: Result, side: str) -> None:
    plant, K = hinf.plants[0], hinf.bank.at(0)
    found = margins(plant, K)
    if side == "gain_up":
        for factor, stable in ((0.999, True), (1.001, False)):
            louder = K._replace(C=found.gain_up * factor * K.C)
            assert (growth(plant, louder) < 0.0) == stable
    else:  # no loop with less phase than twice the angle that the modulus margin guarantees
        assert found.phase is not None
        assert found.phase >= np.degrees(2.0 * np.arcsin(0.5 * found.modulus))


def growth(plant: Plant, K: StateSpace) -> float:
    poles: NDArray[np.complex128] = np.linalg.eigvals(plant.closed_loop(K).A)
    return float(poles.real.max())


def test_a_controller_that_does_nothing_has_every_margin(hinf: Result) -> None:
    plant, K = hinf.plants[0], hinf.bank.at(0)
    found = margins(plant, K._replace(C=0.0 * K.C))
    assert found.modulus == pytest.approx(1.0, rel=1e-5)
    assert found.phase is None
    assert (found.gain_up or inf) > 1e9
    assert facts_of(hinf)["speeds"][0]["speed"] == 0.0
    assert grid_rows(hinf) == [0]


def test_the_same_design_is_drawn_to_the_same_bytes(hinf: Result, tmp_path: Path) -> None:
    for name in ("one.png", "two.png"):
        draw_design(hinf, tmp_path / name)
    assert (tmp_path / "one.png").read_bytes() == (tmp_path / "two.png").read_bytes()
