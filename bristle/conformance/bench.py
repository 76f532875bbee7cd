"""The test bench inside a child process: legal runs, and what they are compared with."""

from __future__ import annotations

import ctypes
import json
import math
import mmap
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from ..core.text import in_one_line, listed
from ..fmu.archive import library_member
from ..fmu.description import Description, Value, Variable
from ..fmu.library import (
    DISCARD,
    ERROR,
    FATAL,
    OK,
    PENDING,
    STATUS,
    WARNING,
    FatalAnswerError,
    FmuLibrary,
    Handle,
    UnexpectedError,
    resources_of,
)
from ..units import Unit

_MOST_MESSAGES = 1000
_LAST = 3  # messages that are told of a failure


@dataclass
class ProbePlan:
    """An unpacked FMU and how to try it, as the parent tells its child processes; times in s.

    `steps` is how many communication steps the comparing probes take, `instances` how often
    the repeating ones instantiate; both shrink for an FMU that is slow. `driven` says whether
    real inputs may be moved. `tolerance` [1] is that of the FMU's solver, 0 where it states none:
    two runs are equal if they differ by less of a variable's largest value. `ours` says that
    bristle's rules for faults apply. `fmi3` is also known where the variables cannot be read.
    `listens` has every instance log for debugging, and `proxy` is a library that puts the numbers
    into its messages (see `fmu.library.FmuLibrary`).
    """

    fmu: str
    folder: str
    work: str
    timeout: float
    description: Description | None = None
    start: float = 0.0
    stop: float | None = None
    step: float = 0.01
    steps: int = 60
    instances: int = 30
    driven: bool = True
    tolerance: float = 0.0
    repeatable: bool = True
    ours: bool = False
    fmi3: bool = False
    listens: bool = False
    proxy: str = ""
    categories: list[str] = field(default_factory=list)
    beside: ProbePlan | None = None

    @property
    def about(self) -> Description:
        """Return the description; probes that run the FMU are only started with one."""
        assert self.description is not None
        return self.description

    @property
    def resources(self) -> str:
        """Return where the resources are, as an instance is told."""
        return resources_of(Path(self.folder), self.about.version)

    @property
    def end(self) -> float:
        """Return where the default experiment ends; one second after its start if not said."""
        return self.start + 1.0 if self.stop is None else self.stop

    def claims(self, flag: str) -> bool:
        """Return whether a capability flag of the FMU is set."""
        return self.about.capabilities.get(flag, "false").strip() in ("true", "1")

    def variables(self, causality: str, *kinds: str) -> list[Variable]:
        """Return the variables of a causality, of certain kinds or of all."""
        return [v for v in self.about.of(causality) if not kinds or v.kind in kinds]

    def save(self, file: Path) -> None:
        """Write the plan as JSON."""
        file.write_text(json.dumps(asdict(self)))

    @staticmethod
    def load(file: Path) -> ProbePlan:
        """Read what `save` wrote."""
        return _plan(json.loads(file.read_text()))


def _plan(raw: dict[str, Any]) -> ProbePlan:
    if raw["description"] is not None:
        raw["description"] = _description(raw["description"])
    if raw["beside"] is not None:
        raw["beside"] = _plan(raw["beside"])
    return ProbePlan(**raw)


def _description(raw: dict[str, Any]) -> Description:
    variables = {}
    for name, fields in raw["variables"].items():
        causes = fields["dependencies"]
        fields["dependencies"] = None if causes is None else tuple(causes)
        defined = fields["defined"]
        if defined is not None:
            unit, factor, dimension, offset = defined
            fields["defined"] = Unit(unit, factor, tuple(dimension), offset)
        variables[name] = Variable(**fields)
    return Description(**{**raw, "variables": variables})


