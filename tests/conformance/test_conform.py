"""`bristle conform`: a healthy toy passes, and each spoilt one fails the probe it is made for."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from bristle import cli
from bristle.conformance import conform
from bristle.conformance.probes import PROBES
from bristle.conformance.runner import Report
from bristle.errors import FmuError
from bristle.fmu import build, catalogue
from bristle.view.blocks import Table

TOY = Path(__file__).with_name("toy_slave.py")
XML, SCRIPT = "modelDescription.xml", "resources/toy_slave.py"

Spoil = Callable[..., Path]


@pytest.fixture(scope="session")
def healthy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("toy")
    options = ["--no-external-tool", "--handle-state", "--serialize-state"]
    command = [sys.executable, "-m", "pythonfmu", "build", "-f", TOY, "-d", folder, *options]
    subprocess.run(command, check=True, capture_output=True, cwd=folder)
    return folder / "Toy.fmu"


@pytest.fixture
def spoil(healthy: Path, tmp_path: Path) -> Spoil:
    """Return a function that writes the toy anew, with texts replaced and members added."""

    def write(*changes: tuple[str, str, str], add: dict[str, str] | None = None) -> Path:
        path = tmp_path / "Spoilt.fmu"
        with zipfile.ZipFile(healthy) as source, zipfile.ZipFile(path, "w") as sink:
            for info in source.infolist():
                data = source.read(info)
                for member, old, new in changes:
                    if member == info.filename:
                        assert old.encode() in data
                        data = data.replace(old.encode(), new.encode())
                sink.writestr(info, data)
            for name, text in (add or {}).items():
                sink.writestr(name, text)
        return path

    return write


@pytest.fixture
def trait(spoil: Spoil) -> Callable[[str], Path]:
    known = TOY.read_text()

    def write(name: str) -> Path:
        assert f'TRAIT == "{name}"' in known
        return spoil((SCRIPT, '"healthy"', f'"{name}"'))

    return write


@pytest.fixture(scope="session")
def full_report(healthy: Path) -> Report:
    return conform(healthy)


def test_healthy_toy_conforms_and_every_probe_has_its_row(full_report: Report) -> None:
    assert full_report.ok, repr(full_report)
    assert [r.probe for r in full_report.rows] == [
        n for n, p in PROBES.items() if p.rule != "bristle"
    ]
    assert full_report.counts()["pass"] >= 30
    for row in full_report.rows:
        assert row.tried
        assert row.seen
        assert row.standard
        assert row.verdict in ("pass", "note")


def test_illegal_calls_that_are_answered_ok_are_notes(full_report: Report) -> None:
    for name in ("step before initialisation", "zero step", "wrong guid", "initialise twice"):
        row = full_report.row(name)
        assert (row.verdict, row.seen) == (
            "note",
            "answered OK as if it were allowed; no harm seen",
        )


# What is spoilt, the probe that must fail for it, and a word of what was seen.
FAILING = [
    ("abort", "legal run", "crashed in fmi2DoStep: SIGABRT"),
    ("exit", "legal run", "left the process in fmi2DoStep with exit code 3"),
    ("hang", "legal run", "hung in fmi2DoStep: no answer within 1 s"),
    ("crash at instantiation", "legal run", "crashed in fmi2Instantiate: SIGSEGV"),
    ("hang at terminate", "legal run", "hung in fmi2Terminate"),
    ("raise", "legal run", "fmi2DoStep answered Fatal"),
    ("never step", "legal run", "fmi2DoStep at t = 0 s answered Discard"),
    ("NaN", "legal run", "not finite at t = 0.06 s: y = nan"),
    ("NaN at the start", "outputs at the start", "y = nan"),
    ("crash on NaN", "NaN input", "crashed in fmi2DoStep: SIGSEGV"),
    ("crash before initialisation", "step before initialisation", "crashed in fmi2DoStep"),
    ("hang on infinity", "infinite step", "hung in fmi2DoStep"),
    ("one step size", "variable steps", "answered Discard"),
    ("one step size", "split steps", "answered Discard"),
    ("hidden state", "state replay", "y at t = 0.31 s"),
    ("hidden state", "state across reset", "y at"),
    ("hidden state", "serialised state", "y at"),
    ("hidden state", "state across processes", "y at"),
    ("lossy bytes", "serialised state", "y at"),
    ("crash on restore", "state replay", "crashed in fmi2SetFMUstate: SIGSEGV"),
    ("shared state", "two instances", "beside another instance: y at"),
    ("shared state", "many instances", "instances: y at"),
    ("shared state", "reset", "reset in mid-run: y at"),
    ("shared state", "zero step", "a new instance is harmed"),
    ("remember gain", "reset", "reset in mid-run: y at"),
    ("gain at entry", "parameters in initialisation", "set in initialisation mode, y at"),
    ("random", "state replay", "y at"),
    ("forget inputs", "set values stay", "before the step u is"),
    ("secret dependency", "direct dependencies", "y follows u"),
    ("crash on infinity", "infinite input", "crashed in fmi2DoStep: SIGSEGV"),
    ("crash on large numbers", "huge input", "crashed in fmi2DoStep: SIGSEGV"),
    ("remember NaN", "NaN input", "fmi2Reset does not clear it: y at"),
    ("count in the process", "two libraries", "beside its copy: y at"),
    ("look at the path", "another FMU before", "y at"),
    ("look at the path", "another FMU after", "y at"),
    ("use numpy if there is one", "bare interpreter", "without installed packages: y at"),
]


def by_trait(rows: Iterable[tuple[str, str, str]]) -> dict[str, dict[str, str]]:
    """Return what is seen by each probe, by what is spoilt: one FMU is tried once."""
    found: dict[str, dict[str, str]] = {}
    for trait, probe, seen in rows:
        found.setdefault(trait, {})[probe] = seen
    return found


@pytest.mark.parametrize(("name", "probes"), by_trait(FAILING).items())
def test_spoilt_toy_fails(trait: Callable[[str], Path], name: str, probes: dict[str, str]) -> None:
    report = conform(trait(name), timeout=1.0 if "hang" in name else 10.0, only=probes)
    assert not report.ok
    for probe, seen in probes.items():
        assert report.row(probe).verdict == "fail"
        assert seen in report.row(probe).seen


NOTED = [
    ("NaN when driven", "driven run", "not finite at t = 0.06 s: y = nan"),
    ("random", "repeatable", "not repeatable: y at"),
    ("random", "reset", "cannot be judged"),
    ("leak", "memory", "KiB per instance"),
    ("leave a file", "terminate and free", "left.txt"),
    ("strange category", "logging", "logStrange"),
    ("need a package", "bare interpreter", "needs something that is installed here"),
    ("one step size", "zero step", "refused"),
    ("end early", "legal run", "the FMU ended the run itself at t = 0.1 s"),
    ("end early", "state replay", "5 steps replayed bit by bit"),
]


@pytest.mark.parametrize(("name", "probes"), by_trait(NOTED).items())
def test_what_the_standard_leaves_open_is_no_failure(
    trait: Callable[[str], Path], name: str, probes: dict[str, str]
) -> None:
    report = conform(trait(name), only=probes)
    assert report.ok
    for probe, seen in probes.items():
        assert seen in report.row(probe).seen


# Changes of modelDescription.xml, the probe that must fail, a word of what was seen.
BAD_FILES = [
    ('<Unknown index="2" dependencies=""/>', "", "modelDescription.xml", "Outputs"),
    ('<Unknown index="2"/>', "", "modelDescription.xml", "InitialUnknowns"),
    ('<Real start="0" unit="m"/>', '<Real unit="m"/>', "modelDescription.xml", "start"),
    ('guid="', 'guids="', "modelDescription.xml", "guid"),
    ('guid="', 'guid="" author="', "guid", "there is none"),
    ('start="0.3" unit="m"', 'start="0.3" max="0.2"', "start values", "tau = 0.3"),
    ('start="0.3" unit="m"', 'start="0.3" unit="s"', "units", "not defined: s"),
    ('valueReference="6"', 'valueReference="5"', "value references", "gain = tau"),
    ('stopTime="0.5"', 'stopTime="-1.0"', "default experiment", "make no run"),
    ('start="2"', 'start="3"', "start values in the code", "gain is 2.0, not 3.0"),
    ('variability="discrete">\n\t\t\t<Integer/>', '>\n\t\t\t<Integer start="x"/>', XML, "'x'"),
]


@pytest.mark.parametrize(
    ("old", "new", "probe", "seen"), BAD_FILES, ids=[f"{p}-{s}" for *_, p, s in BAD_FILES]
)
def test_bad_description_fails(spoil: Spoil, old: str, new: str, probe: str, seen: str) -> None:
    report = conform(spoil((XML, old, new)), only=[probe])
    assert report.row(probe).verdict == "fail"
    assert seen in report.row(probe).seen


def test_backslash_in_a_member_name_fails(spoil: Spoil) -> None:
    report = conform(spoil(add={"resources\\extra.txt": "text"}), only=["archive"])
    assert "resources\\extra.txt" in report.row("archive").seen
    assert not report.ok


def test_library_that_cannot_be_loaded_fails_and_stops_the_rest(
    spoil: Spoil, healthy: Path
) -> None:
    # A library for the right machine that breaks off in its middle.
    path = spoil()
    with zipfile.ZipFile(healthy) as source:
        whole = {n: source.read(n) for n in source.namelist()}
    with zipfile.ZipFile(path, "w") as sink:
        for name, data in whole.items():
            sink.writestr(name, data[:1000] if name.endswith(".so") else data)
    report = conform(path)
    assert report.row("library").verdict == "fail"
    assert report.row("reset").seen == "not tried: the library does not load"


def test_failure_of_what_a_probe_rests_on_is_not_hidden_by_only(
    trait: Callable[[str], Path],
) -> None:
    report = conform(trait("abort"), only=["state replay"])
    assert not report.ok
    assert report.row("state replay").seen.startswith("not tried: no life of this FMU")
    assert report.row("legal run").verdict == "fail"


def test_fmu_that_cannot_follow_moving_inputs_is_tried_at_rest(spoil: Spoil) -> None:
    path = spoil(
        (SCRIPT, "self.steps += 1\n", "self.steps += 1\n        if self.u: return False\n")
    )
    report = conform(path, only=["driven run", "reset", "state replay"])
    assert report.ok
    assert "inputs at rest only; with inputs moving, fmi2DoStep at t = 0" in report.rows[0].seen
    assert report.row("state replay").verdict == "pass"


def test_slow_fmu_is_tried_with_fewer_steps_not_called_hung(spoil: Spoil) -> None:
    path = spoil((SCRIPT, "self.steps += 1\n", "self.steps += 1; time.sleep(0.05)\n"))
    report = conform(path, timeout=4.0, only=["legal run", "many instances", "state replay"])
    assert report.ok, repr(report)
    assert "of 50 steps" in report.row("legal run").seen


def test_what_an_fmu_starts_dies_with_its_probe(spoil: Spoil, tmp_path: Path) -> None:
    mark = tmp_path / "pid"
    start = f"""import subprocess
        child = subprocess.Popen(["sleep", "1000"])
        Path({str(mark)!r}).write_text(str(child.pid))
        time.sleep(1000.0)
