"""What a building's masses, springs and instruments make of a site is no finding."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shaken import building, friction, measured, shake

from bristle.diagnosis import diagnose_rig
from bristle.diagnosis.building_numbers import Shaken, moved, suited_masses, with_masses
from bristle.diagnosis.diagnosis import diagnose_lines
from bristle.diagnosis.rig_runs import runs_of_rig
from bristle.identification.building_motion import responses
from bristle.model.model import Model

OFF = np.array([0.0, 0.02, -0.03])
"""Shares by which the masses in the file are off."""


def recorded(hidden=None, without=(), **chosen):
    """Return a building of two floors on isolation, and three of its runs."""
    b, runs = building(2, True, 6), []
    for i in range(3):
        clean = shake(b, 30 + i, friction, hidden, **chosen)
        clean["voltage"] = np.where(clean["time"] < np.mean(clean["time"]), 4.0, 0.0)
        runs.append(measured(clean, i, without=without))
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
    [(stop, "end_stop", "layer"), (softening, "storey_softening", "storey1")],
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


def quieter(run, share):
    """Return a run whose accelerometers are said to have less noise than they have."""
    told = {
        name: size * (share if name.endswith("absolute") else 1.0)
        for name, size in run.noise.items()
    }
    return replace(run, noise=told)


@pytest.mark.parametrize(("without", "kind"), [((), "unknown"), (("floor1",), "none")])
def test_a_few_per_cent_of_noise_are_no_finding_without_an_accelerometer(without, kind):
    lost = tuple(f"{level}_acceleration_absolute" for level in without)
    b, runs = recorded(without=lost)
    share = 0.74 if not without else 0.78
    rig = runs_of_rig(
        [quieter(run, share) for run in runs[:2]], [quieter(runs[2], share)], Model("tanh"), b
    )
    layer = diagnose_lines(rig)["layer"]
    assert 1.15 < layer.z_before < 1.25
    assert layer.kind == kind
    assert ("Without the acceleration of floor1" in layer.reasons[0]) == bool(without)


def test_a_spring_of_the_file_is_no_second_effect():
    b, runs = recorded(stop, without=("force",), peak=3.0)
    file = moved(b, np.array([1.2, 0.0, 0.0, 0.0, 0.0, 0.0]))
    found = diagnose_rig(runs[:2], runs[2:], Model("tanh"), file)
    assert found.findings["damper"].effects == ("end_stop",)
    assert any("stiffness of isolation -3" in note for note in found.reasons)
