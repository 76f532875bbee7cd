"""Identification of published measurements, against the numbers known of them.

The data lie beside the repository where there are any; they are not part of it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bristle.study.api import identify

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"  # ../shared/data
pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="the reference data are not there")


def crank(*patterns):
    """Return frames of the crank-driven damper (UTFPR) in SI, in the channels' names."""
    files = [f for p in patterns for f in sorted((DATA / "mr_damper_utfpr").glob(p))]
    frames = {}
    for file in files:
        raw = pd.read_csv(file)
        frames[file.stem] = pd.DataFrame(
            {
                "time": raw.time_s,
                "displacement": 1e-3 * raw.displacement_mm,
                "velocity": 1e-3 * raw.velocity_mm_s,
                "voltage": raw.coil_voltage_V,
                "force": raw.force_N,
            }
        )
    return frames


@pytest.mark.slow  # two fits of measured data
def test_crank_driven_damper_needs_a_spring_beside_its_law():
    """Its force carries about 130 N of preload: no law of a damper alone has that."""
    train = crank("ident_*_ensaio1_*.csv", "ident_*_[AB]_[157].csv")
    held = crank("valid_*_[17].csv")
    plain = identify(train, "lugre", holdout=held)
    spring = identify(train, "lugre", effects=("gas_spring",), holdout=held)
    assert spring.fit.model.values["gas_spring.preload"] == pytest.approx(130.0, abs=25.0)
    assert spring.after["share_holdout"] < 0.22 < 0.34 < plain.after["share_holdout"]
    # Its README: mean dissipative force 85-108 N at 0 V, 653-794 N at 3.212 V (loop area over
    # path, viscous part included).
    values = spring.fit.model.values
    at_rest, at_top = (
        (values["sigma_a"] + V * values["sigma_0"]) / values["a_0"] for V in (0.0, 3.212)
    )
    assert 20.0 < at_rest < 108.0
    assert 200.0 < at_top < 794.0  # the viscous part carries the rest
    # It is not the whole truth, and says so.
    assert spring.after["z_holdout"] > 1.15
    assert any("exceeds the noise" in note for note in spring.notes)


def fit_percent(found):
    """Return 1 - NRMSE [%] on the held-out run, as system identification has it."""
    assert found.holdout is not None
    (run,) = found.holdout.runs
    error = run.force - found.holdout.predict(found.fit.model, run)
    return 100.0 * (1.0 - np.linalg.norm(error) / np.linalg.norm(run.force - run.force.mean()))


def test_velocity_force_set_beats_a_law_without_hysteresis():
    """Its README: viscous 36.8 %, best tanh of velocity 45.3 % on samples 2001 to 3499."""
    raw = pd.read_csv(DATA / "mr_damper_mathworks" / "mrdamper.csv")
    frame = pd.DataFrame(
        {"time": raw.time_s, "velocity": 1e-2 * raw.velocity_cm_s, "force": -raw.force_N}
    )
    found = identify([frame.iloc[:2000]], "lugre", holdout=[frame.iloc[2000:3499]])
    assert found.model.values["sigma_0"] == found.model.values["sigma_b"] == 0.0  # no command
    assert fit_percent(found) > 45.3
