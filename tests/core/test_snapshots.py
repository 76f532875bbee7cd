"""Snapshots: one line of JSON behind a record separator, which no text is taken for."""

from __future__ import annotations

import pytest

from bristle.core import progress
from bristle.core.progress import SEPARATOR, read, watched_by, watcher, write


def test_what_is_written_is_read_as_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    told = {"series": "model", "text": "two\nlines", "values": [1.5, None]}
    write(told)
    out, err = capsys.readouterr()
    assert out == ""
    line, rest = err.split("\n")
    assert rest == ""
    assert line.startswith(SEPARATOR)
    assert read(line) == told


@pytest.mark.parametrize("line", ["fitting ...", "", '{"series": 1}', "\x1e{", "\x1e[1]"])
def test_other_lines_are_no_snapshots(line: str) -> None:
    assert read(line) is None


def test_a_number_that_json_has_not_is_refused() -> None:
    with pytest.raises(ValueError, match="JSON"):
        write({"z": float("nan")})


def test_nobody_watches_unless_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    assert watcher() is None
    with watched_by(write):
        assert watcher() is write
        with watched_by(None):
            assert watcher() is None
    assert watcher() is None
    monkeypatch.delenv(progress.VARIABLE, raising=False)
    assert not progress.wanted()
    monkeypatch.setenv(progress.VARIABLE, "lines")
    assert progress.wanted()
