"""One FMU, loaded and stepped: a class per version of FMI, both with the same methods.

The master prepares its calls once, by names without a version ("DoStep", "GetFMUstate") and by
`transfer` for values. `Fmi2` hands out the library's own functions; `Fmi3` hands out functions of
the same arguments where the library's differ.
"""

from __future__ import annotations

import ctypes
import itertools
import os
import sys
import tempfile
import threading
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn, Self

from fmpy import fmi2, fmi3
from fmpy.fmi1 import FMICallException

from ..core.interrupt import Interrupt
from ..errors import FmuError, RunError
from ..fmu import binary
from ..fmu.archive import extract, library_member, platform_folder
from ..fmu.binary import reset_at_exit
from ..fmu.description import Description, Value, Variable

STATUS = ("OK", "Warning", "Discard", "Error", "Fatal", "Pending")
WARNING, DISCARD, ERROR, FATAL = 1, 2, 3, 4

_CHANGES_FOLDER = threading.Lock()
"""Held while fmpy loads a library: the whole process works in the FMU's folder meanwhile."""
_SLAVE_MODULE = Path("resources", "slavemodule.txt")
"""What an FMU of PythonFMU holds: it runs in the interpreter of a Python host."""
_NATURAL = {"Real": "Float64", "Integer": "Int32"}
"""Types of FMI 3.0 that lie in memory as the kinds of FMI 2.0 do."""
_C_TYPES: dict[str, Any] = {
    "Float64": ctypes.c_double, "Float32": ctypes.c_float, "Boolean": ctypes.c_bool,
    "Int8": ctypes.c_int8, "UInt8": ctypes.c_uint8, "Int16": ctypes.c_int16,
    "UInt16": ctypes.c_uint16, "Int32": ctypes.c_int32, "UInt32": ctypes.c_uint32,
    "Int64": ctypes.c_int64, "UInt64": ctypes.c_uint64,
}  # fmt: skip
_KINDS_IN_MEMORY: dict[str, Any] = {
    "Real": ctypes.c_double, "Integer": ctypes.c_int, "Boolean": ctypes.c_int,
}  # fmt: skip
_STATE = {name: name.replace("state", "State") for name in ("GetFMUstate", "SetFMUstate")}
_STATE["FreeFMUstate"] = "FreeFMUState"

Say = Callable[[str, str], None]
Status = Callable[..., int]


def load(description: Description, folder: Path, name: str, callbacks: Any, say: Say) -> Binding:
    """Return an FMU's library, loaded.

    Parameters
    ----------
    description : Description
    folder : Path
        Where the FMU is unpacked.
    name : str
        The instance's.
    callbacks : fmi2CallbackFunctions
        What an FMU of FMI 2.0 calls.
    say : callable
        (status, text): takes the messages of an FMU of FMI 3.0, and what is said of its calls.

    Raises
    ------
    Exception
        The library cannot be loaded.
    """
    if (folder / _SLAVE_MODULE).is_file():
        reset_at_exit()
    given = {
        "guid": description.guid, "modelIdentifier": description.identifier,
        "unzipDirectory": str(folder), "instanceName": name,
    }  # fmt: skip
    with _CHANGES_FOLDER:
        before = Path.cwd()
        try:
            if description.version == "3.0":
                return Fmi3(given, description, say)
            return Fmi2(given, callbacks)
        finally:
            os.chdir(before)  # fmpy stays in the FMU's folder where it fails


