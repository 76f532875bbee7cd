"""`bristle design`: a controller file, a picture, the numbers; and refusals that leave nothing."""

from __future__ import annotations

import json
import re
import sys
import warnings
from math import inf
from pathlib import Path

import control
import numpy as np
import pytest
from numpy.typing import NDArray

from bristle.cli import main
from bristle.component.controller_file import read_controller
from bristle.fmu.build import plan
from bristle.synthesis import DesignResult, Task, design
from bristle.synthesis.analysis import curves, facts_of, grid_rows, margins, task_curves
from bristle.synthesis.plant import Plant, StateSpace
from bristle.synthesis.view import draw_design

IMPROPER = "[weights]\ncommand = { numerator = [1, 2, 3], denominator = [1, 4] }"
ROLLING_OFF = "[weights]\ncommand = { gain = 2.0, corner = 50.0 }"
UNSTABLE_WEIGHT = "[weights]\nacceleration = { gain = 1.5, corner = -12.0 }"
CANCELLING = "[weights]\nacceleration = { numerator = [1, 5], denominator = [1, 5] }"
BUILDINGS = {
    "undamped": "masses = [2, 1]\nstiffnesses = [1e3, 1e3]\ndamping_ratio = 0.0\n",
    "apart": "M = [[2.0, 0], [0, 1]]\nC = [[5.0, 0], [0, 1]]\nK = [[2e3, 0], [0, 1e3]]\n",
}
"""An undamped one, one whose floor hangs on nothing that moves."""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the current folder, empty but for design files."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_hinf.toml").write_text('schema = 1\nkind = "hinf"\ntitle = "mine"\n')
    (tmp_path / "houses").mkdir()
    for name, text in BUILDINGS.items():
        (tmp_path / "houses" / f"{name}.toml").write_text("schema = 1\n" + text)
    (tmp_path / "my_lpv.toml").write_text(
        'schema = 1\nkind = "lpv"\n[scheduling]\nrows = 61\ngrid = [0.0, 0.02, 0.08, 0.3]\n'
    )
    return tmp_path


