"""Controllers and sensors as FMUs: their clock, their state, their laws, and the closed loop."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import cos, pi, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave

from bristle.cli import main
from bristle.component import control_laws
from bristle.component.clock import COMING
from bristle.component.controller_file import Controller, building_digest, read_controller
from bristle.component.sensors import reading
from bristle.engine.run import run
from bristle.errors import BuildError, DesignError
from bristle.fmu import build, catalogue
from bristle.fmu.archive import extract
from bristle.fmu.build import PACKAGE
from bristle.fmu.controller import MEASURED
from bristle.fmu.description import read_description
from bristle.fmu.slave import Slave
from bristle.physics.building import paper_building
from bristle.physics.laws import law_code
from bristle.physics.laws.lugre import LuGre
from bristle.system.scenario import load_scenario
from bristle.system.toml import scenario_text

H = 0.002
CONTROLLERS = ("ClippedOptimal", "HinfInverse", "LqgClipped", "Lpv", "Skyhook", "TrainedPolicy")
SAMPLED = (*CONTROLLERS, "Sensors")
FROZEN = Path(__file__).parents[1] / "reference" / "controllers"


def started(name: str, **parameters: Any) -> Slave:
    """Return a component as a Python object, initialised at t = 0 with inputs at zero."""
    slave = catalogue.instantiate(name)
    for key, value in parameters.items():
        slave._set_any([slave._index[key]], [value], type(slave[key]))
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    return slave


def motion(t: float) -> list[float]:
    """Return what a controller measures [m/s2, m, m/s, N]: two tones, linear in no interval."""
    t = round(t, 9)
    v = 0.08 * cos(4 * pi * t) - 0.03 * sin(23.0 * t)
    return [3.0 * sin(13.2 * t) + sin(34.0 * t), 0.006 * sin(4 * pi * t), v, 40.0 * v]


def stepped(slave: Slave, step: float, stop: float, start: float = 0.0) -> list[list[float]]:
    """Step with the inputs of each step's end; return the outputs after each step."""
    rows = []
    for k in range(round((stop - start) / step)):
        t = start + k * step
        slave.set_real(slave._inputs, motion(t + step))
        assert slave.do_step(t, step), slave.fault
        rows.append(slave.get_real(slave._outputs))
    return rows


# -- clock and state


@contextmanager
def loaded(path: Path, folder: Path) -> Iterator[tuple[FMU2Slave, Callable[..., list[int]]]]:
    """Yield an FMU, instantiated, and a function from names to value references."""
    description = read_description(path)
    extract(path, folder / "unpacked")
    fmu = FMU2Slave(
        guid=description.guid, unzipDirectory=str(folder / "unpacked"),
        modelIdentifier=description.identifier, instanceName=path.stem,
    )  # fmt: skip
    fmu.instantiate()
    try:
        yield fmu, lambda *names: [description.variables[name].reference for name in names]
    finally:
        fmu.freeInstance()
        shutil.rmtree(folder / "unpacked")


def initialise(fmu: FMU2Slave) -> None:
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()


@pytest.mark.parametrize("name", SAMPLED)
def test_reset_equals_fresh_and_the_fmu_does_as_its_object(name: str, tmp_path: Path) -> None:
    path = build.build(build.plan(name), tmp_path)
    expected = stepped(started(name), 0.0005, 0.1)
    outputs = [v.name for v in read_description(path).of("output") if v.name != "fault"]
    with loaded(path, tmp_path) as (fmu, refer):
        for _ in range(2):
            initialise(fmu)
            rows = []
            for k in range(200):
                fmu.setReal(refer(*MEASURED), motion((k + 1) * 0.0005))
                fmu.doStep(k * 0.0005, 0.0005)
                rows.append(fmu.getReal(refer(*outputs)))
            assert rows == expected
            fmu.terminate()
            fmu.reset()
    assert any(row[0] for row in expected)


@pytest.mark.parametrize("name", SAMPLED)
def test_a_state_set_back_replays_bit_by_bit(name: str) -> None:
    slave, other = started(name), started(name)
    stepped(slave, 0.0005, 0.0615)  # between two samples
    state = slave._get_fmu_state()
    after = stepped(slave, 0.0005, 0.2, 0.0615)
    for one in (slave, other):
        one._set_fmu_state(state)
        assert stepped(one, 0.0005, 0.2, 0.0615) == after


@pytest.mark.parametrize("name", SAMPLED)
def test_keeps_its_own_clock_whatever_the_step(name: str) -> None:
    fine = stepped(started(name), 0.0005, 0.2)
    own = stepped(started(name), H, 0.2)
    assert fine[3::4] == own  # the same samples
    for k in range(0, len(fine) - 4, 4):  # held in between
        assert fine[k + 4] == fine[k + 5] == fine[k + 6] == fine[k + 3]


