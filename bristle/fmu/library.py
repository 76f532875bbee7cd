"""The functions of an FMU's library, FMI 2.0 and 3.0: their C signatures, and bare calls of them.

Each call returns the status that the FMU answered. The engine builds on it, and the conformance
test, beside code that nobody has vouched for: standard library only.
"""

from __future__ import annotations

import ctypes
import functools
import os
import sys
import time
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
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ..errors import FmuError
from .archive import platform_folder
from .description import Value

OK, WARNING, DISCARD, ERROR, FATAL, PENDING = range(6)
STATUS = ("OK", "Warning", "Discard", "Error", "Fatal", "Pending")

_DO_STEP_STATUS, _TERMINATED = 0, 3

Heard = Callable[[int | None, bytes | None, int, bytes | None, bytes | None], None]
"""Takes a message: environment, instance's name (None in FMI 3.0), status, category, text."""
_LOGGER = ctypes.CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p)
_LOGGER_FMI3 = ctypes.CFUNCTYPE(None, c_void_p, c_int, c_char_p, c_char_p)
_ALLOCATE = ctypes.CFUNCTYPE(c_void_p, c_size_t, c_size_t)
_FREE = ctypes.CFUNCTYPE(None, c_void_p)
_FINISHED = ctypes.CFUNCTYPE(None, c_void_p, c_int)

_refs, _state = POINTER(c_uint), c_void_p
TYPES: dict[str, Any] = {"Real": c_double, "Integer": c_int, "Boolean": c_int, "String": c_char_p}
_values = {
    f"fmi2{verb}{kind}": (c_void_p, _refs, c_size_t, POINTER(TYPES[kind]))
    for verb in ("Get", "Set")
    for kind in TYPES
}
UNCALLED = ("fmi2CancelStep", "fmi2GetRealStatus", "fmi2GetIntegerStatus", "fmi2GetStringStatus")
"""Optional functions that nothing here calls: a library is only asked whether it has them."""
OPTIONAL: dict[str, tuple[Any, ...]] = {
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
    "fmi2GetStatus": (c_void_p, c_int, POINTER(c_int)),
    "fmi2GetBooleanStatus": (c_void_p, c_int, POINTER(c_int)),
    **dict.fromkeys(UNCALLED, ()),
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
    **_values,
}
RESULTS: dict[str, Any] = {
    "fmi2GetTypesPlatform": c_char_p,
    "fmi2GetVersion": c_char_p,
    "fmi2Instantiate": c_void_p,
    "fmi2FreeInstance": None,
}

_sizes = POINTER(c_size_t)
_flag, _numbers = POINTER(c_bool), POINTER(c_double)
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

_values_fmi3 = {
    f"fmi3{verb}{name}": (c_void_p, _refs, c_size_t, POINTER(kind), c_size_t)
    for verb in ("Get", "Set")
    for name, kind in TYPES_FMI3.items()
}
REQUIRED_FMI3 = {
    "fmi3GetVersion": (),
    "fmi3SetDebugLogging": (c_void_p, c_bool, c_size_t, POINTER(c_char_p)),
    "fmi3InstantiateCoSimulation": (
        *(c_char_p, c_char_p, c_char_p, c_bool, c_bool, c_bool, c_bool),
        *(_refs, c_size_t, c_void_p, _LOGGER_FMI3, c_void_p),
    ),
    "fmi3FreeInstance": (c_void_p,),
    "fmi3EnterInitializationMode": (c_void_p, c_bool, c_double, c_double, c_bool, c_double),
    "fmi3ExitInitializationMode": (c_void_p,),
    "fmi3Terminate": (c_void_p,),
    "fmi3Reset": (c_void_p,),
    "fmi3DoStep": (c_void_p, c_double, c_double, c_bool, _flag, _flag, _flag, _numbers),
    **_values_fmi3,
}
UNCALLED_FMI3 = (
    "GetAdjointDerivative", "GetBinary", "SetBinary", "GetClock", "SetClock", "GetIntervalDecimal",
    "GetIntervalFraction", "GetShiftDecimal", "GetShiftFraction", "SetIntervalDecimal",
    "SetIntervalFraction", "SetShiftDecimal", "SetShiftFraction", "GetNumberOfVariableDependencies",
    "GetVariableDependencies", "EnterEventMode", "EnterStepMode", "UpdateDiscreteStates",
    "EvaluateDiscreteStates", "EnterConfigurationMode", "ExitConfigurationMode",
)  # fmt: skip
"""As `UNCALLED`, without the prefix."""
OPTIONAL_FMI3: dict[str, tuple[Any, ...]] = {
    "fmi3GetFMUState": (c_void_p, POINTER(_state)),
    "fmi3SetFMUState": (c_void_p, _state),
    "fmi3FreeFMUState": (c_void_p, POINTER(_state)),
    "fmi3SerializedFMUStateSize": (c_void_p, _state, _sizes),
    "fmi3SerializeFMUState": (c_void_p, _state, c_char_p, c_size_t),
    "fmi3DeserializeFMUState": (c_void_p, c_char_p, c_size_t, POINTER(_state)),
    "fmi3GetDirectionalDerivative": (
        (c_void_p, _refs, c_size_t, _refs, c_size_t, _numbers, c_size_t, _numbers, c_size_t)
    ),
    "fmi3GetOutputDerivatives": (c_void_p, _refs, c_size_t, POINTER(c_int), _numbers, c_size_t),
    **{f"fmi3{name}": () for name in UNCALLED_FMI3},
}
RESULTS_FMI3: dict[str, Any] = {
    "fmi3GetVersion": c_char_p,
    "fmi3InstantiateCoSimulation": c_void_p,
    "fmi3FreeInstance": None,
}


