"""Scenarios as web pages: the numbers that sliders move, the module, the loader and the page."""

from __future__ import annotations

import importlib.util
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bristle.cli import main
from bristle.engine.coupled import Coupled
from bristle.errors import BuildError, ScenarioError
from bristle.export.web import (
    PageNumbers,
    Slider,
    body,
    chosen,
    described,
    export_component,
    export_web,
)
from bristle.fmu import catalogue
from bristle.native import zig
from bristle.system.scenario import load_scenario, stock_scenarios

PASSIVE = "el_centro_lugre_passive"
AGREE = 1e-12
"""Difference of a module's rows from the compiled engine's, over the peak."""
PEAKS = 0.03
"""The same of peaks, where a controller switches and one decision differs."""

needs_tools = pytest.mark.skipif(
    importlib.util.find_spec("ziglang") is None or shutil.which("node") is None,
    reason="needs ziglang (bristle[native]) and Node",
)


@pytest.fixture(scope="module")
def numbers() -> PageNumbers:
    return PageNumbers(PASSIVE)


def moved(numbers: PageNumbers, slider: Slider, value: float) -> bytes:
    """Return the numbers as the loader moves them."""
    data = bytearray(numbers.data)
    for at, offset, slope in slider.moved:
        data[at : at + 8] = np.float64(offset + slope * value).tobytes()
    return bytes(data)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("voltage.level", 6.5),
        ("damper.sigma_a", 700.0),
        ("ground.factor", 0.3),
        ("ground.peak", 4.0),
    ],
)
def test_a_slider_gives_the_numbers_of_the_scenario_with_that_value(
    numbers: PageNumbers, name: str, value: float
) -> None:
    slider = numbers.slider(name, 0.5 * value, 1.2 * value)
    other = PageNumbers(PASSIVE, {name: value})
    found = np.frombuffer(moved(numbers, slider, value), dtype=np.uint8)
    right = np.frombuffer(other.data, dtype=np.uint8)
    at = [one.at for one in slider.moved]
    for k in at:
        pair = [np.frombuffer(one[k : k + 8].tobytes())[0] for one in (found, right)]
        assert pair[0] == pytest.approx(pair[1], rel=1e-14)
    same = np.ones(found.size, dtype=bool)
    for k in at:
        same[k : k + 8] = False
    assert np.array_equal(found[same], right[same])


def test_a_mass_is_refused_for_the_matrices_follow_it_otherwise(numbers: PageNumbers) -> None:
    with pytest.raises(ScenarioError, match=r"structure\.attached_mass: .* in proportion"):
        numbers.slider("structure.attached_mass", 0.0, 5.0)


@pytest.mark.parametrize("name", ["damper.nosuch", "nobody.level", "damper.force", "ground.record"])
def test_what_is_no_number_of_a_component_is_refused(numbers: PageNumbers, name: str) -> None:
    with pytest.raises(ScenarioError, match="no component has a number"):
        numbers.slider(name)


def test_a_slider_without_room_is_refused(numbers: PageNumbers) -> None:
    with pytest.raises(ScenarioError, match=r"from 3 to 3 moves nothing"):
        numbers.slider("voltage.level", 3.0, 3.0)


def test_a_slider_that_does_not_hold_the_value_of_the_scenario_is_refused(
    numbers: PageNumbers,
) -> None:
    # The page begins there, and could not run any value of another slider.
    with pytest.raises(ScenarioError, match=r"voltage\.level is 4 V .* from 5 to 8"):
        chosen(numbers, {"voltage.level": (5.0, 8.0)})


def test_two_sliders_that_move_one_number_are_refused(numbers: PageNumbers) -> None:
    with pytest.raises(ScenarioError, match=r"ground\.factor and ground\.peak move the same"):
        chosen(numbers, {"ground.peak": (None, None), "ground.factor": (None, None)})


def test_by_itself_a_page_moves_what_is_set_and_the_law(numbers: PageNumbers) -> None:
    names = [slider.name for slider in chosen(numbers, None)]
    assert names[:2] == ["ground.peak", "voltage.level"]
    assert {"damper.sigma_a", "damper.sigma_2"} < set(names)


def test_a_scenario_that_is_not_there_is_refused_and_nothing_written(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="there is no scenario file"):
        export_web("nosuch", tmp_path / "web")
    assert not (tmp_path / "web").exists()


