"""The limit of control: its model against the coupled engine, its derivative, bound and search."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

import bristle
from bristle.cli import main
from bristle.core.files import scenarios_folder
from bristle.engine.coupled import Coupled
from bristle.engine.results import statistic_of
from bristle.errors import BristleError, ScenarioError
from bristle.optimal_control import Limit, case, limit, search
from bristle.optimal_control.bound import bound_of, largest_force
from bristle.optimal_control.case import ControlProblem, case_of, with_voltage
from bristle.optimal_control.search import descended, levelled
from bristle.system.scenario import load_scenario

PULSE, Y = "half_sine_pulse", "structure.floor2_acceleration_absolute"
BRACE = """
schema = 1
title = "A damper in the first storey"
[run]
stop = 1.0
step = 0.002
[components.ground]
fmu = "SignalSource"
parameters = { kind = "half_sine", amplitude = 2.0, duration = 0.2 }
[components.structure]
fmu = "Structure"
building = "FILE"
parameters = { damper_force = 0.0 }
[components.brace]
fmu = "LuGreDamper"
parameters = { voltage = 3.0 }
[connections]
"structure.ground_acceleration" = "ground.value"
"structure.brace_force" = "brace.force"
"brace.displacement" = "structure.brace_displacement"
"brace.velocity" = "structure.brace_velocity"
"""


@pytest.fixture
def in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compute without numba: short responses take less than to compile."""
    monkeypatch.setattr(case, "compiled", lambda function: function)


def made(stop: float, every: int = 1, output: str = Y, **values: object) -> ControlProblem:
    """Return the problem of a half-sine pulse; `damper__x` sets `damper.x`."""
    overrides = {name.replace("__", "."): value for name, value in values.items()}
    return ControlProblem(
        case_of(load_scenario(PULSE, {"run.stop": stop, **overrides}), output), every
    )


@pytest.mark.usefixtures("in_python")
@pytest.mark.parametrize(
    ("fmu", "output", "apart"),
    [
        ("LuGreDamper", Y, 2e-3),
        ("LuGreDamper", "structure.base_displacement", 2e-3),
        ("LuGreDamper", "structure.base_acceleration_absolute", 1e-2),
        ("BinghamDamper", Y, 2e-2),
        ("ModifiedBoucWenDamper", "structure.drift1", 2e-3),
    ],
)
def test_the_response_is_that_of_the_coupled_engine(fmu: str, output: str, apart: float) -> None:
    values: dict[str, object] = {"run.stop": 1.0, "damper.fmu": fmu, "voltage.level": 3.0}
    scenario = load_scenario(PULSE, values)
    whole = Coupled().run(scenario)[output]
    case = case_of(scenario, output)
    one = ControlProblem(case)
    steps = round(scenario.step / case.plant.h)
    y = one.respond(one.level(3.0))[::steps]
    assert np.abs(y - whole).max() < apart * np.abs(whole).max()


@pytest.mark.usefixtures("in_python")
def test_a_damper_between_floors_is_felt_and_pushes_there(tmp_path: Path) -> None:
    file = tmp_path / "brace.toml"
    building = scenarios_folder() / "buildings" / "damper_in_first_storey.toml"
    file.write_text(BRACE.replace("FILE", building.as_posix()))
    scenario = load_scenario(file)
    one = ControlProblem(case_of(scenario, Y))
    whole = Coupled().run(scenario)[Y]
    assert np.abs(one.respond(one.level(3.0)) - whole).max() < 2e-3 * np.abs(whole).max()


@pytest.mark.usefixtures("in_python")
@pytest.mark.parametrize(
    "values",
    [
        {},
        {"damper__coil_lag.on": True, "damper__gas_spring.on": True},
        {"damper__fmu": "ModifiedBoucWenDamper"},
    ],
)
def test_the_derivative_is_that_of_the_response(values: dict[str, object]) -> None:
    one = made(0.3, 3, **values)
    random = np.random.default_rng(1)
    nodes = random.uniform(1.0, 7.0, len(one.nodes))
    voltage = one.between(nodes)
    one.respond(voltage)
    one.slopes(voltage)
    weights = random.standard_normal(one.last + 1)
    slope = one.to_nodes(one.pull_back(weights))
    along, change = random.standard_normal(len(nodes)), 1e-4
    high, low = (
        float(weights @ one.respond(one.between(nodes + sign * change * along))) for sign in (1, -1)
    )
    assert slope @ along == pytest.approx((high - low) / (2.0 * change), rel=1e-4)


