"""A whole scenario as one FMU gives the rows of the coupled engine, in every host and every way."""

from __future__ import annotations

import math
import shutil
import subprocess
from ctypes import c_void_p
from functools import partial
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from both_forms import needs_zig
from composites import Composite, built, compared

from benchmarks import _hosts
from bristle.cli import main
from bristle.conformance import conform
from bristle.engine.coupled import Coupled
from bristle.engine.run import run
from bristle.export.composite import export_composite
from bristle.fmu.archive import library_member
from bristle.native.build import build
from bristle.native.zig import here
from bristle.system.scenario import load_scenario, stock_scenarios

pytestmark = [needs_zig, pytest.mark.slow]  # the functions take minutes to compile

EQUAL = 1e-12
"""Largest difference from the coupled engine as a share of an output's peak."""
HALF_SINE, PASSIVE, SENSORS = (
    "half_sine_pulse",
    "el_centro_lugre_passive",
    "el_centro_0p6g_lpv_sensors",
)
COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
VALGRIND = shutil.which("valgrind")


@pytest.mark.parametrize("scenario", stock_scenarios(), ids=lambda path: path.stem)
def test_rows_are_those_of_the_coupled_engine(scenario: Path) -> None:
    assert compared(scenario) <= EQUAL


def test_so_are_those_of_a_trained_policy() -> None:
    given = {"controller.fmu": "TrainedPolicy", "damper.fmu": "LuGreDamper"}
    assert compared("el_centro_0p6g_clipped", given, stop=5.0) <= EQUAL


def test_so_are_those_of_a_damper_that_knows_the_range_of_its_data() -> None:
    known = {"damper.range.speed": 0.08, "damper.range.displacement_low": -0.005}
    assert "damper.outside" in Coupled().run(load_scenario("half_sine_pulse", known)).values
    assert compared("half_sine_pulse", known, stop=1.0) <= EQUAL


def test_so_are_those_of_a_law_of_ones_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "law", "my_law"]) == 0
    text = load_scenario(PASSIVE).file.read_text(encoding="utf-8")
    scenario = tmp_path / "mine.toml"
    scenario.write_text(text.replace('fmu = "LuGreDamper"', 'law = "my_law.py"'), encoding="utf-8")
    assert "my_law.py" in scenario.read_text(encoding="utf-8")
    assert compared(scenario, stop=5.0) <= EQUAL


def test_so_are_they_in_fmpy() -> None:
    path = built(PASSIVE)
    description = fmpy.read_model_description(str(path))
    names = [v.name for v in description.modelVariables if v.causality == "output"]
    experiment = description.defaultExperiment
    assert (float(experiment.stopTime), float(experiment.stepSize)) == (35.0, 0.002)
    table = fmpy.simulate_fmu(str(path), output=names, output_interval=0.002)
    right = Coupled().run(load_scenario(PASSIVE))
    assert len(table) == len(right["time"])
    for name in {*names} - {"fault"}:  # that of the whole has no column in a run
        peak = float(np.max(np.abs(right[name]))) or 1.0
        assert float(np.max(np.abs(table[name] - right[name]))) / peak <= EQUAL, name


@pytest.mark.skipif(COMPILER is None, reason="no C compiler on the path, so no host in C")
def test_a_host_in_c_without_python_runs_it(tmp_path: Path) -> None:
    one = Composite(built(SENSORS))
    program = _hosts.compiled(Path(__file__).parents[1] / "fmu" / "host.c", tmp_path)
    assert program is not None
    copy = shutil.copytree(one.form.folder, tmp_path / "copy")
    places = [
        text
        for where in (one.form.folder, copy)
        for text in (
            str(where / library_member(one.form.about.identifier)),
            (where / "resources").as_uri(),
        )
    ]
    extra = one.variables["structure.extra_force"].reference
    outputs = ",".join(str(v.reference) for v in one.reals)
    command = [str(program), "-", one.form.about.guid, *places, f"{extra}:0.0:0.0", outputs]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300.0, env={})
    assert (done.returncode, done.stderr) == (0, "")
    said = [float(line) for line in done.stdout.split()]
    assert np.isfinite(said).all()
    if VALGRIND is not None:
        leaks = ["--leak-check=full", "--errors-for-leak-kinds=definite,indirect,possible"]
        check = [VALGRIND, "-q", *leaks, "--error-exitcode=9", *command]
        done = subprocess.run(check, capture_output=True, text=True, timeout=900.0, env={})
        assert (done.returncode, done.stderr) == (0, "")


