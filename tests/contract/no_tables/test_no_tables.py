"""Files that are no table of channels are named as such, shortly and at once."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
import pytest

from bristle.cli import main
from bristle.core.text import cut_short, listed
from bristle.data.read import read_table
from bristle.errors import RecordError

ROWS = np.random.default_rng(0).normal(size=(20, 20000))


def read_nothing(folder: Path) -> None:
    """Import what reads files."""
    (folder / "other.csv").write_text("t [s],F [N]\n0,1\n")
    read_table(folder / "other.csv")


def side_by_side(delimiter: str, titles: bool, rows: int = 4) -> str:
    return "\n".join(
        delimiter.join([*([f"channel {k}"] if titles else []), *(f"{v:.5f}" for v in row)])
        for k, row in enumerate(ROWS[:rows])
    )


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("a.json", json.dumps(ROWS[:, :500].tolist()), "this is JSON"),
        ("a.json", json.dumps({"time": [0.0, 0.1], "force": [1, 2]}), "this is JSON"),
        ("a.txt", json.dumps([{"t": 0.1, "F": 2.0}] * 99, indent=1), "this is JSON"),
        ("a.csv", "\n".join(['{"t": 0.1, "F": 2.0}'] * 99), "this is JSON"),
        ("a.xml", '<?xml version="1.0"?><a/>', "this is XML"),
        ("a.csv", side_by_side(",", True), "channels are rows"),
        ("a.txt", side_by_side("\t", False, 20), "channels are rows"),
        ("a.csv", side_by_side(";", True).replace(".", ","), "channels are rows"),
        ("a.csv", side_by_side(",", False, 1), "channels are rows"),
    ],
)
def test_they_are_named_in_a_line_and_a_second(
    tmp_path: Path, capsys, name: str, text: str, told: str
) -> None:
    (tmp_path / name).write_text(text)
    read_nothing(tmp_path)
    began = time.perf_counter()
    with pytest.raises(RecordError, match=told):
        read_table(tmp_path / name)
    assert time.perf_counter() - began < 1.0
    code = main(["study", "new", str(tmp_path / "s"), "--data", str(tmp_path / name), "--quiet"])
    said = capsys.readouterr().err
    assert code == 2
    assert told in said
    assert len(said) < 1000
    assert said.count("\n") == 1


@pytest.mark.parametrize("above", ["[1]\nname=x\ntime [s],F [N]\n", "[s],[mm]\n"])
def test_a_table_below_brackets_is_read(tmp_path: Path, above: str) -> None:
    (tmp_path / "a.csv").write_text(above + "".join(f"{0.01 * k},{k % 7}\n" for k in range(99)))
    assert read_table(tmp_path / "a.csv").rows == 99


def test_what_is_not_there_is_answered_with_a_few_names(tmp_path: Path) -> None:
    titles = ",".join(f"channel number {k}" for k in range(300))
    rows = "\n".join(",".join(f"{v:.3f}" for v in row[:300]) for row in np.tile(ROWS, (20, 1)))
    (tmp_path / "a.csv").write_text(f"{titles}\n{rows}\n")
    with pytest.raises(RecordError, match=r'"channel number 0", .* and 288 more') as error:
        read_table(tmp_path / "a.csv").find("force")
    assert len(str(error.value)) < 1000


def test_lists_and_messages_end_with_a_count_of_the_rest() -> None:
    assert listed(["a", "b"]) == "a, b"
    assert listed(map(str, range(30)), 3) == "0, 1, 2 and 27 more"
    assert len(listed(["x" * 100] * 12)) < 330
    assert cut_short("short\nlines") == "short\nlines"
    assert cut_short("\n".join(map(str, range(50)))).endswith("8\n  ... and 41 more lines.")
    for text in ("x" * 5000, "\n".join(["y" * 300] * 9), "\n".join(["z" * 90] * 40)):
        short = cut_short(text)
        assert len(short) <= 1000
        assert short.count("\n") < 10
        assert "more" in short
