"""Controllers compared: laws that every comparison keeps, whatever is compared."""

from __future__ import annotations

import json
from functools import cache
from html import escape
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pytest

import bristle
from bristle.cli import main
from bristle.component.controller_file import read_controller
from bristle.controller_comparison import ControllerComparison, Spread, compare_controllers
from bristle.controller_comparison.compare import task_for
from bristle.controller_comparison.setting import (
    BEST,
    LIMIT,
    OFF,
    ON,
    Folder,
    damper_from,
    plain_name,
    site_from,
)
from bristle.fmu.build import build, plan
from bristle.physics.building import PAPER
from bristle.report.controllers_page import controllers_report
from bristle.synthesis import design

TOWER = """schema = 1
name = "tower"
masses = [4.0, 2.0, 2.0, 2.0]
stiffnesses = [1500.0, 4000.0, 3500.0, 3000.0]
base = "isolated"
damping_ratio = 0.01
"""
MOTION = "el_centro_1940_ns,peak=0.4g,factor=0.45,stop=4,label=weak"
STRONG = "el_centro_1940_ns,peak=0.6g,factor=0.45,stop=4,label=strong"
ZERO = "ConstantVoltage,level=0,label=zero volts"
STEM = "structure.floor3_acceleration_absolute"


def tower(folder: Path) -> Path:
    path = folder / "tower.toml"
    path.write_text(TOWER, encoding="utf-8")
    return path


@cache
def compared() -> ControllerComparison:
    """Return a comparison that many tests look at; its folder stays until the tests end."""
    folder = Path(mkdtemp(prefix="bristle_compared_"))
    return compare_controllers(
        [MOTION, STRONG], ["ClippedOptimal", "LqgClipped", "Skyhook", ZERO], building=tower(folder),
        grid=5, spread=Spread(3), workers=1, out=folder / "out",
    )  # fmt: skip


def scenario_of(found: ControllerComparison, motion: str, controller: str) -> Path:
    assert found.setting.folder is not None
    name = f"{plain_name(controller)}.toml"
    return found.setting.folder / "scenarios" / plain_name(motion) / name


def test_every_case_is_what_running_its_scenario_gives() -> None:
    found = compared()
    weak, strong = found.motions
    for motion, controller in (
        (weak, OFF), (strong, BEST), (weak, "ClippedOptimal"), (strong, "Skyhook"),
    ):  # fmt: skip
        frame = bristle.run(scenario_of(found, motion, controller), engine="compiled")
        for column in (STEM, "structure.base_displacement", "damper.force"):
            peak = float(np.abs(frame[column]).max())
            assert found.value(motion, controller, f"peak {column}") == peak


def test_zero_volts_are_the_passive_damper() -> None:
    found = compared()
    for motion in found.motions:
        for output in found.outputs:
            off = found.value(motion, OFF, output.name)
            assert found.value(motion, "zero volts", output.name) == off


def test_the_best_constant_voltage_is_the_least_of_the_grid() -> None:
    found = compared()
    name = found.setting.judged.name
    assert name == f"peak {STEM}"
    for motion in found.motions:
        levels = found.levels[motion][name]
        assert levels.index.tolist() == [0.0, 2.0, 4.0, 6.0, 8.0]
        assert found.value(motion, BEST) == levels.min()
        assert (found.value(motion, OFF), found.value(motion, ON)) == (levels[0.0], levels[8.0])


def test_the_worst_case_is_no_better_than_the_case() -> None:
    found = compared()
    assert found.worst is not None
    assert (found.worst["failed"] == 0).all()
    both = found.table.merge(found.worst, on=["motion", "controller"], suffixes=("", " worst"))
    assert len(both) == len(found.table)
    for output in found.outputs:
        assert (both[f"{output.name} worst"] >= both[output.name]).all()
    assert (both[f"peak {STEM} worst"] > both[f"peak {STEM}"]).any()


def test_a_worst_case_is_what_its_ensemble_gives() -> None:
    found = compared()
    assert found.setting.folder is not None
    file = found.setting.folder / "ensembles" / "weak" / "LqgClipped.toml"
    again = bristle.ensemble(file, workers=1).runs[f"peak {STEM}"].max()
    own = found.value("weak", "LqgClipped")
    assert found.worst_value("weak", "LqgClipped") == max(own, again)


