"""Dampers at any level, identified: the truth lies in the intervals, what is lacking is named."""

from __future__ import annotations

import numpy as np
import pytest
from braced import BRACE, brace, noisy, shake, tie, tower

import bristle
from bristle.data.channels import at_device, channel_unit, no_device
from bristle.errors import PhysicsError, RecordError, StudyError
from bristle.identification.building_fit import building_text, identify_structure
from bristle.identification.building_motion import responses
from bristle.identification.building_sites import motion_across, sliding, storey_run
from bristle.identification.equilibrium import equations_of, reconstructed, stiffness_matrix
from bristle.identification.rig import building_rig
from bristle.model.model import Model
from bristle.physics.building import GROUND, Device, with_damper
from bristle.study.inputs import measurements

STOREY = {"name": "brace", "at": "storey2"}
TWO_STOREYS = {"name": "brace", "between": ["floor1", "floor3"]}
FROM_GROUND = {"name": "brace", "between": ["ground", "floor2"]}
TIE = {"name": "tie", "between": ["ground", "floor2"]}
LAWS = {"brace": (brace, True), "tie": (tie, False)}
NO_CELL = ("brace_force",)


def laws_of(devices):
    """Return the laws of these devices."""
    return {one["name"]: LAWS[one["name"]] for one in devices}


def runs_of(devices, seeds, without=(), **building):
    """Return a building with the brace as its damper, and runs of it."""
    b = with_damper(tower(devices, **building), "brace")
    clean = [shake(b, seed, laws_of(devices)) for seed in seeds]
    return b, [noisy(run, seed, without=without) for run, seed in zip(clean, seeds, strict=True)]


def off(b, known=(), factor=1.2):
    """Return a building with other stiffnesses to begin with, apart from those that are known."""
    k = np.array([one * (1.0 if i in known else factor) for i, one in enumerate(b.stiffnesses)])
    return b._replace(K=tuple(map(tuple, stiffness_matrix(b, k).tolist())), stiffnesses=tuple(k))


def held(errors, most=5.0, share=0.75):
    """Assert that errors in standard deviations are those of intervals of 95 %."""
    errors = np.concatenate(errors)
    assert np.mean(np.abs(errors) < 1.96) > share, errors
    assert np.max(np.abs(errors)) < most, errors


# -- the building


@pytest.mark.parametrize(
    ("devices", "without", "told"),
    [
        # Half a second each: by default with a load cell, beside a tie, and over two storeys.
        ([STOREY], (), (0, 1, 2)),
        pytest.param([STOREY], NO_CELL, (0, 2), marks=pytest.mark.slow),
        ([STOREY, TIE], NO_CELL, (0, 2)),
        pytest.param([STOREY, TIE], (), (0, 1, 2), marks=pytest.mark.slow),
        # Half a second each: other places of a device.
        pytest.param([TWO_STOREYS], (), (0, 1, 2), marks=pytest.mark.slow),
        ([TWO_STOREYS], NO_CELL, (0, 1, 2)),  # the level between has no unknown force
        pytest.param([FROM_GROUND], NO_CELL, (0, 1, 2), marks=pytest.mark.slow),
    ],
)
def test_stiffnesses_come_back_within_their_intervals(devices, without, told):
    errors = []
    told = np.array(told)
    hidden = [i for i in range(3) if i not in told]
    for seed in range(3):
        b, runs = runs_of(devices, [seed], without)
        given = off(b, hidden)
        fit = identify_structure(measurements(runs, building=b), given)
        truth = np.array(b.stiffnesses)
        errors.append((fit.stiffnesses - truth)[told] / fit.std_stiffnesses[told])
        finite = np.isfinite(fit.std_damping_ratios)
        errors.append((fit.damping_ratios - 0.02)[finite] / fit.std_damping_ratios[finite])
        assert np.all(fit.std_stiffnesses[told] < 2e-3 * truth[told])
        assert fit.z[np.isfinite(fit.z)] == pytest.approx(1.0, abs=0.15)
        assert [f"stiffness below {b.levels()[i]}" in fit.unidentified for i in range(3)] == [
            i in hidden for i in range(3)
        ]
    held(errors)
    if hidden:
        assert "values below floor2 stay as given" in fit.notes[0]


def test_equations_have_no_unknown_force():
    for lower, upper in ((GROUND, 0), (0, 1), (GROUND, 2), (0, 3)):
        device = Device("brace", lower, upper)
        found = equations_of(4, device)
        assert found.weights @ np.array(device.incidence(4)) == pytest.approx(0.0)
        assert np.linalg.matrix_rank(found.weights) == 3
        neighbours = upper - lower == 1
        assert found.told == tuple(i for i in range(4) if not (neighbours and i == upper))
    assert equations_of(4).told == (0, 1, 2, 3)


def test_the_file_of_an_identified_building_keeps_its_devices():
    b, runs = runs_of([STOREY, TIE], [1])
    fit = identify_structure(measurements(runs, building=b), off(b))
    assert 'name = "tie"\nbetween = ["ground", "floor2"]' in building_text(fit)


# -- motion and force of a device