def test_hinf_tells_gamma_norm_poles_and_margins(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["design", "hinf", "my_hinf.toml"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    for words in ("gamma 6.01", "of any controller 4.9", "closed-loop norm", "phase"):
        assert words in said
    # The solver's kernels differ in the third digit: -5.062 to -5.118 over five of them.
    pole = re.search(r"(-\d\.\d+) ± (59\.9\d*)j", said)
    assert pole is not None
    assert float(pole[1]) == pytest.approx(-5.09, abs=0.04)
    assert sorted(path.name for path in here.iterdir()) == [
        "houses", "my_hinf.json", "my_hinf.png", "my_hinf.toml", "my_hinf_answer.json",
        "my_lpv.toml",
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
    names = ["mine.json", "mine_answer.json", "mine.png"]
    assert [Path(name).name for name in told["files"]] == names
    assert sorted(path.name for path in (here / "deep").iterdir()) == sorted(names)
    assert [entry["speed"] for entry in told["margins"]["speeds"]] == [0.0, 0.02, 0.08, 0.3]
    kept = json.loads((here / "deep" / "mine_answer.json").read_text())
    speeds = kept.pop("curves")["speeds"]
    assert {**kept, "files": told["files"]} == told
    assert [one["speed"] for one in speeds] == [0.0, 0.02, 0.08, 0.3]
    for one in speeds:  # gamma bounds the weighted loop at every frequency
        assert max(one["closed_loop"]) <= 1.001 * told["facts"]["gamma"]
    assert 0.0 < told["margins"]["modulus"] <= 1.0


def test_what_a_task_weighs_is_known_before_its_design() -> None:
    task = Task("hinf")
    before, after = task_curves(task), curves(design(task))
    (one,) = after["speeds"]
    assert before["frequency"] == pytest.approx(after["frequency"])
    assert before["acceleration_open"] == pytest.approx(one["acceleration_open"], rel=1e-9)
    gamma = one["acceleration_bound"][0] * before["acceleration_weight"][0]
    assert before["acceleration_weight"] * one["acceleration_bound"] == pytest.approx(gamma)
    assert before["command_weight"] * one["command_bound"] == pytest.approx(gamma)
    assert not curves(design(Task("lqg")))


@pytest.mark.parametrize(
    ("arguments", "text", "words"),
    [
        (["hinf", "gone.toml"], None, "gone.toml: there is no such file"),
        (["lpv", "my_hinf.toml"], None, "bristle design hinf"),
        (["hinf", "bad.toml"], 'kind = "hinf"\n[weights]\nnoise = 0.0', "singular"),
        (["hinf", "bad.toml"], 'kind = "hinf"\nsample_period = 0.0', "must be positive"),
        (["hinf", "bad.toml"], 'kind = "hinf"\nsample_period = 0.2', "too long for the first mode"),
        (["hinf", "bad.toml"], 'kind = "hinf"\ntau = 1.0', "unstable|too fast"),
        (["hinf", "bad.toml"], 'kind = "hinf"\n[damper]\nv_max = 0.0', "nothing to control"),
        (["lpv", "bad.toml"], 'kind = "lpv"\n[scheduling]\ngrid = [0.0]', "give two"),
        (["lpv", "bad.toml"], 'kind = "lpv"\n[scheduling]\ngrid = [0.0, 0.2, 0.1]', "must rise"),
        (["hinf", "bad.toml"], f'kind = "hinf"\n{IMPROPER}', "improper"),
        (["lpv", "bad.toml"], f'kind = "lpv"\n{ROLLING_OFF}', "singular"),
        (["hinf", "bad.toml"], f'kind = "hinf"\n{UNSTABLE_WEIGHT}', "must be < 0"),
        (["hinf", "bad.toml"], f'kind = "hinf"\n{CANCELLING}', "cannot be balanced"),
        (["lqg", "bad.toml"], 'kind = "lqg"\n[lqg]\nnoise = 0.0', "singular"),
        (["hinf", "bad.toml"], 'kind = "hinf"\nbuilding = "houses/undamped.toml"', "is not damped"),
        (["lpv", "bad.toml"], 'kind = "lpv"\nbuilding = "houses/undamped.toml"', "is not damped"),
        (["lqg", "bad.toml"], 'kind = "lqg"\nbuilding = "houses/undamped.toml"', "is not damped"),
        (["hinf", "bad.toml"], 'kind = "hinf"\nbuilding = "houses/apart.toml"', "not controllable"),
        (["lpv", "bad.toml"], 'kind = "lpv"\n[scheduling]\ngrid = []', "give two"),
        (["lpv", "bad.toml"], 'kind = "lpv"\n[scheduling]\ngrid = [0.0, 0.0]', "must rise"),
        (["lpv", "bad.toml"], 'kind = "lpv"\n[scheduling]\ngrid = [0.0, inf]', "grid holds inf"),
        (["lpv", "bad.toml"], 'kind = "lpv"\n[scheduling]\ngrid = [0.1, 0.2]', "begin at 0"),
        (["lpv", "bad.toml"], 'kind = "lpv"\n[damper]\nknown_to = 0.2', "beyond the 0.2 m/s"),
        (["lpv", "bad.toml"], 'kind = "lpv"\n[damper]\nv_max = -1.0', "nothing to control"),
        (["lpv", "bad.toml"], 'kind = "lpv"\n[damper]\nv_max = nan', "finite number"),
        (["lqg", "bad.toml"], 'kind = "lqg"\nsample_period = -0.002', "must be positive"),
        (["hinf", "bad.toml"], 'kind = "policy"', "There are: hinf, lpv, lqg"),
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
    before = {path.name: path.read_bytes() for path in here.rglob("*.*")}
    assert main(["design", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("DesignError: ")
    assert any(word in err for word in words.split("|"))
    assert {path.name: path.read_bytes() for path in here.rglob("*.*")} == before


def test_a_damper_that_a_study_has_identified_on_a_building_of_ones_own(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from bristle.data.building_file import read_building
    from bristle.model.model import new_model
    from bristle.model.model_file import write_model

    model = new_model("lugre").with_effect("gas_spring")
    found = {"sigma_a": 720.0, "sigma_0": 390.0, "gas_spring.k": 60.0}
    model = model.with_values(found, {"sigma_a": 12.0})
    (here / "my_study").mkdir()
    write_model(here / "my_study" / "model.toml", model)
    (here / "houses" / "mine.toml").write_text(
        "schema = 1\nmasses = [2.2, 1.3, 1.1]\nstiffnesses = [1100.0, 1500.0, 1400.0]\n"
        "damping_ratio = 0.02\n"
    )
    text = """
        schema = 1
        kind = "{}"
        building = "houses/mine.toml"
        [damper]
        model = "my_study/model.toml"
        """
    for kind, more in (("hinf", ""), ("lpv", "[scheduling]\nrows = 21\ngrid = [0, 0.05, 0.3]\n")):
        (here / "task.toml").write_text(text.format(kind) + more)
        assert main(["design", kind, "task.toml", "--out", f"{kind}.json"]) == 0
        controller = read_controller(here / f"{kind}.json")
        controller.check_building(read_building(here / "houses" / "mine.toml"))
        damper = controller.design["damper"]
        assert damper["law"] == "lugre"
        assert damper["effects"] == ["gas_spring"]
        assert {name: damper["parameters"][name] for name in found} == found
    told = capsys.readouterr().err.splitlines()
    assert [line for line in told if not line.endswith("...")] == []  # a slow machine's progress


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (("sigma_a", "sigma_x"), 'there is no parameter "sigma_x"'),
        (('law = "lugre"', 'law = "maxwell"'), "maxwell"),
        (("value = 650.0", 'value = "650"'), "number"),
        (("value = 650.0", "value = -650.0"), "outside"),
        (('unit = "N/m"', 'unit = "kg"'), "dimension"),
    ],
)
def test_a_study_model_that_is_wrong_is_one_message(
    edit: tuple[str, str], words: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from bristle.model.model import new_model
    from bristle.model.model_file import write_model

    write_model(here / "model.toml", new_model("lugre"))
    text = (here / "model.toml").read_text()
    assert edit[0] in text
    (here / "model.toml").write_text(text.replace(*edit, 1))
    (here / "task.toml").write_text('schema = 1\nkind = "hinf"\n[damper]\nmodel = "model.toml"\n')
    assert main(["design", "hinf", "task.toml"]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert "model.toml" in error
    assert "Traceback" not in error
    assert not list(here.glob("task.json"))


def test_a_solver_that_fails_is_one_message_and_no_file(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    import cvxpy as cp

    def breaks(self: object, **settings: object) -> None:
        raise cp.error.SolverError("it broke down")

    monkeypatch.setattr(cp.Problem, "solve", breaks)
    for kind in ("hinf", "lpv"):
        assert main(["design", kind, f"my_{kind}.toml"]) == 2
        assert "DesignError: the solver CLARABEL failed: it broke down" in capsys.readouterr().err
    assert not list(here.glob("*.json"))


def test_without_the_solver_a_design_says_what_installs_it(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "cvxpy", None)
    assert main(["design", "hinf", "my_hinf.toml"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "pip install 'bristle[design]'" in said


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (('"C":[', '"C":[1.0,'), "does not match its digest"),
        (('"C":[', '"C":[NaN,'), "not a finite number"),
        (('"sample_period":0.002', '"sample_period":0.0'), "does not match its digest"),
    ],
)
def test_a_controller_file_edited_by_hand_is_not_built(
    edit: tuple[str, str], words: str, here: Path, capsys: pytest.CaptureFixture[str], frozen: Path
) -> None:
    text = (frozen / "hinf.json").read_text()
    assert edit[0] in text
    (here / "mine.json").write_text(text.replace(*edit, 1))
    assert main(["build", "HinfInverse", "--controller", "mine.json", "--name", "Mine"]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1
    assert not list(here.glob("*.fmu"))


@pytest.fixture
def frozen() -> Path:
    """Return the folder of the frozen controllers."""
    return Path(__file__).parents[1] / "reference" / "controllers"


# -- margins


@pytest.fixture(scope="module")
def hinf() -> DesignResult:
    return design(Task("hinf"))


def test_margins_are_those_of_python_control(hinf: DesignResult) -> None:
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
def test_a_loop_at_its_margin_is_at_the_edge_of_stability(hinf: DesignResult, side: str) -> None:
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


def test_a_controller_that_does_nothing_has_every_margin(hinf: DesignResult) -> None:
    plant, K = hinf.plants[0], hinf.bank.at(0)
    found = margins(plant, K._replace(C=0.0 * K.C))
    assert found.modulus == pytest.approx(1.0, rel=1e-5)
    assert found.phase is None
    assert (found.gain_up or inf) > 1e9
    assert facts_of(hinf)["speeds"][0]["speed"] == 0.0
    assert grid_rows(hinf) == [0]


def test_the_same_design_is_drawn_to_the_same_bytes(hinf: DesignResult, tmp_path: Path) -> None:
    for name in ("one.png", "two.png"):
        draw_design(hinf, tmp_path / name)
    assert (tmp_path / "one.png").read_bytes() == (tmp_path / "two.png").read_bytes()
