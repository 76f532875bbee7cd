"""A controller of one's own: its file, its FMU, a run; and copies of stock scenarios."""

from __future__ import annotations

import json
import subprocess
import sys
from math import exp, pi
from pathlib import Path

import numpy as np
import pytest

from bristle.cli import main
from bristle.conformance import conform
from bristle.engine.run import IncompleteRunError, run
from bristle.errors import BuildError, ScenarioError
from bristle.fmu import catalogue
from bristle.fmu.build import build, plan
from bristle.fmu.controller import MEASURED
from bristle.fmu.own_controller import Measured
from bristle.system.scenario import copy_scenario, load_scenario, stock_scenarios
from bristle.system.toml import scenario_text

ROOT = Path(__file__).resolve().parents[2]
OF_A_LAW = (
    "modelDescription.xml", "start values in the code", "direct dependencies", "reset",
    "state replay", "serialised state", "bare interpreter", "fault: input", "fault: earlier state",
)  # fmt: skip
"""Probes of what a user writes; the others are of what all controllers share."""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def file(here: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    """Return the file of a new controller."""
    assert main(["new", "controller", "my_controller"]) == 0
    assert "bristle build my_controller.py" in capsys.readouterr().out
    return here / "my_controller.py"


def test_the_template_builds_and_runs(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["build", "my_controller.py"]) == 0
    assert "MyController.fmu: built" in capsys.readouterr().out
    frame = run(
        "el_centro_0p6g_clipped",
        {"controller.fmu": "MyController.fmu", "controller.gain": 40.0, "controller.v_max": 5.0,
         "run.stop": 4.0, "run.step": 0.002},
    )  # fmt: skip
    # The law again, by hand: a sample every 2 ms, at each row.
    speed, wanted = 0.0, []
    for v in frame["structure.base_velocity"]:
        speed += (1.0 - exp(-2.0 * pi * 10.0 * 0.002)) * (abs(v) - speed)
        wanted.append(40.0 * speed)
    assert frame["controller.command_raw"].to_numpy() == pytest.approx(wanted, abs=1e-9)
    voltage = frame["controller.voltage"].to_numpy()
    assert voltage == pytest.approx(np.clip(wanted, 0.0, 5.0), abs=1e-9)
    assert voltage.max() == 5.0, "the limit was reached"


@pytest.mark.slow  # 3 s of probes: by default a stock controller of the same class has them all
def test_the_template_conforms(file: Path) -> None:
    assert main(["build", "my_controller.py"]) == 0
    report = conform("MyController.fmu", only=OF_A_LAW)
    assert report.ok, repr(report)


def test_the_page_shows_the_template_without_its_comments(file: Path) -> None:
    lines = [line for line in file.read_text().splitlines() if not line.strip().startswith("#")]
    page = (ROOT / "docs" / "controllers.md").read_text(encoding="utf-8")
    shown = page.partition("```py\n")[2].partition("```")[0]
    assert shown.splitlines() == lines


def test_what_is_measured_are_the_ports_of_every_controller() -> None:
    assert Measured._fields == tuple(MEASURED)


def test_an_edited_file_is_read_again(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    start = text[text.index("        super().declare_law()") :].splitlines()[0] + "\n"
    for name in ("one", "two"):  # of one size, and within a second
        law = f'        self.add_parameter("{name}", 1.0, "V", "a level", (0.0, 9.0))\n'
        file.write_text(text.replace(start, start + law), encoding="utf-8")
        assert plan(str(file), starts={name: 2.0}).baked["starts"] == {name: 2.0}
    with pytest.raises(BuildError, match='no parameter "one"'):
        plan(str(file), starts={"one": 2.0})
    file.unlink()
    with pytest.raises(BuildError, match=r"my_controller\.py: cannot be read"):
        catalogue.component_class(file)


def test_it_samples_on_its_own_clock(file: Path) -> None:
    build(plan(str(file)), file.parent)
    settings = {"controller.fmu": "MyController.fmu", "run.stop": 0.5, "run.step": 0.0005}
    frame = run("el_centro_0p6g_clipped", settings)
    raw = frame["controller.command_raw"].to_numpy()
    for k in (1, 2, 3):
        assert np.array_equal(raw[k::4][: len(raw[::4]) - 1], raw[::4][:-1]), "held over 2 ms"


@pytest.mark.parametrize(
    ("new", "words"),
    [
        # A second each: by default what the controller's own code raises.
        ("return 1.0 / 0.0, (speed,)", "division by zero"),
        *(
            pytest.param(*one, marks=pytest.mark.slow)
            for one in (
                ("return speed, ()", "0 numbers to remember; memory names 1"),
                ("return float('nan'), (speed,)", "not finite"),
            )
        ),
    ],
)
def test_a_law_that_goes_wrong_stops_the_run_with_its_words(
    file: Path, new: str, words: str, caplog: pytest.LogCaptureFixture
) -> None:
    old, text = "return self.gain * speed, (speed,)", file.read_text()
    assert old in text
    late = new.replace("return", "if measured.base_velocity > 0.01:\n            return")
    file.write_text(text.replace(old, f"{late}\n        {old}"))
    build(plan(str(file)), file.parent)
    with pytest.raises(IncompleteRunError, match="controller in the step from"):
        run("el_centro_0p6g_clipped", {"controller.fmu": "MyController.fmu", "run.stop": 4.0})
    assert words in caplog.text


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("MyController", "small letters"),
        ("my controller", "small letters"),
        ("_mine", "small letters"),
        ("skyhook", "is a built-in component"),
        ("my_controller", "is there already"),
    ],
)
def test_a_name_that_cannot_be_is_refused(
    file: Path, name: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = file.read_text()
    assert main(["new", "controller", name]) == 2
    assert words in capsys.readouterr().err
    assert [path.name for path in file.parent.glob("*.py")] == [file.name]
    assert file.read_text() == before


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("import nothing_like_it\n", "No module named 'nothing_like_it'"),
        ("def broken(:\n", "SyntaxError"),
        ("x = 1\n", "0 component classes"),
    ],
)
def test_a_file_that_is_no_component_is_one_message(
    here: Path, text: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "bad.py").write_text(text)
    assert main(["build", "bad.py"]) == 2
    err = capsys.readouterr().err
    assert err.startswith("BuildError: ")
    assert words in err
    assert main(["build", "gone.py"]) == 2
    assert "there is no such file" in capsys.readouterr().err