class Fmi2:
    """The library of an FMU of FMI 2.0."""

    def __init__(self, given: dict[str, str], callbacks: Any) -> None:
        self.slave: Any = fmi2.FMU2Slave(**given)
        self._callbacks = callbacks

    def instantiate(self) -> None:
        """Make the instance; raise an exception if the FMU makes none."""
        self.slave.instantiate(callbacks=self._callbacks, loggingOn=True)

    def set_up(self, stop: float) -> None:
        """Tell start and stop time [s], where that comes before parameters are set."""
        self.slave.setupExperiment(startTime=0.0, stopTime=stop)

    def enter_initialisation(self, stop: float) -> None:
        """Enter the initialisation mode at t = 0."""
        self.slave.enterInitializationMode()

    def set(self, kind: str, variables: Sequence[Variable], values: Sequence[Value]) -> None:
        """Set variables of one kind."""
        getattr(self.slave, f"set{kind}")([v.reference for v in variables], values)

    def get(self, kind: str, variables: Sequence[Variable]) -> list[Value]:
        """Return the values of variables of one kind."""
        found: list[Value] = getattr(self.slave, f"get{kind}")([v.reference for v in variables])
        return found

    def function(self, name: str) -> Status:
        """Return a C function without argument conversion, for arguments prepared once.

        An FMU that runs in this interpreter takes its lock at once, so the lock is not given up
        around the call; that saves a tenth of the call.
        """
        return self._raw(f"fmi2{name}")

    def transfer(self, verb: str, kind: str, variables: Sequence[Variable], address: int) -> Status:
        """Return a function that gets or sets variables of one kind at an address in memory.

        It takes the component, the address of the value references, their number, and `address`.

        Parameters
        ----------
        verb, kind : "Get" or "Set"; "Real", "Integer" or "Boolean"
        variables : sequence of Variable
        address : of the values, doubles or ints, in the order of the variables
        """
        return self.function(f"{verb}{kind}")

    def _raw(self, name: str) -> Status:
        address = ctypes.cast(getattr(self.slave.dll, name), ctypes.c_void_p).value
        assert address is not None
        inside = Path(self.slave.unzipDirectory, _SLAVE_MODULE).is_file()
        prototype = ctypes.PYFUNCTYPE if inside else ctypes.CFUNCTYPE
        return prototype(ctypes.c_int)(address)