def test_the_motion_across_a_storey_errs_as_much_as_it_says():
    b = with_damper(tower([STOREY]), "brace")
    clean = shake(b, 3, laws_of([STOREY]))
    (run,) = measurements([noisy(clean, 3)], building=b)
    x, v, _, std, error = motion_across(responses([run], b)[0])
    for k, (found, what) in enumerate(((x, "displacement"), (v, "velocity"))):
        left = (found - clean[f"floor2_{what}"] + clean[f"floor1_{what}"])[50:-50]
        assert 0.6 < np.std(left) / np.std(error[:, 50:-50, k]) < 1.25
    assert std == pytest.approx(np.std(error[:, 50:-50, 1]), rel=0.2)


@pytest.mark.parametrize(
    "devices", [[STOREY], [STOREY, TIE], [TWO_STOREYS], [FROM_GROUND]], ids=str
)
def test_equilibrium_gives_the_force_and_its_noise(devices):
    b = with_damper(tower(devices), "brace")
    clean = shake(b, 4, laws_of(devices))
    (run,) = measurements([noisy(clean, 4, without=NO_CELL)], building=b)
    found = reconstructed(responses([run], b)[0], b)
    error = (found.force - clean["brace_force"])[50:-50]
    assert np.std(error) == pytest.approx(found.noise, rel=0.3)
    assert np.std(error) < 0.05 * np.std(clean["brace_force"])
    assert np.hypot(found.white, np.std(found.error)) == pytest.approx(found.noise, rel=0.3)


def test_forces_of_all_devices_are_taken_off_a_storeys_shear():
    devices = [STOREY, TIE]
    b = with_damper(tower(devices), "brace")
    clean = shake(b, 5, laws_of(devices))
    (run,) = measurements([noisy(clean, 5, noise=1e-5)], building=b)
    response = responses([run], b)[0]
    for level in range(3):
        below = clean[f"floor{level}_displacement"] if level else 0.0
        spring = b.stiffnesses[level] * (clean[f"floor{level + 1}_displacement"] - below)
        carried = storey_run(response, b, level).whole.force
        assert np.std((carried - spring)[50:]) < 2e-3 * np.std(spring)


# -- the law


@pytest.mark.parametrize(
    ("devices", "without"),
    [
        # A second each; by default the study of a brace beside a tie shows those with a load cell
        # (tests/contract/studies).
        pytest.param([STOREY], (), marks=pytest.mark.slow),
        ([STOREY], NO_CELL),
        pytest.param([STOREY, TIE], (), marks=pytest.mark.slow),
        pytest.param([STOREY, TIE], NO_CELL, marks=pytest.mark.slow),
        # A second each: other places of a device.
        pytest.param([TWO_STOREYS], (), marks=pytest.mark.slow),
        ([TWO_STOREYS], NO_CELL),
    ],
)
def test_the_laws_parameters_come_back_within_their_intervals(devices, without):
    errors = []
    for seed in (0, 4):
        b, runs = runs_of(devices, [seed, seed + 1], without)
        found = bristle.identify(runs, "tanh", building=b, device="brace")
        rows = {row["name"]: row for row in found.parameters() if row["name"] in BRACE}
        assert set(rows) == set(BRACE)
        errors.append(
            np.array([1.96 * (r["value"] - BRACE[n]) / r["interval95"] for n, r in rows.items()])
        )
        for name, row in rows.items():
            assert row["value"] == pytest.approx(BRACE[name], rel=0.05)
        assert found.after["z_holdout"] == pytest.approx(1.0, abs=0.12)
    held(errors, share=0.7)
    hidden = [note for note in found.notes if "was not measured: it is computed" in note]
    assert bool(hidden) == bool(without)
    if without:
        place = "at storey2" if devices[0] is STOREY else "between floor1 and floor3"
        assert f"force (brace, {place})" in hidden[0]


def test_sites_are_those_that_forces_part():
    def shown(devices, without=(), **building):
        b, runs = runs_of(devices, [1], without, **building)
        rig = building_rig(measurements(runs, building=b), [], b)
        return list(rig.sites(Model("tanh")))

    every = ["storey1", "storey2", "storey3", "damper"]
    assert shown([STOREY, TIE]) == every
    assert shown([STOREY], NO_CELL) == ["storey1", "storey3", "damper"]
    assert shown([TWO_STOREYS], NO_CELL) == ["storey1", "damper"]
    storey1 = {"name": "brace", "at": "storey1"}
    # The isolation layer is told though no load cell shows the brace above it.
    assert shown([storey1], NO_CELL, floors=2, isolated=True) == ["storey2", "layer", "damper"]


