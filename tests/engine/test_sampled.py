"""Controllers and sensors in the coupled engine: the components' laws on their clocks."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from bristle.engine.coupled import Coupled
from bristle.engine.run import run
from bristle.fmu import catalogue
from bristle.fmu.controller import MEASURED
from bristle.system.scenario import load_scenario

PLANT = """
schema = 1
title = "a controller, with another force to measure than the damper's"

[run]
stop = {stop}
step = {step}

[components.ground]
fmu = "GroundMotion"
parameters = {{ record = "el_centro_1940_ns", peak = 5.886, factor = 0.45 }}

[components.structure]
fmu = "Structure"

[components.damper]
fmu = "LuGreDamper"

[components.other]
fmu = "SignalSource"
parameters = {{ kind = "sine", amplitude = 4.0, frequency = 1.7 }}

{components}

[connections]
"structure.ground_acceleration" = "ground.ground_acceleration"
"structure.damper_force" = "damper.force"
"damper.displacement" = "structure.base_displacement"
"damper.velocity" = "structure.base_velocity"
"damper.voltage" = "controller.voltage"
{connections}
"""
SOURCES = {
    "floor_acceleration": "structure.floor2_acceleration_absolute",
    "base_displacement": "structure.base_displacement",
    "base_velocity": "structure.base_velocity",
    "damper_force": "other.value",
}
SETTINGS = {
    "ClippedOptimal": [{}, {"f_min": 1.5, "v_max": 5.0}],
    "HinfInverse": [{}, {"inverse": "bingham", "anti_windup": 200.0, "velocity": "filtered"}],
    "Lpv": [{}, {"anti_windup": 0.0, "v_max": 4.0}],
    "LqgClipped": [{}, {"velocity": "filtered"}],
    "TrainedPolicy": [{}, {"velocity": "filtered", "v_max": 4.0}],
    "Skyhook": [{}, {"kind": "inverse", "gain": 80.0, "integral_corner": 0.4}],
}
CASES = [(fmu, given) for fmu, listed in SETTINGS.items() for given in listed]


def written(folder: Path, fmu: str, given: dict[str, object], **run_values: float) -> Path:
    """Write a scenario with one controller, which measures through nothing."""
    values = ", ".join(f"{key} = {_toml(value)}" for key, value in given.items())
    components = f'[components.controller]\nfmu = "{fmu}"\nparameters = {{ {values} }}'
    connections = "\n".join(f'"controller.{port}" = "{SOURCES[port]}"' for port in MEASURED)
    return _file(folder, components, connections, run_values)


def _file(folder: Path, components: str, connections: str, run_values: dict[str, float]) -> Path:
    settings = {"stop": 4.0, "step": 0.002, **run_values}
    path = folder / "scenario.toml"
    path.write_text(PLANT.format(components=components, connections=connections, **settings))
    return path


def _toml(value: object) -> str:
    return f'"{value}"' if isinstance(value, str) else repr(value)


def replayed(columns: dict[str, np.ndarray], slave, ports: dict[str, str]) -> np.ndarray:
    """Return what a component answers to the recorded signals, sample by sample."""
    measured = np.column_stack([columns[ports[port]] for port in MEASURED]).tolist()
    c, state, work = slave.setup()
    shown, rows = [0.0] * len(slave._outputs), []
    slave.functions.start(0.0, measured[0], c, state, shown, [0.0] * work)
    for k, (before, now) in enumerate(pairwise(measured)):
        rows.append(list(shown))
        clock = (k * c.period, c.period, 0)
        assert slave.functions.step(clock, before, now, c, state, state, shown, [0.0] * work) == 0
    return np.array([*rows, shown])


def ready(scenario, name: str):
    """Return a component of a scenario as the object that its FMU carries."""
    component = scenario.components[name]
    slave = catalogue.instantiate(component.kind)
    for key, value in component.values.items():
        slave._values[slave._index[key]] = type(slave[key])(value)
    return slave


@pytest.mark.parametrize(("fmu", "given"), CASES, ids=lambda value: str(value)[:40])
def test_the_engine_runs_the_law_of_the_component(
    fmu: str, given: dict[str, object], tmp_path: Path
) -> None:
    scenario = load_scenario(written(tmp_path, fmu, given))
    columns = Coupled().run(scenario)
    answers = replayed(columns, ready(scenario, "controller"), SOURCES)
    assert np.ptp(answers[:, 0]) > 0.5
    for j, port in enumerate(("voltage", "command_raw", "scheduling")):
        found = columns[f"controller.{port}"]
        # Summed in another order, a switch could turn at another sample; none does here.
        assert found == pytest.approx(answers[:, j], rel=1e-9, abs=1e-9), port


def test_sensors_show_in_the_engine_what_the_component_shows(tmp_path: Path) -> None:
    given = {
        "seed": 7, "floor_acceleration.noise_density": 0.01, "floor_acceleration.cut_off": 18.0,
        "base_displacement.quantisation": 1e-4, "base_velocity.delay": 0.0051,
        "damper_force.gain": 1.1, "damper_force.bias": -0.2,
    }  # fmt: skip
    values = "\n".join(f'"{key}" = {value!r}' for key, value in given.items())
    components = (
        '[components.sensors]\nfmu = "Sensors"\n[components.sensors.parameters]\n'
        f'{values}\n[components.controller]\nfmu = "Lpv"'
    )
    connections = "\n".join(
        [
            *(f'"sensors.{port}" = "{SOURCES[port]}"' for port in MEASURED),
            *(f'"controller.{port}" = "sensors.{port}_measured"' for port in MEASURED),
        ]
    )
    scenario = load_scenario(_file(tmp_path, components, connections, {}))
    columns = Coupled().run(scenario)
    shown = replayed(columns, ready(scenario, "sensors"), SOURCES)
    for j, port in enumerate(MEASURED):
        assert columns[f"sensors.{port}_measured"] == pytest.approx(shown[:, j], rel=1e-12), port
    through = {port: f"sensors.{port}_measured" for port in MEASURED}
    answers = replayed(columns, ready(scenario, "controller"), through)
    assert columns["controller.voltage"] == pytest.approx(answers[:, 0], rel=1e-9, abs=1e-9)


def test_a_controller_keeps_its_clock_whatever_the_step(tmp_path: Path) -> None:
    """Rows 10 ms apart show every fifth of those 2 ms apart: the loop inside is the same."""
    fine = Coupled().run(load_scenario(written(tmp_path, "Lpv", {})))
    coarse = Coupled().run(load_scenario(written(tmp_path, "Lpv", {}, step=0.01)))
    for name in ("structure.floor2_acceleration_absolute", "damper.force", "controller.voltage"):
        assert coarse[name] == pytest.approx(fine[name][::5], rel=1e-9, abs=1e-9), name


def test_instants_between_substeps_are_measured_as_if_inputs_were_linear(tmp_path: Path) -> None:
    # 1.8943 ms is no whole number of substeps; 1.9 ms is.
    peaks = [
        np.abs(
            Coupled().run(load_scenario(written(tmp_path, "Skyhook", given)))[
                "structure.floor2_acceleration_absolute"
            ]
        ).max()
        for given in (
            {"kind": "inverse", "sample_period": 0.0018943},
            {"kind": "inverse", "sample_period": 0.0019},
        )
    ]
    assert peaks[0] == pytest.approx(peaks[1], rel=2e-3)


def test_the_force_follows_a_new_voltage_at_once() -> None:
    """At an instant the row shows the force at the new voltage: the motion has not moved yet."""
    columns = Coupled().run(
        load_scenario("el_centro_0p6g_clipped", {"run.stop": 3.0, "run.step": 2e-4})
    )
    voltage = columns["controller.voltage"]
    changes = np.abs(np.diff(columns["damper.force"]))
    turned = np.diff(voltage) != 0.0
    assert turned.sum() > 20
    # A voltage step moves the force by up to 0.83 N/V and 20 N s/m per volt; motion in 0.2 ms,
    # hardly. A force that followed a step late would show the change a row after the voltage's.
    assert np.median(changes[turned]) > 3.0
    assert changes[~turned].max() < 0.5


@pytest.mark.parametrize(("law", "peak"), [("hinf", 6.958), ("lpv", 6.353), ("clipped", 7.141)])
def test_stock_scenarios_give_the_published_peaks(law: str, peak: float) -> None:
    columns = Coupled().run(load_scenario(f"el_centro_0p6g_{law}", {"run.stop": 31.18}))
    found = np.abs(columns["structure.floor2_acceleration_absolute"]).max()
    assert found == pytest.approx(peak, rel=0.03 if law == "clipped" else 0.01)


@pytest.mark.parametrize("law", [pytest.param("hinf", marks=pytest.mark.slow), "lpv"])  # 2 s each
def test_coupled_and_stepped_runs_agree_at_small_steps(law: str) -> None:
    """FMUs exchange values every 0.25 ms, the coupled engine has no such error."""
    overrides = {"run.stop": 3.0, "run.step": 2.5e-4}
    stepped = run(f"el_centro_0p6g_{law}", overrides)
    coupled = run(f"el_centro_0p6g_{law}", overrides, engine="compiled")
    assert list(stepped.columns) == list(coupled.columns)
    assert stepped.attrs["units"] == coupled.attrs["units"]
    for name, share in (
        ("structure.floor2_acceleration_absolute", 2e-3),
        ("structure.base_displacement", 2e-3),
        ("controller.command_raw", 0.02),
    ):
        allowed = share * coupled[name].abs().max()
        assert stepped[name].to_numpy() == pytest.approx(coupled[name].to_numpy(), abs=allowed)


def test_a_wrong_parameter_is_refused_with_the_component(tmp_path: Path) -> None:
    from bristle.errors import ScenarioError

    path = written(tmp_path, "Skyhook", {"kind": "pendulum"})
    with pytest.raises(ScenarioError, match=r"controller.*pendulum"):
        Coupled().run(load_scenario(path))


def test_filtered_velocity_is_the_rate_of_the_low_passed_displacement(tmp_path: Path) -> None:
    given = {"velocity": "filtered", "velocity_corner": 18.0}
    columns = Coupled().run(load_scenario(written(tmp_path, "Lpv", given)))
    v, filtered = columns["structure.base_velocity"], columns["controller.scheduling"]
    spectrum, own = np.fft.rfft(v), np.fft.rfft(filtered)
    f = np.fft.rfftfreq(len(v), 0.002)
    loud = np.abs(spectrum) > 0.05 * np.abs(spectrum).max()
    ratio = own[loud] / spectrum[loud]
    expected = 1.0 / (1.0 + 1j * f[loud] / 18.0)
    assert np.abs(ratio - expected).max() < 0.1
