"""Numbers as people write them, in units of the rig's size; no command prints a power of ten."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from made import bench_run, write

from bristle.cli import main
from bristle.core.text import log_ticks, plain, quantity, scale, short_z, tick, typed, with_interval
from bristle.study import create_study

POWER = re.compile(r"\d[eE][+-]?\d")


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (220.0, 2, "220"), (2.2e5, 2, "220000"), (0.00023, 2, "0.00023"), (99.96, 3, "100"),
        (99.96, 4, "99.96"), (0.0, 3, "0"), (-0.5, 3, "-0.5"), (1234567.0, 3, "1230000"),
        (1e-12, 2, "1.0 \u00d7 10⁻¹²"), (float("nan"), 3, "-"), (9.996, 3, "10"), (0.1, 3, "0.1"),
    ],
)  # fmt: skip
def test_a_number_has_its_digits_and_no_power_of_ten(value: float, digits: int, text: str) -> None:
    assert plain(value, digits) == text


def test_a_value_of_zero_has_no_power_beside_its_interval() -> None:
    assert with_interval(12.0, 6e4) == ("0", "± 120 \u00d7 10³")
    assert with_interval(-1.2e6, 9e5)[0] == "\u22121.2 \u00d7 10⁶"


def test_the_rigs_size_decides_on_the_unit() -> None:
    assert quantity(220.0, "N", 2) == "220 N"
    assert quantity(1340.0, "N", 2) == "1300 N"
    assert quantity(220.0, "N", 2, 5e4) == "0.22 kN"
    assert quantity(5.2e4, "N") == "52 kN"
    assert quantity(2.5e6, "N/m3") == "2.5 × 10⁶ N/m3"  # noqa: RUF001
    assert scale("N", -5.2e4) == scale("N", 5.2e4) == (1e-3, "kN")
    assert quantity(0.11, "m/s", 2) == "110 mm/s"
    assert quantity(0.3, "1") == "0.3"
    assert quantity(0.35, "T") == "0.35 T"
    assert quantity(0.05, "T") == "50 mT"
    assert quantity(8.4e-5, "T", 2, 0.6) == "0.000084 T"
    assert quantity(8.4e-5, "T", fine=True) == "84 µT"
    assert quantity(2.5e-3, "A", fine=True) == "2.5 mA"
    assert scale("N", 3.0) == (1.0, "N")
    assert scale("V", 3e9) == (1.0, "V")
    assert short_z(1.234) == "1.23"
    assert short_z(1234.5) == "1230"


@pytest.fixture(scope="module", params=[1e-2, 2e5], ids=["tiny", "huge"])
def rig(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a study of a damper of some 0.1 N, and of 2 MN."""
    folder = tmp_path_factory.mktemp("rig")
    files = []
    for k in (1, 2, 3):
        columns = bench_run(k, 2.0)
        columns["F [N]"] = request.param * columns["F [N]"]
        files.append(write(folder / "lab" / f"run_{k}.csv", columns))
    create_study(folder / "rig", files)
    return folder / "rig"


@pytest.mark.parametrize(
    "line",
    [
        "study check",
        "compare",
        "identify --starts 1",
        # A report of very large and very small forces.
        pytest.param("report", marks=pytest.mark.slow),
    ],
)
def test_no_command_prints_a_power_of_ten(
    line: str, rig: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*line.split(), str(rig)]) == 0
    told = capsys.readouterr()
    assert not POWER.search(told.out), told.out
    if line == "report":
        page = (rig / "reports" / "report.html").read_text(encoding="utf-8")
        hashes = r"<td[^>]*>[0-9a-f]{16}</td>"
        hidden = r"<style.*?</style>|<script.*?</script>"
        text = re.sub(rf"{hidden}|{hashes}|<[^>]*>", " ", page, flags=re.DOTALL)
        assert [text[m.start() - 30 : m.end() + 10] for m in POWER.finditer(text)] == []


@pytest.mark.slow  # all commands of a study, a diagnosis among them
def test_nor_does_a_diagnosis(rig: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for line in ("identify", "diagnose", "add", "compare", "report"):
        words = [line, str(rig), *(["stribeck"] if line == "add" else [])]
        assert main(words) == 0
        told = capsys.readouterr()
        assert not POWER.search(told.out), told.out


def test_marks_of_a_logarithmic_axis() -> None:
    marks = (1e-9, 2e-6, 1e-5, 1e-4, 0.01, 1.0, 100.0, 1e4, 1e5, 3e7)
    shown = ["10⁻⁹", "2 × 10⁻⁶", "10⁻⁵", "0.0001", "0.01", "1", "100", "10000", "10⁵", "3 × 10⁷"]  # noqa: RUF001
    assert [tick(mark) for mark in marks] == shown
    assert tick(0.0) == "0"
    assert tick(-1e10) == "-10¹⁰"


def test_a_number_to_type_has_its_zeros_until_they_must_be_counted() -> None:
    assert [typed(value) for value in (1e6, 0.02, -415.0, 123456.7)] == [
        "1000000", "0.02", "-415", "123457",
    ]  # fmt: skip
    assert [typed(value) for value in (1e9, -1e10, 1e-7)] == ["10⁹", "-10¹⁰", "10⁻⁷"]


@pytest.mark.parametrize(
    "line", ["list ports LuGreDamper", "list ports Structure", "list effects", "list laws"]
)
def test_no_list_shows_a_power_of_ten(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(line.split()) == 0
    told = capsys.readouterr().out
    assert told
    assert not POWER.search(told), told


def test_the_decades_of_an_axis_are_written_in_one_way():
    assert [log_ticks(0.1, 2e4)(v) for v in (0.1, 1e4)] == ["0.1", "10000"]
    assert [log_ticks(0.1, 2e5)(v) for v in (0.1, 1e4, 1e5)] == ["10⁻¹", "10⁴", "10⁵"]