@pytest.mark.usefixtures("in_python")
def test_descent_and_linear_programs_lower_the_peak(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "NORMS", (8.0,))
    monkeypatch.setattr(search, "ITERATIONS", 4)
    monkeypatch.setattr(search, "PROGRAMS", 2)
    one = made(0.3, 5)
    nodes = np.full(len(one.nodes), 4.0)
    before = statistic_of(one.respond(one.between(nodes)), "peak")
    first = descended(one, nodes, "peak")
    halfway = statistic_of(one.respond(one.between(first)), "peak")
    second, peak = levelled(one, first)
    assert peak < halfway < before
    assert statistic_of(one.respond(one.between(second)), "peak") == pytest.approx(peak)
    assert second.min() >= 0.0
    assert second.max() <= 8.0


@pytest.mark.usefixtures("in_python")
@pytest.mark.parametrize("statistic", ["peak", "rms"])
def test_no_constant_voltage_comes_below_the_bound(statistic: str) -> None:
    one = made(0.8)
    least = min(statistic_of(one.respond(one.level(V)), statistic) for V in (0.0, 2.0, 4.0, 8.0))
    found = bound_of(one, statistic, 9.9)
    assert found is not None
    assert 0.0 < found < least


@pytest.mark.usefixtures("in_python")
def test_without_any_force_the_bound_is_the_building_without_damper() -> None:
    one = made(0.8)
    found = bound_of(one, "peak", 1e-9)
    p, ground = one.case.plant, one.case.ground
    x, most = np.zeros(len(p.phi)), 0.0
    for k in range(one.last):
        x = p.phi @ x + p.ground_0 * ground[k] + p.ground_1 * ground[k + 1]
        most = max(most, abs(float(p.output @ x)))
    assert found == pytest.approx(most, rel=0.02)  # the bound's instants are further apart


def test_overrides_do_not_take_the_voltage_from_what_plays_it() -> None:
    case = case_of(load_scenario(PULSE), Y)
    played = with_voltage(case, np.zeros(len(case.time)))
    with pytest.raises(ScenarioError, match="was made"):
        load_scenario(played, {"run.stop": 0.5})