@pytest.mark.parametrize("name", SAMPLED)
def test_a_longer_step_warns_once_and_takes_the_samples_in_between(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    slave, said = started(name), []
    monkeypatch.setattr(slave, "log", lambda text, *_: said.append(text))
    long = stepped(slave, 0.005, 0.2)
    assert len(said) == 1
    assert "longer than its sample period of 0.002 s" in said[0]
    assert slave.state[COMING] == round(0.2 / H) + 1  # that of t = 0 included
    # What is measured is taken as linear: no exact match, but the same course.
    own = np.array(stepped(started(name), H, 0.2))[4::5, 0]
    shown = np.array(long)[1::2, 0]
    if name in ("HinfInverse", "Lpv", "Sensors"):  # not the switches
        assert np.abs(shown - own).max() < 0.15 * np.abs(own).max()
    assert np.abs(shown).max() > 0.0


@pytest.mark.parametrize("name", SAMPLED)
def test_reading_changes_nothing(name: str) -> None:
    read, unread = started(name), started(name)
    rows = stepped(read, 0.0005, 0.1)
    for k in range(200):
        unread.set_real(unread._inputs, [9.0, 9.0, 9.0, 9.0])
        unread._get_fmu_state()
        unread.set_real(unread._inputs, motion((k + 1) * 0.0005))
        assert unread.do_step(k * 0.0005, 0.0005)
    assert unread.get_real(unread._outputs) == rows[-1]


def test_no_output_follows_an_input_but_at_the_start() -> None:
    description = catalogue.describe("Lpv")
    assert description.variables["voltage"].dependencies == ()
    assert description.variables["command_raw"].unit == "V"
    assert catalogue.describe("HinfInverse").variables["command_raw"].unit == "N"


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("Lpv", {"velocity": "guessed"}),
        ("Lpv", {"v_max": 0.0}),
        ("Lpv", {"sample_period": 0.001}),  # the design's matrices are those of 2 ms
        ("HinfInverse", {"inverse": "maxwell"}),
        ("HinfInverse", {"lugre.a_0": -1.0}),
        ("Skyhook", {"sample_period": 0.0}),
        ("Skyhook", {"kind": "sky"}),
        ("Sensors", {"damper_force.delay": -1.0}),
    ],
)
def test_a_wrong_parameter_is_a_fault_and_nothing_raises(name: str, wrong: dict[str, Any]) -> None:
    slave = started(name, **wrong)
    assert slave.fault == 5
    assert not slave.do_step(0.0, H)
    assert slave.get_real(slave._outputs) == [0.0] * len(slave._outputs)


def test_a_step_of_a_lifetime_is_a_fault_and_does_not_hang() -> None:
    slave = started("Lpv")
    assert not slave.do_step(0.0, 1e9)
    assert slave.fault == 4


# -- laws


def one_step_late(kind: str) -> Controller:
    """Return a controller whose command is the floor acceleration of the sample before."""
    return Controller(
        kind=kind, title="late", n=1, rows=1, v_top=0.0, sample_period=H, A=[0.0], B=[1.0],
        W=[0.0], C=[1.0], facts={}, design={}, building=building_digest(paper_building()),
    )  # fmt: skip