"""
    path = spoil((SCRIPT, "self.steps += 1\n", start))
    report = conform(path, timeout=1.0, only=["legal run"])
    assert report.row("legal run").seen.startswith("hung in fmi2DoStep")
    deadline = time.monotonic() + 5.0
    while time.monotonic() < deadline and _alive(int(mark.read_text())):
        time.sleep(0.01)
    assert not _alive(int(mark.read_text()))


def _alive(pid: int) -> bool:
    status = Path(f"/proc/{pid}/stat")
    try:
        return status.read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_fmu_finds_no_bristle_of_the_judge(spoil: Spoil) -> None:
    code = "assert 'bristle' not in sys.modules; self.steps += 1\n"
    path = spoil((SCRIPT, "self.steps += 1\n", code), (SCRIPT, "import os\n", "import os, sys\n"))
    assert conform(path, only=["legal run"]).ok


def test_unknown_probe_and_bad_time_limit_are_refused(healthy: Path) -> None:
    with pytest.raises(FmuError, match="no probe is named nonsense"):
        conform(healthy, only=["nonsense"])
    for limit in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(FmuError, match="time limit"):
            conform(healthy, timeout=limit)


# -- the command


def test_command_prints_json_and_exits_0(healthy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["conform", str(healthy), "--json", "--only", "library"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["ok"] is True
    assert told["counts"] == {"pass": 1, "fail": 0, "note": 0}
    assert told["conforms"] is True
    assert told["failures"] == {"standard": [], "bristle": [], "robustness": []}
    assert set(told["rows"][0]) == {"probe", "tried", "seen", "standard", "verdict", "rule"}


def test_command_says_first_what_is_broken_then_with_details_every_probe(
    trait: Callable[[str], Path], capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["conform", str(trait("abort")), "--only", "legal run"]
    assert cli.main(asked) == 1
    first, _, rest = capsys.readouterr().out.partition("\n\n")
    told = " ".join(first.split())
    assert told.endswith("Spoilt.fmu does not conform: 0 passed, 1 failed, 0 noted.")
    assert rest.startswith("Violations of the standard\n")
    assert "crashed in fmi2DoStep: SIGABRT" in rest
    assert "the default experiment" not in rest
    assert cli.main([*asked, "--details"]) == 1
    assert "tried: the default experiment" in capsys.readouterr().out


def test_a_lack_of_robustness_is_told_apart_and_counts_with_strict(
    trait: Callable[[str], Path], capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["conform", str(trait("crash on NaN")), "--only", "NaN input"]
    assert cli.main(arguments) == 0
    out = capsys.readouterr().out
    assert "Violations" not in out
    assert "Lack of robustness" in out
    assert out.count("crashed in fmi2DoStep: SIGSEGV") == 1
    assert "0 passed, 1 failed, 1 of them in robustness, 0 noted." in " ".join(out.split())
    assert cli.main([*arguments, "--strict"]) == 1
    assert cli.main([*arguments, "--json"]) == 0
    told = json.loads(capsys.readouterr().out.partition("\n{")[2].join(["{", ""]))
    assert (told["conforms"], told["ok"]) == (True, False)
    assert told["failures"]["robustness"] == ["NaN input"]


def test_a_reset_that_mends_nothing_violates_the_standard(trait: Callable[[str], Path]) -> None:
    report = conform(trait("remember NaN"), only=["NaN input"])
    assert report.row("NaN input").rule == "standard"
    assert not report.conforms


def test_command_prints_a_table_on_a_terminal(healthy: Path) -> None:
    pty = pytest.importorskip("pty")
    mother, child = pty.openpty()
    arguments = ["conform", str(healthy), "--only", "guid"]
    code = f"from bristle.cli import main; raise SystemExit(main({arguments}))"
    environment = {**os.environ, "COLUMNS": "150", "TERM": "xterm"}
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdout=child, stderr=child, env=environment
    )
    os.close(child)
    seen = b""
    while True:
        try:
            part = os.read(mother, 65536)
        except OSError:  # how a terminal ends on Linux
            break
        if not part:
            break
        seen += part
    assert process.wait() == 0
    assert "conforms to the standard: 1 passed" in seen.decode()
    assert "guid" in seen.decode()


@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
def test_interrupted_command_exits_130_and_leaves_nothing_behind(
    trait: Callable[[str], Path], tmp_path: Path
) -> None:
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    code = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
    arguments = ["conform", str(trait("hang"))]
    code += f"from bristle.cli import main; raise SystemExit(main({arguments}))"
    environment = {**os.environ, "TMPDIR": str(temporary)}
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    deadline = time.monotonic() + 15.0

    def stepping() -> bool:
        for box in temporary.glob("*/work/box"):
            with suppress(FileNotFoundError):  # the probe before has just ended
                if b"fmi2DoStep" in box.read_bytes():
                    return True
        return False

    while not stepping():
        assert time.monotonic() < deadline
        time.sleep(0.01)
    time.sleep(0.3)  # the box also names steps that pass
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=10.0)
    assert (process.returncode, out) == (130, b"")
    *progress, last = err.splitlines()
    assert last == b"interrupted. No verdict is kept. The same command begins anew."
    assert all(line.endswith(b" ...") for line in progress)  # a slow machine tells what it tries
    assert list(temporary.iterdir()) == []
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):  # a process that has just ended
            assert str(temporary).encode() not in entry.read_bytes()


@pytest.mark.parametrize("what", ["missing", "text", "folder"])
def test_command_exits_2_for_what_cannot_be_opened(
    what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "x.fmu"
    if what == "text":
        path.write_text("no zip")
    elif what == "folder":
        path.mkdir()
    assert cli.main(["conform", str(path)]) == 2
    assert capsys.readouterr().err.startswith(f"FmuError: {path}: ")


# -- our own FMUs


OWN = (
    "archive", "modelDescription.xml", "guid", "value references", "start values", "units",
    "outputs at the start", "start values in the code", "variable steps", "split steps",
    "direct dependencies", "parameters in initialisation", "bare interpreter", "state replay",
    "state across reset", "serialised state", "state across processes", "fault: input",
    "fault: step", "fault: order", "fault: parameter", "fault: earlier state",
)  # fmt: skip
"""Probes of what a component itself says and computes; the others are of its slave class."""


def _slow_but(*names: str) -> list[Any]:
    """Return all components: those of these names by default, the others among slow tests."""
    return [
        # 2 to 7 s each: what is left are siblings of those by default.
        name if name in names else pytest.param(name, marks=pytest.mark.slow)
        for name in catalogue.component_names()
    ]


def tried(name: str, only: tuple[str, ...] | None = None) -> Report:
    """Try a built-in FMU and see that it conforms."""
    report = conform(build.ensure(name), only=only)
    assert report.ok, repr(report)
    for probe in ("fault: input", "fault: step", "fault: order", "fault: earlier state"):
        assert report.row(probe).verdict == "pass"
    return report


@pytest.mark.parametrize("name", _slow_but("ClippedOptimal"), ids=str)
def test_built_in_fmu_conforms(name: str) -> None:
    report = tried(name)
    for probe in ("another FMU before", "another FMU after", "repeatable", "bare interpreter"):
        assert report.row(probe).verdict == "pass"


@pytest.mark.parametrize("name", _slow_but("Structure"), ids=str)
def test_what_a_component_computes_conforms(name: str) -> None:
    assert tried(name, OWN).row("bare interpreter").verdict == "pass"


def test_a_missing_unit_is_a_violation_of_our_own_and_a_note_of_others(
    spoil: Spoil, tmp_path: Path
) -> None:
    bare = tmp_path / "ConstantVoltage.fmu"
    with (
        zipfile.ZipFile(build.ensure("ConstantVoltage")) as source,
        zipfile.ZipFile(bare, "w") as sink,
    ):
        for info in source.infolist():
            data = source.read(info)
            sink.writestr(info, data.replace(b' unit="V"', b"") if info.filename == XML else data)
    report = conform(bare, only=["units"])
    row = report.row("units")
    assert (row.verdict, row.rule, report.conforms) == ("fail", "bristle", False)
    assert "voltage" in row.seen
    (broken, _every) = report.view().every(Table)
    assert broken.title == "Violations of bristle's rules for its own FMUs"
    assert [row[0] for row in broken.rows] == ["units"]
    foreign = conform(spoil((XML, 'start="0.3" unit="m"', 'start="0.3"')), only=["units"])
    assert foreign.row("units").verdict == "note"


def test_a_unit_that_only_words_can_tell_is_none_missing() -> None:
    for name in ("SignalSource", "Sensors"):
        assert conform(build.ensure(name), only=["units"]).row("units").verdict == "note"


REFERENCE = Path(__file__).parents[2].parent / "shared" / "fmi" / "reference_fmus" / "2.0"


@pytest.mark.skipif(not REFERENCE.exists(), reason="the Reference-FMUs are not at hand")
@pytest.mark.slow  # 2 to 10 s each: by default the C toy of test_conform_native.py conforms
@pytest.mark.parametrize("name", [path.stem for path in sorted(REFERENCE.glob("*.fmu"))])
def test_the_reference_fmus_violate_nothing_but_lack_robustness(name: str) -> None:
    """Of the Modelica Association; steps of NaN and infinity keep them busy for ever."""
    report = conform(REFERENCE / f"{name}.fmu", timeout=2.0)
    assert report.conforms, repr(report)
    robustness = {row.probe for row in report.failures("robustness")}
    assert robustness == (set() if name == "Stair" else {"NaN step", "infinite step"})


# Lines of the bundled slave base, by what each is replaced, the probe that must fail, its words.
BREAKS_RULES = [
    ('NOT_FINITE_INPUT, f"', 'BAD_STATE, f"', "fault: input", "fault = 4"),
    ("_stop(BAD_STEP,", "_stop(BAD_STATE,", "fault: step", "fault = 4"),
    ('WRONG_MODE, "doStep', 'BAD_STEP, "doStep', "fault: order", "fault = 2"),
    ("_stop(BAD_PARAMETER,", "_stop(BAD_STATE,", "fault: parameter", "fault = 4"),
    (
        'self._values[:] = state["values"]',
        'self._values[:-1] = state["values"][:-1]',
        "fault: earlier state",
        "Discard",
    ),
]
LASTS_NOT = [
    (
        "if self.fault:\n                return False",
        "pass",
        "fault: input",
        "the step after displacement = nan: answered OK",
    )
]


@pytest.mark.parametrize("broken", [BREAKS_RULES, LASTS_NOT], ids=["five rules", "it lasts"])
def test_built_in_fmu_that_breaks_rules_of_ours_fails(
    broken: list[tuple[str, str, str, str]], tmp_path: Path
) -> None:
    path = tmp_path / "Spoilt.fmu"
    found = []
    with (
        zipfile.ZipFile(build.ensure("BinghamDamper")) as source,
        zipfile.ZipFile(path, "w") as sink,
    ):
        for name in source.namelist():
            data = source.read(name)
            if name.endswith("/fmu/slave.py"):
                text = data.decode()
                for old, new, _, _ in broken:
                    found.append(text.count(old))
                    text = text.replace(old, new)
                data = text.encode()
            sink.writestr(name, data)
    assert found == [1] * len(broken)
    report = conform(path, only=[probe for _, _, probe, _ in broken])
    for _, _, probe, seen in broken:
        assert report.row(probe).verdict == "fail"
        assert seen in report.row(probe).seen
