"""View 7: what a page asks for is a run of a stock scenario, by the command that it shows."""

from __future__ import annotations

import itertools
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made import write_runs
from page.served import page_on

import bristle
from bristle.data import read_ground_motion
from bristle.engine.results import spectra
from bristle.errors import BristleError, RecordError, RunError, ScenarioError
from bristle.page import control_views
from bristle.page.control_views import LONGEST, asked_for, controls, damper_of, stock_file
from bristle.study import Study, create_study
from bristle.system.overrides import parse_overrides
from bristle.system.scenario import load_scenario, stock_scenarios
from bristle.view.html import unpack

BENCH = "bench_sine_bingham"
PASSIVE = "el_centro_lugre_passive"
RECORD = "uploads/record-1/motion.csv"


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("simulated")
    create_study(folder / "rig", write_runs(folder / "lab", 3, seconds=3.0), law="bingham")
    file = folder / RECORD
    file.parent.mkdir(parents=True)
    time = np.arange(0.0, 41.4, 0.02)
    columns = np.column_stack([time, 0.3 * np.sin(6.0 * time)])
    np.savetxt(file, columns, delimiter=",", header="time [s],acceleration [g]", comments="")
    (folder / "uploads" / "record-1" / "words.csv").write_text("a,b\nx,y\n")
    return folder


def overrides_of(command: str) -> dict[str, Any]:
    words = shlex.split(command)
    return parse_overrides([b for a, b in itertools.pairwise(words) if a == "--set"])


def test_a_slider_gives_what_the_run_gives(home: Path) -> None:
    values = {"voltage.level": 5.0}
    shown = control_views.simulate_view(home, {"scenario": BENCH, "values": values, "about": True})
    frame = bristle.run(BENCH, values, engine="compiled")
    for one in shown["outputs"]:
        assert one["peak"] == pytest.approx(float(frame[one["name"]].abs().max()), rel=1e-12)
    assert shown["command"] == f"bristle run {BENCH} --engine compiled --set voltage.level=5"
    assert any(slider["name"] == "voltage.level" for slider in shown["sliders"])
    assert all(one["low"] < one["high"] for one in shown["sliders"])


def test_the_damper_of_a_study_takes_the_place_of_the_scenarios(home: Path) -> None:
    study = Study(home / "rig")
    assert "rig" in control_views.scenarios_view(home, {})["studies"]
    given = damper_of(home, BENCH, "rig")
    assert given["damper.fmu"] == "BinghamDamper"
    assert given["damper.f_c"] == study.model().values["f_c"]
    shown = control_views.simulate_view(home, {"scenario": BENCH, "study": "rig"})
    assert "--set damper.fmu=BinghamDamper" in shown["command"]


def test_every_control_is_a_scenario_with_the_same_ground_building_and_damper() -> None:
    own = load_scenario(PASSIVE)
    known = controls(PASSIVE)
    assert {"ConstantVoltage", "ClippedOptimal", "HinfInverse", "Lpv", "Skyhook"} <= set(known)
    for control, (name, overrides) in known.items():
        other = load_scenario(name, overrides)
        assert control in {one.kind for one in other.components.values()}
        for part in ("ground", "structure", "damper"):
            mine, its = own.components[part], other.components[part]
            assert (mine.kind, mine.values) == (its.kind, its.values), control
        assert own.stop == other.stop


def test_another_intensity_goes_with_the_control() -> None:
    name = "el_centro_0p2g_constant_voltage"
    scenario, overrides = controls(name)["Lpv"]
    peak = load_scenario(name).components["ground"].values["peak"]
    assert load_scenario(scenario, overrides).components["ground"].values["peak"] == peak


@pytest.mark.parametrize("name", [file.stem for file in stock_scenarios()])
def test_controls_of_every_scenario_can_be_loaded(name: str) -> None:
    for scenario, overrides in controls(name).values():
        load_scenario(stock_file(scenario), overrides)