class BlackBox:
    """Remembers the call under way, and what the FMU says in it, where it outlives a crash.

    Behind its text the file has the number of calls, by which the parent sees that they go on, and
    behind that the FMU's last message.
    """

    SIZE, COUNT, SAID = 256, 8, 1024
    """Bytes of each."""

    def __init__(self, file: Path) -> None:
        size = self.SIZE + self.COUNT + self.SAID
        file.write_bytes(bytes(size))
        self._calls = 0
        self._heard = False
        with file.open("r+b") as stream:
            self._map = mmap.mmap(stream.fileno(), size)

    def note(self, text: str) -> None:
        """Write what happens next."""
        size, end = self.SIZE, self.SIZE + self.COUNT
        self._map[:size] = text.encode("ascii", "replace")[:size].ljust(size, b"\0")
        if text not in ("", "fmi2GetStatus"):  # to ask whether a step is over is no progress
            self._calls += 1
            self._map[size:end] = self._calls.to_bytes(self.COUNT, "little")
        if self._heard:
            self._map[end:] = bytes(self.SAID)
            self._heard = False

    def hear(self, text: str) -> None:
        """Write what the FMU says meanwhile."""
        said = in_one_line(text).encode()[: self.SAID].ljust(self.SAID, b"\0")
        self._map[self.SIZE + self.COUNT :] = said
        self._heard = True

    def text(self) -> str:
        """Return what was noted last, "" if that is over."""
        return bytes(self._map[: self.SIZE]).rstrip(b"\0").decode("ascii")

    @classmethod
    def read(cls, file: Path) -> tuple[str, str]:
        """Return what was noted last and what was said then, "" for nothing."""
        data = file.read_bytes() if file.exists() else b""
        noted, said = (
            part.rstrip(b"\0") for part in (data[: cls.SIZE], data[cls.SIZE + cls.COUNT :])
        )
        return noted.decode("ascii"), said.decode("utf-8", "ignore")

    @classmethod
    def calls(cls, file: Path) -> int:
        """Return how many calls were noted."""
        data = file.read_bytes() if file.exists() else b""
        return int.from_bytes(data[cls.SIZE : cls.SIZE + cls.COUNT], "little")


class WatchedLibrary(FmuLibrary):
    """A library whose calls and messages are noted; `messages` holds what its instances logged."""

    def __init__(self, plan: ProbePlan, box: BlackBox) -> None:
        self.box = box
        self._latest: deque[str] = deque(maxlen=_LAST)  # in the call under way
        self._complaints: deque[str] = deque(maxlen=_LAST)
        self._refused: list[str] = []  # with the last call that was refused
        self._names: list[str] = []
        self.messages: list[tuple[str, int, str, str]] = []
        self.bad_messages = 0
        about = plan.about
        box.note("loading the library")
        super().__init__(
            Path(plan.folder) / library_member(about.identifier, about.version),
            about.version,
            self._log,
            types={v.reference: v.type for v in about.variables.values()},
            proxy=plan.proxy if plan.listens else "",
        )
        box.note("")

    def _log(
        self, environment: int | None, name: bytes | None, status: int, kind: bytes | None,
        text: bytes | None,
    ) -> None:  # fmt: skip
        if self.fmi3:  # an instance is told apart by the environment that it passes back
            place = (environment or 0) - 1
            name = self._names[place].encode() if 0 <= place < len(self._names) else None
        if name is None or text is None or not OK <= status <= PENDING:
            self.bad_messages += 1
        if len(self.messages) < _MOST_MESSAGES:
            parts = [(part or b"").decode("utf-8", "replace") for part in (name, kind, text)]
            self.messages.append((parts[0], status, parts[1], parts[2]))
        said = (text or b"").decode("utf-8", "replace")
        self.box.hear(said)
        self._latest.append(said)
        if status != OK:
            self._complaints.append(said)

    def said(self) -> list[str]:
        """Return what the FMU said of the last call that it refused, else its last complaints."""
        return self._refused or list(self._complaints)

    def call(self, name: str, *arguments: Any) -> Any:
        """Call one function, noting it first, and return its result as it is."""
        self.found(name)
        self.box.note(name)
        self._latest.clear()
        result = super().call(name, *arguments)
        self.box.note("")
        return result

    def status(self, name: str, *arguments: Any) -> int:
        """Call a function that returns a status; raise FatalAnswerError for Fatal."""
        status = super().status(name, *arguments)
        if status in (DISCARD, ERROR, FATAL):
            self._refused = list(self._latest)
        if status == FATAL:
            raise FatalAnswerError(name)
        return status

    def instantiate(
        self, name: str, guid: str, resources: str, *, logging: bool = False, environment: int = 0
    ) -> Handle | None:
        """Return a new instance, whose messages are told apart by its name.

        Parameters
        ----------
        name, guid, resources, logging, environment : as `FmuLibrary` takes them; FMI 3.0 is given
            an environment of its own
        """
        self._names.append(name)
        environment = len(self._names) if self.fmi3 else 0
        made = super().instantiate(name, guid, resources, logging=logging, environment=environment)
        self._refused = [] if made else list(self._latest)
        return made

    def close(self) -> None:
        """Unload the library."""
        self.box.note("unloading the library")
        super().close()
        self.box.note("")


Values = list[Value]
GOOD = (OK, WARNING)
NAME = "bench"


