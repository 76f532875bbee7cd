"""What a comparison of controllers refuses: one message that says what is right, exit code 2."""

from __future__ import annotations

from pathlib import Path

import pytest

from bristle.cli import main
from bristle.controller_comparison.compare import Maker
from bristle.controller_comparison.setting import (
    DEFAULT,
    Folder,
    choice_of,
    choices_of,
    damper_from,
    site_from,
)
from bristle.errors import ScenarioError
from bristle.fmu.build import build, plan
from bristle.synthesis import design

MOTION = "el_centro_1940_ns,stop=1"
DESIGN = Path(__file__).parents[2] / "bristle" / "component" / "data" / "lqg.json"
WINDY = '''"""FMU: a controller that asks for the wind."""

from bristle.fmu.own_controller import OwnController


class Windy(OwnController):
    """Windy: needs what no building shows."""

    def declare_measured(self):
        super().declare_measured()
        self.add_input("wind", "m/s", "wind speed", over_step="sampled")

    def command(self, measured, memory):
        return 0.0, ()
'''
TOWER = """schema = 1
masses = [4.0, 2.0]
stiffnesses = [1500.0, 4000.0]
base = "isolated"
damping_ratio = 0.01
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder that commands run in, with files that are not right."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tower.toml").write_text(TOWER)
    (tmp_path / "broken.toml").write_text(TOWER.replace("4.0, 2.0", "4.0, -2.0"))
    text = DESIGN.read_text()
    assert '"sample_period":0.002' in text
    (tmp_path / "edited.json").write_text(text.replace('period":0.002', 'period":0.003'))
    (tmp_path / "other.json").write_text(text)
    (tmp_path / "windy.py").write_text(WINDY)
    return tmp_path


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--controller", "Skyhook"], "no ground motions"),
        (["--no-figure"], "no controllers"),
        (["--motions", MOTION], "no controllers"),
        (["--motions", MOTION, "--controller", "LqgCliped"], 'Did you mean "LqgClipped"?'),
        (["--motions", "el_centra", "--controller", "Skyhook"], "el_centro_1940_ns"),
        (["--motions", "el_centro,peek=1", "--controller", "Skyhook"], 'Did you mean "peak"?'),
        (["--motions", "el_centro,peak=high", "--controller", "Skyhook"], "5.9 (m/s2) or 0.6g"),
        (["--motions", MOTION, MOTION, "--controller", "Skyhook"], "is there twice"),
        (["--motions", f"{MOTION},label=a b", f"{MOTION},label=a_b", "--controller", "Skyhook"],
         '"a_b" is there twice'),
        (["--motions", MOTION, "--controller", "Skyhook", "Skyhook"], "is there twice"),
        (["--motions", MOTION, "--controller", "Skyhook,label=limit"], "is there twice"),
        (["--motions", MOTION, "--controller", "Skyhook,gian=3"], "gian"),
        (["--motions", MOTION, "--controller", "Skyhook", "--building", "broken.toml"],
         "masses[1]"),
        (["--motions", MOTION, "--controller", "Skyhook", "--device", "brace"],
         "no device 'brace'"),
        (["--motions", MOTION, "--controller", "edited.json"], "does not match its digest"),
        (["--motions", MOTION, "--controller", "other.json", "--building", "tower.toml"],
         "designed for the building"),
        (["--motions", MOTION, "--controller", "TrainedPolicy", "--building", "tower.toml"],
         "python -m benchmarks train my_policy.toml"),
        (["--motions", MOTION, "--controller", "gone.fmu"], "gone.fmu"),
        (["--motions", MOTION, "--controller", "gone.py"], "gone.py"),
        (["--motions", MOTION, "--controller", "windy.py"], "windy.py,wind=0"),
        (["--motions", MOTION, "--controller", "Skyhook,sample_period=0.2"],
         "too long for the first mode"),
        (["--motions", MOTION, "--controller", "Skyhook", "--damper", "LuGreDampr"],
         'Did you mean "LuGreDamper"?'),
        (["--motions", MOTION, "--controller", "Skyhook", "--damper", "LuGreDamper,v_max=0"],
         "leaves controllers nothing to command"),
        (["--motions", MOTION, "--controller", "Skyhook", "--grid", "3", "--damper",
          "LuGreDamper,sigma_0=0,sigma_b=0"], "its command changes nothing"),
        (["--motions", MOTION, "--controller", "HinfInverse", "--damper", "ModifiedBoucWenDamper"],
         "none that can be inverted"),
        (["--motions", MOTION, "--controller", "Skyhook", "--output", "structure.floor9"],
         "structure.floor9"),
        (["--motions", MOTION, "--controller", "Skyhook", "--damper", "LuGreDamper,sigma_a=stiff"],
         'sigma_a = the text "stiff"; a number is right'),
        (["--motions", MOTION, "--controller", "Skyhook,sample_period=fast"],
         'sample_period = the text "fast"; a number is right'),
        (["--motions", "el_centro,factor=0", "--controller", "Skyhook"], "ground does not move"),
        (["--motions", MOTION, "--controller", "Skyhook", "--step", "0"], "a time above 0 s"),
        (["--motions", MOTION, "--controller", "Skyhook", "--grid", "1"], "3 to 1000"),
        (["--motions", MOTION, "--controller", "Skyhook", "--ensemble", "1"], "2 or more members"),
        (["--motions", MOTION, "--controller", "Skyhook", "--spread", "wide"], "0.2% or 0.002"),
    ],
)  # fmt: skip
def test_one_message_says_what_is_right(
    words: list[str], said: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["controllers", *words, "--out", "out", "--quiet"]) == 2
    printed = capsys.readouterr()
    assert said in printed.err
    assert "Traceback" not in printed.err
    assert len(printed.err.split("Error: ")) == 2
    assert not printed.out
    assert not (folder / "out" / "comparison.csv").exists()


def test_a_design_for_another_damper_of_the_building_is_refused(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "braced.toml").write_text(
        f'{TOWER}[[devices]]\nname = "brace"\nat = "storey1"\n'
        '[[devices]]\nname = "low"\nat = "isolation"\n'
    )
    design({"kind": "lqg", "building": "braced.toml"}).controller.save("base.json")
    words = ["controllers", "--motions", MOTION, "--controller", "base.json", "--building",
             "braced.toml", "--grid", "3", "--out", "out", "--no-figure", "--quiet"]  # fmt: skip
    assert main([*words, "--device", "brace"]) == 2
    said = "designed for the damper on the first level, not for brace"
    assert said in capsys.readouterr().err
    out = Folder(folder / "same")
    same_place = site_from("braced.toml", "low", out)
    (candidate,) = Maker(same_place, damper_from(DEFAULT, out), out).candidates(["base.json"])
    assert candidate.name == "base"


def test_fmus_without_the_ports_are_refused(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fmu = build(plan("GroundMotion"), folder)
    words = ["controllers", "--motions", MOTION, "--out", "out", "--quiet"]
    assert main([*words, "--controller", str(fmu)]) == 2
    assert "has no output voltage [V]" in capsys.readouterr().err
    assert main([*words, "--controller", "Skyhook", "--damper", str(fmu)]) == 2
    assert "has no displacement and no velocity" in capsys.readouterr().err


def test_a_folder_that_is_a_file_is_refused(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["controllers", "--motions", MOTION, "--controller", "Skyhook", "--out", "tower.toml"]
    assert main([*words, "--quiet"]) == 2
    assert "cannot be written" in capsys.readouterr().err


def test_choices_are_names_with_values() -> None:
    found = choice_of("a, b/law.fmu,gain=2,kind=inverse,label=mine", "--controller")
    assert found == ("a, b/law.fmu", {"gain": 2, "kind": "inverse"}, "mine")
    assert [one.label for one in choices_of({"x": "Lpv", "y": "Lpv"}, "")] == ["x", "y"]
    with pytest.raises(ScenarioError, match="given twice"):
        choice_of("Lpv,a=1,a=2", "--controller")
    with pytest.raises(ScenarioError, match="a name or a file"):
        choice_of("", "--controller")
