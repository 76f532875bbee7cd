"""The coupling error that a run states, against what it is; the step for a tolerance; energy."""

from __future__ import annotations

import logging
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from toys import Maker

from bristle import load_results, run
from bristle.cli import main
from bristle.engine.cosimulation import Cosimulation, ignore
from bristle.engine.coupling_error import (
    again_by,
    against,
    discrete_outputs,
    estimate,
    extrapolated,
    find_step,
    without_doubtful,
)
from bristle.engine.schedule import held_inputs, make_nodes
from bristle.errors import RunError, ScenarioError
from bristle.system.model import System
from bristle.system.scenario import load_scenario

AGAIN = again_by(Cosimulation(listen=ignore))


T = np.linspace(0.0, 3.0, 301)
EXACT = np.sin(T)


def off(error: float) -> np.ndarray:
    """Return a run with an error that grows with time."""
    return EXACT * (1.0 + error * T)


def rms(values: np.ndarray) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize(("order", "h"), [(1, 0.02), (2, 0.02), (2, 1e-5)])
def test_an_error_that_falls_regularly_is_told_to_a_percent(order: int, h: float) -> None:
    one, half, quarter = (off(h / 2 ** (order * k)) for k in range(3))
    true = float(np.abs(one - EXACT).max())
    for found in (extrapolated(one, half, quarter), against(one, half, EXACT)):
        assert found.worth
        assert found.order == pytest.approx(order, abs=0.02)
        assert found.along == pytest.approx(true, rel=0.02)
        assert found.peak == pytest.approx(np.abs(one).max() / EXACT.max() - 1.0, rel=0.4, abs=1e-6)
        assert found.rms == pytest.approx(rms(one) / rms(EXACT) - 1.0, rel=0.4, abs=1e-6)


def test_an_error_that_does_not_fall_is_worth_nothing() -> None:
    jumps = [np.sign(EXACT - 0.5 + shift) for shift in (0.02, -0.02, 0.015)]
    assert not extrapolated(*jumps).worth
    assert not against(*jumps).worth
    growing = extrapolated(off(0.01), off(0.02), off(0.05))
    assert not growing.worth
    assert growing.order < 0.0


def test_what_no_step_changes_has_no_error() -> None:
    for same in (EXACT, np.zeros(5), np.full(5, 8.0)):
        found = extrapolated(same, same, same)
        assert (found.along, found.peak, found.rms, found.worth) == (0.0, 0.0, 0.0, True)
        assert math.isnan(found.order)
        assert not found.some


def oscillator(scenario_of: Maker, algorithm: str) -> Path:
    """Return x1' = x2 + 1, x2' = -x1 of foreign FMUs: there is no engine but theirs."""
    return scenario_of(
        {"one": "Integrator", "two": "Integrator", "minus": "Gain"},
        {"one.u": "two.y", "two.u": "minus.y", "minus.u": "one.y"},
        parameters={
            "one": {"gain": 0.0},
            "two": {"gain": 0.0},
            "minus": {"gain": -1.0, "offset": 1.0},
        },
        step=0.025,
        steps={"two": 0.0125},
        stop=3.0,
        algorithm=algorithm,
    )


@pytest.mark.parametrize(("algorithm", "order"), [("midpoint", 2), ("gauss-seidel", 1)])
def test_foreign_fmus_are_run_at_h_and_at_a_half_and_a_quarter(
    scenario_of: Maker, algorithm: str, order: int
) -> None:
    frame = run(oscillator(scenario_of, algorithm), coupling_error=True)
    assert frame.attrs["coupling_error_by"] == "h, h/2, h/4"
    found = frame.attrs["coupling_error"]["one.x"]
    exact = 1.0 - np.cos(frame.index.to_numpy())
    true = float(np.abs(frame["one.x"] - exact).max() / exact.max())
    assert true / 1.3 <= found["along"] <= 1.3 * true
    assert found["order"] == pytest.approx(order, abs=0.2)
    assert found["worth"]


