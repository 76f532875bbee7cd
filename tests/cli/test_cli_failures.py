"""What the command line does when something goes wrong that nobody foresaw, and on Ctrl-C."""

from __future__ import annotations

import hashlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from made import write_runs

from bristle.cli import main
from bristle.errors import StudyError
from bristle.study import create_study
from bristle.study.study import Study


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    return create_study(tmp_path / "rig", write_runs(tmp_path / "lab", seconds=2.0)).study.folder


def digests(folder: Path) -> dict[str, str]:
    """Return the digests of a folder's files, locks aside."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != ".lock"
    }


def test_a_channel_that_is_given_twice_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["compare-fmu", "a.fmu", "--data", "run.csv"]
    assert main([*asked, "--channel", "force=a", "--channel", "force=b"]) == 2
    assert "--channel force is given twice; once is right" in capsys.readouterr().err


def test_an_error_that_nobody_foresaw_is_one_line_with_a_file(
    rig: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("BRISTLE_STATE", str(tmp_path / "state"))

    def broken(study: Study, role: str | None = None) -> None:
        raise ZeroDivisionError("float\ndivision by zero")

    monkeypatch.setattr(Study, "read", broken)
    before = digests(rig)
    assert main(["diagnose", str(rig)]) == 1
    told = capsys.readouterr()
    assert told.out == ""
    (line,) = told.err.splitlines()
    assert "bristle diagnose" in line
    assert "ZeroDivisionError: float division by zero" in line
    file = Path(line.rpartition(": ")[2])
    assert file.parent == tmp_path / "state" / "errors"
    kept = file.read_text(encoding="utf-8")
    assert "Traceback (most recent call last)" in kept
    assert "in broken" in kept
    assert digests(rig) == before
    with pytest.raises(ZeroDivisionError):
        main(["diagnose", str(rig), "--debug"])


def test_a_failure_between_two_writes_leaves_the_study_whole(
    rig: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from bristle.study import history

    study = Study(rig)
    study.add_step("add stribeck", "to see", study.model().with_effect("stribeck"))
    before = {k: v for k, v in digests(rig).items() if not k.startswith("history/.")}

    def full(path: Path, data: object) -> None:
        raise RuntimeError("no such thing")

    monkeypatch.setattr(history, "write_json", full)
    assert main(["undo", str(rig)]) == 1
    monkeypatch.undo()
    assert "RuntimeError: no such thing" in capsys.readouterr().err
    again = Study(rig)
    assert [step.what for step in again.steps()][-1] == "add stribeck"
    assert {k: v for k, v in digests(rig).items() if not k.startswith("history/.")} == before
    assert main(["undo", str(rig)]) == 0


def test_where_no_folder_can_be_written_the_line_says_so(
    rig: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("BRISTLE_STATE", str(tmp_path / "file"))
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path / "file"))
    monkeypatch.setattr(Study, "undo", lambda self: 1 // 0)
    assert main(["undo", str(rig)]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "--debug shows it" in line


def test_only_the_last_tracebacks_are_kept(
    rig: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BRISTLE_STATE", str(tmp_path / "state"))
    folder = tmp_path / "state" / "errors"
    folder.mkdir(parents=True)
    for number in range(30):
        (folder / f"20200101-0000{number:02d}-1.txt").touch()
    monkeypatch.setattr(Study, "undo", lambda self: 1 // 0)
    assert main(["undo", str(rig)]) == 1
    assert len(list(folder.glob("*.txt"))) == 20


KERNEL = """
        from bristle.core.jit import compiled

        def spin(n):
            total = 0.0
            for i in range(n):
                total += 1.0 / (1.0 + total * i)
            return total

        kernel = compiled(spin, keep=False)
        kernel(10)
        print("in", flush=True)
        kernel(10**13)
"""
STUCK = {
    "compiled code": KERNEL,
    "compiled code, with other processes": """
        import multiprocessing, time
        for _ in range(2):
            multiprocessing.get_context("fork").Process(target=time.sleep, args=(60,)).start()
    """
    + KERNEL,
    "python": """
        print("in", flush=True)
        while True:
            pass
    """,
}


def alive(group: int) -> list[str]:
    """Return the processes of a group that have not ended."""
    command = ["ps", "-A", "-o", "pgid=,stat="]
    rows = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    return [row for row in rows if row.split()[0] == str(group) and "Z" not in row.split()[1]]


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C cannot be sent to one process")
@pytest.mark.parametrize("what", STUCK)
def test_ctrl_c_is_answered_whatever_does_not_return(what: str, tmp_path: Path) -> None:
    body = "\n".join(f"    {line}" for line in STUCK[what].splitlines())
    code = f"""