class _Callbacks(ctypes.Structure):
    _fields_ = (
        ("logger", _LOGGER),
        ("allocate", _ALLOCATE),
        ("free", _FREE),
        ("finished", _FINISHED),
        ("environment", c_void_p),
    )


class MissingFunctionError(FmuError):
    """The library does not export a function."""


class UnexpectedError(Exception):
    """A legal call was not answered as the standard demands; the text says which."""


class FatalAnswerError(Exception):
    """The FMU answered Fatal: by the standard, nothing of it may be called any more."""


def answer_of(status: int) -> str:
    """Return what a call has answered, in FMI's words."""
    return STATUS[status] if 0 <= status < len(STATUS) else f"status {status}"


def resources_of(folder: Path, version: str) -> str:
    """Return where an unpacked FMU has its resources: an URI; in FMI 3.0 a path with a separator.

    Parameters
    ----------
    folder : where the FMU is unpacked
    version : "2.0" or "3.0"
    """
    resources = folder / "resources"
    return f"{resources}{os.sep}" if version == "3.0" else resources.as_uri()


def logger_proxy() -> str:
    """Return fmpy's library that puts numbers into messages of printf's form, "" without it."""
    spec = find_spec("fmpy")
    for folder in (spec and spec.submodule_search_locations) or ():
        found = sorted(Path(folder, "logging", platform_folder("2.0")).glob("logging.*"))
        if found:
            return str(found[0])
    return ""


@functools.cache
def _logger(heard: Heard) -> Any:
    """Return a C function, kept for good: the proxy calls the last one that it was given."""
    return _LOGGER(heard)


