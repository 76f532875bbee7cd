"""The compiled engine beside the FMUs: same columns, same answer, any building; its failures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bristle import run
from bristle.engine.coupled import Coupled
from bristle.engine.results import load_results
from bristle.engine.run import IncompleteRunError
from bristle.fmu.catalogue import component_of_law
from bristle.physics.laws import laws_of
from bristle.system.scenario import load_scenario

BUILDINGS = {
    "fixed": """
masses = [2.0, 1.5, 1.0]
stiffnesses = [3000.0, 2500.0, 2000.0]
base = "fixed"
damping_ratio = 0.02
""",
    "twenty floors": f"""
masses = {[2.0] + [0.2] * 20}
stiffnesses = {[1057.0] + [10e3 - 300.0 * i for i in range(20)]}
base = "isolated"
modal = {[0.03] + [0.02] * 20}
""",
}
SCENARIO = """
schema = 1
title = "half-sine pulse"

[run]
stop = 1.0
step = 0.0005

[components.ground]
fmu = "SignalSource"
parameters = {{ kind = "half_sine", amplitude = 2.0, duration = 0.2 }}

[components.structure]
fmu = "Structure"
{building}

{dampers}

[connections]
"structure.ground_acceleration" = "ground.value"
{wires}
"""
DAMPER = """
[components.{name}]
fmu = "{kind}"
parameters = {{ voltage = 4.0, {parameters} }}
"""
WIRES = """
"structure.{port}" = "{name}.force"
"{name}.displacement" = "structure.{level}_displacement"
"{name}.velocity" = "structure.{level}_velocity"
"""
# Every coefficient that the force is proportional to, or, as a compliance, the reverse, by law.
COEFFICIENTS = {
    component_of_law(law.name): {
        name: (parameter.value, -1.0 if parameter.unit.endswith("/N") else 1.0)
        for name, parameter in law.parameters.items()
        if "N" in parameter.unit
    }
    for law in laws_of("damper")
}


def scenario(
    folder: Path, kind: str, times: list[float], level: str = "base", building: str = ""
) -> Path:
    """Write a scenario with one damper per entry of `times`, its coefficients times that."""
    dampers, wires = [], []
    for factor, port, name in zip(
        times, ("damper_force", "extra_force"), ("damper", "second"), strict=False
    ):
        given = ", ".join(f"{n} = {v * factor**p!r}" for n, (v, p) in COEFFICIENTS[kind].items())
        dampers.append(DAMPER.format(name=name, kind=kind, parameters=given))
        wires.append(WIRES.format(name=name, port=port, level=level))
    file = folder / f"{len(times)}.toml"
    text = SCENARIO.format(building=building, dampers="".join(dampers), wires="".join(wires))
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize("kind", COEFFICIENTS)
def test_two_dampers_are_one_with_twice_the_coefficients(kind: str, tmp_path: Path) -> None:
    one = Coupled().run(load_scenario(scenario(tmp_path, kind, [2.0])))
    two = Coupled().run(load_scenario(scenario(tmp_path, kind, [1.0, 1.0])))
    for name, column in one.values.items():
        if name == "structure.holding_force":
            continue  # the first damper's share of what holds the base, which the second also does
        near = 2e-5 * np.abs(column).max()
        if name in ("damper.force", "damper.dissipated_energy"):
            assert two[name] == pytest.approx(column / 2.0, abs=near), name
            assert two[name.replace("damper", "second")] == pytest.approx(two[name], abs=near)
        else:
            assert two[name] == pytest.approx(column, abs=near), name
    assert np.abs(one["damper.force"]).max() > 1.0


def apart(file: Path, step: float) -> pd.Series[float]:
    """Return the RMS difference of the engines as a share of each column's RMS."""
    fmu, compiled = (run(file, {"run.step": step}, engine=engine) for engine in ("fmu", "compiled"))
    moving = compiled.columns[compiled.abs().max() > 0.0]
    difference = ((fmu[moving] - compiled[moving]) ** 2).mean() / (compiled[moving] ** 2).mean()
    return difference**0.5