def test_without_zig_the_command_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    zig.version.cache_clear()
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    try:
        code = main(["export", "half_sine_pulse", "--web", str(tmp_path / "web")])
    finally:
        zig.version.cache_clear()
    assert code == BuildError.exit_code
    assert "pip install 'bristle[native]'" in capsys.readouterr().err
    assert not (tmp_path / "web").exists()


@pytest.mark.parametrize("ends", ["1", "a..b", "1..2..3"])
def test_ends_that_are_no_numbers_are_refused(
    ends: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = ["export", PASSIVE, "--web", str(tmp_path), "--slider", f"voltage.level={ends}"]
    assert main(given) == ScenarioError.exit_code
    assert "NAME=LOW..HIGH is right" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("more", "text"),
    [
        (["--slider", "voltage.level", "--slider", "voltage.level=0..8"], "is given twice"),
        (["--native", "--fmi", "3"], "--native and --fmi are for an FMU"),
        (["--platform", "win64"], "--platform is for an FMU"),
    ],
)
def test_what_would_do_nothing_is_refused(
    more: list[str], text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", PASSIVE, "--web", str(tmp_path), *more]) == ScenarioError.exit_code
    assert text in capsys.readouterr().err


def test_the_page_needs_no_other_file(numbers: PageNumbers) -> None:
    page = body(b"\0asm", described(numbers, {"voltage.level": (0.0, 8.0)}))
    script = page.partition('<script type="module">')[2]
    assert not re.search(r"^(import|export) ", script, re.MULTILINE)
    assert "http" not in page
    assert len(page) < 8e6


def run_in_node(folder: Path, changes: dict[str, float], times: int = 1) -> dict[str, Any]:
    script = Path(__file__).with_name("rows.mjs")
    order = ["node", str(script), str(folder), str(times), json.dumps(changes)]
    said = subprocess.run(order, capture_output=True, text=True, check=True)
    found: dict[str, Any] = json.loads(said.stdout)
    outputs = json.loads((folder / "scenario.json").read_text())["outputs"]
    table = np.fromfile(folder / "rows.bin").reshape(len(outputs), found["rows"])
    return found | {"columns": dict(zip([o["name"] for o in outputs], table, strict=True))}


@pytest.mark.slow  # the same for every scenario of the library
@needs_tools
@pytest.mark.parametrize("name", [file.stem for file in stock_scenarios()])
def test_rows_are_those_of_the_compiled_engine(name: str, tmp_path: Path) -> None:
    export_web(name, tmp_path)
    found = run_in_node(tmp_path, {})
    right = Coupled().run(load_scenario(name))
    assert found["complete"]
    for port, column in found["columns"].items():
        peak = np.max(np.abs(right[port]))
        same = np.abs(column - right[port]) <= AGREE * peak
        if not same.all():  # one decision of a switch differs: from there on only peaks agree
            assert abs(np.max(np.abs(column)) - peak) <= PEAKS * peak, port


@pytest.mark.slow  # zig compiles a module of a whole scenario, and a browser's engine runs it
@needs_tools
def test_so_is_how_far_a_damper_is_outside_of_its_data(tmp_path: Path) -> None:
    known = {"damper.range.speed": 0.08, "damper.range.command_high": 3.0}
    export_web("bench_sine_bingham", tmp_path, {"voltage.level": (0.0, 8.0)}, known)
    found = run_in_node(tmp_path, {})["columns"]["damper.outside"]
    right = Coupled().run(load_scenario("bench_sine_bingham", known))["damper.outside"]
    assert np.max(np.abs(found - right)) <= AGREE
    assert right.min() == pytest.approx(1.0 / 3.0)  # 4 V of 3 V


@pytest.mark.slow  # a scenario is compiled to WebAssembly
@needs_tools
def test_a_moved_slider_gives_the_run_with_that_value(tmp_path: Path) -> None:
    files = export_web(PASSIVE, tmp_path, {"voltage.level": (0.0, 8.0)})
    found = run_in_node(tmp_path, {"voltage.level": 7.0})
    right = Coupled().run(load_scenario(PASSIVE, {"voltage.level": 7.0}))
    for port, column in found["columns"].items():
        assert np.max(np.abs(column - right[port])) <= AGREE * np.max(np.abs(right[port])), port
    wasm = next(file for file in files if file.suffix == ".wasm")
    assert wasm.stat().st_size <= 150e3
    with pytest.raises(subprocess.CalledProcessError):
        run_in_node(tmp_path, {"voltage.level": 9.0})


def stepped_in_node(
    folder: Path, rows: list[dict[str, float]], parameters: dict[str, Any], output: str
) -> dict[str, Any]:
    (folder / "steps.json").write_text(json.dumps(rows))
    script = Path(__file__).with_name("steps.mjs")
    order = ["node", str(script), str(folder), json.dumps(parameters), output]
    said = subprocess.run(order, capture_output=True, text=True, check=True)
    found: dict[str, Any] = json.loads(said.stdout)
    return found


def stepped_in_python(
    name: str, rows: list[dict[str, float]], parameters: dict[str, Any], output: str
) -> list[float]:
    slave = catalogue.component_class(catalogue.source(name))(instance_name="one")
    for key, value in parameters.items():
        slave._set_any([slave._index[key]], [value], type(value))
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    time, found = 0.0, []
    for row in rows:
        inputs = {key: value for key, value in row.items() if key != "dt"}
        slave.set_real([slave._index[key] for key in inputs], list(inputs.values()))
        assert slave.do_step(time, row["dt"])
        time += row["dt"]
        found.append(slave.get_real([slave._index[output]])[0])
    return found


@pytest.mark.slow  # a component is compiled to WebAssembly
@needs_tools
def test_a_component_takes_a_long_text_after_its_parameters_were_read(tmp_path: Path) -> None:
    export_component("SignalSource", tmp_path)
    script = tmp_path / "long.mjs"
    script.write_text("""
import fs from "node:fs";
import { Component } from "./component.mjs";
const [about, module] = ["component.json", "component.wasm"].map((name) =>
  fs.readFileSync(new URL(name, import.meta.url)));
const source = await Component.load(module, JSON.parse(about));
const before = source.get("offset");
const steps = Array.from({ length: 20000 }, (_, k) => `${k}:${k % 7}`).join(" ");
source.set({ kind: "steps", steps, offset: 0.5 });
source.step(19998.5);
console.log(JSON.stringify([before, source.get("offset"), source.get("value")]));
""")
    said = subprocess.run(["node", str(script)], capture_output=True, text=True, check=True)
    assert json.loads(said.stdout) == [0.0, 0.5, 19998 % 7]


def motion(count: int) -> list[dict[str, float]]:
    t = 1e-3 * np.arange(1, count + 1)
    x, v = 0.01 * np.sin(9.0 * t), 0.09 * np.cos(9.0 * t)
    volts = 4.0 + 4.0 * np.sign(np.sin(3.0 * t))
    rows = zip(x.tolist(), v.tolist(), volts.tolist(), strict=True)
    return [{"dt": 1e-3, "displacement": a, "velocity": b, "voltage": c} for a, b, c in rows]


@pytest.mark.slow  # components are compiled to WebAssembly: their numbers
@needs_tools
@pytest.mark.parametrize(
    "parameters", [{}, {"stribeck.on": True, "coil_lag.on": True, "coil_lag.tau": 0.02}]
)
def test_a_component_steps_as_its_python_form(parameters: dict[str, Any], tmp_path: Path) -> None:
    export_component("LuGreDamper", tmp_path)
    rows = motion(2000)
    found = stepped_in_node(tmp_path, rows, parameters, "force")
    right = stepped_in_python("LuGreDamper", rows, parameters, "force")
    assert found["error"] == ""
    assert np.max(np.abs(np.subtract(found["values"], right))) <= AGREE * np.max(np.abs(right))


@pytest.mark.slow  # a component is compiled to WebAssembly: its faults
@needs_tools
@pytest.mark.parametrize(
    ("row", "parameters", "said"),
    [
        ({"dt": 0.0}, {}, "fault 2"),
        ({"dt": 1e-3, "nosuch": 1.0}, {}, "no variable is named nosuch"),
        ({"dt": 1e-3}, {"sigma_a": -5.0}, "sigma_a = -5.0 lies outside"),
    ],
)
def test_what_a_component_refuses_is_said(
    row: dict[str, float], parameters: dict[str, Any], said: str, tmp_path: Path
) -> None:
    export_component("LuGreDamper", tmp_path)
    assert said in stepped_in_node(tmp_path, [row], parameters, "force")["error"]


def test_a_component_that_plays_a_file_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", "GroundMotion", "--web", str(tmp_path / "web")]) == BuildError.exit_code
    assert "which a page cannot open" in capsys.readouterr().err
    assert not (tmp_path / "web").exists()
