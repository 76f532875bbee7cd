"""The functions of an FMU's library, FMI 2.0 and 3.0, called bare, so that each status is seen.

Runs in the child process beside code that nobody has vouched for: standard library only.
"""

from __future__ import annotations

import ctypes
import mmap
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from ctypes import (
    POINTER,
    byref,
    c_bool,
    c_char_p,
    c_double,
    c_int,
    c_size_t,
    c_uint,
    c_void_p,
    create_string_buffer,
)
from pathlib import Path
from typing import Any

from ..fmu.description import Value

_refs, _state = POINTER(c_uint), c_void_p
TYPES: dict[str, Any] = {"Real": c_double, "Integer": c_int, "Boolean": c_int, "String": c_char_p}
_VALUES = {
    f"fmi2{verb}{kind}": (c_void_p, _refs, c_size_t, POINTER(TYPES[kind]))
    for verb in ("Get", "Set")
    for kind in TYPES
}
OPTIONAL = {
    "fmi2GetFMUstate": (c_void_p, POINTER(_state)),
    "fmi2SetFMUstate": (c_void_p, _state),
    "fmi2FreeFMUstate": (c_void_p, POINTER(_state)),
    "fmi2SerializedFMUstateSize": (c_void_p, _state, POINTER(c_size_t)),
    "fmi2SerializeFMUstate": (c_void_p, _state, c_char_p, c_size_t),
    "fmi2DeSerializeFMUstate": (c_void_p, c_char_p, c_size_t, POINTER(_state)),
    "fmi2GetDirectionalDerivative": (
        (c_void_p, _refs, c_size_t, _refs, c_size_t, POINTER(c_double), POINTER(c_double))
    ),
    "fmi2SetRealInputDerivatives": ((c_void_p, _refs, c_size_t, POINTER(c_int), POINTER(c_double))),
    "fmi2GetRealOutputDerivatives": (
        (c_void_p, _refs, c_size_t, POINTER(c_int), POINTER(c_double))
    ),
    "fmi2CancelStep": (c_void_p,),
    "fmi2GetStatus": (c_void_p, c_int, POINTER(c_int)),
    "fmi2GetRealStatus": (c_void_p, c_int, POINTER(c_double)),
    "fmi2GetIntegerStatus": (c_void_p, c_int, POINTER(c_int)),
    "fmi2GetBooleanStatus": (c_void_p, c_int, POINTER(c_int)),
    "fmi2GetStringStatus": (c_void_p, c_int, POINTER(c_char_p)),
}
REQUIRED = {
    "fmi2GetTypesPlatform": (),
    "fmi2GetVersion": (),
    "fmi2SetDebugLogging": (c_void_p, c_int, c_size_t, POINTER(c_char_p)),
    "fmi2Instantiate": (c_char_p, c_int, c_char_p, c_char_p, c_void_p, c_int, c_int),
    "fmi2FreeInstance": (c_void_p,),
    "fmi2SetupExperiment": (c_void_p, c_int, c_double, c_double, c_int, c_double),
    "fmi2EnterInitializationMode": (c_void_p,),
    "fmi2ExitInitializationMode": (c_void_p,),
    "fmi2Terminate": (c_void_p,),
    "fmi2Reset": (c_void_p,),
    "fmi2DoStep": (c_void_p, c_double, c_double, c_int),
    **_VALUES,
}
RESULTS: dict[str, Any] = {
    "fmi2GetTypesPlatform": c_char_p,
    "fmi2GetVersion": c_char_p,
    "fmi2Instantiate": c_void_p,
    "fmi2FreeInstance": None,
}

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


