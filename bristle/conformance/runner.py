"""The parent: unpacks the FMU, starts one process per probe, turns every end into a row."""

from __future__ import annotations

import json
import math
import os
import re
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from ..core.finding import Finding
from ..core.progress import Count
from ..errors import BristleError, FmuError
from ..fmu.archive import extract
from ..fmu.description import NATIVE, check_ports, describe, read_description, read_root
from ..fmu.library import logger_proxy
from ..view import Viewable
from ..view.blocks import Table, View, view_of
from ._probe import BOX, FINDING, PLAN
from .bench import BlackBox, ProbePlan
from .probe import Probe, failed, in_fmi3, noted
from .probes import PROBES

VERDICTS = {"pass": "pass", "error": "fail", "note": "note"}
"""What a report calls the level of a finding."""
RULES = {
    "standard": "Violations of the standard",
    "bristle": "Violations of bristle's rules for its own FMUs",
    "robustness": "Lack of robustness, where the standard forbids the call or does not define it",
}
"""What a failure breaks, and the heading under which it is repeated at the end."""


@dataclass(frozen=True)
class Row:
    """One probe: what was tried, what was seen, what the standard says, and the verdict.

    `rule` is what a failure would break: the "standard", "robustness" or a rule of "bristle".
    """

    probe: str
    tried: str
    seen: str
    standard: str
    verdict: str
    rule: str


@dataclass(frozen=True, repr=False)
class Report(Viewable):
    """All rows of one FMU, in the order in which they were tried."""

    fmu: str
    rows: Sequence[Row]

    @property
    def ok(self) -> bool:
        """Whether nothing falls short; notes are allowed."""
        return all(row.verdict != "fail" for row in self.rows)

    @property
    def conforms(self) -> bool:
        """Whether no rule of the standard is broken, nor one of bristle's for its own FMUs."""
        return not self.failures("standard", "bristle")

    def failures(self, *rules: str) -> list[Row]:
        """Return the rows that fail, of certain rules or of all."""
        return [r for r in self.rows if r.verdict == "fail" and (not rules or r.rule in rules)]

    def row(self, probe: str) -> Row:
        """Return the row of one probe; KeyError if it was not tried."""
        for row in self.rows:
            if row.probe == probe:
                return row
        raise KeyError(probe)

    def counts(self) -> dict[str, int]:
        """Return how many rows have each verdict."""
        found = Counter(row.verdict for row in self.rows)
        return {verdict: found[verdict] for verdict in VERDICTS.values()}

    def to_json(self) -> str:
        """Return the report as JSON text: schema, fmu, conforms, ok, counts, failures, rows."""
        return json.dumps(
            {
                "schema": 1,
                "fmu": self.fmu,
                "conforms": self.conforms,
                "ok": self.ok,
                "counts": self.counts(),
                "failures": {rule: [row.probe for row in self.failures(rule)] for rule in RULES},
                "rows": [asdict(row) for row in self.rows],
            },
            indent=2,
        )

    def summary(self) -> str:
        """Return in one sentence whether the FMU conforms, with the counts."""
        counts = self.counts()
        verdict = "conforms to the standard" if self.conforms else "does not conform"
        weak = len(self.failures("robustness"))
        robust = f", {weak} of them in robustness" if weak else ""
        return (
            f"{self.fmu} {verdict}: {counts['pass']} passed, {counts['fail']} failed{robust}, "
            f"{counts['note']} noted."
        )


@view_of(Report)
def report_view(report: Report) -> View:
    """Return the view of a judgement."""
    tables = [
        Table(("probe", "seen"), [[row.probe, row.seen] for row in rows], (), heading)
        for rule, heading in RULES.items()
        if (rows := report.failures(rule))
    ]
    header = ("probe", "verdict", "tried", "seen", "standard")
    cells = [[row.probe, row.verdict, row.tried, row.seen, row.standard] for row in report.rows]
    return View(report.summary(), tuple(tables), (Table(header, cells, (), "Every probe"),))


# On Linux a process that has imported the probes, and never an FMU, forks one child per probe:
# starting Python anew each time would take most of the time of a judgement. Elsewhere, and where
# a probe asks for it, Python starts anew.

