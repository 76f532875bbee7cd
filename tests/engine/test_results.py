"""Results: what is written is read again, and what was cut short says so."""

from __future__ import annotations

import errno
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from bristle.engine import results
from bristle.engine.results import (
    CsvWriter,
    OutputColumn,
    RunTable,
    from_frame,
    load_results,
    to_frame,
    write_csv,
    write_parquet,
)
from bristle.engine.view import run_view
from bristle.errors import RunError

MADE: dict[str, Any] = {
    "version": "0.1.0",
    "title": 'a "title", with µ',
    "overrides": {"damper.f_c": 2.0},
    "step": 0.002,
    "scenario": 'schema = 1\n\n[run]\n  stop = 1.0  # "s"\n',
    "wall_time": 1.25,
}
AWKWARD = [0.1 + 0.2, -0.0, 5e-324, 1.7976931348623157e308, np.nan, np.inf, -np.inf, 1 / 3, 1.0]


@pytest.fixture
def frame() -> pd.DataFrame:
    n = len(AWKWARD)
    columns = (
        OutputColumn("damper.force", "Real", "N"),
        OutputColumn("damper.stroke_ratio", "Real", "1"),
        OutputColumn("source.value", "Real"),
        OutputColumn("foreign.x[1,2]", "Real", "N.s/(m.V)"),
        OutputColumn("damper.fault", "Integer"),
        OutputColumn("foreign.on", "Boolean"),
    )
    arrays = [np.array(AWKWARD), np.zeros(n), np.ones(n), np.arange(n) / 7, np.arange(n)]
    values = {c.name: a for c, a in zip(columns, [*arrays, np.arange(n) % 2 == 0], strict=True)}
    return to_frame(RunTable(np.arange(n) * 0.1, columns, values), MADE)


@pytest.mark.parametrize(("write", "name"), [(write_csv, "r.csv"), (write_parquet, "r.parquet")])
def test_read_gives_back_what_was_written_to_the_last_bit(
    frame: pd.DataFrame, tmp_path: Path, write: Any, name: str
) -> None:
    write(frame, tmp_path / name)
    read = load_results(tmp_path / name)
    pd.testing.assert_frame_equal(read, frame, check_exact=True)
    assert np.signbit(read["damper.force"].iloc[1])
    assert read.attrs == frame.attrs
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_a_column_that_is_not_finite_is_told(frame: pd.DataFrame) -> None:
    assert "Not finite from 0.4 s on: damper.force." in str(run_view(frame.iloc[4:5]))


def test_folder_is_read_by_its_results(frame: pd.DataFrame, tmp_path: Path) -> None:
    write_parquet(frame, tmp_path / "results.parquet")
    assert load_results(tmp_path).equals(frame)


def test_csv_opens_with_pandas_and_shows_units(frame: pd.DataFrame, tmp_path: Path) -> None:
    write_csv(frame, tmp_path / "r.csv")
    read = pd.read_csv(tmp_path / "r.csv", comment="#")
    assert list(read)[:4] == [
        "time [s]",
        "damper.force [N]",
        "damper.stroke_ratio [1]",
        "source.value",
    ]
    assert read["damper.fault"].to_list() == list(range(9))
    assert (tmp_path / "r.csv").read_text().startswith("# bristle results\n# status: complete")


def test_parquet_keeps_units_as_metadata(frame: pd.DataFrame, tmp_path: Path) -> None:
    import pyarrow.parquet as pq

    write_parquet(frame, tmp_path / "r.parquet")
    schema = pq.read_schema(tmp_path / "r.parquet")
    assert schema.field("damper.force").metadata == {b"unit": b"N"}
    assert schema.field("time").metadata == {b"unit": b"s"}


def test_csv_that_grows_is_readable_at_any_moment(frame: pd.DataFrame, tmp_path: Path) -> None:
    table = from_frame(frame)
    path = tmp_path / "results.csv"
    writer = CsvWriter(path, part(table, 0, 2), MADE)
    for first in (2, 4, 6, 8):
        read = load_results(path)
        assert read.attrs["complete"] is False
        assert read.equals(frame.iloc[:first])
        writer.write(part(table, first, min(first + 2, 9)))
    writer.finish(True, 1.25)
    writer.close()
    assert load_results(path).attrs == frame.attrs