class Bench:
    """One FMU, ready to be instantiated, stepped and compared.

    `pace` is for the probes that follow: the steps that it makes, and what they and an instance
    take [s].
    """

    def __init__(self, plan: ProbePlan, box: BlackBox) -> None:
        self.plan = plan
        self.box = box
        self.pace: dict[str, float] = {}
        self._library: WatchedLibrary | None = None
        if plan.description is not None:
            self.inputs = plan.variables("input", "Real")
            self.observed = plan.variables("output") or plan.variables("local")
            self._amplitudes = [_amplitude(v) for v in self.inputs]

    @property
    def library(self) -> WatchedLibrary:
        """The FMU's library, loaded at first use."""
        if self._library is None:
            self._library = WatchedLibrary(self.plan, self.box)
        return self._library

    def instance(self, *, name: str = NAME, logging: bool = False) -> Handle:
        """Return a new instance; UnexpectedError if the FMU refuses to make one."""
        made = self.library.instantiate(
            name, self.plan.about.guid, self.plan.resources,
            logging=logging or self.plan.listens,
        )  # fmt: skip
        if made is None:
            raise UnexpectedError("fmi2Instantiate answered NULL")
        return made

    def said(self) -> str:
        """Return what the FMU said of its failure, "" for nothing."""
        texts = () if self._library is None else self._library.said()
        return in_one_line(" / ".join(texts))

    def entered(self, instance: Handle | None = None, stop: float | None = None) -> Handle:
        """Return an instance in initialisation mode, a new one unless one is given; `stop` in s."""
        instance = instance or self.instance()
        good(instance.setup(self.plan.start, stop), "SetupExperiment")
        good(instance.enter(), "EnterInitializationMode")
        return instance

    def under_way(self) -> Handle:
        """Return a new instance that has made two steps."""
        instance = self.ready()
        self.run(instance, 0, 2)
        return instance

    def ready(
        self, instance: Handle | None = None, *, drive: bool | None = None, stop: bool = False
    ) -> Handle:
        """Return an instance that has passed initialisation, a new one unless one is given."""
        instance = self.entered(instance, self.plan.end if stop else None)
        if self.plan.driven if drive is None else drive:
            self.move(instance, 0)
        good(instance.leave(), "ExitInitializationMode")
        return instance

    def move(self, instance: Handle, k: int) -> None:
        """Set all real inputs to their values of step `k`."""
        if self.inputs:
            values = [self.driven(i, k) for i in range(len(self.inputs))]
            status = instance.set("Real", [v.reference for v in self.inputs], values)
            good(status, f"SetReal of the inputs at {self._at(k)}")

    def driven(self, i: int, k: float) -> float:
        """Return the value of input `i` at step `k`: a sine about its start value."""
        centre, amplitude = self._amplitudes[i]
        value = centre + amplitude * math.sin(0.3 * k + 0.7 * i)
        return ctypes.c_float(value).value if self.inputs[i].type == "Float32" else value

    def time(self, k: float) -> float:
        """Return the time of communication point `k` in s."""
        return self.plan.start + k * self.plan.step

    def _at(self, k: float) -> str:
        return f"t = {self.time(k):g} s"

    def read(self, instance: Handle, variables: Sequence[Variable] | None = None) -> Values:
        """Return the values of variables, all observed ones if none are given."""
        variables = self.observed if variables is None else variables
        found: dict[str, Value] = {}
        for kind in dict.fromkeys(v.kind for v in variables):
            some = [v for v in variables if v.kind == kind]
            status, values = instance.get(kind, [v.reference for v in some])
            good(status, f"Get{kind} of {len(some)} variables ({some[0].name} ...)")
            found.update(zip((v.name for v in some), values, strict=True))
        return [found[v.name] for v in variables]

    def run(
        self, instance: Handle, first: int = 0, last: int | None = None, drive: bool | None = None
    ) -> list[Values]:
        """Step an instance and return the outputs after each step.

        Parameters
        ----------
        instance : Handle
            In step mode.
        first, last : int
            Communication points where the run begins and ends; `last` None: where the plan ends.
        drive : bool or None
            Whether the inputs move; None: as planned.

        Raises
        ------
        UnexpectedError
            If the FMU answers a call with anything but OK or Warning.
        """
        rows = []
        for k in range(first, self.plan.steps if last is None else last):
            if self.plan.driven if drive is None else drive:
                self.move(instance, k)
            self.step(instance, self.time(k), self.plan.step)
            rows.append(self.read(instance))
        return rows

    def step(self, instance: Handle, time: float, step: float) -> None:
        """Step once; UnexpectedError unless the FMU answers OK or Warning."""
        status = instance.step(time, step)
        if status in GOOD:
            return
        ends = status == DISCARD and instance.wants_to_end()
        wish = ", and it wants the run to end" if ends else ""
        raise UnexpectedError(f"fmi2DoStep at t = {time:g} s answered {STATUS[status]}{wish}")

    def whole_run(self, instance: Handle | None = None) -> list[Values]:
        """Return the outputs of a legal run from initialisation on, as the reference holds them."""
        instance = self.ready(instance)
        return [self.read(instance), *self.run(instance)]

    @property
    def _file(self) -> Path:
        return Path(self.plan.work) / "reference.json"

    def keep(self, rows: list[Values]) -> None:
        """Keep a run as the reference of all later probes."""
        self._file.write_text(json.dumps(rows))

    def reference(self) -> list[Values]:
        """Return the run of a fresh process."""
        rows: list[Values] = json.loads(self._file.read_text())
        return rows

    def differs(self, rows: Iterable[Values], wanted: Sequence[Values], first: int = 0) -> str:
        """Return where two runs differ first, in words; "" if they are `equal`.

        `first` is the communication point of the first row.
        """
        allowed = self._allowed(wanted)
        for k, (row, want) in enumerate(zip(rows, wanted, strict=True), first):
            for variable, a, b, less in zip(self.observed, row, want, allowed, strict=True):
                if not _same(a, b, less):
                    return f"{variable.name} at {self._at(k)} is {a!r} instead of {b!r}"
        return ""

    def same(
        self, rows: Iterable[Values], wanted: Sequence[Values], where: str = "", first: int = 0
    ) -> None:
        """Raise UnexpectedError where two runs differ.

        Parameters
        ----------
        rows, wanted : values of the observed variables, a row a step
        where : words that the error begins with
        first : step of the first row
        """
        if difference := self.differs(rows, wanted, first):
            raise UnexpectedError(f"{where}{difference}")

    @property
    def equal(self) -> str:
        """How equal runs are that do not differ."""
        tolerance = self.plan.tolerance
        return f"within the tolerance of {tolerance:g}" if tolerance else "bit by bit"

    def _allowed(self, wanted: Sequence[Values]) -> list[float]:
        """Return by how much the observed variables may differ: a solver's tolerance of a peak."""
        if not self.plan.tolerance:
            return [0.0] * len(self.observed)
        rows = [*wanted, *(self.reference() if self._file.exists() else ())]
        return [
            self.plan.tolerance
            * max((abs(row[i]) for row in rows if isinstance(row[i], float)), default=0.0)
            for i in range(len(self.observed))
        ]