def test_members_are_the_same_for_all_controllers() -> None:
    found = compared()
    assert found.setting.folder is not None
    folder = found.setting.folder / "ensembles" / "weak"
    name = "structure.building.masses.1"
    drawn = [
        bristle.ensemble(folder / f"{one}.toml", workers=1).runs[name].tolist()
        for one in ("LqgClipped", "zero_volts")
    ]
    assert drawn[0] == drawn[1]
    assert all(1.8 <= value <= 2.2 for value in drawn[0])


def test_shares_are_over_the_reference() -> None:
    found = compared()
    for reference in (OFF, ON, BEST):
        assert (found.shares(reference)[reference] == 1.0).all()


def test_designs_for_another_building_are_made_anew_and_said() -> None:
    found = compared()
    said = next(note for note in found.notes if "belong to" in note)
    assert said.startswith("ClippedOptimal, LqgClipped: ")
    assert found.setting.folder is not None
    kept = found.setting.folder / "files" / "hinf.json"
    read_controller(kept).check_building(found.setting.site.building)


def test_the_verdict_is_what_the_table_says() -> None:
    found = compared()
    best = {m: min(found.controllers, key=lambda c, m=m: found.value(m, c)) for m in found.motions}  # type: ignore[misc]
    first = found.verdict[0].partition(" has the lowest")[0]
    wins = sum(one == first for one in best.values())
    assert f"in {wins} of 2 motions" in found.verdict[0]
    mean = found.shares()[first].mean()
    assert f"{abs(100 * (1 - mean)):.0f} %" in found.verdict[0]


def test_the_report_is_one_file_with_every_case(tmp_path: Path) -> None:
    found = compared()
    text = controllers_report(found)
    assert "http" not in text.replace("http-equiv", "")
    for name in (*found.controllers, *found.motions, *found.notes):
        assert escape(name) in text
    assert text.count('<img src="data:image/png') == 1 + len(found.motions)
    files = found.write(tmp_path)
    assert [path.name for path in files] == ["comparison.csv", "worst.csv"]


def test_a_building_in_another_unit_of_mass_gets_the_same_design(tmp_path: Path) -> None:
    tons = tmp_path / "tons.toml"
    masses, stiffnesses = ([1e3 * value for value in PAPER[key]] for key in
                           ("masses", "stiffnesses"))  # fmt: skip
    tons.write_text(
        f'schema = 1\nbase = "isolated"\nmasses = {masses}\nstiffnesses = {stiffnesses}\n'
        "rayleigh = { alpha = 0.213967932082332, beta = 2.86765663228640e-4 }\n"
    )
    folder = Folder(tmp_path / "out")
    damper = damper_from("LuGreDamper", folder)
    for kind in ("hinf", "lqg"):
        here, large = (
            design(task_for(kind, site_from(file, "", folder), damper)) for file in (None, tons)
        )
        if kind == "hinf":
            assert large.facts["gamma"] == pytest.approx(here.facts["gamma"], rel=1e-3)
        poles = [np.linalg.eigvals(np.reshape(one.controller.A, (one.controller.n, -1)))
                 for one in (here, large)]  # fmt: skip
        assert sorted(np.abs(poles[1])) == pytest.approx(sorted(np.abs(poles[0])), rel=0.02)


def test_stock_designs_stay_on_the_building_they_were_made_for() -> None:
    found = compare_controllers([MOTION], {"a": "ClippedOptimal", "b": "Lpv"}, grid=3, workers=1)
    assert found.notes == ()
    assert all(candidate.part.source.keys() == {"fmu"} for candidate in found.setting.candidates)
    assert found.controllers == ["a", "b"]
    assert found.setting.folder is None


@pytest.mark.slow  # an own FMU in every case
def test_a_controller_of_ones_own_is_stepped_as_an_fmu(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "controller", "my_law"]) == 0
    motion = "el_centro_1940_ns,stop=1"
    found = compare_controllers(
        [motion], ["my_law.py,gain=40", "Skyhook"], building=tower(tmp_path), grid=3, out="out",
        spread=Spread(2), workers=1,
    )  # fmt: skip
    own = found.table[found.table["controller"] == "my_law gain=40"].iloc[0]
    assert own["engine"] == "fmu"
    assert any("stepped as FMUs" in note for note in found.notes)
    voltage = found.frames[found.motions[0], "my_law gain=40"]["controller.voltage"]
    assert 0.0 < voltage.max() <= 8.0
    worst = found.worst_value(found.motions[0], "my_law gain=40")
    assert worst >= own[found.setting.judged.name]
    fmu = next((tmp_path / "out" / "files").glob("*.fmu"))
    again = compare_controllers(
        [motion], f"{fmu},gain=40,label=again", building=tower(tmp_path), grid=3, workers=1
    )
    name = found.setting.judged.name
    assert again.value(again.motions[0], "again", name) == own[name]


