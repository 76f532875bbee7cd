"""What a command is at: told on stderr, overwritten on a terminal, now and then in a pipe."""

from __future__ import annotations

import os
import re
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from bristle import progress
from bristle.cli import _line
from bristle.cli._line import Line
from bristle.progress import Count, Progress, counted, tell, telling


def test_nobody_is_told_where_nobody_listens(capsys: pytest.CaptureFixture[str]) -> None:
    tell("at work")
    Count("effect", 2).done("coil_lag")
    assert list(counted([1, 2], "start")) == [1, 2]
    assert capsys.readouterr() == ("", "")


def test_things_done_are_counted_with_the_time_left(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    said: list[str] = []
    with telling(said.append):
        count = Count("effect", 3)
        now[0] += 90.0  # the first one compiles
        count.done("coil_lag", "best so far saturation")
        now[0] += 20.0
        count.done("stribeck")
        now[0] += 20.0
        count.done("delay")
    assert said == [
        "effect 1 of 3, coil_lag; best so far saturation",
        "effect 2 of 3, stribeck; about 20 s left",
        "effect 3 of 3, delay",
    ]


def test_threads_tell_whom_the_first_one_tells() -> None:
    said: list[str] = []
    with telling(said.append):
        count = Count("effect", 20)
        with ThreadPoolExecutor(4) as pool:
            list(pool.map(lambda _: count.done(), range(20)))
    assert sorted(said) == sorted(f"effect {k} of 20" for k in range(1, 21))


def test_a_pipe_gets_few_plain_lines(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    with Line() as line, telling(line.say):
        for k in range(240):
            now[0] = 0.1 * k
            tell(f"step {k}")
    told = capsys.readouterr()
    assert told.out == ""
    lines = told.err.splitlines()
    assert lines[0] == "step 50 ..."
    assert len(lines) == 4
    assert "\033" not in told.err


def test_what_takes_long_is_told_though_nothing_more_is_said(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(_line, "_PLAIN_AFTER", 0.5)
    monkeypatch.setattr(_line, "_AGAIN", 1.5)
    with Line() as line, telling(line.say):
        tell("compiling the laws, once")
        time.sleep(4.5)
    first, second, *_ = capsys.readouterr().err.splitlines()
    assert first == "compiling the laws, once ..."
    assert re.fullmatch(r"compiling the laws, once, \d s \.\.\.", second)


@pytest.mark.skipif(sys.platform == "win32", reason="a pseudo-terminal is needed")
def test_a_program_that_asks_for_lines_gets_every_text_at_once(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(progress.LINES, "lines")
    with Line() as line, telling(line.say):
        for text in ("reading", "fitting", "fitting", "judging"):
            tell(text)
    assert capsys.readouterr().err.splitlines() == ["reading ...", "fitting ...", "judging ..."]


def test_a_terminal_has_one_line_that_is_gone_before_the_answer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    import pty

    ours, theirs = pty.openpty()
    with open(theirs, "w", closefd=False) as stream:
        monkeypatch.setattr(sys, "stderr", stream)
        monkeypatch.setattr(sys, "stdout", stream)
        with Line() as line, telling(line.say):
            tell("one")
            tell("two")
            print("the answer", flush=True)
        assert sys.stdout is stream
        stream.flush()
    shown = ""
    while "the answer\r\n" not in shown:
        shown += os.read(ours, 4096).decode()
    os.close(theirs)
    os.close(ours)
    assert shown.count("\n") == 1
    assert shown.index("two ...") < shown.rindex("\033[2K") < shown.index("the answer")


def test_a_bar_in_a_pipe_tells_its_share(capsys: pytest.CaptureFixture[str]) -> None:
    said: list[str] = []
    with telling(said.append), Progress("controllers", 50, True) as bar:
        bar.show(1)
        bar.show(25)
    assert [text.partition(",")[0] for text in said] == [
        "controllers", "controllers: 2 %", "controllers: 50 %",
    ]  # fmt: skip
    said.clear()
    with telling(said.append), Progress("controllers", 50, False) as bar:
        bar.show(25)
    assert said == []
    assert capsys.readouterr() == ("", "")