class Fmi3(Fmi2):
    """The library of an FMU of FMI 3.0, stepped without event mode and without early return."""

    def __init__(self, given: dict[str, str], description: Description, say: Say) -> None:
        self.slave = fmi3.FMU3Slave(**given)
        self._description = description
        self._say = say

    def instantiate(self) -> None:
        self.slave.instantiate(loggingOn=True, logMessage=self._log)

    def set_up(self, stop: float) -> None:
        """Tell nothing: the times are told as the initialisation is entered."""

    def enter_initialisation(self, stop: float) -> None:
        self.slave.enterInitializationMode(startTime=0.0, stopTime=stop)

    def set(self, kind: str, variables: Sequence[Variable], values: Sequence[Value]) -> None:
        for name, places in _by_type(variables).items():
            given = [values[i] for i in places]
            for i, value in zip(places, given, strict=True):
                self._refuse_large(name, variables[i], value)
            getattr(self.slave, f"set{name}")([variables[i].reference for i in places], given)

    def _refuse_large(self, name: str, variable: Variable, value: Value) -> None:
        """Refuse a whole number that its type would cut off: C does so without a word."""
        if isinstance(value, int) and _C_TYPES[name](value).value != value:
            self._say("Error", f"{variable.name} = {value} does not fit into {name}.")
            raise FMICallException(f"fmi3Set{name}", ERROR)

    def get(self, kind: str, variables: Sequence[Variable]) -> list[Value]:
        found: list[Value] = [0] * len(variables)
        for name, places in _by_type(variables).items():
            references = [variables[i].reference for i in places]
            values = getattr(self.slave, f"get{name}")(references)
            for i, value in zip(places, values, strict=True):
                found[i] = value
        return found

    def function(self, name: str) -> Status:
        return self._step() if name == "DoStep" else self._raw(f"fmi3{_STATE.get(name, name)}")

    def transfer(self, verb: str, kind: str, variables: Sequence[Variable], address: int) -> Status:
        """Return a function that gets or sets variables, whatever types FMI 3.0 gives them.

        Parameters
        ----------
        verb, kind : "Get" or "Set"; "Real", "Integer" or "Boolean", as they lie in memory
        variables : sequence of Variable
        address : of the values, doubles or ints, in the order of the variables
        """
        types = _by_type(variables)
        if list(types) == [_NATURAL.get(kind)]:
            function = self._raw(f"fmi3{verb}{_NATURAL[kind]}")
            return lambda c, references, n, values: function(c, references, n, values, n)
        memory = (_KINDS_IN_MEMORY[kind] * len(variables)).from_address(address)
        calls = [
            self._one_type(verb, name, places, variables, memory) for name, places in types.items()
        ]
        return lambda c, references, n, values: max(call(c) for call in calls)

    def _one_type(
        self, verb: str, name: str, places: Sequence[int], variables: Sequence[Variable],
        memory: Any,
    ) -> Status:  # fmt: skip
        """Return a function that passes on values of one type, by way of memory of that type."""
        function = self._raw(f"fmi3{verb}{name}")
        count = ctypes.c_size_t(len(places))
        references = (ctypes.c_uint * len(places))(*(variables[i].reference for i in places))
        own = (_C_TYPES[name] * len(places))()
        real = memory._type_ is ctypes.c_double

        def get(component: Any) -> int:
            status = function(component, references, count, own, count)
            for i, value in zip(places, own, strict=True):
                if not real and not -(2**31) <= value < 2**31:
                    self._say("Error", f"{variables[i].name} = {value} has more than 32 bits.")
                    return ERROR
                memory[i] = value
            return status

        def set_(component: Any) -> int:
            for k, i in enumerate(places):
                own[k] = memory[i]
                if not real and own[k] != memory[i]:
                    told = f"{variables[i].name} = {memory[i]} does not fit into {name}."
                    self._say("Error", told)
                    return ERROR
            return function(component, references, count, own, count)

        return get if verb == "Get" else set_

    def _step(self) -> Status:
        function = self._raw("fmi3DoStep")
        event, end, early = (ctypes.c_bool() for _ in range(3))
        last = ctypes.c_double()
        answers = tuple(ctypes.byref(one) for one in (event, end, early, last))

        def step(component: Any, time: Any, length: Any, past: Any) -> int:
            status = function(component, time, length, past, *answers)
            if status < DISCARD and (end.value or early.value):
                told = "asks to end the simulation" if end.value else "returned early"
                self._say("Error", f"it {told} at t = {last.value:.9g} s.")
                return DISCARD
            return status

        return step

    def _log(self, _environment: Any, status: int, category: bytes, message: bytes) -> None:
        self._say(answer_of(status), (message or b"").decode("utf-8", "replace"))


Binding = Fmi2


def _by_type(variables: Sequence[Variable]) -> dict[str, list[int]]:
    """Return the places of the variables of each type; an enumeration is a long integer."""
    found: dict[str, list[int]] = {}
    for i, variable in enumerate(variables):
        name = "Int64" if variable.type == "Enumeration" else variable.type
        found.setdefault(name, []).append(i)
    return found


# FMUs as loaded instances: unpacked, instantiated, initialised, with their messages collected.

_SHARED_PYTHON = (
    "It runs Python code and needs the symbols of libpython. Use a Python that offers them to "
    "shared libraries (built with --enable-shared, as those of Linux distributions and conda "
    "are), or start it with LD_PRELOAD=.../libpython{0}.{1}.so.1.0."
)


def answer_of(status: int) -> str:
    """Return what a call has answered, in FMI's words."""
    return STATUS[status] if 0 <= status < len(STATUS) else f"status {status}"


@dataclass(frozen=True)
class Message:
    """One line that an FMU sent to its logger."""

    component: str
    status: str
    category: str
    text: str

    @property
    def shown(self) -> str:
        """The line, which begins with the component."""
        begins = f"{self.component}: "
        return self.text if self.text.startswith(begins) else begins + self.text