class UnexpectedError(Exception):
    """A legal call was not answered as the standard demands; the text says which."""


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
    ) -> Instance | None:
        """Return a new instance for co-simulation, None if the FMU refuses.

        Parameters
        ----------
        name, guid : of the instance; of the model description
        resources : URI of the unpacked resources
        logging : whether the FMU logs for debugging
        """
        handle = self.call(
            "fmi2Instantiate", name.encode(), 1, guid.encode(), resources.encode(),
            ctypes.addressof(self._callbacks), 0, int(logging),
        )  # fmt: skip
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

    _output_slopes = "GetRealOutputDerivatives"

    def __init__(self, library: Library, handle: int) -> None:
        self.library = library
        self.handle = handle

    def _do(self, name: str, *arguments: Any) -> int:
        """Call a function by its name without a version."""
        return self.library.status(f"{self.library.prefix}{name}", self.handle, *arguments)

    def _sized(self, array: Any) -> tuple[Any, ...]:
        """Return an array as its version of FMI takes it: FMI 3.0 asks for its length as well."""
        return (array,)

    def setup(self, start: float, stop: float | None) -> int:
        """Call fmi2SetupExperiment without a tolerance; times in s."""
        return self._do("SetupExperiment", 0, 0.0, start, int(stop is not None), stop or 0.0)

    def enter(self) -> int:
        """Call fmi2EnterInitializationMode."""
        return self._do("EnterInitializationMode")

    def leave(self) -> int:
        """Call fmi2ExitInitializationMode."""
        return self._do("ExitInitializationMode")

    def terminate(self) -> int:
        """Call fmi2Terminate."""
        return self._do("Terminate")

    def reset(self) -> int:
        """Call fmi2Reset."""
        return self._do("Reset")

    def free(self) -> None:
        """Call fmi2FreeInstance."""
        self.library.call(f"{self.library.prefix}FreeInstance", self.handle)

    def step(self, time_: float, step: float) -> int:
        """Call fmi2DoStep (s), and wait where the FMU computes asynchronously."""
        status = self._do("DoStep", time_, step, 1)
        while status == PENDING:  # the time limit of the call ends an endless wait
            answer = c_int(PENDING)
            asked = self._do("GetStatus", _DO_STEP_STATUS, byref(answer))
            status = answer.value if asked in (OK, WARNING) else asked
            if status == FATAL:
                raise FatalAnswerError("fmi2DoStep")
            time.sleep(0.001)
        return status

    def wants_to_end(self) -> bool:
        """Return whether the FMU says, after Discard, that it wants the run to end."""
        answer = c_int(0)
        try:
            status = self._do("GetBooleanStatus", _TERMINATED, byref(answer))
        except (FatalAnswerError, MissingFunctionError):
            return False
        return status in (OK, WARNING) and bool(answer.value)

    def get(self, kind: str, references: Sequence[int]) -> tuple[int, list[Value]]:
        """Return the status and the values of variables of one kind."""
        kind, count = _base(kind), len(references)
        values = (TYPES[kind] * count)()
        status = self._do(f"Get{kind}", (c_uint * count)(*references), count, values)
        if kind == "String":
            return status, [(v or b"").decode("utf-8", "replace") for v in values]
        return status, [bool(v) for v in values] if kind == "Boolean" else list(values)

    def set(self, kind: str, references: Sequence[int], values: Sequence[Value]) -> int:
        """Set variables of one kind."""
        kind, count = _base(kind), len(references)
        array = (TYPES[kind] * count)(*_raw(values))
        return self._do(f"Set{kind}", (c_uint * count)(*references), count, array)

    def save(self, state: c_void_p) -> int:
        """Call fmi2GetFMUstate into `state`."""
        return self._do("GetFMUstate", byref(state))

    def restore(self, state: c_void_p) -> int:
        """Call fmi2SetFMUstate."""
        return self._do("SetFMUstate", state)

    def forget(self, state: c_void_p) -> int:
        """Call fmi2FreeFMUstate."""
        return self._do("FreeFMUstate", byref(state))

    def serialise(self, state: c_void_p) -> tuple[int, bytes]:
        """Return the status and the bytes of a saved state."""
        size = c_size_t(0)
        status = self._do("SerializedFMUstateSize", state, byref(size))
        if status not in (OK, WARNING):
            return status, b""
        buffer = create_string_buffer(size.value)
        return self._do("SerializeFMUstate", state, buffer, size.value), buffer.raw

    def deserialise(self, data: bytes, state: c_void_p) -> int:
        """Call fmi2DeSerializeFMUstate into `state`."""
        return self._do("DeSerializeFMUstate", data, len(data), byref(state))

    def debug_logging(self, on: bool, categories: Sequence[str] = ()) -> int:
        """Call fmi2SetDebugLogging."""
        names = (c_char_p * len(categories))(*(c.encode() for c in categories))
        return self._do("SetDebugLogging", int(on), len(categories), names)

    def derivatives(
        self, unknowns: Sequence[int], knowns: Sequence[int]
    ) -> tuple[int, list[float]]:
        """Return the status and the directional derivative along the sum of all knowns."""
        n, m = len(unknowns), len(knowns)
        seed, result = (c_double * m)(*[1.0] * m), (c_double * n)()
        status = self._do(
            "GetDirectionalDerivative", (c_uint * n)(*unknowns), n, (c_uint * m)(*knowns), m,
            *self._sized(seed), *self._sized(result),
        )  # fmt: skip
        return status, list(result)

    def input_derivative(self, reference: int, value: float, order: int = 1) -> int:
        """Call fmi2SetRealInputDerivatives with one derivative [per s, per s2 ...] of an order."""
        one = (c_uint * 1)(reference)
        return self._do(
            "SetRealInputDerivatives", one, 1, (c_int * 1)(order), (c_double * 1)(value)
        )

    def output_derivative(self, reference: int) -> tuple[int, float]:
        """Return the status and the first derivative of one output."""
        value, one = (c_double * 1)(), (c_uint * 1)(reference)
        status = self._do(self._output_slopes, one, 1, (c_int * 1)(1), *self._sized(value))
        return status, value[0]


