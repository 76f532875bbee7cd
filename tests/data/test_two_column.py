"""The two-column file that FMUs read, and what lies between its samples."""

from __future__ import annotations

import os
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bristle.errors import PhysicsError
from bristle.physics import motion_file
from bristle.physics.motion_file import ANY_HEADER, HEADER, Motion, interpolate, read_two_column

Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def write(content: str | bytes, name: str = "motion.csv") -> Path:
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def samples(*pairs: tuple[object, object], header: str = HEADER) -> str:
    return header + "\n" + "".join(f"{t},{a}\n" for t, a in pairs)


def test_reads_samples_past_comments_blank_lines_and_windows_line_ends(write: Write) -> None:
    path = write("\ufeff# from a shaker\r\n" + HEADER + "\r\n0,1\r\n\r\n# half way\r\n0.5,-2e0\r\n")
    assert read_two_column(path) == ([0.0, 0.5], [1.0, -2.0])


def test_another_second_column_only_where_it_is_asked_for(write: Write) -> None:
    path = write(samples((0, 1), (1, 2), header="time [s],F [N]"))
    for header in (ANY_HEADER, "time [s],NAME [N]"):
        assert read_two_column(path, header) == ([0.0, 1.0], [1.0, 2.0])
    with pytest.raises(PhysicsError, match=r'line 1.*F \[N\]".* must be "time \[s\],NAME \[kN\]"'):
        read_two_column(path, "time [s],NAME [kN]")
    with pytest.raises(PhysicsError, match=r'line 1.*"time \[s\],F \[N\]".*acceleration \[m/s2\]'):
        read_two_column(path)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "holds no samples"),
        ("# nothing\n", "holds no samples"),
        (HEADER + "\n", "0 samples"),
        (samples((0, 1)), "1 sample. A record has two"),
        (samples((0, 1), (1, "high")), 'line 3: "high" is not a number'),
        (samples((0, 1), (1, "1_0")), 'line 3: "1_0" is not a number'),
        (samples((0, 1), (1, "")), "line 3: a value is missing"),
        (samples((0, 1), (1, "nan")), "line 3: nan is not finite"),
        (samples((0, 1), ("inf", 2)), "line 3: inf is not finite"),
        (samples((0, 1), (1, "2,3")), 'line 3: "1,2,3" has 3 columns'),
        (samples((0, 1), (2, 1), (1, 1)), r"line 4: the time 1.0 s follows 2.0 s"),
        (samples((0, 1), (1, 1), (1, 1)), r"line 4: the time 1.0 s appears twice"),
        (samples((-1, 1), (0, 1)), "line 2: the time begins at -1 s"),
        (samples(*((t, 0) for t in (0, 1, 2, 3.6, 4.6, 5.6))), "line 5: a gap from 2 s to 3.6 s"),
        ("0,1\n1,2\n", r"line 1: the header is .0,1.\. It must be"),
        (b"\x00\x01\x02" * 50, "binary data"),
        (HEADER.encode("utf-16"), "UTF-16"),
        (HEADER.encode() + b"\n0,1\n1,\xb2\n", "line 3: byte 0xb2 is not UTF-8"),
    ],
)
def test_what_must_not_be_trusted_is_refused(write: Write, content: str | bytes, says: str) -> None:
    path = write(content)
    with pytest.raises(PhysicsError, match=says) as caught:
        read_two_column(path)
    assert str(path) in str(caught.value)


def test_a_spacing_of_one_and_a_half_times_the_median_is_no_gap(write: Write) -> None:
    path = write(samples(*((t, 0) for t in (0, 1, 2, 3.5, 4.5))))
    assert len(read_two_column(path)[0]) == 5


def test_no_file_folder_or_device(tmp_path: Path) -> None:
    with pytest.raises(PhysicsError, match="no such file"):
        read_two_column(tmp_path / "none.csv")
    with pytest.raises(PhysicsError, match="this is a folder"):
        read_two_column(tmp_path)
    with pytest.raises(PhysicsError, match="cannot be read"):
        read_two_column("no\0name")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this platform has no pipes in folders")
