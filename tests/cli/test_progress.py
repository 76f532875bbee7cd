"""What a command is at: told on stderr, overwritten on a terminal, now and then in a pipe."""

from __future__ import annotations

import os
import re
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from bristle.cli import _line
from bristle.cli._line import ProgressLine
from bristle.core import progress
from bristle.core.progress import Count, Progress, Stages, counted, listening, tell, telling


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
    with ProgressLine() as line, telling(line.say):
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
    monkeypatch.setattr(_line, "_PLAIN_AFTER", 0.3)
    monkeypatch.setattr(_line, "_AGAIN", 1.0)
    with ProgressLine() as line, telling(line.say):
        tell("compiling the laws, once")
        time.sleep(2.5)
    first, second, *_ = capsys.readouterr().err.splitlines()
    assert first == "compiling the laws, once ..."
    assert re.fullmatch(r"compiling the laws, once, \d s \.\.\.", second)


@pytest.mark.skipif(sys.platform == "win32", reason="a pseudo-terminal is needed")
def test_a_program_that_asks_for_lines_gets_every_text_at_once(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(progress.LINES, "lines")
    with ProgressLine() as line, telling(line.say):
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
        with ProgressLine() as line, telling(line.say):
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


def test_the_one_at_work_is_told_with_what_those_before_it_took(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    said: list[str] = []
    with telling(said.append):
        count = Count("test", 4)
        for seconds in (60.0, 10.0, 10.0, 10.0):  # the first one compiles
            count.begins()
            now[0] += seconds
    assert said == [
        "test 1 of 4", "test 2 of 4", "test 3 of 4; about 20 s left",
        "test 4 of 4; about 10 s left",
    ]  # fmt: skip


def test_time_left_is_told_once_each_kind_was_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    said: list[str] = []
    with telling(said.append):
        stages = Stages("case", {"run": 4, "worst": 2, "limit": 0})
        for kind, seconds in (("run", 9.0), ("run", 4.0), ("worst", 60.0), ("run", 4.0)):
            stages.begins(kind, kind)
            now[0] += seconds
        stages.begins("worst", "worst")
        now[0] += 200.0
        stages.begins("run", "run")
    assert said == [
        "case 1 of 6, run", "case 2 of 6, run",
        "case 3 of 6, worst",  # nobody knows yet how long one takes
        "case 4 of 6, run; about 70 s left",  # two runs of 4 s, and 60 s
        "case 5 of 6, worst; about 60 s left",
        "case 6 of 6, run; about 4 s left",
    ]  # fmt: skip


def test_what_was_kept_from_before_does_not_shorten_the_time_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    said: list[str] = []
    with telling(said.append), Progress("ensemble", 100, True) as bar:
        now[0] += 5.0
        bar.show(81)  # 80 of them are from an earlier start
        now[0] += 6.0
        bar.show(84)
    assert said[-1] == "ensemble: 84 %, about 30 s left"  # 2 s each


def test_bars_are_silenced_where_a_command_is_quiet() -> None:
    assert not listening()
    with telling(None):
        assert not listening()
        with Progress("ensemble", 2, True) as bar:
            assert not bar._live
    with telling(print):
        assert listening()


@pytest.mark.skipif(sys.platform == "win32", reason="a pseudo-terminal is needed")
def test_questions_and_warnings_stand_alone_on_the_terminal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    import pty

    ours, theirs = pty.openpty()
    with open(theirs, "w", closefd=False) as stream:
        monkeypatch.setattr(sys, "stderr", stream)
        with ProgressLine("bristle run") as line, telling(line.say):
            tell("")
            print("Run it? [y/N] ", end="", file=sys.stderr, flush=True)
            time.sleep(1.2)
            tell("at work")
            print("a warning", file=sys.stderr, flush=True)
        assert sys.stderr is stream
    shown = ""
    while "a warning\r\n" not in shown:
        shown += os.read(ours, 4096).decode()
    os.close(theirs)
    os.close(ours)
    assert shown == "Run it? [y/N] \r\033[2Kat work ...\r\r\033[2Ka warning\r\n"
