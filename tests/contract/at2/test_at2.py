"""AT2 as archives write it: DT in other units, counts in groups, fixed widths, the end of DOS."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bristle.data import read_ground_motion
from bristle.errors import RecordError

VALUES = 0.1 * np.sin(0.3 * np.arange(1200)) - 0.05


def at2(folder: Path, numbers: str = "NPTS=   1200, DT=   .0100 SEC", end: str = "\n", width=15):
    rows = [VALUES[k : k + 5] for k in range(0, len(VALUES), 5)]
    form = f"{{:{width}.7E}}" if width else "{:.7E}"
    body = "\n".join("".join(form.format(one) for one in row) for row in rows)
    head = f"PEER NGA\nSomewhere\nACCELERATION TIME SERIES IN UNITS OF G\n{numbers}\n"
    (folder / "a.AT2").write_bytes((head + body + end).encode())
    return read_ground_motion("a.AT2", folder)


@pytest.mark.parametrize(
    "numbers",
    [
        "NPTS=   1200, DT=   10.0 MSEC", "NPTS= 1,200, DT= .0100 SEC", "NPTS= 1 200, DT= .01",
        "NPTS=1200, DT=10.ms", "NPTS: 1200, DT: 10000 usec", "  1,200   0.0100    NPTS, DT (SEC)",
        "1200   10.0    NPTS, DT (MSEC)", "NPTS=1200, DT=.0100 SEC, FILTER 0.1-25 HZ",
    ],
)  # fmt: skip
def test_count_and_step_in_their_units(tmp_path: Path, numbers: str) -> None:
    found = at2(tmp_path, numbers)
    np.testing.assert_allclose(found.time, 0.01 * np.arange(1200), atol=1e-9)
    np.testing.assert_allclose(found.acceleration, 9.80665 * VALUES, rtol=1e-6)


@pytest.mark.parametrize("unit", ["HZ", "FT", "MIN."])
def test_a_step_in_another_unit_is_refused(tmp_path: Path, unit: str) -> None:
    with pytest.raises(RecordError, match=r"line 4: DT is in .* SEC or MSEC is right"):
        at2(tmp_path, f"NPTS= 1200, DT= 100 {unit}")


@pytest.mark.parametrize(
    ("step", "said"),
    [
        ("10.0", r"line 4: DT = 10 has no unit.* Write SEC or MSEC"),
        ("2,5 MSEC", r"line 4: .*2,5 MSEC.* does not give both NPTS and DT"),
        ("12,5 MSEC", r"line 4: .*12,5 MSEC.* does not give both NPTS and DT"),
    ],
)
def test_a_step_that_may_be_another_is_refused(tmp_path: Path, step: str, said: str) -> None:
    with pytest.raises(RecordError, match=said):
        at2(tmp_path, f"NPTS= 1200, DT= {step}")


@pytest.mark.parametrize("end", ["\x1a", "\r\n\x1a\r\n", "\n" + 90 * "\x1a", "\x1a\0\0\0"])
def test_the_byte_that_ends_a_text_of_dos(tmp_path: Path, end: str) -> None:
    assert len(at2(tmp_path, end=end).time) == 1200


def test_columns_of_a_fixed_width_without_blanks(tmp_path: Path) -> None:
    (tmp_path / "a.AT2").write_text(
        "x\nx\nIN UNITS OF G\nNPTS= 6, DT= .01 SEC\n"
        " -.2016698E-01-.3948841E-01 -.5742128E-01\n-0.5000000-0.2500000 0.1250000\n"
    )
    found = read_ground_motion("a.AT2", tmp_path).acceleration / 9.80665
    wanted = [-0.02016698, -0.03948841, -0.05742128, -0.5, -0.25, 0.125]
    np.testing.assert_allclose(found, wanted, rtol=1e-9)


@pytest.mark.parametrize("row", ["1.5-101 2.0", "1.5E-02\x07 2.0"])
def test_what_is_no_number_is_seen(tmp_path: Path, row: str) -> None:
    (tmp_path / "a.AT2").write_text(f"x\nx\nIN UNITS OF G\nNPTS= 2, DT= .01 SEC\n{row}\n")
    shown = row.split(" ")[0].replace("\x07", r"\\x07")
    with pytest.raises(RecordError, match=f'line 5: "{shown}" is not a number'):
        read_ground_motion("a.AT2", tmp_path)


def test_the_advice_for_several_columns_keeps_their_unit(tmp_path: Path) -> None:
    rows = "".join(f"{0.01 * k:.2f},{a:.5f},{a:.5f}\n" for k, a in enumerate(VALUES))
    (tmp_path / "a.csv").write_text(f"Time (s),Acc NS (g),Acc EW (g)\n{rows}")
    with pytest.raises(RecordError, match=r'Call the one .* "ground_acceleration \[g\]"\.'):
        read_ground_motion("a.csv", tmp_path)
    (tmp_path / "a.csv").write_text(f"Time (s),ground_acceleration [g],Acc EW (g)\n{rows}")
    found = read_ground_motion("a.csv", tmp_path)
    np.testing.assert_allclose(found.acceleration, 9.80665 * VALUES, atol=1e-4)


@pytest.mark.parametrize(
    ("title", "said"),
    [
        ("ACCELERATION TIME SERIES IN UNITS OF G x 1000", 'the unit "G x 1000" is not known'),
        ("ACCELERATION TIME SERIES IN UNITS OF G*1000", r'the unit "G\*1000" is not known'),
        ("ACCELERATION TIME SERIES IN UNITS OF G / 10", 'the unit "G / 10" is not known'),
        ("ACCELERATION IN G (X 1000)", r'the unit "G \(X 1000" is not known'),
        ("ACCELERATION IN G; SCALE FACTOR = 100", '"SCALE FACTOR = 100", and nothing tells'),
        ("VELOCITY TIME SERIES IN UNITS OF G", "the values are a velocity in G"),
    ],
)
def test_a_factor_and_another_quantity_are_refused(tmp_path: Path, title: str, said: str) -> None:
    text = f"PEER NGA\nSomewhere\n{title}\nNPTS= 4, DT= .01 SEC\n .1 .2 .3 .4\n"
    (tmp_path / "a.AT2").write_text(text)
    with pytest.raises(RecordError, match=f"line 3: {said}"):
        read_ground_motion("a.AT2", tmp_path)


@pytest.mark.parametrize("unit", ["CM S-2", "CM/SEC**2", "CM PER SEC PER SEC", "GALS (CORRECTED)"])
def test_units_as_archives_spell_them(tmp_path: Path, unit: str) -> None:
    title = f"ACCELERATION TIME SERIES IN UNITS OF {unit}"
    (tmp_path / "a.AT2").write_text(f"PEER\nX\n{title}\nNPTS= 4, DT= .01 SEC\n .1 .2 .3 .4\n")
    found = read_ground_motion("a.AT2", tmp_path).acceleration
    np.testing.assert_allclose(found, [0.001, 0.002, 0.003, 0.004])


def test_a_word_among_the_values_is_told_as_it_is_written(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match='"END" is not a number'):
        at2(tmp_path, end="\nEND OF RECORD\n")