# The child takes the package's folder off its path again, and the package out of its modules, so
# that an FMU cannot lean on the bristle that judges it.
_BOOT = (
    "import sys; from pathlib import Path; sys.path.insert(0, sys.argv[1]); "
    "from bristle.conformance._probe import forget_ourselves, main, serve; "
    "sys.path.remove(sys.argv[1]); forget_ourselves(); "
    "main(Path(sys.argv[2]), sys.argv[3]) if sys.argv[3:] else serve(Path(sys.argv[2]))"
)
_PACKAGES = str(Path(__file__).parents[2])


class Subprocesses:
    """Starts a process per probe; used as a context, it leaves none behind."""

    def __init__(self, work: Path) -> None:
        self._work = work
        self._count = 0
        self._living: list[int] = []
        self._mother: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Subprocesses:
        return self

    def __exit__(self, *_: object) -> None:
        for pid in self._living:
            _kill(pid)
        if self._mother is not None:
            _kill(self._mother.pid)
            self._mother.communicate()

    def run(
        self, probe: str, timeout: float, calls: Callable[[], int], *, anew: bool, bare: bool
    ) -> int | None:
        """Return how a probe's process ended: its exit code, None if it had to be killed.

        As in subprocess, an exit code is positive and a signal negative.

        Parameters
        ----------
        probe : name of the probe
        timeout : time limit of one call [s]
        calls : returns how many calls there were
        anew, bare : whether Python starts anew for it; whether without site-packages, anew as well

        Raises
        ------
        FmuError
            If the process that starts the probes has ended.
        """
        self._count += 1
        folder = self._work / f"cwd{self._count}"
        folder.mkdir()
        if anew or bare or sys.platform != "linux":
            return self._start(probe, folder, timeout, calls, bare)
        return self._fork(probe, folder, timeout, calls)

    def _open(
        self, ends: int, bare: bool, *arguments: str, cwd: Path | None = None
    ) -> subprocess.Popen[bytes]:
        """Start Python in a session of its own; `ends` is what its input and output lead to."""
        flags = ["-I", "-S"] if bare else ["-P"]
        command = [sys.executable, *flags, "-c", _BOOT, _PACKAGES, str(self._work), *arguments]
        return subprocess.Popen(
            command, bufsize=0, cwd=cwd, stdin=ends, stdout=ends, stderr=subprocess.DEVNULL,
            start_new_session=True,
        )  # fmt: skip

    def _start(
        self, probe: str, folder: Path, timeout: float, calls: Callable[[], int], bare: bool
    ) -> int | None:
        process = self._open(subprocess.DEVNULL, bare, probe, cwd=folder)
        # Popen.wait(timeout) would poll every 50 ms.
        waiter = threading.Thread(target=process.wait, daemon=True)
        try:
            waiter.start()

            def over(seconds: float) -> bool:
                waiter.join(seconds)
                return not waiter.is_alive()

            ended = _ends(over, timeout, calls)
        finally:
            _kill(process.pid)
            code = process.wait()
        return code if ended else None

    def _fork(
        self, probe: str, folder: Path, timeout: float, calls: Callable[[], int]
    ) -> int | None:
        if self._mother is None:
            self._mother = self._open(subprocess.PIPE, False)
        request, answer = self._mother.stdin, self._mother.stdout
        assert request is not None
        assert answer is not None
        request.write(f"{probe}\t{folder}\n".encode())
        pid = _number(answer.readline())
        self._living.append(pid)
        ended = _ends(
            lambda seconds: bool(select.select([answer], [], [], seconds)[0]), timeout, calls
        )
        _kill(pid)
        code = _number(answer.readline())
        self._living.remove(pid)
        return code if ended else None


def _ends(over: Callable[[float], bool], timeout: float, calls: Callable[[], int]) -> bool:
    """Wait for the end of a process; return False if one call takes longer than its time [s]."""
    last, since = calls(), time.monotonic()
    while not over(timeout / 10):
        if (now := calls()) != last:
            last, since = now, time.monotonic()
        elif time.monotonic() - since >= timeout:
            return False
    return True


def _number(line: bytes) -> int:
    if not line:
        raise FmuError("the process that starts the probes has ended unexpectedly.")
    return int(line)


