"""The rod of a bench whose measured motion ends before the run, or begins after it."""

from __future__ import annotations

from pathlib import Path

import pytest

from bristle import run

SCENARIO = """
schema = 1
[run]
stop = 1.0
step = 0.05
[components.rod]
fmu = "PrescribedMotion"
parameters = { kind = "csv", file = "motion.csv" }
[components.signal]
fmu = "SignalSource"
parameters = { kind = "csv", file = "motion.csv" }
"""


@pytest.mark.parametrize("engine", ["fmu", "compiled"])
def test_a_rod_stands_where_its_samples_begin_and_end(engine: str, tmp_path: Path) -> None:
    (tmp_path / "motion.csv").write_text("time [s],displacement [m]\n0.2,-0.002\n0.6,0.006\n")
    file = tmp_path / "rod.toml"
    file.write_text(SCENARIO)
    frame = run(file, engine=engine)
    t = frame.index.to_numpy()
    x, v = frame["rod.displacement"].to_numpy(), frame["rod.velocity"].to_numpy()
    assert x[:5] == pytest.approx(-0.002)
    assert x[4:13] == pytest.approx(-0.002 + 0.02 * (t[4:13] - 0.2))
    assert x[12:] == pytest.approx(0.006)
    assert [*v[:4], *v[13:]] == [0.0] * 12
    assert v[5:12] == pytest.approx(0.02)
    # Any other signal is zero there, as before.
    signal = frame["signal.value"].to_numpy()
    assert [*signal[:4], *signal[13:]] == [0.0] * 12
    assert signal[5:12] == pytest.approx(x[5:12])