def test_a_controller_that_does_not_settle_spoils_every_estimate_from_finer_steps() -> None:
    scenario = load_scenario("el_centro_0p6g_clipped", {"run.stop": 0.02, "run.step": 0.002})
    assert discrete_outputs(scenario) == [
        f"controller.{name}" for name in ("voltage", "command_raw", "scheduling")
    ]
    quiet = AGAIN(scenario, "fmu")

    def again(one: System, engine: str) -> pd.DataFrame:
        if engine == "compiled":
            raise ScenarioError("foreign")
        parts = round(one.steps / scenario.steps)
        frame = quiet.loc[quiet.index.repeat(parts)].iloc[parts - 1 :].copy()
        frame["damper.force"] += 0.1 * one.step  # of first order
        if switching:
            frame["controller.voltage"] += 8.0 * (parts % 4 == 2)
        return frame

    first = quiet.copy()
    first["damper.force"] += 0.1 * scenario.step
    for switching in (False, True):
        how, found = estimate(scenario, first, again)
        assert how == "h, h/2, h/4"
        assert found["damper.force"].order == pytest.approx(1.0)
        assert found["damper.force"].worth is not switching
        assert found["structure.drift1"].worth  # no step changes it
    first.loc[0.01:, "controller.voltage"] = 8.0  # in all three runs: they agree, perhaps wrongly
    quiet.loc[0.01:, "controller.voltage"] = 8.0
    switching = False
    _, found = estimate(scenario, first, again)
    assert found["controller.voltage"].along == 0.0
    assert "switches" in found["damper.force"].doubt()
    assert not found["damper.force"].worth