def _raw(values: Sequence[Value]) -> list[Any]:
    return [v.encode() if isinstance(v, str) else v for v in values]


def _base(kind: str) -> str:
    return "Integer" if kind == "Enumeration" else kind


_sizes = POINTER(c_size_t)
_flag, _numbers, _qualifiers = POINTER(c_bool), POINTER(c_double), POINTER(c_int)
_counters = POINTER(ctypes.c_uint64)
TYPES_FMI3: dict[str, Any] = {
    "Float64": c_double, "Float32": ctypes.c_float, "Boolean": c_bool, "String": c_char_p,
    "Int8": ctypes.c_int8, "UInt8": ctypes.c_uint8, "Int16": ctypes.c_int16,
    "UInt16": ctypes.c_uint16, "Int32": c_int, "UInt32": c_uint,
    "Int64": ctypes.c_int64, "UInt64": ctypes.c_uint64,
}  # fmt: skip
NATURAL = {
    "Real": "Float64", "Integer": "Int32", "Enumeration": "Int64", "Boolean": "Boolean",
    "String": "String",
}  # fmt: skip
"""The type of a kind of FMI 2.0 where nothing else is said."""
LOGGER = ctypes.CFUNCTYPE(None, c_void_p, c_int, c_char_p, c_char_p)

