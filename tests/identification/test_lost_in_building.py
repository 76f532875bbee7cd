"""A building's samples that were not measured have no say, and each run has its own step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shaken
from shaken import building, friction, measured, shake

from bristle.data.decimate import decimated
from bristle.data.sampling import Even
from bristle.identification.building_fit import equilibrium, identify_structure
from bristle.identification.building_motion import responses
from bristle.identification.building_sites import damper_run, storey_run

HOUSE = building(2, True, 1)
STRETCH = slice(3000, 3300)


@pytest.fixture(scope="module")
def whole():
    return measured(shake(HOUSE, 11, friction, samples=6000), 11)


def with_lost(run, channel: str):
    """Return a run of which a channel stood still for a while, which is known."""
    channels, flags = dict(run.channels), np.zeros(len(run.time), dtype=bool)
    flags[STRETCH] = True
    channels[channel] = np.where(flags, channels[channel][STRETCH.start], channels[channel])
    return replace(run, channels=channels, lost={channel: flags})


def test_equilibrium_is_judged_where_all_was_measured(whole):
    lost = with_lost(whole, "floor1_acceleration_absolute")
    before, after = equilibrium([whole], HOUSE), equilibrium([lost], HOUSE)
    np.testing.assert_allclose(after.z, before.z, rtol=0.03)
    found = identify_structure([lost], HOUSE)
    off = (found.stiffnesses - np.array(HOUSE.stiffnesses)) / found.std_stiffnesses
    assert np.max(np.abs(off)) < 3.0


def test_a_storey_and_the_damper_know_what_was_not_measured(whole):
    (lost,) = responses([with_lost(whole, "floor1_acceleration_absolute")], HOUSE)
    below, above = (storey_run(lost, HOUSE, level) for level in (1, 2))
    assert not below.judged[STRETCH.start - below.skip : STRETCH.stop - below.skip].any()
    assert below.judged.sum() == len(below.judged) - 300
    assert above.judged.all()
    assert damper_run(lost, HOUSE, "lugre").judged.all()  # its own force was measured
    (lost,) = responses([with_lost(whole, "force")], HOUSE)
    assert (~damper_run(lost, HOUSE, "lugre").judged).sum() == 300


def test_motion_goes_on_where_one_of_its_channels_is_lost(whole):
    first, second = responses([whole, with_lost(whole, "floor1_displacement")], HOUSE)
    off = np.abs(second.v[1] - first.v[1])[STRETCH]
    assert float(off.max()) < 10.0 * first.std[1, 1]


def test_each_run_has_the_errors_of_its_own_step(monkeypatch):
    runs = []
    for dt, seed, samples in ((0.002, 11, 4000), (0.01, 12, 800)):
        monkeypatch.setattr(shaken, "DT", dt)
        runs.append(measured(shake(HOUSE, seed, friction, samples=samples), seed, name=f"{dt}"))
    for order in (runs, runs[::-1]):
        for found in responses(order, HOUSE):
            spread = np.std(found.draws, axis=(1, 2))
            np.testing.assert_allclose(spread[:, :2], found.std[:, :2], rtol=0.1)


def test_a_decimated_building_is_in_equilibrium_and_its_damper_behind_the_same_filter(monkeypatch):
    monkeypatch.setattr(shaken, "DT", 1.0 / 3000.0)
    whole = measured(shake(HOUSE, 11, friction, samples=24000), 11, noise=1e-3)
    even = Even([(whole.time, whole.channels, whole.measured)], whole.sampling, [])
    found = decimated(even, 500.0)
    time, channels, known = found.even.pieces[0]
    noise = {name: found.gain[name] * whole.noise[name] for name in channels}
    run = replace(
        whole, time=time, channels=channels, measured=known, noise=noise, lost=found.lost[0],
        parts=found.parts, since=found.since[0], sampling=found.even.sampling,
    )  # fmt: skip
    assert run.measured.all()
    np.testing.assert_allclose(equilibrium([run], HOUSE).z, 1.0, atol=0.15)
    (response,) = responses([run], HOUSE)
    seen = damper_run(response, HOUSE, "lugre").whole
    moments = seen.smoothed
    error = (seen.force - seen.seen(friction(moments.x, moments.v)))[seen.skip :]
    plain = (seen.force - friction(seen.x, seen.v))[seen.skip :]
    assert np.std(error) < 0.5 * np.std(plain)
    assert damper_run(response, HOUSE, "lugre").judged.all()