def _kill(pid: int) -> None:
    """Kill a process and whatever has been started in its session."""
    with suppress(ProcessLookupError, PermissionError):  # all have ended by themselves
        if sys.platform == "win32":
            os.kill(pid, signal.SIGTERM)
        else:
            os.killpg(pid, signal.SIGKILL)
    with suppress(ProcessLookupError, PermissionError):  # it had no session of its own yet
        os.kill(pid, signal.SIGTERM if sys.platform == "win32" else signal.SIGKILL)


_BUNDLE = re.compile(r"bristle_[0-9a-f]{12}")  # the code inside our FMUs, named by its digest
_LIBRARY, _LEGAL, _REFERENCE, _REPEATABLE = "library", "legal run", "driven run", "repeatable"
_FIRST = {  # what a probe rests on, by its level
    "file": set[str](),
    "library": {_LIBRARY, _LEGAL},
    "run": {_LIBRARY, _LEGAL, _REFERENCE, _REPEATABLE},
}
_DEFAULT_STEPS = 100  # where the FMU names no step
_MOST_INNER = 100  # steps of its own that such a step holds at most, where the FMU names theirs


def conform(
    path: Path | str,
    timeout: float = 20.0,
    *,
    only: Collection[str] | None = None,
    beside: Path | str | None = None,
) -> Report:
    """Try a co-simulation FMU of FMI 2.0 or 3.0 against the standard; return what was seen.

    Parameters
    ----------
    path : Path or str
        The .fmu file, anybody's.
    timeout : float
        Time limit of one call in s; an FMU that does not answer by then fails the probe.
    only : collection of str, optional
        Names of the probes to try; all of them otherwise.
    beside : Path or str, optional
        Another FMU to load into the same process; a trivial one of our own otherwise.

    Returns
    -------
    Report
        `rows` (probe, tried, seen, standard, verdict), `ok` (no verdict is "fail"), `to_json()`.

    Raises
    ------
    FmuError
        If a file cannot or must not be opened, ports of FMI 3.0 are arrays or belong to clocks, a
        probe is unknown, or the time limit is not positive and finite.
    """
    path = Path(path)
    if not 0.0 < timeout < math.inf:
        raise FmuError(f"the time limit is {timeout} s; it must be positive and finite.")
    unknown = sorted(set(only or ()) - set(PROBES))
    if unknown:
        raise FmuError(f"no probe is named {', '.join(unknown)}. There are: {', '.join(PROBES)}.")
    root = read_root(path)
    if root.get("fmiVersion") == "3.0":
        try:
            check_ports(root)  # no fault of the FMU, but nothing that the probes could move
        except FmuError as error:
            raise FmuError(f"{path} modelDescription.xml: {error}") from None
    with tempfile.TemporaryDirectory(prefix="bristle-conform-") as folder:
        plan = make_plan(path, root, Path(folder), timeout)
        if beside is not None:
            other = Path(beside)
            read_description(other)  # which says what is wrong with it
            plan.beside = make_plan(other, read_root(other), Path(folder) / "beside", timeout)
        elif only is None or any(name.startswith("another FMU") for name in only):
            plan.beside = _companion(plan, Path(folder))
        with Subprocesses(Path(plan.work)) as subprocesses:
            return Report(str(path), _Session(plan, subprocesses, only).rows())


def make_plan(path: Path, root: ElementTree.Element, folder: Path, timeout: float) -> ProbePlan:
    """Unpack an FMU and plan how to try it.

    Parameters
    ----------
    path, root : the .fmu file and its parsed modelDescription.xml
    folder : where it is unpacked, into `fmu`; the probes work in `work` beside that
    timeout : time limit of one call [s]

    Raises
    ------
    FmuError
        If the file cannot or must not be unpacked.
    """
    work = folder / "work"
    work.mkdir(parents=True)
    plan = ProbePlan(str(path.resolve()), str(extract(path, folder / "fmu")), str(work), timeout)
    plan.fmi3 = root.get("fmiVersion") == "3.0"
    try:
        plan.description = describe(root)
    except FmuError:
        return plan  # "modelDescription.xml" will say why
    plan.proxy = "" if plan.fmi3 else logger_proxy()
    plan.ours = _ours(plan, root.get("generationTool", ""))
    plan.categories = [c.get("name", "") for c in root.iterfind("LogCategories/Category")]
    experiment = root.find("DefaultExperiment")
    times = {} if experiment is None else experiment.attrib
    plan.start = _time(times.get("startTime"), -math.inf) or 0.0
    plan.stop = _time(times.get("stopTime"), plan.start)
    tolerance = _time(times.get("tolerance"), 0.0) or 0.0
    plan.tolerance = tolerance if tolerance < 1.0 else 0.0
    step = _time(times.get("stepSize"), 0.0)
    plan.step = step or _usual_step(plan, root)
    return plan