def test_the_largest_force_is_that_of_sliding_at_the_worst_speed() -> None:
    """LuGre at 8 V: (sigma_a + 8 sigma_0)/a_0 + (sigma_2 + 8 sigma_b) v_n/e, at v = v_n."""
    case = case_of(load_scenario(PULSE), Y)
    law = (650.0 + 8.0 * 415.0) / 500.0 + (100.0 + 8.0 * 20.0) * 0.02 / np.e
    assert largest_force(case, 0.2) == pytest.approx(law, rel=0.01)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["no_damper"], "has 0 components of the kind damper"),
        (["dampers_at_two_levels"], "has 2 components of the kind damper (damper, brace)"),
        (["bench_sine_lugre"], "has 0 components of the kind structure"),
        ([PULSE, "--output", "structure.floor9_velocity"], "no output"),
        ([PULSE, "--output", "damper.force"], "no output"),
        ([PULSE, "--starts", "0"], "1 or more is right"),
        ([PULSE, "--preview", "-1"], "0 to 10 s is right"),
        ([PULSE, "--preview", "nan"], "0 to 10 s is right"),
        ([PULSE, "--set", "structure.duffing.on=true"], "nonlinear"),
        ([PULSE, "--set", "run.stop=0.04"], "too short"),
        ([PULSE, "--set", "ground.amplitude=0"], "the ground does not move"),
        ([PULSE, "--set", "structure.extra_force=1"], "acts besides the damper"),
        ([PULSE, "--out", __file__], "is a file"),
        ([PULSE, "--set", "damper.v_max=0"], "leaves nothing to choose"),
        (["nosuch"], "no scenario file"),
    ],
)
def test_what_a_limit_is_refused_for(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["limit", *arguments]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert "Traceback" not in said


@pytest.mark.slow  # an optimal control is computed
def test_without_the_solver_there_is_a_limit_and_no_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cvxpy", None)
    found = limit(PULSE, {"run.stop": 0.3}, previews=(), starts=1)
    assert found.bound is None
    assert "No lower bound: it needs cvxpy" in found._repr_html_()


def test_a_statistic_that_there_is_not_is_refused() -> None:
    with pytest.raises(BristleError, match="peak, rms"):
        limit(PULSE, statistic="mean")


@pytest.fixture(scope="module")
def pulse(tmp_path_factory: pytest.TempPathFactory) -> tuple[Limit, Path]:
    """The limit of a half-sine pulse, and the folder that it was written to."""
    folder = tmp_path_factory.mktemp("limit")
    return limit(PULSE, {"run.stop": 1.5}, out=folder), folder


@pytest.mark.slow  # an optimal control, and many others
def test_nothing_comes_below_the_limit_and_the_limit_not_below_the_bound(
    pulse: tuple[Limit, Path],
) -> None:
    found, _ = pulse
    others = [*found.constant.values(), *found.previews.values(), found.as_it_is]
    assert found.value <= 1.002 * min(others)
    assert found.bound is not None
    assert found.bound < found.value
    assert found.sure
    assert found.agreeing == len(found.starts) == 3
    assert found.previews[0.0] > found.previews[0.1]


@pytest.mark.slow  # an optimal control, played through FMUs
def test_the_voltage_reaches_the_limit_through_fmus(pulse: tuple[Limit, Path]) -> None:
    found, folder = pulse
    frame = bristle.run(folder / "limit.toml")
    assert float(frame[Y].abs().max()) == pytest.approx(found.value, rel=0.01)
    written = bristle.load_results(folder)
    assert float(written[Y].abs().max()) == pytest.approx(found.value, rel=1e-9)
    assert found.plot().axes
    shown = found._repr_html_()
    assert "limit: any voltage, motion known" in shown
    assert "data:image/png;base64," in shown


@pytest.mark.slow  # an optimal control beside a controller
def test_a_controller_does_not_come_below_the_limit() -> None:
    values = {"run.stop": 6.0}
    found = limit("el_centro_0p6g_clipped", values, previews=(), starts=1)
    assert found.value < 0.5 * found.as_it_is
    lpv = Coupled().run(load_scenario("el_centro_0p6g_lpv", values))[Y]
    assert found.value < float(np.abs(lpv).max())


@pytest.mark.slow  # two optimal controls
def test_friction_that_sticks_and_effects_are_confirmed_by_the_coupled_engine() -> None:
    more = {"damper.fmu": "BinghamDamper"}
    assert limit(PULSE, {"run.stop": 1.0, **more}, previews=(), starts=2).sure
    more = {"damper.coil_lag.on": True}
    found = limit(PULSE, {"run.stop": 1.0, **more}, previews=(), starts=2)
    assert found.sure
    assert found.bound is None


@pytest.mark.slow  # an optimal control by the command
def test_the_command_writes_what_it_says(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [PULSE, "--set", "run.stop=1.0", "--preview", "--starts", "2"]
    assert main(["limit", *arguments, "--out", str(tmp_path), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["bound"] < answer["limit"] < answer["as_it_is"]
    assert answer["previews"] == []
    assert all(Path(path).is_file() for path in answer["files"])
    assert [Path(path).name for path in answer["files"]][-1] == "limit.png"
    assert main(["limit", *arguments, "--out", str(tmp_path), "--no-figure"]) == 0
    said = capsys.readouterr().out
    assert "2 of 2 starts agree" in said
    assert "The coupled engine confirms the value" in said
