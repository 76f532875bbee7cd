"""What commands show on a terminal while they work, and leave behind where Ctrl-C ends them."""

from __future__ import annotations

import argparse
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from made import write_runs

from bristle.cli import KEPT, build_parser, main
from bristle.study import create_study
from bristle.study.study import Study

needs_terminal = pytest.mark.skipif(sys.platform == "win32", reason="a pseudo-terminal is needed")

OWN_MESSAGE = {"run", "ensemble"}
"""Commands that tell themselves how much they kept."""
SHORT = {
    "bug-report", "check", "example", "import-ssp", "list", "new", "page", "study", "undo",
}  # fmt: skip
"""Commands that are done in a moment, wait for the user, or have actions that are told apart."""


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    return create_study(tmp_path / "rig", write_runs(tmp_path / "lab", seconds=2.0)).study.folder


@contextmanager
def terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[], str]]:
    """Make stderr a terminal; yield what returns all that it shows, once nothing more comes."""
    import pty

    ours, theirs = pty.openpty()
    shown: list[bytes] = []

    def read() -> None:
        while True:
            try:
                part = os.read(ours, 65536)
            except OSError:  # how a terminal ends on Linux
                return
            if not part:
                return
            shown.append(part)

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    stream = os.fdopen(theirs, "w", encoding="utf-8")
    monkeypatch.setattr(sys, "stderr", stream)

    def all_shown() -> str:
        stream.close()
        reader.join(10.0)
        return b"".join(shown).decode()

    try:
        yield all_shown
    finally:
        monkeypatch.undo()
        stream.close()
        os.close(ours)


FAST = {
    "study check": (["study", "check", "{rig}"], "checking the data"),
    "study check, as JSON": (["study", "check", "{rig}", "--json"], "checking the data"),
    "run": (
        ["run", "bench_sine_bingham", "--set", "run.stop=0.2", "--coupling-error", "--no-figure",
         "--out", "{out}"],
        "a step of 0.25 ms",
    ),
    "optimise": (
        ["optimise", "passive", "--set", "run.stop=1.0", "--intensities", "0.4", "--grid", "3",
         "--no-figure", "--out", "{out}"],
        "passive optimum",
    ),
}  # fmt: skip
SLOW = {
    "example": (["example", "bench", "{out}"], "run 2 of 5"),
    "identify": (["identify", "{rig}"], r"start \d of 4"),
    "diagnose": (["diagnose", "{rig}", "--law", "lugre"], r"effect \d+ of \d+"),
    "compare": (["compare", "{rig}"], "holding the model against the runs"),
    "report": (["report", "{rig}"], "drawing"),
    "limit": (
        ["limit", "half_sine_pulse", "--set", "run.stop=1.0", "--starts", "2", "--preview", "0.1",
         "--no-figure", "--out", "{out}"],
        "search 2 of 2, from",
    ),
    "controllers": (
        ["controllers", "--motions", "el_centro_1940_ns,peak=0.4g,factor=0.45,stop=4",
         "--controller", "Skyhook", "--grid", "3", "--spread", "10%", "--ensemble", "4",
         "--no-figure", "--out", "{out}"],
        r"case 5 of 10|run 4 of 4",
    ),
    "ensemble": (
        ["ensemble", "el_centro_damper_and_building", "--runs", "4", "--no-figure", "--out",
         "{out}"],
        "100%",
    ),
    "conform": (["conform", "{fmu}"], r"probe 2 of \d+"),
}  # fmt: skip


def words(of: list[str], rig: Path, tmp_path: Path) -> list[str]:
    """Return a command line of the tables with its files."""
    fmu = ""
    if "{fmu}" in of:
        from bristle.fmu.build import ensure

        fmu = str(ensure("ConstantVoltage"))
    return [word.format(rig=rig, out=tmp_path / "out", fmu=fmu) for word in of]