def test_it_conforms() -> None:
    report = conform(built(SENSORS), timeout=120.0)
    assert report.conforms, [row for row in report.rows if row.verdict == "fail"]


def test_fmi_3_gives_the_same_rows(tmp_path: Path) -> None:
    path = export_composite(HALF_SINE, tmp_path, partial(build, platforms=[here()], fmi=3))
    right = Coupled().run(load_scenario(HALF_SINE, {"run.stop": 0.5}))
    table = fmpy.simulate_fmu(
        str(path), output=["damper.force"], stop_time=0.5, output_interval=0.002
    )
    assert np.max(np.abs(table["damper.force"] - right["damper.force"])) <= 1e-12


# -- the life of an instance


def test_a_reset_begins_anew_and_instances_are_apart() -> None:
    path = built(SENSORS)
    one, other = Composite(path).begin(), Composite(path)
    other.set("damper.sigma_a", 900.0)
    other.begin()
    first = one.rows(200, 0.0005)
    differs = other.rows(200, 0.0005)
    assert np.abs(first - differs).max() > 0.0
    assert one.one.reset() == 0
    assert np.array_equal(one.begin().rows(200, 0.0005), first)
    third = Composite(path).begin()
    assert np.array_equal(third.rows(200, 0.0005), first)


def test_a_state_is_saved_restored_and_taken_by_another_instance() -> None:
    path = built(SENSORS)
    one = Composite(path).begin()
    one.rows(150, 0.0005)
    state, taken = c_void_p(), c_void_p()
    assert one.one.save(state) == 0
    status, data = one.one.serialise(state)
    assert status == 0
    right = one.rows(150, 0.0005, time=0.075)
    assert one.one.restore(state) == 0
    assert np.array_equal(one.rows(150, 0.0005, time=0.075), right)
    other = Composite(path).begin()
    assert other.one.deserialise(data, taken) == 0
    assert other.one.restore(taken) == 0
    assert np.array_equal(other.rows(150, 0.0005, time=0.075), right)


def test_a_parameter_has_the_effect_that_it_has_in_the_scenario() -> None:
    values: dict[str, Any] = {
        "damper.sigma_a": 800.0, "structure.attached_mass": 0.7, "ground.amplitude": 1.5,
        "structure.duffing.on": True, "damper.gas_spring.on": True,
    }  # fmt: skip
    one = Composite(built(HALF_SINE))
    for name, value in values.items():
        assert one.set(name, value) == 0
    right = Coupled().run(load_scenario(HALF_SINE, {**values, "run.stop": 1.0}))
    assert one.difference(one.begin().rows(500, 0.002), right) <= EQUAL
    seen = {"sensors.seed": 3, "sensors.base_velocity.delay": 0.0031}
    one = Composite(built(SENSORS))
    for name, value in seen.items():
        assert one.set(name, value) == 0
    right = Coupled().run(load_scenario(SENSORS, {**seen, "run.stop": 1.0}))
    assert one.difference(one.begin().rows(2000, 0.0005), right) <= EQUAL


def test_a_record_of_ones_own_is_played_and_comes_along(tmp_path: Path) -> None:
    rows = "".join(f"{0.02 * k!r},{math.sin(0.3 * k)!r}\n" for k in range(60))
    quake = tmp_path / "quake.csv"
    quake.write_text("time [s],acceleration [m/s2]\n" + rows)
    right = Coupled().run(load_scenario(PASSIVE, {"ground.record": str(quake), "run.stop": 1.0}))
    one = Composite(built(PASSIVE))  # read when the run begins
    assert one.set("ground.record", str(quake)) == 0
    assert one.difference(one.begin().rows(500, 0.002), right) <= EQUAL
    path = export_composite(
        PASSIVE, tmp_path / "out", partial(build, platforms=[here()]),
        {"ground.record": str(quake)},
    )  # fmt: skip
    quake.unlink()
    other = Composite(path)
    assert other.difference(other.begin().rows(500, 0.002), right) <= EQUAL


