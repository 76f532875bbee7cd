"""A plan of a building: its ground motions keep the table's limits, and sensors are told that help.

The long test plans for a tower whose damper's force was not measured.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bristle
from bristle.cli import main
from bristle.data.ground_motion import GroundMotion, read_ground_motion
from bristle.data.measurement import Measurement
from bristle.errors import RecordError, StudyError
from bristle.examples.make import Choice, make_building, perform_plan
from bristle.planning.building import ONE_FORCE, BuildingPlan, limits_of_shaking
from bristle.planning.folder import ROLES, read_plan
from bristle.planning.information import Goal
from bristle.planning.limits import RESERVE, PrescribedSignals, RigLimits, Test, read_rig
from bristle.planning.plan import Outcome
from bristle.planning.questions import are_twins, default_requests, twins_of
from bristle.planning.shaking_table import Columns, ShakingTable, TablePlanner
from bristle.planning.waveforms import (
    Command,
    Waveform,
    displacement_of,
    records_at_hand,
    scalable,
    shape_of,
)
from bristle.prediction.model_system import BuildingWithFile
from bristle.study.steps import create_study
from tests.shaken import building, friction, measured, shake

Array = NDArray[np.float64]
TOWER = building(1, seed=2)
LIMITS = RigLimits(
    0.02, 0.2, 4.0, band=(0.5, 8.0), command=(0.0, 5.0), duration=10.0, rate=200.0,
    damper_stroke=0.01, drift=0.005,
)  # fmt: skip


@pytest.fixture(scope="module")
def run() -> Measurement:
    clean = shake(TOWER, 3, friction, samples=2500)
    clean["voltage"] = 2.0 + np.sin(clean["time"])
    return measured(clean, 3, without=("floor1_velocity", "floor1_acceleration_absolute", "force"))


# --- ground motions


def test_a_table_that_runs_a_record_shows_its_acceleration() -> None:
    motion = read_ground_motion("el_centro_1940_ns", Path())
    test = Test(scalable(motion, 200.0, 12.0, 0.2), Command("held", 0.0, 0.0), seconds=12.0)
    one = test.signals(replace(LIMITS, stroke=10.0, speed=10.0, acceleration=3.0))
    assert np.max(np.abs(one.a)) == pytest.approx(RESERVE * 3.0, rel=1e-3)
    for rests in (one.x, one.v, one.a):
        assert max(abs(rests[0]), abs(rests[-1])) < 0.01 * np.max(np.abs(rests))
    felt = np.interp(motion.time[0] + one.time, motion.time, motion.acceleration)
    alike = [np.corrcoef(one.a, np.roll(felt, k))[0, 1] for k in range(-600, 600, 2)]
    assert max(alike) > 0.9  # but for what is slow, and both ends


def test_a_sine_comes_back_from_its_acceleration() -> None:
    t = np.arange(4000) / 200.0
    x, _, a = (0.01 * one for one in shape_of(Waveform("sine", 0.5, 2.0), t))
    np.testing.assert_allclose(displacement_of(a, 0.005, 0.1), x, atol=2e-4)


def test_the_strongest_stretch_of_a_long_record_is_taken() -> None:
    t = np.arange(8000) / 200.0
    strong = np.where((t > 25.0) & (t < 33.0), 3.0, 0.1) * np.sin(2.0 * np.pi * t)
    found = scalable(GroundMotion(t, strong, "late", "test"), 200.0, 10.0, 0.2)
    assert len(found.record) == 2001
    assert np.std(found.record) > 0.9 * 3.0 / (2.0 * np.pi) ** 2 * np.sqrt(0.5 * 8.0 / 10.0)


def test_a_record_that_is_still_or_missing_is_refused(run: Measurement) -> None:
    still = GroundMotion(np.arange(100) * 0.01, np.zeros(100), "still", "test")
    with pytest.raises(RecordError, match="still: the ground does not move"):
        scalable(still, 200.0, 10.0, 0.2)
    with pytest.raises(RecordError, match="no ground motion has this name"):
        records_at_hand([run], ["nowhere.at2"], Path())
    names = [one.name for one in records_at_hand([run], [], Path())]
    assert names == ["el_centro_1940_ns", "the ground motion of run"]


# --- the table


def table(run: Measurement, noise: dict[str, float] | None = None) -> ShakingTable:
    model: Any = None  # what simulates is not asked here
    std = run.noise if noise is None else noise
    return ShakingTable(model, BuildingWithFile(TOWER), run, std, 5.0)


def response(signals: PrescribedSignals, size: float = 0.1) -> dict[str, Array]:
    """Return a response in proportion to the ground: the base moves by `size` m per m/s2."""
    out = {"damper.force": 10.0 * signals.a}
    for k, level in enumerate(("base", "floor1")):
        out[f"structure.{level}_displacement"] = (1.0 + 0.1 * k) * size * signals.a
        out[f"structure.{level}_velocity"] = size * signals.a
        out[f"structure.{level}_acceleration_absolute"] = signals.a
    return out


def shaking(size: float = 1.0, rate: float = 0.0) -> PrescribedSignals:
    motion = Waveform("sweep", 0.5, 8.0)
    return Test(motion, Command("held", 0.0, 3.0), size, 10.0).signals(LIMITS, rate)


def test_a_planned_run_has_the_channels_of_the_study_with_their_noise(run: Measurement) -> None:
    one = shaking()
    shown = table(run).measured(one, response(one))
    assert sorted(shown.channels) == sorted(run.channels)
    assert shown.step == pytest.approx(one.dt)
    error = shown["base_displacement"] - response(one)["structure.base_displacement"]
    assert np.std(error) == pytest.approx(run.noise["base_displacement"], rel=0.1)


def test_the_largest_values_are_held_against_their_limits(run: Measurement) -> None:
    one = shaking()
    peak = float(np.max(np.abs(one.a)))
    found = table(run).demands(response(one))
    assert found["damper_stroke"] == pytest.approx(0.1 * peak)
    assert found["drift"] == pytest.approx(0.01 * peak)
    assert found["force"] == pytest.approx(10.0 * peak)
    ratio = 0.1 * peak / (RESERVE * LIMITS.damper_stroke)
    assert table(run).excess(response(one), LIMITS) == pytest.approx(ratio)


class Still(ShakingTable):
    """A table whose building moves by a thousandth, a tenth or a hundredth of a metre per m/s2."""

    size = 0.1

    def response(self, signals: PrescribedSignals) -> Columns | None:
        return response(signals, self.size)


def planner(run: Measurement, size: float, limits: RigLimits = LIMITS) -> TablePlanner:
    own = Still(None, BuildingWithFile(TOWER), run, run.noise, 5.0, Path())  # type: ignore[arg-type]
    object.__setattr__(own, "size", size)
    return TablePlanner(
        Goal((), (), 0, lambda _: 0.0), limits, 0.0, np.zeros((0, 0, 4)), limits.rate,
        candidates=8, improved=4, table=own, show=lambda _: {},
    )  # fmt: skip


def test_a_test_is_made_smaller_until_it_keeps_the_limits(run: Measurement) -> None:
    found = planner(run, 0.1).plan()
    assert len(found) == LIMITS.runs
    for one in found:
        moved = 0.1 * float(np.max(np.abs(one.signals.a)))
        assert 0.03 * LIMITS.damper_stroke < moved <= RESERVE * LIMITS.damper_stroke
        assert float(np.max(np.abs(one.signals.x))) <= RESERVE * LIMITS.stroke * (1.0 + 1e-9)
        assert one.signals.v[0] == pytest.approx(0.0, abs=1e-6)


def test_limits_that_allow_no_ground_motion_are_refused(run: Measurement) -> None:
    with pytest.raises(StudyError, match="no ground motion stays within the limits and moves"):
        planner(run, 1e-5).plan()


def test_records_are_half_of_what_is_looked_at(run: Measurement) -> None:
    record = Waveform("record", 0.2, 100.0, record=(0.0, 1.0, 0.0), name="quake")
    own = replace(planner(run, 0.1), records=(record,))
    kinds = [one.motion.kind for one in own._candidates()]
    assert kinds.count("record") == len(kinds) // 2
    assert {*kinds} > {"record"}
    assert not [one for one in planner(run, 0.1)._candidates() if one.motion.kind == "record"]


def test_limits_are_what_table_and_amplifier_have_done(run: Measurement) -> None:
    found = limits_of_shaking([run], {}, BuildingWithFile(TOWER))
    peak = float(np.max(np.abs(run["ground_acceleration"])))
    assert found.acceleration == pytest.approx(peak / RESERVE, rel=0.1)
    assert found.command == pytest.approx((1.0, 3.0), abs=0.1)
    assert found.rate == pytest.approx(500.0)
    assert (found.motions, found.damper_stroke) == (("sweep", "multisine"), np.inf)


def test_limits_of_a_building_are_read_with_their_units(tmp_path: Path) -> None:
    file = tmp_path / "rig.toml"
    file.write_text('schema = 1\n[limits]\ndamper_stroke = "12 mm"\ndrift = "4 mm"\n')
    assert read_rig(file) == pytest.approx({"damper_stroke": 0.012, "drift": 0.004})
    with pytest.raises(StudyError, match="drift = 0 m: these limits allow no motion"):
        replace(LIMITS, drift=0.0).check()


# --- purposes


def test_what_the_verdict_leaves_open_is_the_purpose() -> None:
    (all_of_it,) = default_requests({})
    assert (all_of_it.request.see, all_of_it.request.sharpen, all_of_it.sites) == ((), (), ())
    storey = {"site": "storey1", "kind": "ambiguous", "effects": ["storey_softening", "duffing"]}
    layer = {"site": "layer", "kind": "unknown", "effects": []}
    first, second = default_requests({"kind": "unknown", "findings": [storey, layer]})
    assert (first.request.separate, first.sites) == (("storey_softening", "duffing"), ("storey1",))
    assert (second.request.learn, second.sites) == ((), ("layer",))


@pytest.mark.parametrize(
    ("named", "rivals"),
    [
        ("gas_spring", ("gas_spring", "duffing")),
        ("base_friction", ("base_friction", "base_friction@damper")),
        ("end_stop", ("end_stop", "end_stop@damper")),
    ],
)
def test_what_adds_up_to_one_force_is_to_be_told_apart(named: str, rivals: tuple[str, ...]) -> None:
    verdict = {
        "kind": "ambiguous", "force": "reconstructed",
        "findings": [{"site": "damper", "kind": "effect", "effects": [named]}],
    }  # fmt: skip
    (found,) = default_requests(verdict)
    assert (found.request.separate, found.sites) == (rivals, ("damper",))
    assert are_twins(*rivals)
    assert are_twins(*rivals[::-1])
    measured_force = default_requests({**verdict, "force": "measured"})
    assert measured_force[0].request.separate is None


def test_a_coil_has_no_twin_in_the_layer() -> None:
    assert twins_of("coil_lag") == []
    assert not are_twins("coil_lag", "gas_spring")
    assert not are_twins("none", "gas_spring")


# --- what is told


PAIR = Outcome("separate", "damper: gas_spring or duffing", ONE_FORCE, "std", 0.0, 310.0)


def a_plan(**changed: Any) -> BuildingPlan:
    record = Waveform("record", 0.2, 100.0, record=(0.0, 0.01, 0.0), name="quake")
    tests = [
        Test(record, Command("held", 0.0, 3.0), 1.0, 10.0),
        Test(Waveform("sweep", 0.5, 8.0), Command("switched", 0.0, 3.0), 0.5, 10.0),
    ]
    signals = tuple(shaking(one.share) for one in tests)
    rows = (replace(PAIR, settled=False),)
    base = tuple(0.001 * one.a for one in signals)
    given = {"predicted": base} | changed
    roles = ("train", "holdout")
    return BuildingPlan(
        "tower", tuple(tests), signals, rows, LIMITS, "voltage", 1.0, roles, **given
    )


def test_what_no_motion_tells_apart_needs_a_load_cell() -> None:
    said = replace(a_plan(), gain=2.0).sentences()
    assert said[0].startswith("plan_1 (train): quake times ")
    assert "voltage held at 3 V; the base moves by " in said[0]
    assert said[2].endswith("no motion tells them apart, a load cell at the damper does.")
    alone = a_plan()
    assert not alone.worth
    assert "Nothing is left to gain" in alone.sentences()[-1]


def test_the_folder_is_one_that_a_table_takes(tmp_path: Path) -> None:
    plan = a_plan()
    plan.write(tmp_path / "plan")
    found = read_plan(tmp_path / "plan")
    assert (found.rig, found.command, found.motion) == (
        "structure", "voltage", "ground_acceleration",
    )  # fmt: skip
    np.testing.assert_allclose(
        found.runs[1].signals["ground_acceleration"], plan.signals[1].a, atol=1e-8
    )
    assert (tmp_path / "plan" / "plan_2.png").stat().st_size > 10_000
    page = (tmp_path / "plan" / "plan.md").read_text()
    assert "## What they will show" in page
    assert (tmp_path / "plan" / "outcomes.json").is_file()


def test_a_bench_has_no_ground_motion(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    t = np.arange(1000) / 200.0
    rows = np.column_stack([t, 10.0 * np.sin(6.0 * t), 5.0 * np.cos(6.0 * t)])
    file, head = tmp_path / "run.csv", "time [s],x [mm],F [N]"
    np.savetxt(file, rows, delimiter=",", header=head, comments="")
    create_study(tmp_path / "rig", [file], law="bingham")
    assert main(["plan", str(tmp_path / "rig"), "--record", "el_centro_1940_ns"]) == 2
    assert "a damper on a bench has no ground motion" in capsys.readouterr().err


# --- the whole of it


@pytest.mark.slow  # a building is identified, diagnosed and planned
def test_a_load_cell_is_asked_for_where_no_motion_tells(tmp_path: Path) -> None:
    make_building(
        tmp_path / "tower", Choice(effects=("gas_spring",), law="lugre", seed=5), load_cell=False
    )
    study = bristle.Study(tmp_path / "tower")
    bristle.identify(study)
    bristle.diagnose(study)
    limits = {"damper_stroke": "9 mm", "acceleration": "2 m/s2"}
    plan = bristle.plan(study, **limits)
    assert isinstance(plan, BuildingPlan)
    assert any(said.endswith("a load cell at the damper does.") for said in plan.sentences())
    assert [one.what for one in plan.outcomes] == [ONE_FORCE]
    for one, moved in zip(plan.signals, plan.predicted, strict=True):
        assert np.max(np.abs(moved)) <= RESERVE * 0.009 * (1.0 + 1e-9)
        assert np.max(np.abs(one.a)) <= RESERVE * 2.0 * (1.0 + 1e-9)
    plan.write(tmp_path / "plan")
    done = perform_plan(tmp_path / "tower", tmp_path / "plan")
    assert len(done.runs) == len(plan.tests)
    seen = {run.name: run for role in ROLES for run in done.study.read(role)}
    for k, moved in enumerate(plan.predicted, 1):
        peak = float(np.max(np.abs(seen[f"plan_{k}"]["base_displacement"])))
        assert peak == pytest.approx(float(np.max(np.abs(moved))), rel=0.15)
        assert peak < 0.009


@pytest.mark.slow  # a plan at every site
def test_all_sites_are_asked_and_a_wrong_name_is_told(tmp_path: Path) -> None:
    make_building(tmp_path / "tower", Choice(nothing=True, law="lugre", seed=7))
    study = bristle.Study(tmp_path / "tower")
    bristle.identify(study)
    with pytest.raises(StudyError, match='no effect "flattering"'):
        bristle.plan(study, see="flattering")
    with pytest.raises(StudyError, match=r'no parameter "layer\.f"'):
        bristle.plan(study, sharpen="layer.f")
    with pytest.raises(StudyError, match="no ground motion stays within"):
        bristle.plan(study, see="coil_lag", acceleration="1 um/s2")
    plan = bristle.plan(study, runs=2)
    sites = {one.name.partition(": ")[0] for one in plan.outcomes}
    assert sites == {"storey1", "storey2", "layer", "damper"}
    sharpened = [one for one in plan.outcomes if one.purpose == "sharpen"]
    assert all(one.then < one.now for one in sharpened)
