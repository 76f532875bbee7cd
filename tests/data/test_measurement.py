"""Measurements: SI channels at even times, with everything that was done said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from bristle.data.channels import ChannelSpec
from bristle.data.measurement import (
    measurements_of,
    measurements_of_frame,
    read_measurement,
    read_measurements,
)
from bristle.data.table import from_arrays
from bristle.engine.results import OutputColumn, RunTable, to_frame, write_csv, write_parquet
from bristle.errors import RecordError

N = 1000
TIME = np.arange(N) * 0.002
SPECS = {
    "time": ChannelSpec("t"),
    "displacement": ChannelSpec("x"),
    "force": ChannelSpec("F", noise=0.002),
    "voltage": ChannelSpec("U"),
}
UNITS = {"t": "s", "x": "mm", "F": "kN", "U": "V"}
Columns = dict[str, NDArray[np.float64]]


def columns(time: NDArray[np.float64] = TIME) -> Columns:
    noise = np.random.default_rng(0).standard_normal((2, len(time)))
    return {
        "t": time.copy(),
        "x": 8.0 * np.sin(9.0 * time) + 0.01 * noise[0],
        "F": np.tanh(5.0 * np.cos(9.0 * time)) + 0.002 * noise[1],
        "U": np.where(time % 1.0 < 0.5, 0.0, 4.0),
    }


def measured(data: Columns, specs: dict[str, ChannelSpec] | None = None):  # type: ignore[no-untyped-def]
    return measurements_of(from_arrays(data, "lab/run_1.csv", UNITS), specs or SPECS)


def test_units_are_converted_once_and_signs_turned() -> None:
    data = columns()
    specs = SPECS | {"force": ChannelSpec("F", "kN", -1)}
    (run,) = measured(data, specs)
    assert run.name == "run_1"
    assert run.units == {"displacement": "m", "force": "N", "voltage": "V"}
    np.testing.assert_allclose(run["force"], -1e3 * data["F"])
    np.testing.assert_allclose(run["displacement"], 1e-3 * data["x"])
    assert run.step == pytest.approx(0.002, rel=1e-12)
    assert run.measured.all()
    assert not run.has("velocity")


def test_noise_is_given_or_estimated_and_says_which() -> None:
    (run,) = measured(columns())
    assert run.noise["force"] == pytest.approx(2.0)
    assert run.noise_facts["force"] is None
    assert run.noise["displacement"] == pytest.approx(1e-5, rel=0.1)
    facts = run.noise_facts["displacement"]
    assert facts is not None
    assert facts.colour == "white"


def test_channels_that_lack_are_said() -> None:
    data = columns()
    specs = {key: SPECS[key] for key in ("time", "displacement", "force")}
    (run,) = measured(data, specs)
    assert any("no velocity" in note for note in run.notes)
    with pytest.raises(RecordError, match=r"voltage was not measured; there are displacement"):
        run["voltage"]


def test_file_without_time_takes_a_step() -> None:
    data = columns()
    del data["t"]
    (run,) = measured(data, SPECS | {"time": ChannelSpec(step=0.004)})
    assert run.step == pytest.approx(0.004)
    with pytest.raises(RecordError, match="sampling step"):
        measured(data, {k: v for k, v in SPECS.items() if k != "time"})


def test_rounded_times_are_taken_as_even() -> None:
    time = np.arange(N) / 300.0
    data = columns(time) | {"t": np.round(time, 3)}
    (run,) = measured(data)
    assert run.step == pytest.approx(1.0 / 300.0, rel=1e-4)
    assert not run.sampling.resampled
    np.testing.assert_array_equal(run["displacement"], 1e-3 * data["x"])
    assert any("taken as even" in note for note in run.notes)


def test_varying_spacing_is_resampled_and_said() -> None:
    generator = np.random.default_rng(3)
    time = np.cumsum(generator.uniform(0.0014, 0.0026, N))
    data = {"t": time, "x": 8.0 * np.sin(9.0 * time), "F": np.cos(9.0 * time), "U": 0.0 * time}
    (run,) = measured(data)
    assert run.sampling.resampled
    np.testing.assert_allclose(np.diff(run.time), run.step, rtol=1e-9)
    np.testing.assert_allclose(run["displacement"], 8e-3 * np.sin(9.0 * run.time), atol=2e-6)
    assert any("PCHIP" in note for note in run.notes)


def test_switched_channels_keep_their_levels_when_resampled() -> None:
    time = np.cumsum(np.random.default_rng(3).uniform(0.0014, 0.0026, N))
    (run,) = measured(columns(time))
    assert set(np.unique(run["voltage"])) == {0.0, 4.0}


def test_short_gaps_are_filled_and_marked() -> None:
    data = {key: np.delete(values, [100, 101, 500]) for key, values in columns().items()}
    data["x"][300] = np.nan
    (run,) = measured(data)
    assert len(run.time) == N
    assert np.flatnonzero(~run.measured).tolist() == [100, 101, 302, 500]
    assert run.sampling.filled == 4
    np.testing.assert_allclose(run["displacement"], 8e-3 * np.sin(9.0 * TIME), atol=1e-4)
    assert any("4 samples" in note and "filled" in note for note in run.notes)


def test_long_gaps_cut_and_nothing_is_lost_silently() -> None:
    data = columns()
    data["F"][400:440] = np.nan
    first, second = measured(data)
    assert (first.name, second.name) == ("run_1 (1 of 2)", "run_1 (2 of 2)")
    assert len(first.time) + len(second.time) == N - 40
    assert second.time[0] == pytest.approx(TIME[440])
    assert any("cut" in note for note in first.notes)
    gap = {key: np.delete(values, np.arange(400, 440)) for key, values in columns().items()}
    pieces = measured(gap)
    assert [len(piece.time) for piece in pieces] == [400, 560]
    assert any("gap" in note for note in pieces[0].notes)


def test_missing_ends_are_cut_and_said() -> None:
    data = columns()
    data["x"][:30] = np.nan
    (run,) = measured(data)
    assert run.time[0] == pytest.approx(TIME[30])
    assert any("missing" in note for note in run.notes)


def test_repeated_lines_are_left_out_with_a_note() -> None:
    data = {key: np.insert(values, 200, values[200]) for key, values in columns().items()}
    (run,) = measured(data)
    assert len(run.time) == N
    assert any("repeat" in note for note in run.notes)


def test_channel_written_less_often_is_held() -> None:
    data = columns()
    data["U"] = np.where(np.arange(N) % 10 == 0, data["U"], np.nan)
    (run,) = measured(data)
    assert set(np.unique(run["voltage"])) == {0.0, 4.0}
    assert any("fewer samples" in note for note in run.notes)


def written_by_turns(data: Columns) -> None:
    """Write every second sample at the time before it, from a run that moves the other way."""
    for key, values in data.items():
        values[1::2] = values[::2] if key == "t" else -values[::2]


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda d: d["t"].__setitem__(slice(500, None), d["t"][:500]), r"row 501: time goes back"),
        (lambda d: d["t"].__setitem__(500, d["t"][499]), r"row 501: .* appears twice.* --step S"),
        (written_by_turns, r"row 2: .* appears twice.* two runs may lie in one file"),
        (lambda d: d["x"].fill(np.nan), "displacement has no number"),
        (lambda d: d["x"].__setitem__(70, 1e30), r"row 71: \"x\" \(displacement\) is 1e\+27 m"),
        (lambda d: d["x"].__setitem__(slice(None, None, 2), np.nan), None),
        (lambda d: d["F"].__setitem__(np.arange(N) % 50 > 40, np.nan), r"no 60 in a row"),
    ],
)
def test_times_and_gaps_that_cannot_be_mended(spoil, told: str | None) -> None:  # type: ignore[no-untyped-def]
    data = columns()
    spoil(data)
    if told is None:  # every second value: written less often
        assert len(measured(data)) == 1
        return
    with pytest.raises(RecordError, match=told) as caught:
        measured(data)
    assert "run_1.csv" in str(caught.value)


def test_too_short_a_record_is_refused() -> None:
    with pytest.raises(RecordError, match="40 samples"):
        measured({key: values[:40] for key, values in columns().items()})


def test_columns_and_units_that_do_not_fit_are_refused() -> None:
    data = columns()
    with pytest.raises(RecordError, match='no column is called "G"; there are "t", "x"'):
        measured(data, SPECS | {"force": ChannelSpec("G")})
    with pytest.raises(RecordError, match="differ in dimension"):
        measured(data, SPECS | {"force": ChannelSpec("F", "mm")})
    with pytest.raises(RecordError, match=r'no channel "forse".*Did you mean "force"'):
        measured(data, SPECS | {"forse": ChannelSpec("F")})
    bare = from_arrays(data, "run.csv")
    with pytest.raises(RecordError, match="has no unit"):
        measurements_of(bare, SPECS)


def test_words_in_a_channel_are_refused_with_their_line(tmp_path: Path) -> None:
    rows = [f"{t:.3f},{np.sin(t):.6f},{np.cos(t):.6f}" for t in TIME]
    rows[7] = "0.014,OVER,1.0"
    path = tmp_path / "run.csv"
    path.write_text("t [s],x [mm],F [N]\n" + "\n".join(rows), encoding="utf-8")
    with pytest.raises(RecordError, match=r'"x \[mm\]" \(displacement\): line 9: "OVER"'):
        read_measurements([path])


def test_guess_is_in_the_notes(tmp_path: Path) -> None:
    data = columns()
    path = tmp_path / "run.csv"
    rows = np.column_stack(list(data.values()))
    np.savetxt(path, rows, delimiter=";", header="t [s];x [mm];F [kN];U [V]", comments="")
    run = read_measurement(path)
    assert set(run.channels) == {"displacement", "force", "voltage"}
    assert sum(note.startswith("guessed: ") for note in run.notes) == 4


def test_results_of_bristle_are_measurements(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).standard_normal(N)
    values = {
        "structure.base_displacement": 1e-3 * np.sin(9.0 * TIME),
        "damper.force": np.cos(9.0 * TIME) + 0.01 * noise,
        "damper.fault": np.zeros(N, dtype=np.int64),
    }
    kinds = (
        OutputColumn("structure.base_displacement", "Real", "m"),
        OutputColumn("damper.force", "Real", "N"),
        OutputColumn("damper.fault", "Integer"),
    )
    made = {"scenario": "schema = 1\n", "version": "0", "wall_time": 1.0}
    frame = to_frame(RunTable(TIME, kinds, values), made, complete=False)
    write_csv(frame, tmp_path / "results.csv")
    write_parquet(frame, tmp_path / "results.parquet")
    specs = {
        "time": ChannelSpec("time"),
        "displacement": ChannelSpec("structure.base_displacement"),
        "force": ChannelSpec("damper.force"),
    }
    from_csv, from_parquet = read_measurements(
        [tmp_path / "results.csv", tmp_path / "results.parquet"], specs
    )
    (from_frame,) = measurements_of_frame(frame, "frame", specs)
    for run in (from_csv, from_parquet):
        np.testing.assert_allclose(run["force"], from_frame["force"])
        assert any("did not come to its end" in note for note in run.notes)
    assert from_csv.digest() == from_parquet.digest() == from_frame.digest()


def test_pieces_are_refused_where_one_is_asked_for(tmp_path: Path) -> None:
    data = columns()
    data["F"][400:440] = np.nan
    frame = pd.DataFrame({f"{key} [{UNITS[key]}]": values for key, values in data.items()})
    frame.to_csv(tmp_path / "run.csv", index=False)
    assert len(read_measurements([tmp_path / "run.csv"])) == 2
    with pytest.raises(RecordError, match="2 pieces"):
        read_measurement(tmp_path / "run.csv")