@pytest.fixture(scope="module")
def switch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the FMU of a clipped-optimal switch with that command."""
    folder = tmp_path_factory.mktemp("switch")
    one_step_late("hinf").save(folder / "late.json")
    what = build.plan("ClippedOptimal", name="Late", controller=folder / "late.json")
    return build.build(what, folder)


def test_truth_table_of_the_clipped_switch_through_the_fmu(switch: Path, tmp_path: Path) -> None:
    t = 0.0
    with loaded(switch, tmp_path) as (fmu, refer):
        initialise(fmu)
        for u, f, voltage in [
            (5, 3, 8), (3, 5, 0), (-5, 3, 0), (-5, -3, 8), (-3, -5, 0), (0.4, 0.2, 0), (5, 0, 0),
        ]:  # fmt: skip
            for y, force in ((u, 0.0), (0.0, f)):
                fmu.setReal(refer("floor_acceleration", "damper_force"), [y, force])
                fmu.doStep(t, H)
                t += H
            assert fmu.getReal(refer("command_raw", "voltage")) == [u, voltage]


@pytest.mark.parametrize(
    ("name", "unit", "reason"),
    [
        ("Lpv", "'lpv'", "a controller of the kind 'hinf'"),
        ("Structure", "not Structure", "goes into a designed controller"),
        ("Skyhook", "not Skyhook", "goes into a designed controller"),
    ],
)
def test_a_build_refuses_a_controller_of_another_kind(name: str, unit: str, reason: str) -> None:
    with pytest.raises(BuildError, match=reason) as caught:
        build.plan(name, controller=FROZEN / "hinf.json")
    assert unit in str(caught.value)


def test_an_edited_controller_is_refused_with_exit_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    text = (FROZEN / "hinf.json").read_text()
    Path("edited.json").write_text(text.replace('"n":8', '"n":9'))
    with pytest.raises(DesignError, match="digest"):
        build.plan("HinfInverse", controller=Path("edited.json"))
    assert main(["build", "HinfInverse", "--controller", "edited.json"]) == 2
    assert "edited.json" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["edited.json"]


def test_inverse_law_gives_the_commanded_force_where_it_can() -> None:
    slave = started("HinfInverse")
    p = [parameter.value for parameter in LuGre.parameters.values()]
    lugre, exact, z = law_code("lugre"), 0, [0.0]
    for k in range(500):
        _, _, v, _ = measured = motion((k + 1) * H)
        control_laws.estimate_states(lugre, p, slave["scheduling"], 0.0, H, z)
        slave.set_real(slave._inputs, measured)
        assert slave.do_step(k * H, H)
        V, u, rho = slave.get_real(slave._outputs)
        assert rho == v
        given = [control_laws.force_of_law(lugre, p, v, at, z) for at in (0.0, 1.0, V)]
        slope = given[1] - given[0]
        if 0.0 < V < 8.0 and abs(slope) >= control_laws.LEAST_SLOPE:
            assert given[2] == pytest.approx(u, rel=1e-9)
            exact += 1
    assert exact > 20


def test_lpv_looks_its_matrices_up_by_the_speed_and_feeds_back_what_is_applied() -> None:
    slave = started("Lpv", anti_windup=200.0)
    c = read_controller(PACKAGE / "component" / "data" / "lpv.json")
    x, spare = [0.0] * c.n, [0.0] * c.n
    for k in range(200):
        y, _, v, _ = motion(k * H) if k else [0.0] * 4
        row = control_laws.table_row(v, c.v_top, c.rows)
        w = control_laws.command(c.n, c.C, row, x)
        V = control_laws.signed_voltage(w, v, 8.0)
        assert slave.get_real(slave._outputs) == [V, w, v]
        inputs = y, 200.0 * ((V if v >= 0 else -V) - w)
        control_laws.advance(c.n, c.A, c.B, c.W, row, x, inputs, spare)
        slave.set_real(slave._inputs, motion((k + 1) * H))
        assert slave.do_step(k * H, H)


def test_filtered_velocity_follows_the_displacement_alone() -> None:
    slave = started("Lpv", velocity="filtered", velocity_corner=18.0)
    w = 4 * pi
    rows = []
    for k in range(1000):
        t = (k + 1) * H
        slave.set_real(slave._inputs, [0.0, 0.006 * sin(w * t), 99.0, 0.0])
        assert slave.do_step(k * H, H)
        rows.append(slave["scheduling"])
    gain = 1.0 / sqrt(1.0 + (2.0 / 18.0) ** 2)
    assert max(rows[500:]) == pytest.approx(0.006 * w * gain, rel=2e-3)


def test_skyhook_brakes_only_what_it_would_slow() -> None:
    slave = started("Skyhook")
    seen = set()
    for k in range(500):
        t = (k + 1) * H
        v = 0.1 * sin(9.0 * t)
        slave.set_real(slave._inputs, [2.0 * cos(13.0 * t), 0.0, v, 0.0])
        assert slave.do_step(k * H, H)
        V, u, _ = slave.get_real(slave._outputs)
        assert (V == 8.0) == (u * v > 0.0)
        seen.add(V)
    assert seen == {0.0, 8.0}


# -- instruments


def test_sensors_are_transparent_unless_told_otherwise() -> None:
    for k, row in enumerate(stepped(started("Sensors"), H, 0.1)):
        assert row == motion((k + 1) * H)


def test_gain_bias_quantisation_and_delay_of_one_channel() -> None:
    given = {"gain": 2.0, "bias": 0.1, "quantisation": 0.25, "delay": 3 * H}
    slave = started("Sensors", **{f"damper_force.{key}": value for key, value in given.items()})
    rows = stepped(slave, H, 0.2)
    for k in range(4, len(rows)):
        exact = 2.0 * motion((k - 2) * H)[3] + 0.1
        assert rows[k][3] == 0.25 * np.floor(exact / 0.25 + 0.5)
        assert rows[k][:3] == motion((k + 1) * H)[:3]


def sensors(seed: int, **values: float) -> Any:
    """Return sensors of which every channel has the same values."""
    slave: Any = catalogue.instantiate("Sensors")
    slave.set_integer([slave._index["seed"]], [seed])
    slave.set_real([slave._index["sample_period"]], [H])
    for key, value in values.items():
        slave.set_real([slave._index[f"{name}.{key}"] for name in MEASURED], [value] * 4)
    slave.configure()
    return slave


def readings(signal: list[float], place: int = 0, seed: int = 1, **values: float) -> list[float]:
    """Return what a channel in a place among four shows of a signal, sample by sample."""
    slave = sensors(seed, **values)
    return [
        reading(place, k, value, slave.constants, slave.state) for k, value in enumerate(signal)
    ]


def test_a_delay_between_two_samples_is_exact_for_a_ramp() -> None:
    found = readings([10.0 * k for k in range(20)], delay=2.5 * H)
    assert found[0] == 0.0
    assert found[4:] == pytest.approx([10.0 * (k - 2.5) for k in range(4, 20)])


def test_cut_off_halves_the_power_at_its_corner() -> None:
    found = readings([sin(2 * pi * 5.0 * k * H) for k in range(2000)], cut_off=5.0)
    assert max(found[1000:]) == pytest.approx(sqrt(0.5), rel=2e-3)


def test_noise_has_its_density_its_seed_and_no_memory() -> None:
    density, n = 0.01, 20000
    found = np.array(readings([0.0] * n, 2, 7, noise_density=density))
    deviation = density * sqrt(0.5 / H)
    assert found.std() == pytest.approx(deviation, rel=4.0 / sqrt(2 * n))
    assert abs(found.mean()) < 4.0 * deviation / sqrt(n)
    assert abs(np.mean(found[1:] * found[:-1])) < 4.0 * deviation**2 / sqrt(n)
    alone = sensors(7, noise_density=density)
    assert reading(2, n - 1, 0.0, alone.constants, alone.state) == found[-1]
    other, seed = (
        readings([0.0] * 6, *choice, noise_density=density) for choice in ((3, 7), (2, 8))
    )
    assert other[5] != found[5] != seed[5]


# -- the closed loop


@pytest.fixture(scope="module")
def closed(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return a function that runs a stock scenario with a frozen controller, for 4 s.

    The peaks of the whole record lie in the first three seconds.
    """
    folder = tmp_path_factory.mktemp("closed")

    def of(
        name: str, fmu: str, kind: str, nominal: float = 0.6, **parameters: Any
    ) -> dict[str, float]:
        path = build.build(
            build.plan(fmu, name=f"Frozen{fmu}", controller=FROZEN / f"{kind}.json"), folder
        )
        overrides = {f"controller.{key}": value for key, value in parameters.items()}
        overrides |= {"run.stop": 4.0, "ground.peak": 9.81 * nominal}
        text = scenario_text(load_scenario(name, overrides))
        file = folder / f"{name}.toml"
        file.write_text(text.replace(f'fmu = "{fmu}"', f'fmu = "{path.name}"'))
        assert path.name in file.read_text()
        frame = run(file)
        assert (frame["controller.fault"] == 0).all()
        return {
            "y": frame["structure.floor2_acceleration_absolute"].abs().max(),
            "drift": 1e3 * frame["structure.base_displacement"].abs().max(),
            "force": frame["damper.force"].abs().max(),
            "voltages": frame["controller.voltage"].nunique(),
        }

    return of