def good(status: int, function: str) -> None:
    """Raise UnexpectedError unless a status is OK or Warning."""
    if status not in GOOD:
        raise UnexpectedError(f"fmi2{function} answered {status_name(status)}")


def status_name(status: int) -> str:
    """Return a status as the standard spells it."""
    return STATUS[status] if 0 <= status < len(STATUS) else f"{status}, which is no status"


def not_finite(variables: Sequence[Variable], values: Values) -> list[str]:
    """Return the names of the reals that are not finite, with their values."""
    pairs = zip(variables, values, strict=True)
    return [f"{v.name} = {x}" for v, x in pairs if isinstance(x, float) and not math.isfinite(x)]


def finite(variables: Sequence[Variable], values: Values, where: str) -> None:
    """Raise UnexpectedError unless all reals are finite, in words that begin with `where`."""
    if bad := not_finite(variables, values):
        raise UnexpectedError(f"{where}: {some(bad)}")


def some(names: Sequence[Any], most: int = 3) -> str:
    """Return the first few of many names, and how many more there are."""
    return listed(map(str, names), most)


def _same(a: Value, b: Value, less: float) -> bool:
    if isinstance(a, float) and isinstance(b, float) and abs(a - b) <= less:
        return True
    return a == b or (a != a and b != b)  # NaN equals NaN here


def _amplitude(v: Variable) -> tuple[float, float]:
    """Return centre and amplitude of a motion that stays inside an input's own bounds."""
    start = float(v.start) if v.start is not None else 0.0
    low, high = v.minimum, v.maximum
    if low is not None and high is not None and math.isfinite(high - low):
        amplitude = 0.05 * (high - low)
    else:
        amplitude = 0.1 * abs(v.nominal) if v.nominal else 0.01 * max(1.0, abs(start))
    centre = start
    if low is not None:
        centre = max(centre, low + amplitude)
    if high is not None:
        centre = min(centre, high - amplitude)
    return centre, amplitude
