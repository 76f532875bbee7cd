"""A study of a damper between two levels, from its files to its FMU in the building."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from braced import BRACE, brace, noisy, shake, tower
from studies import DEVICES, braced_tower

import bristle
from bristle.errors import PhysicsError, StudyError
from bristle.page import data_views
from bristle.prediction.excitation import house_of
from bristle.prediction.model_system import others_of, shaking_of
from bristle.report.study_page import commands
from bristle.study.data_check import check_data
from bristle.study.rig import building_of
from bristle.study.steps import identify_building_alone
from bristle.study.study import Study


@pytest.fixture
def two(device_study):
    """Return the study of a brace beside a tie whose force is measured, identified."""
    return Study(device_study)


def test_the_commands_that_make_a_study_again_name_its_device(two):
    assert "--device brace" in commands(two)[0]


def test_a_study_is_about_the_device_that_is_named(two):
    text = (two.folder / "study.toml").read_text()
    assert 'device = "brace"' in text
    assert "[channels.brace_force]" in text
    assert "[channels.tie_force]" in text
    assert building_of(two, two.model()).studied == "brace"
    (run, *_) = two.read()
    assert run.has("force", "voltage", "tie_force")
    assert two.drive == "voltage"
    values = two.model().values
    for name, value in BRACE.items():
        assert values[name] == pytest.approx(value, rel=0.05)


def test_its_error_is_noise_and_its_force_resists_the_motion_across_it(two):
    assert bristle.compare(two).z == pytest.approx(1.0, abs=0.15)
    checked = check_data(two)
    assert checked.ok
    assert not [one for one in checked.findings if "resists" in one.text or "sign" in one.text]


def test_the_building_is_identified_beside_its_devices(two):
    found = identify_building_alone(two, write=False)
    truth = [1400.0, 1310.0, 1220.0]
    assert found.fit.stiffnesses == pytest.approx(truth, rel=2e-3)
    assert found.after["z_equilibrium_holdout"] < 1.2


def test_a_plan_and_a_building_for_several_dampers_are_refused(two, tmp_path):
    with pytest.raises(StudyError, match=r"no test can be planned beside tie\. A plan is for"):
        bristle.plan(two)
    with pytest.raises(StudyError, match=r"places for 2 dampers \(brace, tie\), and a study is of"):
        house_of(two.folder / "tower.toml")
    shaking = replace(shaking_of(two.read()[0]), others={})
    with pytest.raises(StudyError, match="the force of tie is not known"):
        others_of(building_of(two, two.model()), shaking)


def test_a_study_without_the_key_is_about_the_only_device(tmp_path):
    house = braced_tower(tmp_path, DEVICES[:1], without=("brace_force",), fine=1)
    study = Study.create(
        tmp_path / "rig", sorted(tmp_path.glob("*.csv")), rig="structure", building=house,
        law="tanh",
    )  # fmt: skip
    assert study.settings.device == "brace"
    file = study.folder / "study.toml"
    text = file.read_text()
    file.write_text("\n".join(line for line in text.split("\n") if "device = " not in line))
    again = Study(study.folder)
    assert (again.settings.device, again.drive) == ("brace", "voltage")
    lacking = [one for one in check_data(again).findings if one.kind == "force"]
    assert "the force of brace (at storey1) was not measured" in lacking[0].text


def test_what_is_wrong_with_a_device_is_named(tmp_path):
    house = braced_tower(tmp_path, fine=1)
    files = sorted(tmp_path.glob("*.csv"))

    def new(name, **choices):
        given = {"rig": "structure", "building": house} | choices
        return Study.create(tmp_path / name, files, **given)

    with pytest.raises(PhysicsError, match=r"has 2 devices.*'brace' or 'tie'.*--device"):
        new("a")
    with pytest.raises(PhysicsError, match="has no device 'roof'; there are brace, tie"):
        new("b", device="roof")
    with pytest.raises(StudyError, match="--device goes with --building"):
        new("c", building=None, device="brace")
    study = new("d", device="brace")
    file = study.folder / "study.toml"
    text = file.read_text()
    file.write_text(text.replace("[channels.tie_force]", "[channels.roof_force]"))
    with pytest.raises(bristle.errors.RecordError, match='roof_force: there is no device "roof"'):
        bristle.identify(Study(study.folder))
    file.write_text(text.replace("[channels.tie_force]", "[channels.force]"))
    with pytest.raises(StudyError, match=r"toml:\d+: brace_force and force are both of the device"):
        Study(study.folder)
    file.write_text(text.replace('rig = "structure"', 'rig = "bench"'))
    with pytest.raises(StudyError, match='device goes with rig = "structure"'):
        Study(study.folder)


def test_the_channels_of_devices_are_corrected_by_either_name(tmp_path):
    house = braced_tower(tmp_path, fine=1)
    study = Study.create(
        tmp_path / "rig", sorted(tmp_path.glob("*.csv")), rig="structure", building=house,
        device="brace", law="tanh",
    )  # fmt: skip
    before = study.read()[0]
    column = study.settings.channels["force"].column
    now = study.with_channels({"force": f"-{column}@kN", "tie_force": "-tie_force"})
    text = (now.folder / "study.toml").read_text()
    assert "[channels.brace_force]" in text
    assert "[channels.force]" not in text
    run = now.read()[0]
    np.testing.assert_allclose(run["force"], -1e3 * before["force"])
    np.testing.assert_allclose(run["tie_force"], -before["tie_force"])
    assert now.with_channels({"brace_force": column + "@N"}).settings.channels["force"].sign == 1
    with pytest.raises(StudyError, match='there is no device "roof"; there are brace, tie'):
        now.with_channels({"roof_force": column})
    with pytest.raises(StudyError, match="are one channel here"):
        now.with_channels({"force": column, "brace_force": column})
    shown = data_views.channels_view(now.folder, {})
    assert {"tie_force", "base_displacement"} <= {one["name"] for one in shown["known"]}


@pytest.mark.slow  # two diagnoses at a device
@pytest.mark.parametrize("without", [(), ("brace_force",)])
def test_a_diagnosis_finds_nothing_beside_the_law_and_a_spring_that_is_hidden(tmp_path, without):
    b = tower(DEVICES[:1], floors=2, isolated=True)

    def stiff(x, v, V):
        return brace(x, v, V) + 3e6 * x**3

    for law, kind in ((brace, "none"), (stiff, "effect")):
        runs = [
            noisy(shake(b, 60 + k, {"brace": (law, True)}, samples=4000), k, without=without)
            for k in range(3)
        ]
        found = bristle.diagnose(runs[:2], "tanh", holdout=runs[2], building=b)
        assert found.kind == kind
        if kind == "effect":
            assert found.sites == {"duffing@damper": "damper"}
            assert any("storey's own" in text for text in found.reasons) == bool(without)