def _usual_step(plan: ProbePlan, root: ElementTree.Element) -> float:
    """Return a step [s] for an FMU that names none: one that it can make within the time limit."""
    step = (plan.end - plan.start) / _DEFAULT_STEPS
    simulation = root.find("CoSimulation")
    told = None if simulation is None else simulation.get("fixedInternalStepSize")
    inner = _time(told, 0.0)  # in FMI 3.0
    if inner is None:
        return step
    return inner * max(1, min(round(step / inner), _MOST_INNER))


def _time(text: str | None, above: float) -> float | None:
    try:
        value = float(text) if text is not None else math.nan
    except ValueError:
        return None  # "default experiment" will say so
    return value if above < value < math.inf else None


def _ours(plan: ProbePlan, tool: str) -> bool:
    """Return whether an FMU follows bristle's rule for faults: it carries its slave or its shim."""
    fault = plan.about.variables.get("fault")
    if fault is None or (fault.kind, fault.causality) != ("Integer", "output"):
        return False
    if tool.startswith(NATIVE):
        return True
    resources = Path(plan.folder) / "resources"
    names = [p.name for p in resources.iterdir()] if resources.is_dir() else []
    return any(_BUNDLE.fullmatch(name) for name in names)


def _companion(plan: ProbePlan, folder: Path) -> ProbePlan | None:
    """Return a trivial FMU of our own to stand beside the one in question, None without."""
    from ..fmu.build import ensure

    mine = plan.description.name if plan.description else ""
    name = "ConstantVoltage" if mine != "ConstantVoltage" else "SignalSource"
    try:
        path = ensure(name)
        return make_plan(path, read_root(path), folder / "beside", plan.timeout)
    except BristleError:
        return None  # the row says that there is none at hand