# -- steps of any length


def test_any_step_comes_to_the_same_motion() -> None:
    right = Coupled().run(load_scenario(PASSIVE, {"run.stop": 4.0}))
    one = Composite(built(PASSIVE)).begin()
    time, found = 0.0, [one.shown()]
    draw = np.random.default_rng(1)
    while time < 4.0 - 1e-9:
        dt = float(draw.choice([0.002, 0.001, 0.0005, 0.004, 0.0037]))
        dt = min(dt, 4.0 - time)
        assert one.one.step(time, dt) == 0
        time += dt
    found.append(one.shown())
    for j, variable in enumerate(one.reals):
        peak = float(np.max(np.abs(right[variable.name]))) or 1.0
        tolerance = 2e-3 if variable.name != "structure.holding_force" else 5e-3
        assert abs(found[-1][j] - right[variable.name][-1]) <= tolerance * peak, variable.name


def test_clocks_keep_their_instants_whatever_the_step() -> None:
    right = Coupled().run(load_scenario(SENSORS, {"run.stop": 1.0}))
    for step in (0.002, 0.001):
        one = Composite(built(SENSORS)).begin()
        rows = one.rows(round(1.0 / step), step)
        every = round(step / 0.0005)
        columns = {name: column[::every] for name, column in right.values.items()}
        assert one.difference(rows, columns) <= 2e-2
    one = Composite(built(SENSORS)).begin()  # steps that end on no instant
    rows = one.rows(1428, 0.0007)
    names = [v.name for v in one.reals]
    shown = rows[:, names.index("controller.voltage")]
    assert 300 <= np.count_nonzero(np.diff(shown)) <= 500  # a sample each 2 ms, not each step


def test_a_run_may_begin_at_any_time() -> None:
    right = Coupled().run(load_scenario(SENSORS, {"ground.start": 5.0 - 2.0, "run.stop": 6.0}))
    one = Composite(built(SENSORS))
    one.set("ground.start", 3.0)
    one.begin(time=3.0)  # until then nothing moves
    rows = one.rows(2000, 0.0005, time=3.0)
    later = {name: column[6000:8001] for name, column in right.values.items()}
    j = [v.name for v in one.reals].index("structure.base_displacement")
    peak = np.abs(later["structure.base_displacement"]).max()
    assert np.abs(rows[:, j] - later["structure.base_displacement"]).max() <= 1e-2 * peak


def test_a_step_beyond_all_measure_is_refused() -> None:
    one = Composite(built(HALF_SINE)).begin()
    assert one.one.step(0.0, 1e6) == 3
    assert "a step of 1e+06 s holds too many substeps" in one.said()[-1]


# -- inputs


def test_a_ground_motion_from_outside_is_that_of_the_source() -> None:
    right = Coupled().run(load_scenario(PASSIVE, {"run.stop": 5.0}))
    name = "structure.ground_acceleration"
    motion = right["ground.ground_acceleration"]
    one = Composite(built(PASSIVE, [name])).begin()
    given = lambda t, dt: {name: motion[round((t + dt) / dt)]}  # noqa: E731
    rows = one.rows(2500, 0.002, given=given)
    assert one.difference(rows, right) <= 1e-9  # the samples of the record lie on steps


def test_the_intensity_and_the_voltage_from_outside_are_those_of_the_sources() -> None:
    one = Composite(built(PASSIVE, ["ground.factor", "voltage.level"]))
    one.set("ground.factor", 0.6)
    one.set("voltage.level", 6.0)
    set_so = {"ground.factor": 0.6, "voltage.level": 6.0, "run.stop": 2.0}
    right = Coupled().run(load_scenario(PASSIVE, set_so))
    assert one.difference(one.begin().rows(1000, 0.002), right) <= EQUAL
    assert one.set("voltage.level", 2.0) == 0
    after = one.rows(50, 0.002, time=2.0)
    j = [v.name for v in one.reals].index("voltage.voltage")
    assert set(after[:, j]) == {2.0}