def test_list_scenarios_as_json_has_paths(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "scenarios", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["file"] for row in rows] == [str(file) for file in stock_scenarios()]


@pytest.mark.parametrize("stock", stock_scenarios(), ids=lambda file: file.stem)
def test_a_copy_of_a_stock_scenario_runs_the_same(here: Path, stock: Path) -> None:
    file = copy_scenario(stock.stem)
    assert file == Path(stock.name)
    one, other = load_scenario(file.absolute()), load_scenario(stock)
    copied = scenario_text(one).replace(str(file.absolute().parent), str(stock.parent))
    assert copied == scenario_text(other)
    for component in one.components.values():
        if component.building is not None:  # it stands beside the copy
            assert Path(component.building).is_relative_to(file.absolute().parent)
            assert Path(component.building).is_file()
    assert "#:schema" not in file.read_text()


def test_a_copy_overwrites_nothing_and_names_what_is_near(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["new", "scenario", "mine", "--like", "no_damper"]) == 0
    assert "bristle run mine.toml" in capsys.readouterr().out
    (here / "mine.toml").write_text("mine")
    assert main(["new", "scenario", "mine", "--like", "no_damper"]) == 2
    assert "is there already" in capsys.readouterr().err
    assert (here / "mine.toml").read_text() == "mine"
    assert main(["new", "scenario", "other", "--like", "no_dampr"]) == 2
    assert 'Did you mean "no_damper"?' in capsys.readouterr().err
    assert main(["new", "scenario", "mine"]) == 2
    with pytest.raises(ScenarioError, match="cannot be written"):
        copy_scenario("no_damper", here / "gone" / "mine.toml")


@pytest.mark.parametrize(("option", "words"), [("--help", "--list"), ("--list", "LuGreDamper")])
def test_build_fmus_helps_and_lists(option: str, words: str) -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / "build_fmus.py"), option],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    assert words in done.stdout
    if option == "--list":
        assert done.stdout.split() == catalogue.component_names()
