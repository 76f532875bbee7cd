"""The FMI 2.0 functions of a shared library, called bare, so that each status is seen.

Runs in the child process beside code that nobody has vouched for: standard library only.
"""

# Longer than 300 lines: a docstring says of every argument which shape and unit it has.

from __future__ import annotations

import ctypes
import mmap
import sys
import time
from collections import deque
from collections.abc import Callable, Sequence
from ctypes import byref, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
from pathlib import Path
from typing import Any

from ..fmu.description import Value
from .signatures import OPTIONAL, REQUIRED, RESULTS, TYPES

OK, WARNING, DISCARD, ERROR, FATAL, PENDING = range(6)
STATUS = ("OK", "Warning", "Discard", "Error", "Fatal", "Pending")

_DO_STEP_STATUS, _TERMINATED = 0, 3
_MOST_MESSAGES = 1000
_LAST = 3  # messages that are told of a failure
_MOST_SAID = 270  # characters: a report says them twice

_LOGGER = ctypes.CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p)
_ALLOCATE = ctypes.CFUNCTYPE(c_void_p, c_size_t, c_size_t)
_FREE = ctypes.CFUNCTYPE(None, c_void_p)
_FINISHED = ctypes.CFUNCTYPE(None, c_void_p, c_int)


class _Callbacks(ctypes.Structure):
    _fields_ = (
        ("logger", _LOGGER),
        ("allocate", _ALLOCATE),
        ("free", _FREE),
        ("finished", _FINISHED),
        ("environment", c_void_p),
    )


class FatalAnswerError(Exception):
    """The FMU answered Fatal: by the standard, nothing of it may be called any more."""


class MissingFunctionError(Exception):
    """The library does not export a function."""


def told(text: str) -> str:
    """Return what an FMU said in one line, cut to a length that a row holds."""
    text = " ".join(text.split())
    rest = len(text) - _MOST_SAID
    return f"{text[:_MOST_SAID]} ... and {rest:,} more characters" if rest > 0 else text


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
        said = told(text).encode()[: self.SAID].ljust(self.SAID, b"\0")
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