_values = {
    f"fmi3{verb}{name}": (c_void_p, _refs, c_size_t, POINTER(kind), c_size_t)
    for verb in ("Get", "Set")
    for name, kind in TYPES_FMI3.items()
}
REQUIRED_FMI3 = {
    "fmi3GetVersion": (),
    "fmi3SetDebugLogging": (c_void_p, c_bool, c_size_t, POINTER(c_char_p)),
    "fmi3InstantiateCoSimulation": (
        *(c_char_p, c_char_p, c_char_p, c_bool, c_bool, c_bool, c_bool),
        *(_refs, c_size_t, c_void_p, LOGGER, c_void_p),
    ),
    "fmi3FreeInstance": (c_void_p,),
    "fmi3EnterInitializationMode": (c_void_p, c_bool, c_double, c_double, c_bool, c_double),
    "fmi3ExitInitializationMode": (c_void_p,),
    "fmi3Terminate": (c_void_p,),
    "fmi3Reset": (c_void_p,),
    "fmi3DoStep": (c_void_p, c_double, c_double, c_bool, _flag, _flag, _flag, _numbers),
    **_values,
}
OPTIONAL_FMI3 = {
    "fmi3GetFMUState": (c_void_p, POINTER(_state)),
    "fmi3SetFMUState": (c_void_p, _state),
    "fmi3FreeFMUState": (c_void_p, POINTER(_state)),
    "fmi3SerializedFMUStateSize": (c_void_p, _state, _sizes),
    "fmi3SerializeFMUState": (c_void_p, _state, c_char_p, c_size_t),
    "fmi3DeserializeFMUState": (c_void_p, c_char_p, c_size_t, POINTER(_state)),
    "fmi3GetDirectionalDerivative": (
        (c_void_p, _refs, c_size_t, _refs, c_size_t, _numbers, c_size_t, _numbers, c_size_t)
    ),
    "fmi3GetAdjointDerivative": (
        (c_void_p, _refs, c_size_t, _refs, c_size_t, _numbers, c_size_t, _numbers, c_size_t)
    ),
    "fmi3GetOutputDerivatives": (c_void_p, _refs, c_size_t, POINTER(c_int), _numbers, c_size_t),
    "fmi3GetBinary": (c_void_p, _refs, c_size_t, _sizes, c_void_p, c_size_t),
    "fmi3SetBinary": (c_void_p, _refs, c_size_t, _sizes, c_void_p, c_size_t),
    "fmi3GetClock": (c_void_p, _refs, c_size_t, _flag),
    "fmi3SetClock": (c_void_p, _refs, c_size_t, _flag),
    "fmi3GetIntervalDecimal": (c_void_p, _refs, c_size_t, _numbers, _qualifiers),
    "fmi3GetIntervalFraction": (c_void_p, _refs, c_size_t, _counters, _counters, _qualifiers),
    "fmi3GetShiftDecimal": (c_void_p, _refs, c_size_t, _numbers),
    "fmi3GetShiftFraction": (c_void_p, _refs, c_size_t, _counters, _counters),
    "fmi3SetIntervalDecimal": (c_void_p, _refs, c_size_t, _numbers),
    "fmi3SetIntervalFraction": (c_void_p, _refs, c_size_t, _counters, _counters),
    "fmi3SetShiftDecimal": (c_void_p, _refs, c_size_t, _numbers),
    "fmi3SetShiftFraction": (c_void_p, _refs, c_size_t, _counters, _counters),
    "fmi3GetNumberOfVariableDependencies": (c_void_p, c_uint, _sizes),
    "fmi3GetVariableDependencies": (
        (c_void_p, c_uint, _sizes, _refs, _sizes, _qualifiers, c_size_t)
    ),
    "fmi3EnterEventMode": (c_void_p,),
    "fmi3EnterStepMode": (c_void_p,),
    "fmi3UpdateDiscreteStates": (c_void_p, _flag, _flag, _flag, _flag, _flag, _numbers),
    "fmi3EvaluateDiscreteStates": (c_void_p,),
    "fmi3EnterConfigurationMode": (c_void_p,),
    "fmi3ExitConfigurationMode": (c_void_p,),
}
RESULTS_FMI3: dict[str, Any] = {
    "fmi3GetVersion": c_char_p,
    "fmi3InstantiateCoSimulation": c_void_p,
    "fmi3FreeInstance": None,
}


class LibraryFmi3(Library):
    """A loaded FMU library of FMI 3.0; `types` says of value references which type they have."""

    prefix = "fmi3"
    required, optional, results = REQUIRED_FMI3, OPTIONAL_FMI3, RESULTS_FMI3

    def __init__(self, file: Path, box: BlackBox, types: Mapping[int, str]) -> None:
        super().__init__(file, box)
        self.types = types
        self._names: list[str] = []
        self._logger = LOGGER(self._log_fmi3)

    def _log_fmi3(
        self, environment: int | None, status: int, kind: bytes | None, text: bytes | None
    ) -> None:
        """Take a message; an instance is told apart by the environment that it passes back."""
        place = (environment or 0) - 1
        known = 0 <= place < len(self._names)
        self._log(None, self._names[place].encode() if known else None, status, kind, text)

    def instantiate(
        self, name: str, guid: str, resources: str, *, logging: bool = False
    ) -> Instance | None:
        """Return a new instance for co-simulation, None if the FMU refuses.

        Parameters
        ----------
        name, guid : of the instance; the token of the model description
        resources : path of the unpacked resources, with a separator at its end
        logging : whether the FMU logs for debugging
        """
        self._names.append(name)
        handle = self.call(
            "fmi3InstantiateCoSimulation", name.encode(), guid.encode(), resources.encode(),
            False, logging, False, False, None, 0, len(self._names), self._logger, None,
        )  # fmt: skip
        self._refused = [] if handle else list(self._latest)
        return InstanceFmi3(self, handle) if handle else None