@pytest.mark.parametrize(
    # Two seconds: the force computed.
    "without",
    [(), pytest.param(("force", "iso_force"), marks=pytest.mark.slow)],
)
def test_a_device_on_the_first_level_is_the_damper_of_before(without):
    named = tower([{"name": "iso", "at": "isolation"}], floors=2, isolated=True)
    plain = tower([], floors=2, isolated=True)
    clean = [shake(plain, seed, {"": (brace, True)}) for seed in (1, 2)]
    before = [noisy(run, k, without=without) for k, run in enumerate(clean)]
    theirs = {"force": "iso_force", "voltage": "iso_voltage"}
    after = [{theirs.get(n, n): y for n, y in run.items()} for run in before]
    found = [
        bristle.identify(runs, "tanh", building=b)
        for runs, b in ((before, plain), (after, named), (before, named))
    ]
    rows = [{row["name"]: row for row in one.parameters()} for one in found]
    for name in rows[0]:
        for other in rows[1:]:
            for key in ("value", "interval95"):
                ours, theirs = (np.array(one[name][key], dtype=float) for one in (rows[0], other))
                np.testing.assert_allclose(theirs, ours, rtol=1e-12)
    for one in found[1:]:
        assert one.after == pytest.approx(found[0].after, rel=1e-12)
    fits = [
        identify_structure(measurements(runs, building=with_damper(b)), off(b))
        for runs, b in ((before, plain), (after, named))
    ]
    assert fits[1].stiffnesses == pytest.approx(fits[0].stiffnesses, rel=1e-12)
    assert fits[1].std_damping_ratios == pytest.approx(fits[0].std_damping_ratios, rel=1e-12)


def test_a_model_is_compared_at_a_device():
    b, runs = runs_of([STOREY], [1, 2])
    found = bristle.identify(runs, "tanh", building=b)
    spring = {**runs[0], "brace_force": runs[0]["brace_force"].copy()}
    drift = spring["floor2_displacement"] - spring["floor1_displacement"]
    spring["brace_force"] += 200.0 * drift
    assert bristle.compare(runs[0], found, building=b).z == pytest.approx(1.0, abs=0.15)
    worse = bristle.compare(spring, found, building=b)
    assert worse.z > 5.0
    assert worse.site == "damper"


# -- what is refused


def test_what_is_lacking_is_named():
    b, runs = runs_of([STOREY, TIE], [1], without=("tie_force",))
    missing = r"missing tie_force \(between the ground and floor2\)\. The device that is "
    with pytest.raises(RecordError, match=missing + r"identified is 'brace'; the forces of all"):
        bristle.identify(runs, "tanh", building=b)
    several = r"has 2 devices.* device = 'brace' or 'tie' \(in study\.toml, or --device\) is right"
    with pytest.raises(PhysicsError, match=several):
        bristle.identify(runs, "tanh", building=tower([STOREY, TIE]))
    with pytest.raises(PhysicsError, match="has no device 'roof'; there are brace, tie"):
        bristle.identify(runs, "tanh", building=tower([STOREY, TIE]), device="roof")
    with pytest.raises(StudyError, match="names one of a building, and none is given"):
        bristle.identify(runs, "tanh", device="brace")
    both = {**noisy(shake(b, 1, laws_of([STOREY, TIE])), 1)}
    both["force"] = both["brace_force"]
    with pytest.raises(RecordError, match="brace_force and force are both channels of the device"):
        bristle.identify([both], "tanh", building=b)


def test_a_displacement_that_no_level_gives_is_refused():
    upper = tuple(f"floor{i}_displacement" for i in (2, 3))
    for lost, able in ((upper[1:], True), (upper, False)):
        b, runs = runs_of([STOREY], [1], (*NO_CELL, *lost))
        (run,) = measurements(runs, building=b)
        if able:  # storey 3 has no device: floor 2 gives what is slow of floor 3
            assert responses([run], b)[0].x.shape[0] == 3
            continue
        with pytest.raises(RecordError, match="floor2_displacement was not measured, and no other"):
            responses([run], b)[0]


def test_a_damper_that_stands_still_is_refused():
    b, runs = runs_of([STOREY], [1])
    still = dict(runs[0])
    random = np.random.default_rng(3)
    for what in ("displacement", "velocity", "acceleration_absolute"):
        noise = 1e-3 * np.std(still[f"floor1_{what}"]) * random.normal(size=len(still["time"]))
        still[f"floor2_{what}"] = still[f"floor1_{what}"] + noise
    response = responses([measurements([still], building=b)[0]], b)[0]
    assert sliding(response).any()
    rig = building_rig(measurements([still], building=b), [], b)
    with pytest.raises(RecordError, match="the damper does not move"):
        rig.sites(Model("bingham"))


def test_effects_of_the_layer_are_not_a_storey_dampers():
    b, runs = runs_of([STOREY], [1], NO_CELL)
    rig = building_rig(measurements(runs, building=b), [], b)
    with pytest.raises(StudyError, match=r"duffing.*acts at no site.*storey1, storey3, damper"):
        rig.sites(Model("tanh", ("duffing",)))


def test_channels_of_devices_have_their_units_and_owners():
    assert (channel_unit("brace_force"), channel_unit("brace_voltage")) == ("N", "V")
    assert at_device("brace_force", "brace") == "force"
    assert at_device("tie_force", "brace") == "tie_force"
    assert at_device("holding_force", "holding") == "holding_force"
    assert no_device("tie_force", ["tie"]) == no_device("floor1_velocity", []) == ""
    assert (
        no_device("tie_force", ["brace"]) == 'tie_force: there is no device "tie"; there are brace'
    )