class Library:
    """A loaded FMU library; `messages` holds what its instances logged.

    `proxy` is a library that puts the numbers into a message which an FMU gives in printf's form.
    """

    prefix = "fmi2"
    required, optional, results = REQUIRED, OPTIONAL, RESULTS

    def __init__(self, file: Path, box: BlackBox, proxy: str = "") -> None:
        self.box = box
        self._latest: deque[str] = deque(maxlen=_LAST)  # in the call under way
        self._complaints: deque[str] = deque(maxlen=_LAST)
        self._refused: list[str] = []  # with the last call that was refused
        self.messages: list[tuple[str, int, str, str]] = []
        self.bad_messages = 0
        box.note("loading the library")
        if sys.platform == "win32":
            self._dll = ctypes.CDLL(str(file), winmode=0x8)  # finds DLLs beside it
        else:
            self._dll = ctypes.CDLL(str(file))
        box.note("")
        self._functions: dict[str, Callable[..., Any]] = {}
        for name, arguments in {**self.required, **self.optional}.items():
            function = getattr(self._dll, name, None)
            if function is not None:
                function.argtypes = list(arguments)
                function.restype = self.results.get(name, c_int)
                self._functions[name] = function
        runtime = ctypes.CDLL("msvcrt" if sys.platform == "win32" else None)
        self._callbacks = _Callbacks(
            _LOGGER(self._log),
            ctypes.cast(runtime.calloc, _ALLOCATE),
            ctypes.cast(runtime.free, _FREE),
            _FINISHED(0),
            None,
        )
        if proxy:
            ctypes.CDLL(proxy).addLoggerProxy(byref(self._callbacks))

    def _log(
        self, _: int | None, name: bytes | None, status: int, kind: bytes | None, text: bytes | None
    ) -> None:
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

    def missing(self) -> tuple[list[str], list[str]]:
        """Return the functions that every FMU needs, and the others, that are not exported."""
        return (
            [name for name in self.required if name not in self._functions],
            [name for name in self.optional if name not in self._functions],
        )

    def call(self, name: str, *arguments: Any) -> Any:
        """Call one function, noting it first, and return its result as it is."""
        function = self._functions.get(name)
        if function is None:
            raise MissingFunctionError(f"the library does not export {name}")
        self.box.note(name)
        self._latest.clear()
        result = function(*arguments)
        self.box.note("")
        return result

    def status(self, name: str, *arguments: Any) -> int:
        """Call a function that returns a status; raise FatalAnswerError for Fatal."""
        status = int(self.call(name, *arguments))
        if status in (DISCARD, ERROR, FATAL):
            self._refused = list(self._latest)
        if status == FATAL:
            raise FatalAnswerError(name)
        return status

    def instantiate(
        self, name: str, guid: str, resources: str, *, logging: bool = False
    ) -> Instance | None:  # fmt: skip
        """Return a new instance for co-simulation, None if the FMU refuses.

        Parameters
        ----------
        name, guid : of the instance; of the model description
        resources : URI of the unpacked resources
        logging : whether the FMU logs for debugging
        """
        handle = self.call(
            "fmi2Instantiate",
            name.encode(),
            1,
            guid.encode(),
            resources.encode(),
            ctypes.addressof(self._callbacks),
            0,
            int(logging),
        )
        self._refused = [] if handle else list(self._latest)
        return Instance(self, handle) if handle else None

    def close(self) -> None:
        """Unload the library."""
        self.box.note("unloading the library")
        if sys.platform == "win32":
            ctypes.windll.kernel32.FreeLibrary(c_void_p(self._dll._handle))
        else:
            unload = ctypes.CDLL(None).dlclose
            unload.argtypes = [c_void_p]
            unload(self._dll._handle)
        self.box.note("")