def test_a_command_from_outside_is_that_of_a_source() -> None:
    right = Coupled().run(load_scenario(PASSIVE, {"voltage.level": 6.0, "run.stop": 2.0}))
    one = Composite(built(PASSIVE, ["damper.voltage"]))
    one.set("damper.voltage", 6.0)
    rows = one.begin().rows(1000, 0.002)
    del right["voltage.voltage"]
    columns = {
        **right,
        "voltage.voltage": rows[:, [v.name for v in one.reals].index("voltage.voltage")],
    }
    assert one.difference(rows, columns) <= EQUAL


def test_outputs_follow_inputs_at_once_and_the_motion_does_not() -> None:
    one = Composite(built(PASSIVE, ["damper.voltage"])).begin()
    one.set("damper.voltage", 2.0)
    one.rows(1500, 0.002)
    before = {name: one.get(name) for name in ("damper.force", "structure.base_displacement")}
    acceleration = one.get("structure.base_acceleration_absolute")
    assert one.set("damper.voltage", 8.0) == 0
    assert one.get("structure.base_displacement") == before["structure.base_displacement"]
    assert one.get("damper.force") != before["damper.force"]
    assert one.set("damper.voltage", 2.0) == 0
    assert one.get("damper.force") == before["damper.force"]
    assert one.set("structure.extra_force", 1.0) == 0
    mass = 1.96935633694460  # kg, of the base
    moved = one.get("structure.base_acceleration_absolute") - acceleration
    assert moved == pytest.approx(-1.0 / mass, rel=1e-9)


# -- what is wrong


def test_an_input_that_is_no_number_is_the_fault_of_its_part() -> None:
    one = Composite(built(PASSIVE, ["structure.ground_acceleration"])).begin()
    one.rows(3, 0.002)
    one.set("structure.ground_acceleration", float("nan"))
    assert one.one.step(0.006, 0.002) == 3
    said = "fault 1, an input is not finite: structure.ground_acceleration = nan."
    assert said in one.said()[-1]
    faults = {name: one.get(name) for name in ("fault", "structure.fault", "damper.fault")}
    assert faults == {"fault": 1, "structure.fault": 1, "damper.fault": 0}
    assert np.isfinite(one.shown()).all()
    assert one.one.reset() == 0
    assert one.begin().get("structure.fault") == 0
    assert one.one.step(0.0, 0.002) == 0


@pytest.mark.parametrize(
    ("name", "value", "part", "words"),
    [
        ("ground.peak", -1.0, "ground", "ground.peak = -1.0 lies outside [0.0, 10000.0]."),
        ("ground.record", "nosuch.csv", "ground", "ground: nosuch.csv: there is no such file."),
    ],
)
def test_a_parameter_that_is_wrong_is_the_fault_of_its_part(
    name: str, value: Any, part: str, words: str
) -> None:
    one = Composite(built(PASSIVE))
    one.set(name, value)
    one.begin()
    assert (one.get("fault"), one.get(f"{part}.fault"), one.get("damper.fault")) == (5, 5, 0)
    assert words in one.said()[-1]


def test_series_elements_that_exclude_each_other_are_told_with_their_part() -> None:
    one = Composite(built(PASSIVE))
    one.set("damper.backlash.on", True)
    one.set("damper.mount_compliance.on", True)
    one.begin()
    assert (one.get("fault"), one.get("damper.fault"), one.get("structure.fault")) == (5, 5, 0)
    assert "damper: backlash and mount_compliance are series elements" in one.said()[-1]


def test_a_force_that_does_not_settle_names_the_damper() -> None:
    one = Composite(built(HALF_SINE))
    one.set("damper.v_n", 1e-5)
    one.set("damper.sigma_2", 1e7)
    one.begin()
    statuses = [one.one.step(0.002 * k, 0.002) for k in range(500)]
    assert statuses[-1] == 3
    assert "damper: force and motion do not agree." in one.said()[-1]
    assert (one.get("fault"), one.get("damper.fault"), one.get("ground.fault")) == (4, 4, 0)