class FmuLibrary:
    """A loaded FMU library.

    Parameters
    ----------
    file : Path
    version : "2.0" or "3.0"
    heard : callable
        Takes what the instances log.
    types : mapping of int to str
        The types of FMI 3.0 by value reference; one that it lacks has the natural type of its kind.
    proxy : str
        A library that puts the numbers into a message which an FMU of FMI 2.0 gives in printf's
        form; see `logger_proxy`.

    Raises
    ------
    OSError
        The library cannot be loaded.
    """

    def __init__(
        self,
        file: Path,
        version: str,
        heard: Heard,
        *,
        types: Mapping[int, str] | None = None,
        proxy: str = "",
    ) -> None:
        self.fmi3 = version == "3.0"
        self.prefix = "fmi3" if self.fmi3 else "fmi2"
        self.types = types or {}
        self.called = ""
        """The function that was called last."""
        if sys.platform == "win32":
            self._dll = ctypes.CDLL(str(file), winmode=0x8)  # finds DLLs beside it
        else:
            self._dll = ctypes.CDLL(str(file))
        self.required: dict[str, tuple[Any, ...]] = REQUIRED_FMI3 if self.fmi3 else REQUIRED
        self.optional: dict[str, tuple[Any, ...]] = OPTIONAL_FMI3 if self.fmi3 else OPTIONAL
        results = RESULTS_FMI3 if self.fmi3 else RESULTS
        self._functions: dict[str, Callable[..., Any]] = {}
        for name, arguments in {**self.required, **self.optional}.items():
            function = getattr(self._dll, name, None)
            if function is not None:
                function.argtypes = list(arguments)
                function.restype = results.get(name, c_int)
                self._functions[name] = function
        if self.fmi3:
            self._logger = _LOGGER_FMI3(
                lambda environment, status, kind, text: heard(environment, None, status, kind, text)
            )
            return
        runtime = ctypes.CDLL("msvcrt" if sys.platform == "win32" else None)
        self._callbacks = _Callbacks(
            _logger(heard),
            ctypes.cast(runtime.calloc, _ALLOCATE),
            ctypes.cast(runtime.free, _FREE),
            _FINISHED(0),
            None,
        )
        if proxy:
            ctypes.CDLL(proxy).addLoggerProxy(byref(self._callbacks))

    def missing(self) -> tuple[list[str], list[str]]:
        """Return the functions that every FMU needs, and the others, that are not exported."""
        return (
            [name for name in self.required if name not in self._functions],
            [name for name in self.optional if name not in self._functions],
        )

    def address(self, name: str) -> int:
        """Return the address of a function."""
        address = ctypes.cast(self.found(name), c_void_p).value
        assert address is not None
        return address

    def found(self, name: str) -> Any:
        """Return a function; raise MissingFunctionError if it is not exported."""
        if name not in self._functions:
            raise MissingFunctionError(f"the library does not export {name}")
        return self._functions[name]

    def call(self, name: str, *arguments: Any) -> Any:
        """Call one function and return its result as it is."""
        function = self.found(name)
        self.called = name
        return function(*arguments)

    def status(self, name: str, *arguments: Any) -> int:
        """Call a function that returns a status."""
        return int(self.call(name, *arguments))

    def instantiate(
        self, name: str, guid: str, resources: str, *, logging: bool = False, environment: int = 0
    ) -> Handle | None:
        """Return a new instance for co-simulation, None if the FMU refuses.

        Parameters
        ----------
        name, guid : of the instance; of the model description
        resources : see `resources_of`
        logging : whether the FMU logs for debugging
        environment : what its messages bring with them
        """
        if self.fmi3:
            handle = self.call(
                "fmi3InstantiateCoSimulation", name.encode(), guid.encode(), resources.encode(),
                False, logging, False, False, None, 0, environment, self._logger, None,
            )  # fmt: skip
            return HandleFmi3(self, handle) if handle else None
        self._callbacks.environment = environment
        handle = self.call(
            "fmi2Instantiate", name.encode(), 1, guid.encode(), resources.encode(),
            ctypes.addressof(self._callbacks), 0, int(logging),
        )  # fmt: skip
        return Handle(self, handle) if handle else None

    def close(self) -> None:
        """Unload the library."""
        if sys.platform == "win32":
            ctypes.windll.kernel32.FreeLibrary(c_void_p(self._dll._handle))
        else:
            unload = ctypes.CDLL(None).dlclose
            unload.argtypes = [c_void_p]
            unload(self._dll._handle)


class Handle:
    """One instance. Every method returns the status that the FMU answered."""

    _output_slopes = "GetRealOutputDerivatives"

    def __init__(self, library: FmuLibrary, handle: int) -> None:
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


class HandleFmi3(Handle):
    """One instance of FMI 3.0. Every method returns the status that the FMU answered.

    It is stepped without event mode, intermediate update and early return, as an importer may
    choose for any FMU.
    """

    _output_slopes = "GetOutputDerivatives"

    def __init__(self, library: FmuLibrary, handle: int) -> None:
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

    def by_type(self, kind: str, references: Sequence[int]) -> Iterator[tuple[str, list[int]]]:
        """Yield each type of these variables with their places; an unknown one is the natural."""
        found: dict[str, list[int]] = {} if references else {NATURAL[kind]: []}
        for i, reference in enumerate(references):
            name = self.library.types.get(reference, NATURAL[kind])
            found.setdefault("Int64" if name == "Enumeration" else name, []).append(i)
        yield from found.items()

    def get(self, kind: str, references: Sequence[int]) -> tuple[int, list[Value]]:
        """Return the worst status and the values of variables of one kind, whatever their types.

        The first type whose values are not got or set ends the call, here and in `set`.
        """
        worst, found = OK, dict[int, Value](dict.fromkeys(range(len(references)), 0))
        for name, places in self.by_type(kind, references):
            count = len(places)
            some = (c_uint * count)(*(references[i] for i in places))
            values = (TYPES_FMI3[name] * count)()
            worst = max(worst, self._do(f"Get{name}", some, count, values, count))
            if worst > WARNING:
                break
            for i, value in zip(places, values, strict=True):
                text = name == "String"
                found[i] = (value or b"").decode("utf-8", "replace") if text else value
        return worst, list(found.values())

    def set(self, kind: str, references: Sequence[int], values: Sequence[Value]) -> int:
        """Set variables of one kind, whatever their types; return the worst status."""
        worst = OK
        for name, places in self.by_type(kind, references):
            count = len(places)
            some = (c_uint * count)(*(references[i] for i in places))
            array = (TYPES_FMI3[name] * count)(*_raw([values[i] for i in places]))
            worst = max(worst, self._do(f"Set{name}", some, count, array, count))
            if worst > WARNING:
                break
        return worst
