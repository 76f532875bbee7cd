"""The exported FMU, alone and in its scenario, gives the force that the study's model predicts."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bristle
from bristle.cli import main
from bristle.core.progress import telling
from bristle.fmu.description import read_description
from bristle.identification.histories import DamperForces
from bristle.identification.prepare import prepare
from bristle.identification.problem import Problem
from bristle.prediction.export import export_study
from bristle.prediction.model_system import AGREEMENT, prediction
from bristle.study.study import Study
from bristle.system.scenario import load_scenario

STEP, LENGTH = 0.002, 1.5
OWN = '''
"""A spring of my own."""

from bristle.physics.effect import Effect, Parameter


class OwnSpring(Effect):
    """Own spring: a spring beside the fluid.

        F = k x

    Leaves out everything else.
    """

    name = "own_spring"
    site = "damper"
    needs = ("x",)
    passive = True
    zero_at_rest = True
    source = "Hooke (1678)"
    expect = "a force in phase with displacement alone"
    parameters = {"k": Parameter(50.0, "N/m", (0.0, 1e6), "stiffness")}

    @staticmethod
    def force(q, z, p):
        return p.k * q.x
'''


def bench_run(path: Path, phase: float) -> None:
    """Write a run of a LuGre damper with a gas spring, almost without noise."""
    t = STEP * np.arange(round(LENGTH / STEP) + 1)
    w = 2.0 * np.pi * 2.0
    x = 0.008 * np.sin(w * t + phase) + 0.002 * np.sin(2.7 * w * t)
    v = np.gradient(x, STEP, edge_order=2)
    a = np.gradient(v, STEP, edge_order=2)
    V = 3.0 + 2.0 * np.sin(3.0 * t + phase)
    force = DamperForces("lugre", ["gas_spring"]).force(x, v, a, V, STEP, {"gas_spring.k": 80.0})
    rng = np.random.default_rng(3)
    columns = [t] + [c + 1e-4 * np.std(c) * rng.standard_normal(len(t)) for c in (x, v, V, force)]
    header = "time [s],displacement [m],velocity [m/s],voltage [V],force [N]"
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="")


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Study:
    for name, phase in (("train_1", 0.3), ("holdout_1", 1.1)):
        bench_run(tmp_path / f"{name}.csv", phase)
    return Study.create(tmp_path / "rig", sorted(tmp_path.glob("*.csv")))


def chosen(study: Study, *effects: str, **values: float) -> None:
    model = study.model()
    for effect in effects:
        model = model.with_effect(effect)
    named = {name.replace("__", "."): value for name, value in values.items()}
    study.add_step("choose", "a test", model.with_values(named))


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def alone(fmu: Path, run: object, starts: dict[str, float], output: str = "force") -> np.ndarray:
    """Return the FMU's force at the run's samples by fmpy's own simulator, in a fresh process."""
    code = """
import json, sys
import numpy as np
from fmpy import simulate_fmu
job = json.load(sys.stdin)
rows = np.array(list(zip(*job["signals"].values())))
named = np.array([tuple(row) for row in rows], dtype=[(n, float) for n in job["signals"]])
found = simulate_fmu(
    job["fmu"], stop_time=job["stop"], step_size=job["step"], output_interval=job["step"],
    input=named, output=["force", "outside", "fault"], start_values=job["starts"],
)
names = ("time", "force", "outside")
print(json.dumps([*(found[name].tolist() for name in names), float(found["fault"].max())]))
"""
    time = run.dt * np.arange(len(run.x))
    job = {
        "fmu": str(fmu), "stop": float(time[-1]), "step": 5e-4, "starts": starts,
        "signals": {
            "time": time.tolist(), "displacement": run.x.tolist(), "velocity": run.v.tolist(),
            "voltage": run.V.tolist(), "acceleration": run.a.tolist(),
        },
    }  # fmt: skip
    child = subprocess.run(
        [sys.executable, "-c", code], input=json.dumps(job), capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    t, force, outside, fault = json.loads(child.stdout.splitlines()[-1])
    assert fault == 0.0
    return np.interp(time, t, force if output == "force" else outside)


@pytest.mark.slow  # an export, run in fmpy and as a scenario
def test_the_fmu_gives_the_prediction_alone_and_in_its_scenario(bench: Study) -> None:
    chosen(
        bench, "gas_spring", "coil_lag", "delay", sigma_a=700.0, v_n=0.03, gas_spring__k=75.0,
        coil_lag__tau=0.03, delay__time=0.02,
    )  # fmt: skip
    found = export_study(bench)
    assert found.run == "holdout_1"
    assert any("delay left out" in note for note in found.notes)
    run = prepare(bench.runs().holdout[0])
    expected = prediction(bench.model(), run)
    size = rms(expected)
    starts = {"coil_lag.voltage_0": float(run.V[0]), "coil_lag.field_0": float(run.V[0])}
    assert rms(alone(found.fmu, run, starts) - expected) < AGREEMENT * size
    frame = bristle.run(found.scenario)
    own = np.interp(run.dt * np.arange(len(run.x)), frame.index.to_numpy(), frame["damper.force"])
    assert rms(own - expected) < AGREEMENT * size
    # The measurement lies beside it: the truth has a softer field law, the rest is the delay.
    measured = np.interp(
        run.dt * np.arange(len(run.x)), frame.index.to_numpy(), frame["measured.value"]
    )
    np.testing.assert_allclose(measured, run.force, atol=1e-9)
    assert rms(frame["rod.velocity"].to_numpy()[:: round(run.dt / 5e-4)] - run.v) < 1e-9
    assert main(["conform", str(found.fmu)]) == 0


def test_ports_are_those_of_the_stock_damper_and_defaults_are_baked(
    bench: Study, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    chosen(bench, "gas_spring", sigma_a=700.0, gas_spring__k=75.0)
    assert main(["export", str(bench.folder), "--out", str(tmp_path / "there"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    described = read_description(Path(told["fmu"]), any_platform=True)
    with zipfile.ZipFile(told["fmu"]) as archive:
        page = archive.read("documentation/index.html").decode()
    for reach in (
        "Fitted to 1 run (data ",
        "displacement -0.0097",
        "voltage 1 to 5 V",
        "velocity -",
    ):
        assert reach in described.description
        assert reach in page
    from bristle.fmu import catalogue

    stock = catalogue.describe("LuGreDamper", ranged=True)
    for causality in ("input", "output", "parameter"):
        assert [(v.name, v.unit) for v in described.of(causality)] == [
            (v.name, v.unit)
            for v in stock.of(causality)
            if "." not in v.name or v.name.startswith(("gas_spring.", "range."))
        ]
    variables = described.variables
    assert variables["gas_spring.on"].start is True
    assert variables["gas_spring.k"].start == 75.0
    assert variables["sigma_a"].start == 700.0
    x = bench.runs().train[0]["displacement"]
    assert variables["range.displacement_low"].start == x.min()
    assert variables["range.displacement_high"].start == x.max()
    assert variables["range.command_high"].start == pytest.approx(5.0, rel=1e-3)
    assert Path(told["scenario"]).parent == tmp_path / "there"
    loaded = load_scenario(Path(told["scenario"]))
    assert loaded.step == pytest.approx(5e-4)


def test_a_dampers_own_stop_and_friction_are_in_the_fmu(bench: Study) -> None:
    chosen(
        bench, "end_stop", "base_friction", end_stop__clearance=0.006, end_stop__k=1500.0,
        base_friction__limit=0.4, base_friction__x_s=5e-4,
    )  # fmt: skip
    assert "end_stop" in (bench.folder / "model.toml").read_text()
    found = export_study(bench)
    assert found.proof is not None
    told = bristle.compare(bench.folder).total.error.rms
    assert found.proof.told.rms == pytest.approx(told, rel=1e-9)
    run = prepare(bench.runs().holdout[0])
    expected = prediction(bench.model(), run)
    plain = DamperForces("lugre", []).force(
        run.x, run.v, run.a, run.V, run.dt, bench.model().values
    )
    assert rms(expected - plain) > 0.1 * rms(plain)
    frame = bristle.run(found.scenario)
    own = np.interp(run.dt * np.arange(len(run.x)), frame.index.to_numpy(), frame["damper.force"])
    assert rms(own - expected) < AGREEMENT * rms(expected)
    # fmpy holds what was a step ago, over which a stop's force changes.
    late = rms(np.gradient(expected, run.dt)) * 5e-4
    # It begins in motion: what it held then is told beside the force that it is held against.
    starts = Problem([run]).carrying(bench.model().at("damper", bench=True), run)
    assert rms(alone(found.fmu, run, starts) - expected) < late + AGREEMENT * rms(expected)


def test_the_fmu_and_its_scenario_tell_when_a_run_leaves_the_data(
    bench: Study, caplog: pytest.LogCaptureFixture
) -> None:
    found = export_study(bench)
    run = prepare(bench.runs().holdout[0])
    assert alone(found.fmu, run, {}, "outside").max() < 0.02  # as far as training went
    frame = bristle.run(found.scenario)
    assert frame["damper.outside"].max() < 0.02
    assert not [one for one in caplog.records if "beyond the data" in one.getMessage()]
    run = replace(run, x=1.3 * run.x)
    most = max(abs(bench.runs().train[0]["displacement"]))
    over = np.maximum(np.abs(run.x) / most - 1.0, 0.0)
    own = alone(found.fmu, run, {}, "outside")
    assert own.max() == pytest.approx(over.max(), abs=0.01)
    shorter = bristle.run(found.scenario, {"damper.range.displacement_high": 0.8 * most})
    said = [one.getMessage() for one in caplog.records if "beyond the data" in one.getMessage()]
    assert len(said) == 1
    assert said[0].startswith("damper: displacement 9.97 mm, 2")
    assert shorter["damper.outside"].max() > 0.15


@pytest.mark.slow  # an own effect is compiled and exported
def test_an_effect_of_ones_own_is_in_the_fmu(bench: Study) -> None:
    (bench.effects_folder / "own_spring.py").write_text(OWN, encoding="utf-8")
    study = Study(bench.folder)
    assert study.usable_effects() == []
    chosen(study, "own_spring", own_spring__k=120.0)
    found = export_study(study)
    run = prepare(study.runs().holdout[0])
    expected = prediction(study.model(), run)
    plain = DamperForces("lugre", []).force(
        run.x, run.v, run.a, run.V, run.dt, study.model().values
    )
    np.testing.assert_allclose(expected - plain, 120.0 * run.x, atol=1e-9)
    shutil.rmtree(study.folder / "effects")  # the FMU carries the effect itself
    assert rms(alone(found.fmu, run, {}) - expected) < AGREEMENT * rms(expected)


def test_on_a_building_the_fluids_mass_is_attached(tmp_path: Path) -> None:
    t = 0.005 * np.arange(400)
    ground = 2.0 * np.sin(13.0 * t) * np.minimum(1.0, t)
    x = 0.004 * np.sin(13.0 * t)
    columns = [t, ground, x, 0.052 * np.cos(13.0 * t), 3.0 + 0.0 * t, 5.0 * np.cos(13.0 * t)]
    header = (
        "time [s],ground_acceleration [m/s2],base_displacement [m],base_velocity [m/s],"
        "voltage [V],force [N]"
    )
    for name in ("train_1", "holdout_1"):
        np.savetxt(
            tmp_path / f"{name}.csv", np.column_stack(columns) * (1 + 0.1 * (name < "i")),
            delimiter=",", header=header, comments="",
        )  # fmt: skip
    building = tmp_path / "my_building.toml"
    building.write_text(
        'schema = 1\nname = "b"\nmasses = [2.0, 1.2, 1.2]\n'
        'stiffnesses = [1000.0, 1400.0, 1400.0]\nbase = "isolated"\ndamping_ratio = 0.01\n'
    )
    study = Study.create(
        tmp_path / "rig", sorted(tmp_path.glob("*.csv")), rig="structure", building=building
    )
    chosen(
        study, "fluid_inertia", "duffing", "end_stop", "end_stop@damper", fluid_inertia__m_f=0.4,
        duffing__k_3=2e6, end_stop__clearance=0.04, **{"end_stop@damper__clearance": 0.03},
    )  # fmt: skip
    found = export_study(study)
    assert any("attached_mass" in note for note in found.notes)
    parts = {part.name: part for part in load_scenario(found.scenario).components.values()}
    assert parts["structure"].values["attached_mass"] == 0.4
    assert parts["structure"].values["duffing.k_3"] == 2e6
    assert parts["structure"].values["end_stop.clearance"] == 0.04
    assert parts["damper"].values["fluid_inertia.m_f"] == 0.0
    inside = read_description(found.fmu, any_platform=True).variables
    assert inside["end_stop.on"].start is True
    assert inside["end_stop.clearance"].start == 0.03
    assert "duffing.on" not in inside
    frame = bristle.run(found.scenario)
    assert np.isfinite(frame["damper.force"]).all()
    assert frame["structure.base_displacement"].abs().max() > 1e-4


def test_what_cannot_be_exported_is_said(
    bench: Study, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("in the way")
    assert main(["export", str(bench.folder), "--out", str(tmp_path / "file" / "there")]) == 2
    assert "cannot be written" in capsys.readouterr().err
    assert main(["export", str(tmp_path / "nowhere")]) == 2
    assert "no study" in capsys.readouterr().err


def test_a_bad_effect_of_ones_own_is_left_out_with_a_note(
    bench: Study, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from bristle.diagnosis import Diagnosis
    from bristle.study import steps as learning

    (bench.effects_folder / "own_spring.py").write_text(OWN.replace("p.k * q.x", "p.k / q.x"))
    said: list[str] = []
    nothing = Diagnosis("none", (), ("Nothing is missing.",))
    monkeypatch.setattr(learning, "diagnose_rig", lambda *given, **more: nothing)
    study = Study(bench.folder)
    with telling(said.append):
        assert learning.diagnose_study(study, law=study.model().law, write=False) == nothing
    (why,) = (one for one in said if one.startswith("left out: "))
    assert "own_spring.py, line" in why
    assert "ZeroDivisionError" in why
    # A model that names it says the same, with its line.
    text = (bench.folder / "model.toml").read_text() + "\n[effects.own_spring]\nparameters = {}\n"
    (bench.folder / "model.toml").write_text(text)
    assert main(["export", str(bench.folder)]) == 2
    assert "ZeroDivisionError" in capsys.readouterr().err


def test_the_bench_scenario_plays_a_run_with_a_command_to_its_end_without_notes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, phase in (("train_1", 0.3), ("holdout_1", 1.1), ("holdout_2", 2.0)):
        bench_run(tmp_path / f"{name}.csv", phase)
    idle = np.loadtxt(tmp_path / "holdout_1.csv", delimiter=",", skiprows=1)
    header = (tmp_path / "holdout_1.csv").read_text().partition("\n")[0]
    idle[:, 3] = 0.0
    np.savetxt(tmp_path / "holdout_1.csv", idle, delimiter=",", header=header, comments="")
    study = Study.create(tmp_path / "rig", sorted(tmp_path.glob("*.csv")))
    found = export_study(study)
    assert found.run == "holdout_2"
    assert found.notes[0].startswith("Warning: nothing was fitted")
    assert main(["check", str(found.scenario)]) == 0
    told = capsys.readouterr()
    assert "has no unit" not in told.out + told.err
    measured = bristle.run(found.scenario)["measured.value"].to_numpy()
    assert measured[-1] == pytest.approx(study.runs().holdout[1]["force"][-1], rel=1e-6)


def test_the_damper_takes_the_commands_and_strokes_of_all_runs(tmp_path: Path) -> None:
    for name, phase in (("train_1", 0.3), ("holdout_1", 1.1)):
        bench_run(tmp_path / f"{name}.csv", phase)
    far = np.loadtxt(tmp_path / "train_1.csv", delimiter=",", skiprows=1)
    header = (tmp_path / "train_1.csv").read_text().partition("\n")[0]
    far[:, 1:4] *= [4.0, 4.0, 3.0]
    np.savetxt(tmp_path / "train_1.csv", far, delimiter=",", header=header, comments="")
    found = export_study(Study.create(tmp_path / "rig", sorted(tmp_path.glob("*.csv"))))
    variables = read_description(found.fmu).variables
    assert found.run == "holdout_1"  # whose command stays below the default of 8 V
    assert variables["v_max"].start == np.ceil(1.05 * far[:, 3].max())
    assert variables["stroke"].start == pytest.approx(1.05 * np.abs(far[:, 1]).max(), rel=0.01)