def test_our_own_components_are_held_against_the_coupled_engine(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    short = {"run.stop": 0.5}
    with caplog.at_level(logging.WARNING, "bristle"):
        frame = run("half_sine_pulse", short, coupling_error=True, out=tmp_path)
    assert frame.attrs["coupling_error_by"] == "coupled engine"
    exact = run("half_sine_pulse", short, engine="compiled")
    for name in ("structure.base_displacement", "damper.force", "damper.dissipated_energy"):
        error = frame.attrs["coupling_error"][name]
        true = float((frame[name] - exact[name]).abs().max() / exact[name].abs().max())
        assert error["along"] == pytest.approx(true, rel=0.02)  # the reference has finer substeps
        assert 1.5 < error["order"] < 2.5
    assert frame.attrs["coupling_error"]["voltage.voltage"]["along"] == 0.0
    assert "coupling error of damper.force, by coupled engine" in (tmp_path / "log").read_text()
    assert not caplog.records


def test_friction_that_jumps_is_warned_of(caplog: pytest.LogCaptureFixture) -> None:
    sliding = {"damper.fmu": "BinghamDamper", "run.stop": 1.0}
    with caplog.at_level(logging.WARNING, "bristle"):
        frame = run("half_sine_pulse", sliding, coupling_error=True)
    assert not frame.attrs["coupling_error"]["damper.force"]["worth"]
    assert any("damper.force" in r.message and "worth nothing" in r.message for r in caplog.records)


def test_friction_that_jumps_spoils_all_that_follows_it() -> None:
    scenario = load_scenario("half_sine_pulse", {"damper.fmu": "BinghamDamper", "run.stop": 0.02})
    frame = AGAIN(scenario, "fmu")
    good, none = against(off(0.01), off(0.005), EXACT), against(EXACT, EXACT, EXACT)
    found = {**dict.fromkeys(map(str, frame), good), "voltage.voltage": none}
    assert without_doubtful(scenario, frame, found)["structure.drift1"].worth
    found["damper.force"] = replace(good, order=0.1, worth=False)
    left = without_doubtful(scenario, frame, found)
    assert not left["structure.drift1"].worth
    assert left["voltage.voltage"].worth  # it follows nothing


def test_a_signal_of_steps_is_not_told_ahead_and_spoils_jacobi_alone() -> None:
    given = {"voltage.fmu": "SignalSource", "connections.damper.voltage": "voltage.value"}
    steps = {
        "voltage.kind": "steps",
        "voltage.steps": "0:2 0.01:8",
        "voltage.parameters.level": 0.0,
    }
    for algorithm in ("midpoint", "jacobi"):
        changed = {**given, **steps, "run.stop": 0.02, "run.algorithm": algorithm}
        scenario = load_scenario("half_sine_pulse", changed)
        assert discrete_outputs(scenario) == ["voltage.value"]
        nodes = make_nodes(scenario, {c.name: c.description for c in scenario.components.values()})
        damper = [node.name for node in nodes].index("damper")
        assert (damper, "voltage") not in held_inputs(nodes)
        assert (damper, "velocity") in held_inputs(nodes)
        frame = AGAIN(scenario, "fmu")
        good = against(off(0.01), off(0.005), EXACT)
        found = dict.fromkeys(map(str, frame), good) | {
            "voltage.value": against(EXACT, EXACT, EXACT)
        }
        left = without_doubtful(scenario, frame, found)
        assert left["damper.force"].worth is (algorithm == "midpoint")
        assert left["voltage.value"].worth


def test_an_error_larger_than_the_peak_is_worth_nothing() -> None:
    found = against(3.0 * EXACT, 2.0 * EXACT, EXACT)
    assert found.order == pytest.approx(1.0)
    assert not found.worth
    assert "larger than the peak" in found.doubt()


def test_a_tolerance_finds_the_largest_step_that_keeps_it(scenario_of: Maker) -> None:
    scenario = load_scenario(oscillator(scenario_of, "midpoint"))
    steps = {t: find_step(scenario, t, AGAIN).step for t in (3e-3, 3e-4, 3e-5)}
    assert steps[3e-5] < steps[3e-4] <= 0.025
    for tolerance, step in steps.items():
        finest = load_scenario(scenario.origin, {"run.step": step, "two.step": step / 2})
        frame = run(finest)
        exact = 1.0 - np.cos(frame.index.to_numpy())
        assert np.abs(frame["one.x"] - exact).max() / 2.0 <= 1.1 * tolerance


def test_a_tolerance_shortens_the_own_steps_of_components_too(
    scenario_of: Maker, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = oscillator(scenario_of, "midpoint")
    given = ["run", str(file), "--no-figure", "--out", str(tmp_path / "out")]
    assert main([*given, "--tolerance", "0.003%"]) == 0
    made = load_results(tmp_path / "out").attrs["made"]
    step = find_step(load_scenario(file), 3e-5, AGAIN).step
    assert step < load_scenario(file).step
    assert made["overrides"] == {"run.step": step, "two.step": step / 2}
    assert f"({1e3 * step / 2:.6g} ms of two)" in capsys.readouterr().err


def test_a_tolerance_that_nothing_keeps_is_refused(scenario_of: Maker) -> None:
    scenario = load_scenario(oscillator(scenario_of, "midpoint"))
    quiet = AGAIN(scenario, "fmu")
    noise = np.random.default_rng(1)

    def noisy(one: System, engine: str) -> pd.DataFrame:
        rows = round(one.steps / scenario.steps)
        frame = quiet.loc[quiet.index.repeat(rows)].iloc[rows - 1 :]
        if engine == "compiled":
            raise ScenarioError("foreign")
        return frame + noise.normal(size=frame.shape)

    with pytest.raises(RunError, match=r"(?s)unknown, at least .* nothing to hold a tolerance"):
        find_step(scenario, 1e-3, noisy)


@pytest.mark.parametrize("text", ["", "abc", "-1%", "0", "150%", "nan"])
def test_a_tolerance_that_is_no_share_is_refused(
    text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", "half_sine_pulse", f"--tolerance={text}"]) == 2
    assert "as 0.2% or 0.002" in capsys.readouterr().err


@pytest.mark.slow  # 3 s, runs at finer steps: a tolerance of foreign FMUs is by default
def test_the_command_line_prints_the_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = ["run", "half_sine_pulse", "--set", "run.stop=0.3", "--no-figure"]
    given += ["--out", str(tmp_path)]
    assert main([*given, "--tolerance", "0.3%"]) == 0  # at 2 ms, as the scenario says, it is 0.35 %
    told = capsys.readouterr()
    assert "a step of 1 ms keeps the coupling error below 0.3 %" in told.err
    assert "Coupling error at 1 ms, by coupled engine, in %" in told.out
    assert "order" in told.out
    assert main([*given, "--tolerance", "0.3%", "--engine", "compiled"]) == 2
