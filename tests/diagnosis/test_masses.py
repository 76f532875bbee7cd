"""Masses that a file knows to a few per cent, and a load cell that shows a little more or less."""

from __future__ import annotations

import numpy as np
import pytest
from shaken import building, friction, measured, shake

from bristle.diagnosis.building_numbers import Shaken, suited_masses, text_of_masses, with_masses
from bristle.diagnosis.load_cell import load_cell
from bristle.diagnosis.rule import SITE
from bristle.diagnosis.site import diagnose_line, prepare_line
from bristle.identification.building_motion import responses

DOUBTS = (
    [0.02, -0.03, 0.025],
    # Two seconds each: other masses that are off.
    *(pytest.param(d, marks=pytest.mark.slow) for d in ([-0.04, 0.01, 0.03], [0.0, 0.05, -0.02])),
)


def shaken(gain=1.0, hidden=None, without=()):
    """Return a building of two floors on isolation, and its responses."""
    b = building(2, True, 6)
    runs = []
    for i in range(3):
        clean = shake(b, 30 + i, friction, hidden)
        clean["force"] = clean["force"] * gain
        clean["voltage"] = np.where(clean["time"] < np.mean(clean["time"]), 4.0, 0.0)
        runs.append(measured(clean, i, without=without))
    found = responses(runs, b)
    return b, Shaken(found[:2], found[2:], "bingham", True)


@pytest.fixture(scope="module")
def clean():
    return shaken()


def lacking(lines):
    """Return what each line lacks, by site."""
    return {s: diagnose_line(s, prepare_line(s, *pair)) for s, pair in lines.items()}


@pytest.mark.parametrize("doubt", DOUBTS)
def test_masses_that_are_off_are_found_and_no_fault_is_told(clean, doubt):
    b, runs = clean
    told = with_masses(b, np.array(doubt))
    before = [
        diagnose_line(site, prepare_line(site, *pair)).kind
        for site, pair in runs.lines(told).items()
    ]
    assert "unknown" in before
    found = suited_masses(runs, told)
    # The base's mass stands for a part of its force that the layer's line absorbs by itself.
    assert np.diag(found.M)[1:] == pytest.approx(np.diag(b.M)[1:], rel=3e-3)
    after = {
        site: diagnose_line(site, prepare_line(site, *pair))
        for site, pair in runs.lines(found).items()
    }
    assert {one.kind for one in after.values()} == {"none"}
    (text,) = text_of_masses(told, found)
    assert "floor1" in text
    assert "cell whose gain is wrong" in text


@pytest.mark.parametrize("doubt", [*DOUBTS, [0.0, -0.06, 0.06]])
def test_without_a_measured_force_the_ratio_of_the_floors_is_found(doubt):
    b, runs = shaken(without=("force",))
    told = with_masses(b, np.array(doubt))
    found = suited_masses(runs, told)
    _, one, other = np.diag(b.M)
    ratio = float(np.diag(found.M)[2] / np.diag(found.M)[1])
    assert ratio == pytest.approx(other / one, rel=6e-3)
    assert np.diag(found.M)[0] == np.diag(told.M)[0]
    (text,) = text_of_masses(told, found, runs.measured)
    assert "load cell" not in text
    assert {one.kind for one in lacking(runs.lines(found)).values()} == {"none"}


def test_right_masses_stay(clean):
    b, runs = clean
    assert suited_masses(runs, b) is b
    assert text_of_masses(b, b) == []


def test_a_small_gain_is_masses_and_a_large_one_a_fault():
    b, runs = shaken(1.014)
    sites = lacking(runs.lines(suited_masses(runs, b)))
    assert {one.kind for one in sites.values()} == {"none"}
    b, runs = shaken(1.06)
    found = suited_masses(runs, b)
    assert np.diag(found.M)[1:] == pytest.approx(1.06 * np.diag(b.M)[1:], rel=5e-3)
    b, runs = shaken(1.15)
    assert suited_masses(runs, b) is b, "no file is so wrong"
    layer = diagnose_line("layer", prepare_line("layer", *runs.lines(b)["layer"]))
    cell = load_cell(layer, runs.train, runs.holdout, b)
    assert cell is not None
    assert cell[0].effects == ("force_gain",)
    assert float(cell[0].coordinate) > 1.0 + SITE.mass_doubt


def test_an_effect_is_no_mass():
    def stiffening(x, v):
        return [1.5e7 * x[0] ** 3, 0.0, 0.0]

    b, runs = shaken(hidden=stiffening)
    assert suited_masses(runs, b) is b