class InstanceFmi3(Instance):
    """One instance of FMI 3.0. Every method returns the status that the FMU answered.

    It is stepped without event mode, intermediate update and early return, as an importer may
    choose for any FMU.
    """

    library: LibraryFmi3
    _output_slopes = "GetOutputDerivatives"

    def __init__(self, library: LibraryFmi3, handle: int) -> None:
        super().__init__(library, handle)
        self._start = 0.0
        self._stop: float | None = None
        self._ended = False

    def _do(self, name: str, *arguments: Any) -> int:
        name = name.replace("FMUstate", "FMUState").replace("DeSerialize", "Deserialize")
        return super()._do(name, *arguments)

    def _sized(self, array: Any) -> tuple[Any, ...]:
        return array, len(array)

    def setup(self, start: float, stop: float | None) -> int:
        """Keep start and stop [s] until initialisation mode is entered, which tells them."""
        self._start, self._stop = start, stop
        return OK

    def enter(self) -> int:
        """Call fmi3EnterInitializationMode with the times of `setup`."""
        times = self._start, self._stop is not None, self._stop or 0.0
        return self._do("EnterInitializationMode", False, 0.0, *times)

    def step(self, time_: float, step: float) -> int:
        """Call fmi3DoStep (s); Discard if the FMU asks to end the run, which is its word for it."""
        event, end, early = c_bool(), c_bool(), c_bool()
        last = c_double()
        answers = (byref(one) for one in (event, end, early, last))
        status = self._do("DoStep", time_, step, True, *answers)
        if status in (OK, WARNING) and early.value:
            raise UnexpectedError("fmi3DoStep returned early, which it was not allowed to")
        self._ended = bool(end.value)
        return DISCARD if self._ended and status in (OK, WARNING) else status

    def wants_to_end(self) -> bool:
        """Return whether the last step asked to terminate the simulation."""
        return self._ended

    def _by_type(self, kind: str, references: Sequence[int]) -> Iterator[tuple[str, list[int]]]:
        """Yield each type of these variables with their places; an unknown one is the natural."""
        found: dict[str, list[int]] = {} if references else {NATURAL[kind]: []}
        for i, reference in enumerate(references):
            name = self.library.types.get(reference, NATURAL[kind])
            found.setdefault("Int64" if name == "Enumeration" else name, []).append(i)
        yield from found.items()

    def get(self, kind: str, references: Sequence[int]) -> tuple[int, list[Value]]:
        """Return the worst status and the values of variables of one kind, whatever their types."""
        worst, found = OK, dict[int, Value](dict.fromkeys(range(len(references)), 0))
        for name, places in self._by_type(kind, references):
            count = len(places)
            some = (c_uint * count)(*(references[i] for i in places))
            values = (TYPES_FMI3[name] * count)()
            worst = max(worst, self._do(f"Get{name}", some, count, values, count))
            for i, value in zip(places, values, strict=True):
                text = name == "String"
                found[i] = (value or b"").decode("utf-8", "replace") if text else value
        return worst, list(found.values())

    def set(self, kind: str, references: Sequence[int], values: Sequence[Value]) -> int:
        """Set variables of one kind, whatever their types; return the worst status."""
        worst = OK
        for name, places in self._by_type(kind, references):
            count = len(places)
            some = (c_uint * count)(*(references[i] for i in places))
            array = (TYPES_FMI3[name] * count)(*_raw([values[i] for i in places]))
            worst = max(worst, self._do(f"Set{name}", some, count, array, count))
        return worst