import bristle.cli.undo as command
from bristle.cli import main

def work(arguments):
    if True:
{body}

command.main = work
raise SystemExit(main(["undo", "rig"]))
"""
    file = tmp_path / "stuck.py"
    file.write_text(code)
    child = subprocess.Popen(
        [sys.executable, str(file)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True,
        # A shell's background job ignores it, and so would all that it starts.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    assert child.stdout is not None
    assert child.stdout.readline() == "in\n"
    time.sleep(0.2)
    os.kill(child.pid, signal.SIGINT)
    try:
        _, told = child.communicate(timeout=20)  # two seconds, on a machine that is not busy
    finally:
        child.kill()
    assert child.returncode == 130
    assert told.strip().splitlines()[-1] == "interrupted"  # after what is told of slow work
    deadline = time.monotonic() + 5.0
    while alive(child.pid) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not alive(child.pid)


def test_ctrl_c_before_the_command_begins_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(_only: str) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("bristle.cli.build_parser", interrupted)
    assert main(["undo", "rig"]) == 130
    assert capsys.readouterr().err == "interrupted\n"


def test_every_action_takes_the_options_of_every_command(
    rig: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["study", "check", str(rig), "--quiet"]) == 0
    assert capsys.readouterr().err == ""
    (rig / "study.toml").unlink()
    for line in (["study", "--debug", "check", str(rig)], ["study", "check", str(rig), "--debug"]):
        with pytest.raises(StudyError):
            main(line)


def test_a_file_may_follow_an_option(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "law", "--json", "my_law"]) == 0
    assert (tmp_path / "my_law.py").is_file()
    with pytest.raises(SystemExit):
        main(["new", "law", "--json", "my_law", "other"])
    assert "unrecognized arguments: other" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("line", "now"),
    [
        ("identify rig --no-table", "leave it out: there is no table"),
        ("compare rig --fmu=a.fmu", "bristle compare-fmu"),
        ("study check rig --exclude a", "bristle study roles --exclude"),
        ("laws", "bristle list laws"),
    ],
)
def test_an_option_that_is_gone_names_the_new_form(line, now, capsys) -> None:
    with pytest.raises(SystemExit):
        main(line.split())
    assert f"It is gone; now: {now}" in " ".join(capsys.readouterr().err.split())


def test_an_interrupted_command_ends_without_taking_the_process_down_first(tmp_path: Path) -> None:
    code = """
import atexit, time
import bristle.cli.undo as command
from bristle.cli import run_and_exit

def work(arguments):
    print("half a line", end="")
    raise KeyboardInterrupt

atexit.register(time.sleep, 60.0)  # as compiled code takes its time
command.main = work
run_and_exit()
"""
    file = tmp_path / "slow_to_end.py"
    file.write_text(code)
    command = [sys.executable, str(file), "undo", "rig"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=40, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "half a line", "interrupted\n")


@pytest.mark.parametrize("chosen", [None, "3"])
def test_products_of_matrices_take_one_thread_unless_the_environment_says_otherwise(
    tmp_path: Path, chosen: str | None
) -> None:
    code = """
import os, sys
import bristle.cli.undo as command
from bristle.cli import run_and_exit

def work(arguments):
    print("numpy" in sys.modules, os.environ["OPENBLAS_NUM_THREADS"])
    return 0

command.main = work
run_and_exit()
"""
    file = tmp_path / "tells.py"
    file.write_text(code)
    given = {k: v for k, v in os.environ.items() if not k.endswith("_NUM_THREADS")}
    given |= {"OPENBLAS_NUM_THREADS": chosen} if chosen else {}
    command = [sys.executable, str(file), "undo", "rig"]
    done = subprocess.run(command, capture_output=True, text=True, env=given, check=True)
    assert done.stdout.split() == ["False", chosen or "1"]


@pytest.mark.parametrize(
    ("line", "near"),
    [
        (["diagnos", "my_rig"], "diagnose"),
        (["study", "chek", "my_rig"], "check"),
        (["list", "efects"], "effects"),
        (["diagnose", "my_rig", "--detials"], "--details"),
    ],
)
def test_of_a_misspelt_word_the_one_that_is_near_is_told(capsys, line, near):
    with pytest.raises(SystemExit) as ended:
        main(line)
    assert ended.value.code == 2
    assert f'Did you mean "{near}"?' in capsys.readouterr().err