@pytest.mark.slow  # an own FMU in every case: whose building counts
def test_an_fmu_with_a_design_keeps_the_building_for_all(tmp_path: Path) -> None:
    fmu = build(plan("LqgClipped", name="MyLqg"), tmp_path)
    found = compare_controllers(
        ["el_centro_1940_ns,stop=1"], [str(fmu), "Skyhook"], grid=3, spread=Spread(2), workers=1,
        out=tmp_path / "out",
    )  # fmt: skip
    assert any(note.startswith("MyLqg: the design belongs to the building") for note in found.notes)
    assert found.setting.varied.startswith("damper parameters within 10 %")
    for file in (tmp_path / "out" / "ensembles").rglob("*.toml"):
        assert "structure.building" not in file.read_text()
    assert found.worst is not None
    assert (found.worst["failed"] == 0).all()


def test_the_command_prints_tables_and_verdict(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["controllers", "--motions", MOTION, "--controller", "Skyhook", "--grid", "3"]
    assert main([*words, "--quiet"]) == 0
    printed = capsys.readouterr().out
    assert "Skyhook has the lowest peak acceleration of floor2 under weak" in printed
    assert (tmp_path / "results" / "comparison" / "building" / "report.html").is_file()
    assert main([*words, "--json", "--no-figure"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [case["controller"] for case in answer["cases"]] == [OFF, ON, BEST, "Skyhook"]
    assert answer["worst"] is None


def test_a_damper_in_a_storey_of_a_fixed_building(tmp_path: Path) -> None:
    file = tmp_path / "fixed.toml"
    file.write_text(
        'schema = 1\nmasses = [2.0, 2.0]\nstiffnesses = [900.0, 800.0]\nbase = "fixed"\n'
        'damping_ratio = 0.02\n[[devices]]\nname = "brace"\nat = "storey2"\n'
        '[[devices]]\nname = "idle"\nat = "storey1"\n'
    )
    found = compare_controllers(
        [MOTION], "LqgClipped", building=file, device="brace", grid=3, workers=1, statistic="rms"
    )
    assert "No damper acts at idle: its force is 0." in found.notes
    travel = "peak structure.brace_displacement"
    assert found.value("weak", ON, travel) < 0.5 * found.value("weak", OFF, travel)
    assert found.setting.judged.name == "rms structure.floor2_acceleration_absolute"


@pytest.mark.slow  # the limit is computed for each motion
def test_the_limit_is_below_every_controller_and_is_kept() -> None:
    given = {"grid": 5, "limit": True, "workers": 1}
    motion = "el_centro_1940_ns,peak=0.4g,factor=0.45,stop=3"
    found = compare_controllers([motion], ["ClippedOptimal", "Lpv"], **given)  # type: ignore[arg-type]
    (name,) = found.motions
    for controller in (*found.controllers, OFF, ON, BEST):
        assert found.value(name, LIMIT) < found.value(name, controller)
    reached = found.limits[name]
    assert found.value(name, LIMIT) == pytest.approx(reached.value, rel=1e-6)
    assert reached.bound is not None
    assert reached.bound < reached.value
    again = compare_controllers([motion], "Lpv", **given)  # type: ignore[arg-type]
    assert again.limits[name].kept
    assert again.value(name, LIMIT) == found.value(name, LIMIT)


def test_the_papers_case_has_the_values_of_the_reference_calculation() -> None:
    """Peaks of El Centro 0.6 g as the headings of the stock scenarios have them."""
    found = compare_controllers(
        ["el_centro,peak=0.6g,factor=0.45,stop=20"], ["HinfInverse", "Lpv"], grid=9, workers=1
    )
    (motion,) = found.motions
    assert found.value(motion, "HinfInverse") == pytest.approx(6.958, rel=2e-3)
    assert found.value(motion, "Lpv") == pytest.approx(6.353, rel=2e-3)
    assert found.value(motion, "Lpv", "peak structure.base_displacement") == pytest.approx(
        13.6e-3, rel=5e-3
    )
    table = [11.1, 9.57, 8.34, 7.17, 6.10, 5.99, 6.05, 6.21, 6.35]
    levels = found.levels[motion][f"peak {found.setting.site.top}"]
    assert levels.tolist() == pytest.approx(table, rel=3e-3)
    best = found.table[found.table["controller"] == BEST]["level"]
    assert best.tolist() == [5.0]