@pytest.mark.parametrize(
    ("name", "fmu", "kind", "rate", "published"),
    [
        ("clipped", "ClippedOptimal", "hinf", None, (7.141, 18.1, 9.80)),
        # A second each: by default the coupled engine has this table, and FMUs agree with it.
        pytest.param(
            "hinf", "HinfInverse", "hinf", 0.0, (6.958, 17.7, 8.55), marks=pytest.mark.slow
        ),
        pytest.param("lpv", "Lpv", "lpv", 200.0, (6.353, 13.6, 8.81), marks=pytest.mark.slow),
        pytest.param("lpv", "Lpv", "lpv", 0.0, (5.949, None, None), marks=pytest.mark.slow),
    ],
)
def test_peaks_on_el_centro_with_the_frozen_matrices(
    closed: Any, name: str, fmu: str, kind: str, rate: float | None, published: Any
) -> None:
    parameters = {} if rate is None else {"anti_windup": rate}
    found = closed(f"el_centro_0p6g_{name}", fmu, kind, **parameters)
    y, drift, force = published
    assert found["y"] == pytest.approx(y, rel=0.03 if name == "clipped" else 0.005)
    if drift is not None:
        assert found["drift"] == pytest.approx(drift, rel=0.02)
        assert found["force"] == pytest.approx(force, rel=0.04)
    assert (found["voltages"] == 2) == (name == "clipped")


def test_every_controller_has_the_same_ports() -> None:
    for name in CONTROLLERS:
        variables = catalogue.describe(name).variables
        ports = {key: v.unit for key, v in variables.items() if v.causality == "input"}
        assert ports == {key: unit for key, (unit, _) in MEASURED.items()}
        assert {"voltage", "command_raw", "scheduling", "fault"} == {
            key for key, v in variables.items() if v.causality == "output"
        }