class Unpacked:
    """FMUs unpacked into a temporary folder; leaving it leaves the process as it was found.

    FMUs made with PythonFMU put their folder on `sys.path` and their modules into `sys.modules`
    of a Python host. Both go with the folder, else the next FMU of that name would run old code.
    """

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="bristle-", ignore_cleanup_errors=True)
        self._folders: dict[tuple[Path, int], Path] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self.close()

    def folder(self, path: Path, copy: int = 0) -> Path:
        """Return the folder with the content of an FMU, unpacked on first use.

        Raises
        ------
        FmuError
            The file cannot or must not be unpacked.
        """
        key = path.resolve(), copy
        if key not in self._folders:
            self._folders[key] = extract(path, Path(self._folder.name, str(len(self._folders))))
        return self._folders[key]

    def close(self) -> None:
        """Remove the folder and what FMUs written in Python left in this interpreter."""
        inside = self._folder.name + os.sep
        with binary.LOCK:
            sys.path[:] = [entry for entry in sys.path if not entry.startswith(inside)]
            binary.forget(lambda _, one: _file_of(one).startswith(inside))
        self._folder.cleanup()


def _file_of(module: object) -> str:
    return str(getattr(module, "__file__", None) or "")


class Instance:
    """One instantiated FMU.

    Parameters
    ----------
    name : str
        The component's name in the scenario.
    description : Description
        Variables, guid and model identifier.
    folder : Path
        Where the FMU is unpacked.
    listen : callable
        Gets every Message of the FMU, as it comes.

    Raises
    ------
    FmuError
        No binary for this platform, or the FMU cannot be loaded or instantiated.
    KeyboardInterrupt
        Ctrl-C came meanwhile; the FMU is closed again.
    """

    def __init__(
        self, name: str, description: Description, folder: Path, listen: Callable[[Message], None]
    ) -> None:
        self.name = name
        self.description = description
        self.poisoned = False
        self._initialised = False
        self._last: deque[str] = deque(maxlen=3)
        self._refused: list[str] = []  # by what initialisation ended with: it tells later stops
        self._listen = listen
        self._key = _register(self)
        # A KeyboardInterrupt in an FMU written in Python would be told as that FMU's failure.
        with Interrupt() as interrupt, binary.LOCK:
            self.library = self._load(folder)
            try:
                self.library.instantiate()
            except Exception as error:  # fmpy raises Exception itself
                _LISTENERS.pop(self._key)
                raise FmuError(f"{self._where()}: cannot be instantiated.{self.said()}") from error
        if interrupt.asked:
            self.close()
            raise KeyboardInterrupt

    @property
    def component(self) -> int:
        """The address of the FMU's instance."""
        return int(self.library.slave.component)

    def initialise(self, parameters: Mapping[str, Value], stop: float) -> None:
        """Set parameters and inputs, and enter initialisation mode at t = 0."""
        self._call(self.library.set_up, stop)
        self.set(parameters)
        self._call(self.library.enter_initialisation, stop)

    def finish_initialisation(self) -> None:
        """Leave initialisation mode."""
        self._refused.clear()
        self._call(self.library.slave.exitInitializationMode)
        self._initialised = True
        self._last.clear()

    def set(self, values: Mapping[str, Value]) -> None:
        """Set variables by name, one call per kind."""
        for kind, names in _by_call(self.description, values).items():
            given: list[Value] = [values[name] for name in names]
            if kind == "Real":
                given = [float(value) for value in given]
            self._call(self.library.set, kind, self._variables(names), given)

    def get(self, names: Iterable[str]) -> dict[str, Value]:
        """Return variables by name, one call per kind."""
        found: dict[str, Value] = {}
        for kind, group in _by_call(self.description, names).items():
            values = self._call(self.library.get, kind, self._variables(group))
            found |= zip(group, values, strict=True)
        return found

    def close(self) -> None:
        """Terminate and free the instance; one that answered Fatal must not be called again."""
        if not self.poisoned:
            try:
                if self._initialised:
                    self._call(self.library.slave.terminate)
                self.library.slave.freeInstance()
            except RunError as error:
                self.say("Warning", str(error))
        _LISTENERS.pop(self._key, None)

    def say(self, status: str, text: str, category: str = "") -> None:
        """Pass on a message, as if the FMU had sent it."""
        self._last.append(text)
        if status in STATUS[DISCARD:] and not self._initialised:
            self._refused.append(text)
        self._listen(Message(self.name, status, category, text))

    def said(self) -> str:
        """Return the FMU's last messages as lines for an error's text."""
        return "".join(f"\n  It said: {text}" for text in self._last or self._refused[-3:])

    def fail(self, function: str, status: int) -> NoReturn:
        """Raise RunError for a call that did not answer OK or Warning."""
        self.poisoned |= status == FATAL
        raise RunError(f"{self._where()}: {function} answered {answer_of(status)}.{self.said()}")

    def _call(self, method: Callable[..., Any], *arguments: Any) -> Any:
        self._last.clear()
        try:
            return method(*arguments)
        except FMICallException as error:
            self.fail(error.function, error.status)

    def _variables(self, names: Iterable[str]) -> list[Variable]:
        return [self.description.variables[name] for name in names]

    def _load(self, folder: Path) -> Binding:
        self._need_binary(folder)
        try:
            return load(self.description, folder, self.name, _callbacks(self._key), self.say)
        except Exception as error:  # fmpy raises Exception itself
            _LISTENERS.pop(self._key)
            cure = ""
            if "_Py" in str(error) or "libpython" in str(error):
                cure = "\n  " + _SHARED_PYTHON.format(*sys.version_info)
            raise FmuError(f"{self._where()}: {error}{cure}") from error

    def _need_binary(self, folder: Path) -> None:
        version = self.description.version
        if not (folder / library_member(self.description.identifier, version)).is_file():
            has = sorted(entry.name for entry in (folder / "binaries").glob("*")) or ["none"]
            _LISTENERS.pop(self._key)
            raise FmuError(
                f"{self._where()} has no binary for this platform ({platform_folder(version)}); "
                f"it has: {', '.join(has)}.\n  A scenario of built-in components runs without "
                'binaries: --engine compiled, in Python engine="compiled".'
            )

    def _where(self) -> str:
        return f"{self.name} ({self.description.name})"


