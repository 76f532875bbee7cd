"""A damper that knows the range of its data shows how far outside of it a run is."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from bristle.cli import main
from bristle.engine.run import run

BENCH = "bench_sine_bingham"  # 8 mm, 0.1 m/s, 4 V
KNOWN = {
    "damper.range.displacement_low": -0.007, "damper.range.displacement_high": 0.009,
    "damper.range.speed": 0.08, "damper.range.command_high": 5.0, "run.stop": 0.6,
}  # fmt: skip


def expected(frame: pd.DataFrame) -> np.ndarray:
    """Return how far the motion is outside, by hand."""
    x, v = frame["rod.displacement"].to_numpy(), frame["rod.velocity"].to_numpy()
    over = [(-0.007 - x) / 0.008, (x - 0.009) / 0.008, (abs(v) - 0.08) / 0.08]
    return np.maximum(np.max(over, axis=0), 0.0)


@pytest.mark.parametrize(
    ("engine", "fmus"),
    [
        ("fmu", "python"),
        ("compiled", "python"),
        pytest.param("fmu", "native", marks=pytest.mark.slow),  # zig compiles a whole damper
    ],
)
def test_the_output_is_what_the_worst_of_motion_and_command_exceeds_its_range_by(
    engine: str, fmus: str, caplog: pytest.LogCaptureFixture
) -> None:
    if fmus == "native":
        pytest.importorskip("ziglang")
    frame = run(BENCH, KNOWN, engine=engine, fmus=fmus)
    outside = frame["damper.outside"].to_numpy()
    assert frame.attrs["units"]["damper.outside"] == "1"
    assert np.abs(outside - expected(frame)).max() <= 1e-12
    assert outside.max() == pytest.approx(0.25, abs=0.001)  # 0.1 of 0.08 m/s
    assert np.mean(outside == 0.0) > 0.2
    said = [one.getMessage() for one in caplog.records if "beyond the data" in one.getMessage()]
    assert len(said) == 1
    assert said[0].startswith("damper: velocity ")
    assert "100 mm/s, 25 % beyond the data that its model is from" in said[0]
    assert said[0].endswith("from t = 0 s")  # a sine begins at its full speed


def test_a_command_counts_too_and_where_the_data_have_none_by_the_largest_one() -> None:
    frame = run(BENCH, {**KNOWN, "damper.range.command_low": 0.0, "damper.range.command_high": 0.0})
    assert frame["damper.outside"].min() == pytest.approx(4.0 / 8.0)


def test_within_the_data_nothing_is_said(caplog: pytest.LogCaptureFixture) -> None:
    frame = run(BENCH, {"damper.range.speed": 0.11, "run.stop": 0.1})
    assert (frame["damper.outside"] == 0.0).all()
    assert not [one for one in caplog.records if "beyond the data" in one.getMessage()]


def test_a_damper_that_knows_no_data_has_the_ports_that_it_had() -> None:
    names = [name for name in run(BENCH, {"run.stop": 0.01}) if name.startswith("damper.")]
    assert names == [
        f"damper.{one}" for one in ("force", "dissipated_energy", "stroke_ratio", "fault")
    ]


def test_a_number_of_the_range_that_is_none_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", BENCH, "--set", "damper.range.sped=0.1"]) == 2
    said = capsys.readouterr().err
    assert "range.sped" in said
    assert 'Did you mean "range.speed"?' in said
