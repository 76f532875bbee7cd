"""What a building's masses, springs and instruments make of a site is no finding."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shaken import building, friction, measured, shake

from bristle.diagnosis import rig_runs
from bristle.diagnosis.building_numbers import Shaken, moved, suited_masses, with_masses
from bristle.diagnosis.diagnosis import diagnose_lines
from bristle.diagnosis.rig_runs import runs_of_rig
from bristle.diagnosis.rule import BENCH
from bristle.diagnosis.site_diagnosis import SiteDiagnosis
from bristle.identification.building_motion import responses
from bristle.identification.start_grid import initial_guesses
from bristle.model.model import Model

OFF = np.array([0.0, 0.02, -0.03])
"""Shares by which the masses in the file are off."""


def recorded(hidden=None, without=(), stride=1, **chosen):
    """Return a building of two floors on isolation, and three of its runs.

    The simulation holds forces over its step; every `stride`-th of its samples is recorded.
    """
    b, runs = building(2, True, 6), []
    for i in range(3):
        clean = shake(b, 30 + i, friction, hidden, **chosen)
        clean["voltage"] = np.where(clean["time"] < np.mean(clean["time"]), 4.0, 0.0)
        shown = {channel: values[::stride] for channel, values in clean.items()}
        runs.append(measured(shown, i, without=without))
    return b, runs


def stop(x, _v):
    """Return the force of a stop on the base."""
    return [4e4 * np.sign(x[0]) * max(0.0, abs(x[0]) - 0.006), 0.0, 0.0]


def softening(x, _v):
    """Return the forces of a storey that is no line."""
    force = -3e6 * (x[1] - x[0]) ** 3
    return [-force, force, 0.0]


@pytest.mark.parametrize(
    ("hidden", "name", "at"),
    [
        pytest.param(stop, "end_stop", "layer", marks=pytest.mark.slow),  # a second: another site
        (softening, "storey_softening", "storey1"),
    ],
)
def test_masses_that_are_off_are_found_beside_an_effect(hidden, name, at):
    b, runs = recorded(hidden, peak=3.0)
    file = with_masses(b, OFF)
    rig = runs_of_rig(runs[:2], runs[2:], Model("tanh"), file)
    found = diagnose_lines(rig)
    assert {site: one.effects for site, one in found.items() if one.kind != "none"} == {at: (name,)}
    given = responses(runs, file)
    masses = suited_masses(Shaken(given[:2], given[2:], "tanh", True), file)
    assert np.diag(masses.M)[1:] == pytest.approx(np.diag(b.M)[1:], rel=6e-3)


@pytest.mark.slow  # one more building
@pytest.mark.parametrize("level", ["base", "floor1"])
def test_the_noise_of_an_acceleration_that_was_not_measured_is_known(level):
    b, runs = recorded(without=(f"{level}_acceleration_absolute",), stride=2, samples=10_000)
    layer = diagnose_lines(runs_of_rig(runs[:2], runs[2:], Model("tanh"), b))["layer"]
    assert 0.8 < layer.z_before < 1.1
    assert (layer.kind, layer.effects) == ("none", ())


@pytest.mark.slow  # one more building, diagnosed whole
def test_noise_that_is_stated_too_small_is_a_finding():
    b, runs = recorded()
    loud = [
        replace(run, noise={name: 0.7 * size for name, size in run.noise.items()}) for run in runs
    ]
    layer = diagnose_lines(runs_of_rig(loud[:2], loud[2:], Model("tanh"), b))["layer"]
    assert layer.z_before > BENCH.clean
    assert layer.kind == "unknown"


def test_a_spring_of_the_file_is_none_of_the_damper():
    b, runs = recorded(stop, without=("force",), peak=3.0)
    file = moved(b, np.array([1.2, 0.0, 0.0, 0.0, 0.0, 0.0]))
    rig = runs_of_rig(runs[:2], runs[2:], Model("tanh"), file)
    rig.correct(diagnose_lines(rig))
    (note,) = rig.context(None).notes
    assert "stiffness of isolation -3." in note, "the law's own spring is at its bound"


def test_numbers_of_the_file_come_before_a_second_effect(monkeypatch):
    b, runs = recorded(stop, without=("force",), peak=3.0)
    rig = runs_of_rig(runs[:2], runs[2:], Model("bingham"), b)
    before = rig.prepare("damper").before
    one = replace(before, model=replace(before.model, effects=("duffing",)))
    two = replace(one, model=replace(before.model, effects=("duffing", "gas_spring")), z=1.0)
    pair = SiteDiagnosis(
        "damper", "effect", two.effects, before.z, two.z, 0.9, 0.1,
        before=before, trials=(one,), after=two, together=two,
    )  # fmt: skip
    asked = []

    def suiting(model, _runs, building, *_more):
        asked.append(model.effects)
        return building

    monkeypatch.setattr(rig_runs, "within_prior", suiting)
    assert not rig.suit(pair)
    assert asked == [("duffing",)]


def test_a_stop_is_sought_where_the_weaker_runs_meet_it():
    b, runs = recorded(stop, without=("force",), peak=3.0)
    problem = runs_of_rig(runs[:2], runs[2:], Model("tanh"), b).prepare("damper").problem
    weak = replace(problem.runs[0], x=0.5 * problem.runs[0].x)
    (low, high), *_ = [
        guess.limits["end_stop.clearance"]
        for guess in initial_guesses("end_stop", Model("tanh"), problem.of([weak, *problem.runs]))
    ]
    assert low == pytest.approx(0.4 * np.max(np.abs(weak.x)))
    assert high == pytest.approx(max(np.max(np.abs(run.x)) for run in problem.runs))


def test_a_damper_is_not_judged_by_a_displacement_that_a_bent_storey_gives():
    b, runs = recorded(softening, without=("base_displacement", "force"), peak=3.0)
    rig = runs_of_rig(runs[:2], runs[2:], Model("tanh"), b)
    left = SiteDiagnosis("damper", "unknown", (), 8.0, 8.0, 0.0, 0.1)
    bent = SiteDiagnosis("storey1", "effect", ("storey_softening",), 9.0, 1.0, 1.0, 0.1)
    found = rig.excused(left, {"storey1": bent})
    assert found.kind == "insufficient"
    assert found.reasons[0].startswith("base_displacement was not measured")
    straight = replace(bent, kind="none", effects=())
    assert rig.excused(left, {"storey1": straight}) is left