@pytest.mark.parametrize(
    "name",
    # A tall building by FMUs at two steps.
    [pytest.param(n, marks=pytest.mark.slow) if n == "twenty floors" else n for n in BUILDINGS],
)
def test_any_building_runs_and_fmus_come_nearer_with_the_step(name: str, tmp_path: Path) -> None:
    (tmp_path / "building.toml").write_text(f"schema = 1\n{BUILDINGS[name]}", encoding="utf-8")
    level, floors = ("floor1", 3) if name == "fixed" else ("base", 20)
    given = 'building = "building.toml"'
    file = scenario(tmp_path, "LuGreDamper", [1.0], level, given)
    coarse, fine = apart(file, 0.001), apart(file, 0.0005)
    assert f"structure.floor{floors}_displacement" in fine
    assert ("structure.base_displacement" in fine) == (name != "fixed")
    assert (fine < 0.01).all()
    # Half the step, half the coupling error: with ever smaller steps both give the same.
    worst = fine.nlargest(5).index
    assert (coarse[worst] / fine[worst]).to_numpy() == pytest.approx(2.0, rel=0.05)


@pytest.mark.parametrize(
    "stock", ["half_sine_pulse", "bingham_half_sine_sticking", "bench_stiction"]
)
def test_columns_are_those_of_the_fmus(stock: str) -> None:
    overrides = {"run.stop": 0.05}
    fmu, compiled = (run(stock, overrides, engine=engine) for engine in ("fmu", "compiled"))
    pd.testing.assert_index_equal(fmu.columns, compiled.columns)
    pd.testing.assert_index_equal(fmu.index, compiled.index)
    pd.testing.assert_series_equal(fmu.dtypes, compiled.dtypes)
    assert fmu.attrs["units"] == compiled.attrs["units"]


@pytest.fixture
def exploding(tmp_path: Path) -> dict[str, object]:
    """Return overrides for a ground whose acceleration leaves what numbers can hold squared."""
    file = tmp_path / "ground.csv"
    file.write_text("time [s],acceleration [m/s2]\n0,0\n0.1,1\n0.2,1e300\n0.3,1e300\n")
    return {"ground.kind": "csv", "ground.file": str(file), "run.stop": 0.3}


def test_a_blow_up_names_component_and_time_and_keeps_the_rows(
    exploding: dict[str, object], tmp_path: Path
) -> None:
    whole = run("half_sine_pulse", {**exploding, "run.stop": 0.1}, engine="compiled")
    with pytest.raises(
        IncompleteRunError,
        match=r"damper at t = 0\.102 s: damper\.dissipated_energy is not finite",
    ) as caught:
        run("half_sine_pulse", exploding, engine="compiled", out=tmp_path / "out")
    frame = caught.value.frame
    assert frame.attrs["complete"] is False
    assert frame.index[-1] == 0.1
    assert np.isfinite(frame.to_numpy()).all()
    np.testing.assert_array_equal(frame.to_numpy(), whole.to_numpy())
    kept = load_results(tmp_path / "out" / "results.csv")
    assert (len(kept), kept.attrs["complete"]) == (len(frame), False)
    assert "error: damper at t = 0.102 s" in (tmp_path / "out" / "log").read_text()


def test_a_force_that_does_not_settle_names_the_damper_and_the_time() -> None:
    # A viscous part that falls from its peak within 10 um/s: no force goes with the motion.
    steep = {"damper.v_n": 1e-5, "damper.sigma_2": 1e7, "run.stop": 1.0}
    with pytest.raises(
        IncompleteRunError, match=r"damper before t = [0-9.]+ s: force and motion do not agree"
    ) as caught:
        run("half_sine_pulse", steep, engine="compiled")
    assert len(caught.value.frame) >= 1
    assert np.isfinite(caught.value.frame.to_numpy()).all()


@pytest.mark.parametrize("damper", ["LuGreDamper", "BinghamDamper"])
@pytest.mark.parametrize(("gap", "k", "c"), [(2e-4, 1e5, 80.0), (3e-5, 3.2e6, 1e4)])
def test_a_joint_with_play_and_damping_goes_beside_a_building(
    damper: str, gap: float, k: float, c: float
) -> None:
    joint = {f"damper.backlash.{name}": v for name, v in (("gap", gap), ("k", k), ("c", c))}
    chosen = {"damper.fmu": damper, "damper.backlash.on": True, **joint, "run.stop": 10.0}
    frame = run("el_centro_0p6g_constant_voltage", chosen, engine="compiled")
    assert frame.attrs["complete"] is True
    assert 1.0 < frame["damper.force"].abs().max() < 20.0