def test_a_dropped_record_is_the_ground_motion_of_the_run(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert RECORD in control_views.scenarios_view(home, {})["records"]
    asked = asked_for(home, {"scenario": PASSIVE, "record": RECORD})
    loaded = asked.load()
    assert Path(str(loaded.components["ground"].values["record"])) == home / RECORD
    assert loaded.stop == 42.0  # to the end of the motion
    monkeypatch.chdir(home)  # the command is for the folder of the studies
    again = load_scenario(PASSIVE, overrides_of(asked.run()))
    assert again.components["ground"].values == loaded.components["ground"].values
    assert again.stop == loaded.stop
    motion = read_ground_motion(RECORD, home)
    assert motion.peak == pytest.approx(0.3 * 9.80665, rel=1e-3)


def test_a_long_record_does_not_stretch_the_run_without_end(home: Path) -> None:
    file = home / "uploads" / "record-1" / "long.csv"
    rows = "".join(f"{k},{k % 2}\n" for k in range(round(2 * LONGEST)))
    file.write_text(f"time [s],acceleration [m/s2]\n{rows}")
    asked = asked_for(home, {"scenario": PASSIVE, "record": "uploads/record-1/long.csv"})
    assert asked.overrides["run.stop"] == LONGEST


def test_the_spectrum_is_that_of_the_rows_of_the_run(home: Path) -> None:
    wanted = {"scenario": "half_sine_pulse", "values": {}}
    shown = control_views.spectrum_view(home, wanted)
    frame = bristle.run("half_sine_pulse", engine="compiled")
    columns = {str(name): frame[name].to_numpy() for name in frame}
    right = spectra(columns, float(frame.index[1]))
    assert set(shown["of"]) == set(right) - {"period"}
    for name, values in shown["of"].items():
        assert values == pytest.approx(right[name], rel=1e-9)
    assert shown["command"] == "bristle run half_sine_pulse --engine compiled --spectrum"
    with pytest.raises(RunError, match="no output is an acceleration"):
        control_views.spectrum_view(home, {"scenario": BENCH})


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"scenario": "gone"}, "gone"),
        ({"scenario": "../x"}, "no stock scenario"),
        ({"scenario": BENCH, "values": {"damper.gone": 1.0}}, "gone"),
        ({"scenario": BENCH, "values": []}, "NAME to number"),
        ({"scenario": PASSIVE, "control": "Lpx"}, 'Did you mean "Lpv"'),
        ({"scenario": "no_damper", "control": "Lpv"}, "control"),
        ({"scenario": "no_damper", "study": "rig"}, "no damper"),
        ({"scenario": BENCH, "record": RECORD}, "no ground motion"),
        ({"scenario": PASSIVE, "record": "uploads/record-1/gone.csv"}, "drop it again"),
        ({"scenario": PASSIVE, "record": "../../etc/passwd"}, "no ground motion|dropped file"),
        ({"scenario": PASSIVE, "record": "uploads/../x.csv"}, "batch"),
        ({"scenario": PASSIVE, "record": "uploads/record-1/words.csv"}, "words.csv"),
    ],
)
def test_a_scenario_that_cannot_run_says_why(
    home: Path, asked: dict[str, object], words: str
) -> None:
    with pytest.raises(BristleError, match=words) as found:
        control_views.simulate_view(home, asked)
    if asked.get("record") == "uploads/record-1/words.csv":
        assert found.type is RecordError  # the readers' own words
    elif "record" not in asked:
        assert found.type is ScenarioError


@pytest.mark.slow  # a server and runs; by default its functions
def test_runs_and_spectra_are_asked_for_over_http(home: Path) -> None:
    with page_on(home, start=False) as client:
        wanted = {"scenario": "half_sine_pulse", "values": {}}
        for view, key in (("simulate", "outputs"), ("spectrum", "period")):
            found = client.post(f"/api/{view}", wanted)
            assert found.status == 200, found.body
            assert key in unpack(found.body)
        refused = client.post("/api/spectrum", {"scenario": BENCH})
        assert refused.status == 422
        assert "no output is an acceleration" in refused.error
