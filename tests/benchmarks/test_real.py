"""The benchmark on published measurements, without them and, where they are, with them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks import _measured, real

DATA = Path(__file__).resolve().parents[2] / "../shared/data"


def test_what_is_not_there_is_said(tmp_path, capsys):
    assert real.main(["--data", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert said.count("not run: there is no") == 7
    assert "not run: there is no mr_damper_utfpr" in said


def test_fit_and_loop_area():
    t = np.linspace(0.0, 20.0 * np.pi, 4001)
    assert _measured.fit(np.sin(t), np.sin(t)) == pytest.approx(1.0)
    assert _measured.fit(np.sin(t), np.zeros_like(t)) == pytest.approx(0.0, abs=1e-6)

    class Run:
        """A run that slides against a friction of 3 N."""

        def __getitem__(self, channel):
            return np.sin(t)

    # Whole periods: the area is 3 N times the path, an offset adds nothing.
    force = 3.0 * np.sign(np.cos(t)) + 100.0
    assert _measured.dissipative(Run(), force) == pytest.approx(3.0, rel=1e-2)


@pytest.mark.skipif(not (DATA / "mr_damper_mathworks").is_dir(), reason="the data are not there")
def test_the_published_reference_comes_out():
    run = _measured.read_measurement(DATA / "mr_damper_mathworks" / "mrdamper.csv")
    assert _measured.fit_of(run, tanh=False) == pytest.approx(0.368, abs=5e-4)
    assert _measured.fit_of(run, tanh=True) == pytest.approx(0.453, abs=0.01)


@pytest.mark.skipif(not (DATA / "shake_table_base_isolated").is_dir(), reason="no such data")
def test_the_building_is_the_same_in_two_earthquakes():
    folder = DATA / "shake_table_base_isolated"
    found = []
    for name in ("bi_bncs_cnp100.csv", "bi_bncs_lac100.csv"):
        fit = _measured.identify_structure(
            _measured.shaken(folder, [name]), _measured.unknown_masses()
        )
        found.append((fit.frequencies[:2], fit.std_frequencies[:2]))
    (one, s_1), (other, s_2) = found
    assert np.all(np.abs(one - other) < 3.0 * np.hypot(s_1, s_2))
    assert one == pytest.approx(other, rel=0.02)
