"""Groups of thousands: 1.234 is 1234 where the column says so, and never 1.234 in one sample."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bristle.cli import main
from bristle.data.guess import guess_channels
from bristle.data.measurement import measurements_of
from bristle.data.read import read_table
from bristle.errors import RecordError

T = np.arange(1000) / 500.0
X = 10.0 * np.sin(8.0 * T)
F = 1500.0 * np.cos(8.0 * T) * (1.0 + 0.2 * np.sin(T)) + 40.0
Text = Callable[[float], str]


def number(group: str, decimal: str, places: int) -> Text:
    def text(value: float) -> str:
        plain = f"{value:,.{places}f}"
        return plain.replace(",", "#").replace(".", decimal).replace("#", group)

    return text


def made(path: Path, sep: str, force: Text, other: Text, columns=(T, X, F)) -> Path:
    """Return a file of time, displacement and force; fields that hold the separator are quoted."""
    lines = [sep.join(("time [s]", "x [mm]", "F [N]"))]
    for t, x, f in zip(*columns, strict=True):
        fields = [other(t), other(x), force(f)]
        lines.append(sep.join(f'"{one}"' if sep in one else one for one in fields))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("sep", "group", "decimal", "places"),
    [(";", ".", ",", 0), (";", ".", ",", 2), ("\t", ".", ",", 1), (",", ",", ".", 2),
     (";", ",", ".", 0), (";", "'", ".", 1), (";", "\u2019", ".", 2), (";", "\u202f", ",", 1),
     ("\t", " ", ",", 2), (";", "\u00a0", ",", 0)],
)  # fmt: skip
def test_groups_beside_the_decimals_of_other_columns(tmp_path, sep, group, decimal, places):
    file = made(tmp_path / "a.csv", sep, number(group, decimal, places), number("", decimal, 4))
    (run,) = measurements_of(read_table(file), estimate=False)
    np.testing.assert_allclose(np.abs(run["force"]), np.abs(F), atol=0.51)
    assert any("groups of thousands" in note for note in run.notes)


@pytest.mark.parametrize(("sep", "group"), [(";", "."), (";", ","), ("\t", "."), (",", ",")])
def test_whole_numbers_alone(tmp_path, sep, group) -> None:
    whole = number(group, "", 0)
    lines = [sep.join(("t [ms]", "x [um]", "F [N]"))]
    for t, x, f in zip(1e3 * T, 1e3 * X, F + 6000.0, strict=True):  # a force that is never below
        fields = [whole(round(t)), whole(round(x)), whole(round(f))]
        lines.append(sep.join(f'"{one}"' if sep in one else one for one in fields))
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    table = read_table(tmp_path / "a.csv")
    np.testing.assert_allclose(table.values["t [ms]"], 1e3 * T)
    np.testing.assert_allclose(table.values["F [N]"], F + 6000.0, atol=0.51)


def test_a_column_of_nothing_but_groups_is_doubted(tmp_path) -> None:
    file = made(tmp_path / "a.csv", ";", number("", ",", 2), number("", ",", 4))
    lines = file.read_text().splitlines()
    file.write_text("\n".join(
        [lines[0], *(f"{1.0 + t:.3f};{one.partition(';')[2]}" for t, one in
                     zip(T, lines[1:], strict=True))]))  # fmt: skip
    (time, *_) = guess_channels(read_table(file))
    assert '"1.000" is read as 1000, and nothing tells' in time.doubt


@pytest.mark.parametrize(("sep", "decimal"), [(",", "."), (";", ","), (";", ".")])
def test_three_decimals_are_decimals(tmp_path, sep, decimal) -> None:
    three = number("", decimal, 3)
    file = made(tmp_path / "a.csv", sep, three, three, (T, X, 2.0 + F / 1000.0))
    np.testing.assert_allclose(read_table(file).values["F [N]"], 2.0 + F / 1000.0, atol=1e-3)


def test_one_mark_for_decimals_and_groups_is_named(tmp_path, capsys) -> None:
    file = made(tmp_path / "a.csv", ";", number(".", "", 0), number("", ".", 3))
    assert main(["study", "new", str(tmp_path / "rig"), "--data", str(file)]) != 0
    said = capsys.readouterr().err
    assert 'column "F [N]"' in said
    assert "write numbers without groups" in said


def test_numbers_with_and_without_groups_are_named(tmp_path, capsys) -> None:
    grouped = number(",", ".", 0)
    file = made(
        tmp_path / "a.csv", ";", lambda f: grouped(f) if f > 0.0 else f"{f:.0f}",
        number("", ".", 4),
    )  # fmt: skip
    assert main(["study", "new", str(tmp_path / "rig"), "--data", str(file)]) != 0
    assert "has no group of thousands" in capsys.readouterr().err


def test_what_nothing_settles_is_doubtful(tmp_path, capsys) -> None:
    lines = ["t [ms];x [um];F [N]"]
    lines += [f"{k};{900 * np.sin(k / 30):.0f};{2 + np.cos(k / 30):.3f}" for k in range(900)]
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    assert main(["study", "new", str(tmp_path / "rig"), "--data", str(tmp_path / "a.csv")]) == 0
    assert "nothing tells whether" in " ".join(capsys.readouterr().out.split())


def test_groups_by_the_comma_that_parts_columns_are_refused(tmp_path) -> None:
    lines = ["time [s],x [mm],F [N]"]
    lines += [f"{t:.4f},{x:.4f},{f:,.0f}" for t, x, f in zip(T, X, F + 4000.0, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(RecordError, match=r"line 2: 4 numbers under 3 titles.*thousands"):
        read_table(tmp_path / "a.csv")