def part(table: RunTable, first: int, last: int) -> RunTable:
    values = {name: array[first:last] for name, array in table.values.items()}
    return RunTable(table.time[first:last], table.columns, values)


@pytest.mark.parametrize("lost", [1, 7, 40])
def test_line_that_was_cut_short_is_left_out(
    frame: pd.DataFrame, tmp_path: Path, lost: int
) -> None:
    path = tmp_path / "results.csv"
    CsvWriter(path, from_frame(frame), MADE).close()
    path.write_bytes(path.read_bytes()[:-lost])
    read = load_results(path)
    assert read.attrs["complete"] is False
    assert 0 < len(read) < len(frame)
    assert read.equals(frame.iloc[: len(read)])


@pytest.mark.parametrize(
    "content",
    [b"", b"a,b\n1,2\n", b"# bristle results\n", b"# bristle results\n# status: complete\nx"],
)
def test_other_files_are_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "results.csv"
    path.write_bytes(content)
    with pytest.raises(RunError, match=r"results\.csv: not a file that bristle wrote") as caught:
        load_results(path)
    assert caught.value.exit_code == 2


def test_damaged_parquet_is_refused(frame: pd.DataFrame, tmp_path: Path) -> None:
    path = tmp_path / "results.parquet"
    write_parquet(frame, path)
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(RunError, match="not a file that bristle wrote"):
        load_results(path)


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"nowhere\.csv: cannot be read: No such file"):
        load_results(tmp_path / "nowhere.csv")


@pytest.mark.parametrize("write", [write_csv, write_parquet])
def test_full_disk_at_the_start_leaves_no_file(
    frame: pd.DataFrame, tmp_path: Path, write: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*arguments: Any, **named: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", refuse)
    monkeypatch.setattr("pyarrow.parquet.write_table", refuse)
    with pytest.raises(RunError, match="cannot be written: No space left on device") as caught:
        write(frame, tmp_path / "results")
    assert caught.value.exit_code == 2
    assert not list(tmp_path.iterdir())


class FullDisk:
    """A file on a disk that has room for some more bytes, as the system calls behave."""

    def __init__(self, file: Any, room: int) -> None:
        self.file, self.room = file, room

    def write(self, data: Any) -> int:
        if self.room == 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        taken = int(self.file.write(bytes(data[: self.room])))
        self.room -= taken
        return taken

    def __getattr__(self, name: str) -> Any:
        return getattr(self.file, name)


def test_disk_that_fills_on_the_way_keeps_whole_lines(frame: pd.DataFrame, tmp_path: Path) -> None:
    table = from_frame(frame)
    path = tmp_path / "results.csv"
    writer = CsvWriter(path, part(table, 0, 3), MADE)
    writer._file = FullDisk(writer._file, room=50)  # type: ignore[assignment]
    words = r"cannot be written on: No space left on device; 3 rows are in it"
    with pytest.raises(RunError, match=words) as caught:
        writer.write(part(table, 3, 9))
    assert caught.value.exit_code == 1
    writer.close()
    read = load_results(path)
    assert read.attrs["complete"] is False
    assert read.equals(frame.iloc[:3])


def test_csv_of_a_whole_run_is_fast(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    columns = tuple(OutputColumn(f"c.{i}", "Real", "m") for i in range(25))
    table = RunTable(
        np.arange(17_500) / 500, columns, {c.name: rng.normal(size=17_500) for c in columns}
    )
    best = min(_timed(table, tmp_path / "r.csv") for _ in range(3))
    assert best <= 0.5


def _timed(table: RunTable, path: Path) -> float:
    before = time.process_time()
    CsvWriter(path, table, MADE).close()
    return time.process_time() - before


def test_nothing_heavy_is_imported_for_columns_and_tables() -> None:
    assert "pandas" not in vars(results)