class _Session:
    """The probes of one FMU in their order, each knowing what those before it found."""

    def __init__(
        self,
        plan: ProbePlan,
        subprocesses: Subprocesses,
        only: Collection[str] | None,
    ) -> None:
        self.plan = plan
        self.subprocesses = subprocesses
        self.only = only
        self.reached: set[str] = set()
        self.stuck = False
        self.pace: dict[str, float] = {}
        self.first = set[str]().union(*(_FIRST[PROBES[name].needs] for name in only or ()))

    def rows(self) -> list[Row]:
        """Try everything that was asked for, and what that needs."""
        rows = []
        chosen = [p for p in PROBES.values() if self._wanted(p) or p.name in self.first]
        count = Count("probe", len(chosen))
        for probe in chosen:
            count.begins(probe.name)
            finding = self.find(probe)
            if self._wanted(probe) or finding.level == "error":
                rows.append(self._row(probe, finding))
        return rows

    def _wanted(self, probe: Probe) -> bool:
        if self.only is None:
            return self.plan.ours or probe.rule != "bristle"
        return probe.name in self.only

    def _row(self, probe: Probe, finding: Finding) -> Row:
        tried, seen, standard = probe.tried, finding.text, probe.standard
        if self.plan.fmi3 and not probe.only_fmi2:
            tried, seen = in_fmi3(tried), in_fmi3(seen)
            standard = probe.fmi3 or in_fmi3(standard)
        verdict, rule = VERDICTS[finding.level], finding.kind or probe.rule
        return Row(probe.name, tried, seen, standard, verdict, rule)

    def find(self, probe: Probe) -> Finding:
        """Try one probe, unless there is a reason not to."""
        if probe.only_fmi2 and self.plan.fmi3:
            return noted(f"not tried: {probe.only_fmi2}")
        if probe.needs != "file" and self.plan.description is None:
            return noted("not tried: modelDescription.xml cannot be read")
        if probe.needs != "file" and "library" not in self.reached:
            return noted("not tried: the library does not load")
        if probe.needs != "file" and self.stuck:
            return noted("not tried: no life of this FMU comes to its end (see legal run)")
        if probe.needs == "run" and "run" not in self.reached:
            return noted("not tried: no legal run")
        if probe.rule == "bristle" and not self.plan.ours:
            return noted("not tried: this is no FMU of bristle")
        reason = probe.unless(self.plan)
        if reason is not None:
            return noted(f"not tried: {reason}")
        finding = self.start(probe)
        if probe.name == _REFERENCE and finding.level == "error":
            finding = self._at_rest(probe, finding)
        self._learn(probe, finding)
        return finding

    def _at_rest(self, probe: Probe, moving: Finding) -> Finding:
        """Make the reference with inputs at rest where the FMU cannot follow moving ones."""
        self.plan.driven = False
        finding = self.start(probe)
        if finding.level == "error":
            return finding
        return noted(f"{finding.text} only; with inputs moving, {moving.text}")

    def _learn(self, probe: Probe, finding: Finding) -> None:
        if probe.name == _LIBRARY and finding.level != "error":
            self.reached.add("library")
        if probe.name == _LEGAL:
            self._slow_down()
        if probe.name == _REFERENCE and (Path(self.plan.work) / "reference.json").exists():
            self.reached.add("run")
        if probe.name == _REPEATABLE:
            self.plan.repeatable = finding.level == "pass"

    def _slow_down(self) -> None:
        """Shorten later probes for an FMU that ends early, or that takes long."""
        if "ended" in self.pace:
            self.stuck = True  # every other probe would crash or hang as well
        self.plan.steps = min(self.plan.steps, int(self.pace.get("most_steps", 1000)))
        per_step, per_instance = (self.pace.get(k, 0.0) for k in ("per_step", "per_instance"))
        limit = self.plan.timeout
        if per_step > 0.0:
            most = int(0.05 * limit / per_step)
            self.plan.steps = max(4, min(self.plan.steps, most))
        if per_instance > 0.0:
            most = int(0.3 * limit / (per_instance + 3.0 * per_step))
            self.plan.instances = max(3, min(self.plan.instances, most))

    def start(self, probe: Probe) -> Finding:
        """Run a probe and say how that ended, with what the FMU says of a failure.

        Many FMUs say it only where they are asked to log. That may change what they do, so it is
        asked in a second run, which is for the words alone.
        """
        finding, said, self.pace = self._once(probe)
        if finding.level != "error":
            return finding
        if "hung" not in self.pace:
            self.plan.listens = True
            again, more, _ = self._once(probe)
            self.plan.listens = False
            said = (more if again.level == "error" else "") or said
        return replace(finding, text=f"{finding.text}; the FMU said: {said}") if said else finding

    def _once(self, probe: Probe) -> tuple[Finding, str, dict[str, float]]:
        """Return what a probe found, what the FMU said of it, and its pace."""
        work = Path(self.plan.work)
        self.plan.save(work / PLAN)
        for name in (FINDING, BOX):
            (work / name).unlink(missing_ok=True)
        # Forks share a hash seed and a memory layout; what depends on these is found anew.
        anew = probe.name == _REPEATABLE
        calls = partial(BlackBox.calls, work / BOX)
        timeout = self.plan.timeout
        code = self.subprocesses.run(probe.name, timeout, calls, anew=anew, bare=probe.bare)
        return _finding(work, code, self.plan.timeout)


def _finding(work: Path, code: int | None, timeout: float) -> tuple[Finding, str, dict[str, float]]:
    """Turn what a process left behind into a finding, the FMU's own words, and its pace."""
    under_way, heard = BlackBox.read(work / BOX)
    where = f" in {under_way}" if under_way else ""
    file = work / FINDING
    found: dict[str, Any] = json.loads(file.read_text()) if file.exists() else {}
    after = f" (before that: {found['finding']['text']})" if found else ""
    if code is None:
        ended = f"hung{where}: no answer within {timeout:g} s{after}"
    elif code < 0:
        name = signal.Signals(-code).name if -code in set(signal.Signals) else str(-code)
        ended = f"crashed{where}: {name}{after}"
    elif code != 0 or not found:
        ended = f"left the process{where} with exit code {code}{after}"
    else:
        return Finding(**found["finding"]), found["said"], found["pace"]
    return failed(ended), heard, {"ended": 1.0} | ({"hung": 1.0} if code is None else {})