@needs_terminal
@pytest.mark.parametrize(
    # A process of seconds each: the others of the same list show the kind.
    "what",
    [*FAST, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)],
)
def test_a_terminal_shows_what_a_command_does_and_its_answer_does_not(
    what: str, rig: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    line, expected = {**FAST, **SLOW}[what]
    if what in ("compare", "report"):
        assert main(["identify", str(rig), "--quiet"]) == 0
        capsys.readouterr()
    with terminal(monkeypatch) as shown:
        assert main(words(line, rig, tmp_path)) == 0
        told = shown()
    assert re.search(expected, told), told
    answer = capsys.readouterr().out
    assert not re.search(expected, answer)
    assert "\033" not in answer


@needs_terminal
@pytest.mark.parametrize("what", ["study check", "optimise"])
def test_quiet_shows_nothing_on_a_terminal(
    what: str, rig: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with terminal(monkeypatch) as shown:
        assert main([*words(FAST[what][0], rig, tmp_path), "--quiet"]) == 0
        assert shown() == ""


@needs_terminal
def test_a_command_that_tells_nothing_is_named_after_a_while(
    rig: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bristle.cli._line.SOON", 0.2)
    monkeypatch.setattr(Study, "undo", lambda self: time.sleep(1.3) or self.steps()[0])
    with terminal(monkeypatch) as shown:
        main(["undo", str(rig)])
        assert "bristle undo" in shown()


def test_every_command_that_takes_long_tells_what_ctrl_c_keeps() -> None:
    parser = build_parser()
    (commands,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    told = {name.partition(" ")[0] for name in KEPT}
    assert set(commands.choices) - told - SHORT == OWN_MESSAGE
    assert told <= set(commands.choices)
    for text in KEPT.values():
        assert text[0].isupper()
        assert text.endswith(".")


def test_ctrl_c_tells_what_is_kept(
    rig: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*given: object, **named: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("bristle.study.steps.diagnose_study", interrupted)
    assert main(["diagnose", str(rig)]) == 130
    (line,) = capsys.readouterr().err.splitlines()
    assert line == f"interrupted. {KEPT['diagnose']}"
    monkeypatch.setattr("bristle.study.auto.complete", interrupted)
    assert main(["study", "auto", str(rig)]) == 130
    assert KEPT["study auto"] in capsys.readouterr().err
    monkeypatch.setattr(Study, "undo", interrupted)
    assert main(["undo", str(rig)]) == 130  # nothing of the command before
    assert capsys.readouterr().err == "interrupted\n"


STOPPED = {
    "identify": (["identify", "{rig}"], "fitting|compiling"),
    "diagnose": (["diagnose", "{rig}", "--law", "lugre"], "effect 1 of|compiling"),
    "study auto": (["study", "auto", "{rig}"], "law 1 of|compiling|effect 1 of"),
    "optimise": (["optimise", "passive", "--out", "{out}"], "passive optimum: "),
    "limit": (["limit", "--out", "{out}"], "search 1 of 3"),
    "controllers": (
        ["controllers", "--motions", "el_centro_1940_ns,peak=0.4g,factor=0.45", "--controller",
         "Skyhook", "--spread", "10%", "--ensemble", "400", "--out", "{out}"],
        "run 2 of 400",
    ),
    "run": (["run", "el_centro_0p6g_constant_voltage", "--out", "{out}"], "% *"),
    "export-ssp": (
        ["export-ssp", "el_centro_0p6g_constant_voltage", "--out", "{out}.ssp"], "a step of 1 ms",
    ),
}  # fmt: skip


@pytest.mark.slow  # a process a command, each stopped at work
@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C cannot be sent to one process")
@pytest.mark.parametrize("what", STOPPED)
def test_ctrl_c_amid_the_work_is_one_line_and_leaves_all_whole(
    what: str, rig: Path, tmp_path: Path
) -> None:
    before = {path: path.read_bytes() for path in rig.rglob("*") if path.is_file()}
    line, until = STOPPED[what]
    child = subprocess.Popen(
        [sys.executable, "-m", "bristle.cli", *words(line, rig, tmp_path)], cwd=tmp_path,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        env={**os.environ, "BRISTLE_PROGRESS": "lines"},
        # A shell's background job ignores it, and so would all that it starts.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    assert child.stderr is not None
    told = ""
    while not re.search(until, told):
        told = child.stderr.readline()
        assert told, f"it ended before {until!r}"
    time.sleep(0.3)
    os.kill(child.pid, signal.SIGINT)
    answer, rest = child.communicate(timeout=30)
    assert child.returncode == 130, rest
    (last,) = (text for text in rest.splitlines() if not text.endswith(" ..."))
    assert last.startswith("interrupted. ")
    assert "Traceback" not in answer + rest
    until_ended = time.monotonic() + 10.0
    while working(child.pid):
        assert time.monotonic() < until_ended, "a process outlives its command"
        time.sleep(0.05)
    for path, content in before.items():
        assert path.name == ".lock" or path.read_bytes() == content
    assert not [path for path in tmp_path.rglob("*") if path.name.endswith((".part", ".new"))]


def working(session: int) -> list[str]:
    """Return the processes of a session that have not ended."""
    command = ["ps", "-A", "-o", "sid=,stat=,args="]
    rows = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    return [row for row in rows if row.split()[0] == str(session) and "Z" not in row.split()[1]]