def test_a_pipe_does_not_hang_the_reader(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(PhysicsError, match="no regular file"):
        read_two_column(tmp_path / "pipe")


def test_two_gigabytes_are_refused_by_size(tmp_path: Path) -> None:
    path = tmp_path / "huge.csv"
    with path.open("wb") as file:
        file.truncate(2 * 1024**3)  # sparse: takes no room, and no time unless it is read
    with pytest.raises(PhysicsError, match="2048 MB are more than the limit of 64 MB"):
        read_two_column(path)


def test_missing_permission(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(samples((0, 1), (1, 2)))

    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr("builtins.open", refuse)  # file modes do not bind an administrator
    with pytest.raises(PhysicsError, match=r"cannot be read \(Permission denied\)"):
        read_two_column(path)


increasing = st.lists(st.integers(0, 10_000), min_size=2, max_size=30, unique=True).map(
    lambda ticks: [0.01 * tick for tick in sorted(ticks)]
)


@given(increasing, st.data())
def test_between_samples_it_is_a_straight_line(times: list[float], data: st.DataObject) -> None:
    values = data.draw(st.lists(st.floats(-9, 9), min_size=len(times), max_size=len(times)))
    motion = Motion(times, values)
    for t, value in zip(times, values, strict=True):
        assert motion(t) == value
    t = data.draw(st.floats(times[0], times[-1]))
    assert motion(t) == pytest.approx(np.interp(t, times, values), rel=1e-12, abs=1e-12)
    assert motion.peak == max(map(abs, values))
    assert motion.end == times[-1]


def test_outside_its_samples_a_motion_is_zero() -> None:
    motion = Motion([1.0, 2.0, 3.0], [5.0, 6.0, 7.0])
    assert [motion(t) for t in (-1.0, 0.999, 3.001, float("nan"))] == [0.0, 0.0, 0.0, 0.0]
    assert [motion(1.0), motion(3.0)] == [5.0, 7.0]


def test_lists_arrays_and_compiled_code_agree_to_the_last_bit() -> None:
    numba = pytest.importorskip("numba")
    compiled = numba.njit(interpolate)
    rng = np.random.default_rng(1)
    uneven = np.cumsum(rng.uniform(0.5, 1.5, 40))
    for times in (0.02 * np.arange(40), uneven):
        values = rng.normal(size=40)
        for t in (*rng.uniform(times[0] - 1, times[-1] + 1, 200), *times):
            plain = interpolate(float(t), times.tolist(), values.tolist())
            assert interpolate(t, times, values) == plain
            assert compiled(t, times, values) == plain


@pytest.mark.parametrize("spacing", ["even", "uneven"])
def test_search_takes_few_looks_at_the_times(spacing: str) -> None:
    class Counted(list[float]):
        looks = 0

        def __getitem__(self, index: int) -> float:  # type: ignore[override]
            Counted.looks += 1
            return super().__getitem__(index)

    ticks = np.arange(100_000)
    times = Counted((0.01 * ticks if spacing == "even" else 1e-6 * ticks**2.0).tolist())
    values = [0.0] * len(times)
    interpolate(0.4 * list.__getitem__(times, -1), times, values)
    assert Counted.looks <= (12 if spacing == "even" else 12 + 20)


def test_gap_is_measured_against_the_median() -> None:
    assert motion_file.median([3.0, 1.0, 2.0]) == 2.0
    assert motion_file.median([4.0, 1.0, 2.0, 3.0]) == 2.5
    times = [0.0, 1.0, 2.0, 3.6, 5.2, 6.8]  # median 1.6
    assert max(after - before for before, after in pairwise(times)) < 1.5 * 1.6
    motion_file.check_times(times, range(2, 8), "file")