class Instance:
    """One instance. Every method returns the status that the FMU answered."""

    def __init__(self, library: Library, handle: int) -> None:
        self.library = library
        self.handle = handle

    def _do(self, name: str, *arguments: Any) -> int:
        return self.library.status(name, self.handle, *arguments)

    def setup(self, start: float, stop: float | None) -> int:
        """Call fmi2SetupExperiment without a tolerance; times in s."""
        return self._do("fmi2SetupExperiment", 0, 0.0, start, int(stop is not None), stop or 0.0)

    def enter(self) -> int:
        """Call fmi2EnterInitializationMode."""
        return self._do("fmi2EnterInitializationMode")

    def leave(self) -> int:
        """Call fmi2ExitInitializationMode."""
        return self._do(f"{self.library.prefix}ExitInitializationMode")

    def terminate(self) -> int:
        """Call fmi2Terminate."""
        return self._do(f"{self.library.prefix}Terminate")

    def reset(self) -> int:
        """Call fmi2Reset."""
        return self._do(f"{self.library.prefix}Reset")

    def free(self) -> None:
        """Call fmi2FreeInstance."""
        self.library.call(f"{self.library.prefix}FreeInstance", self.handle)

    def step(self, time_: float, step: float) -> int:
        """Call fmi2DoStep (s), and wait where the FMU computes asynchronously."""
        status = self._do("fmi2DoStep", time_, step, 1)
        while status == PENDING:  # the time limit of the call ends an endless wait
            answer = c_int(PENDING)
            asked = self._do("fmi2GetStatus", _DO_STEP_STATUS, byref(answer))
            status = answer.value if asked in (OK, WARNING) else asked
            if status == FATAL:
                raise FatalAnswerError("fmi2DoStep")
            time.sleep(0.001)
        return status

    def wants_to_end(self) -> bool:
        """Return whether the FMU says, after Discard, that it wants the run to end."""
        answer = c_int(0)
        try:
            status = self._do("fmi2GetBooleanStatus", _TERMINATED, byref(answer))
        except (FatalAnswerError, MissingFunctionError):
            return False
        return status in (OK, WARNING) and bool(answer.value)

    def get(self, kind: str, references: Sequence[int]) -> tuple[int, list[Value]]:
        """Return the status and the values of variables of one kind."""
        kind, count = _base(kind), len(references)
        values = (TYPES[kind] * count)()
        status = self._do(f"fmi2Get{kind}", (c_uint * count)(*references), count, values)
        if kind == "String":
            return status, [(v or b"").decode("utf-8", "replace") for v in values]
        return status, [bool(v) for v in values] if kind == "Boolean" else list(values)

    def set(self, kind: str, references: Sequence[int], values: Sequence[Value]) -> int:
        """Set variables of one kind."""
        kind, count = _base(kind), len(references)
        raw = [v.encode() if isinstance(v, str) else v for v in values]
        array = (TYPES[kind] * count)(*raw)
        return self._do(f"fmi2Set{kind}", (c_uint * count)(*references), count, array)

    def save(self, state: c_void_p) -> int:
        """Call fmi2GetFMUstate into `state`."""
        return self._do("fmi2GetFMUstate", byref(state))

    def restore(self, state: c_void_p) -> int:
        """Call fmi2SetFMUstate."""
        return self._do("fmi2SetFMUstate", state)

    def forget(self, state: c_void_p) -> int:
        """Call fmi2FreeFMUstate."""
        return self._do("fmi2FreeFMUstate", byref(state))

    def serialise(self, state: c_void_p) -> tuple[int, bytes]:
        """Return the status and the bytes of a saved state."""
        size = c_size_t(0)
        status = self._do("fmi2SerializedFMUstateSize", state, byref(size))
        if status not in (OK, WARNING):
            return status, b""
        buffer = ctypes.create_string_buffer(size.value)
        return self._do("fmi2SerializeFMUstate", state, buffer, size.value), buffer.raw

    def deserialise(self, data: bytes, state: c_void_p) -> int:
        """Call fmi2DeSerializeFMUstate into `state`."""
        return self._do("fmi2DeSerializeFMUstate", data, len(data), byref(state))

    def debug_logging(self, on: bool, categories: Sequence[str] = ()) -> int:
        """Call fmi2SetDebugLogging."""
        names = (c_char_p * len(categories))(*(c.encode() for c in categories))
        return self._do("fmi2SetDebugLogging", int(on), len(categories), names)

    def derivatives(
        self, unknowns: Sequence[int], knowns: Sequence[int]
    ) -> tuple[int, list[float]]:  # fmt: skip
        """Return the status and the directional derivative along the sum of all knowns."""
        result = (c_double * len(unknowns))()
        status = self._do(
            "fmi2GetDirectionalDerivative",
            (c_uint * len(unknowns))(*unknowns),
            len(unknowns),
            (c_uint * len(knowns))(*knowns),
            len(knowns),
            (c_double * len(knowns))(*[1.0] * len(knowns)),
            result,
        )
        return status, list(result)

    def input_derivative(self, reference: int, value: float, order: int = 1) -> int:
        """Call fmi2SetRealInputDerivatives with one derivative [per s, per s2 ...] of an order."""
        one = (c_uint * 1)(reference)
        return self._do(
            "fmi2SetRealInputDerivatives", one, 1, (c_int * 1)(order), (c_double * 1)(value)
        )

    def output_derivative(self, reference: int) -> tuple[int, float]:
        """Return the status and the first derivative of one output."""
        value = (c_double * 1)()
        one = (c_uint * 1)(reference)
        status = self._do("fmi2GetRealOutputDerivatives", one, 1, (c_int * 1)(1), value)
        return status, value[0]


def _base(kind: str) -> str:
    return "Integer" if kind == "Enumeration" else kind