def _by_call(description: Description, names: Iterable[str]) -> dict[str, list[str]]:
    groups: dict[str, list[str]] = {}
    for name in names:
        variable: Variable = description.variables[name]
        kind = "Integer" if variable.kind == "Enumeration" else variable.kind
        groups.setdefault(kind, []).append(name)
    return groups


# The logger that formats printf arguments keeps one Python function for the whole process, so
# all instances share it and are told apart by the environment pointer that they pass back.
_LISTENERS: dict[int, Instance] = {}
_keys = itertools.count(1)
_shared: list[fmi2.fmi2CallbackFunctions] = []


def _register(instance: Instance) -> int:
    key = next(_keys)
    _LISTENERS[key] = instance
    return key


def _callbacks(key: int) -> fmi2.fmi2CallbackFunctions:
    if not _shared:
        common = fmi2.fmi2CallbackFunctions()
        common.logger = _LOGGER
        common.allocateMemory = fmi2.defaultCallbacks.allocateMemory
        common.freeMemory = fmi2.defaultCallbacks.freeMemory
        fmi2.addLoggerProxy(ctypes.byref(common))
        _shared.append(common)
    own = fmi2.fmi2CallbackFunctions.from_buffer_copy(_shared[0])
    own.componentEnvironment = key
    return own


def _on_message(
    environment: int | None, name: bytes | None, status: int, category: bytes, text: bytes
) -> None:
    said_by = (name or b"").decode("utf-8", "replace")
    named = [one for one in _LISTENERS.values() if one.name == said_by]  # many pass no environment
    instance = _LISTENERS.get(environment or 0, named[-1] if named else None)
    if instance is None:  # an FMU that another part of this process has loaded through fmpy
        fmi2.printLogMessage(environment, name or b"", status, category or b"", text or b"")
        return
    decoded = ((part or b"").decode("utf-8", "replace") for part in (text, category))
    instance.say(answer_of(status), *decoded)


_LOGGER = fmi2.fmi2CallbackLoggerTYPE(_on_message)