def test_a_blow_up_names_the_part_and_holds_the_last_finite_outputs(tmp_path: Path) -> None:
    file = tmp_path / "ground.csv"
    file.write_text("time [s],acceleration [m/s2]\n0,0\n0.1,1\n0.2,1e300\n0.3,1e300\n")
    one = Composite(built(HALF_SINE))
    one.set("ground.kind", "csv")
    one.set("ground.file", str(file))
    one.begin()
    statuses = [one.one.step(0.002 * k, 0.002) for k in range(60)]
    assert statuses.count(0) == 50  # as the coupled engine, which stops at 0.102 s
    assert "not finite: damper.dissipated_energy" in one.said()[-1]
    assert one.get("damper.fault") == 4
    assert np.isfinite(one.shown()).all()


# -- as a component of another scenario


def test_it_is_a_component_of_another_scenario(tmp_path: Path) -> None:
    shutil.copy(built(PASSIVE, ["structure.ground_acceleration"]), tmp_path / "el_centro.fmu")
    file = tmp_path / "around.toml"
    file.write_text(
        'schema = 1\ntitle = "around"\n[run]\nstop = 2.0\nstep = 0.002\n'
        '[components.quake]\nfmu = "GroundMotion"\nparameters = { peak = 5.886, factor = 0.45 }\n'
        '[components.whole]\nfmu = "el_centro.fmu"\nparameters = { "damper.sigma_a" = 700.0 }\n'
        '[connections]\n"whole.structure.ground_acceleration" = "quake.ground_acceleration"\n'
    )
    frame = run(file)
    right = Coupled().run(load_scenario(PASSIVE, {"damper.sigma_a": 700.0, "run.stop": 2.0}))
    for name in ("structure.base_displacement", "damper.force"):
        peak = np.abs(right[name]).max()
        assert np.abs(frame[f"whole.{name}"].to_numpy() - right[name]).max() <= 1e-9 * peak
    assert frame.attrs["units"]["whole.damper.force"] == "N"


def test_the_command_writes_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    order = ["export", HALF_SINE, "--native", "--as-one", "--platform", here().name]
    assert main([*order, "--out", str(tmp_path), "--set", "voltage.level=2"]) == 0
    said = capsys.readouterr().out
    (path,) = tmp_path.glob("*.fmu")
    assert said.startswith(f"{path}: built, guid ")
    assert "structure.extra_force [N]" in said
    one = Composite(path).begin()
    right = Coupled().run(load_scenario(HALF_SINE, {"voltage.level": 2.0, "run.stop": 0.2}))
    assert one.difference(one.rows(100, 0.002), right) <= EQUAL


HOUSE = """schema = 1
title = "a house"
[run]
stop = 0.5
step = 0.002
[components.ground]
fmu = "SignalSource"
parameters = {{ kind = "half_sine", amplitude = 2.0, duration = 0.2 }}
[components.damper]
{damper}
[components.structure]
fmu = "Structure"
[connections]
"structure.ground_acceleration" = "ground.value"
"structure.damper_force" = "damper.force"
"damper.displacement" = "structure.base_displacement"
"damper.velocity" = "structure.base_velocity"
"""
OWN = """fmu = "LuGreDamper"
effects = ["my_effect.py"]
parameters = { "my_effect.on" = true, "my_effect.f_s" = 1.5, voltage = 3.0 }
"""


def test_a_chosen_form_of_the_command_is_in_it(tmp_path: Path) -> None:
    file = tmp_path / "bent.toml"
    bent = 'law = "lugre"\ncommand = "quadratic"\nparameters = { voltage = 3.0 }'
    file.write_text(HOUSE.format(damper=bent))
    assert compared(file) <= EQUAL


def test_effects_of_a_users_own_are_in_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "effect", "my_effect"]) == 0
    (tmp_path / "effect.toml").write_text(HOUSE.format(damper=OWN))
    assert compared(tmp_path / "effect.toml") <= EQUAL
