"""FMUs as loaded instances: unpacked, instantiated, initialised, with their messages collected.

The master prepares its calls once, by names without a version ("DoStep", "GetFMUstate") and by
`transfer` for values. `Calls` hands out the library's own functions; `CallsFmi3` hands out
functions of the same arguments where the library's differ.
"""

from __future__ import annotations

import ctypes
import itertools
import os
import sys
import tempfile
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn, Self

import numpy as np
from numpy.typing import NDArray

from ..core.interrupt import Interrupt
from ..core.text import in_one_line, listed
from ..errors import FmuError, RunError
from ..fmu import binary
from ..fmu.archive import extract, library_member, platform_folder
from ..fmu.binary import reset_at_exit
from ..fmu.description import Description, Value, Variable
from ..fmu.library import (
    DISCARD,
    ERROR,
    FATAL,
    NATURAL,
    STATUS,
    TYPES,
    TYPES_FMI3,
    WARNING,
    FmuLibrary,
    Handle,
    HandleFmi3,
    answer_of,
    logger_proxy,
    resources_of,
)

_SLAVE_MODULE = Path("resources", "slavemodule.txt")
"""What an FMU of PythonFMU holds: it runs in the interpreter of a Python host."""
_STATE = {name: name.replace("state", "State") for name in ("GetFMUstate", "SetFMUstate")}
_STATE["FreeFMUstate"] = "FreeFMUState"

Say = Callable[[str, str], None]
Status = Callable[..., int]
Pass = Callable[[], None]


class Calls:
    """The functions of an FMU of FMI 2.0, for arguments that are prepared once."""

    def __init__(self, handle: Handle, inside: bool) -> None:
        self._handle = handle
        self._prototype = ctypes.PYFUNCTYPE if inside else ctypes.CFUNCTYPE

    def function(self, name: str) -> Status:
        """Return a C function without argument conversion, by its name without a version.

        An FMU that runs in this interpreter takes its lock at once, so the lock is not given up
        around the call; that saves a tenth of the call.
        """
        library = self._handle.library
        return self._prototype(ctypes.c_int)(library.address(library.prefix + name))

    def transfer(self, verb: str, kind: str, variables: Sequence[Variable], address: int) -> Status:
        """Return a function that gets or sets variables of one kind at an address in memory.

        It takes the component, the address of the value references, their number, and `address`.

        Parameters
        ----------
        verb, kind : "Get" or "Set"; "Real", "Integer" or "Boolean", as they lie in memory
        variables : sequence of Variable
        address : of the values, doubles or ints, in the order of the variables
        """
        return self.function(f"{verb}{kind}")


class CallsFmi3(Calls):
    """Those of FMI 3.0, stepped without event mode and without early return."""

    _handle: HandleFmi3

    def __init__(self, handle: HandleFmi3, inside: bool, say: Say) -> None:
        super().__init__(handle, inside)
        self._say = say

    def function(self, name: str) -> Status:
        return self._step() if name == "DoStep" else super().function(_STATE.get(name, name))

    def transfer(self, verb: str, kind: str, variables: Sequence[Variable], address: int) -> Status:
        """Return what gets or sets the variables of a kind, each by the function of its type.

        Parameters
        ----------
        verb : "Get" or "Set"
        kind : "Real", "Integer", "Boolean"
        variables : in the order of their values
        address : of the memory of these
        """
        types = dict(self._handle.by_type(kind, [v.reference for v in variables]))
        if kind != "Boolean" and list(types) == [NATURAL[kind]]:  # as the kind lies in memory
            function = self.function(verb + NATURAL[kind])
            return lambda c, references, n, values: function(c, references, n, values, n)
        memory = (TYPES[kind] * len(variables)).from_address(address)
        calls = [
            self._one_type(verb, name, places, variables, memory) for name, places in types.items()
        ]
        return lambda c, references, n, values: max(call(c) for call in calls)

    def _one_type(
        self, verb: str, name: str, places: Sequence[int], variables: Sequence[Variable],
        memory: Any,
    ) -> Status:  # fmt: skip
        """Return a function that passes on values of one type, by way of memory of that type."""
        function = self.function(verb + name)
        count = ctypes.c_size_t(len(places))
        references = (ctypes.c_uint * len(places))(*(variables[i].reference for i in places))
        own = (TYPES_FMI3[name] * len(places))()
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
        function = super().function("DoStep")
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


_SHARED_PYTHON = (
    "It runs Python code and needs the symbols of libpython. Use a Python that offers them to "
    "shared libraries (built with --enable-shared, as those of Linux distributions and conda "
    "are), or start it with LD_PRELOAD=.../libpython{0}.{1}.so.1.0."
)


@dataclass(frozen=True)
class Message:
    """One line that an FMU sent to its logger."""

    component: str
    status: str
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
        self._key = next(_keys)
        self._need_binary(folder)
        _LISTENERS[self._key] = self
        # A KeyboardInterrupt in an FMU written in Python would be told as that FMU's failure.
        with Interrupt() as interrupt, binary.LOCK:
            try:
                self._handle = self._made(folder)
            except FmuError:
                _LISTENERS.pop(self._key)
                raise
        inside = (folder / _SLAVE_MODULE).is_file()
        self.calls = (
            CallsFmi3(self._handle, inside, self.say)
            if isinstance(self._handle, HandleFmi3)
            else Calls(self._handle, inside)
        )
        if interrupt.asked:
            self.close()
            raise KeyboardInterrupt

    @property
    def component(self) -> int:
        """The address of the FMU's instance."""
        return self._handle.handle

    def initialise(self, parameters: Mapping[str, Value], stop: float) -> None:
        """Set parameters and inputs, and enter initialisation mode at t = 0."""
        self._call(self._handle.setup, 0.0, stop)
        self.set(parameters)
        self._call(self._handle.enter)

    def finish_initialisation(self) -> None:
        """Leave initialisation mode."""
        self._refused.clear()
        self._call(self._handle.leave)
        self._initialised = True
        self._last.clear()

    def set(self, values: Mapping[str, Value]) -> None:
        """Set variables by name, one call per kind."""
        for kind, names in _by_call(self.description, values).items():
            given: list[Value] = [values[name] for name in names]
            if kind == "Real":
                given = [float(value) for value in given]
            else:
                self._refuse_large(names, given)
            self._call(self._handle.set, kind, self._references(names), given)

    def get(self, names: Iterable[str]) -> dict[str, Value]:
        """Return variables by name, one call per kind."""
        found: dict[str, Value] = {}
        for kind, group in _by_call(self.description, names).items():
            _, values = self._call(self._handle.get, kind, self._references(group))
            found |= zip(group, values, strict=True)
        return found

    def passing(self, verb: str, names: Sequence[str], memory: NDArray[np.float64]) -> Pass:
        """Return a call, prepared, that sets Real variables from an array (n,), or gets them.

        Parameters
        ----------
        verb : "Set" or "Get"
        names : of the variables
        memory : their values, in the FMU's units
        """
        if not names:
            return lambda: None
        variables = [self.description.variables[name] for name in names]
        address = ctypes.c_void_p(memory.ctypes.data)
        function = self.calls.transfer(verb, "Real", variables, memory.ctypes.data)
        references = (ctypes.c_uint * len(names))(*self._references(names))
        component, count = ctypes.c_void_p(self.component), ctypes.c_size_t(len(names))

        def call() -> None:
            if (status := function(component, references, count, address)) > WARNING:
                self.fail(f"{verb}Real", status)

        return call

    def step(self, time: float, step: float) -> None:
        """Step from a time [s] over a step [s]."""
        self._call(self._handle.step, time, step)

    def close(self) -> None:
        """Terminate and free the instance; one that answered Fatal must not be called again."""
        if not self.poisoned:
            try:
                if self._initialised:
                    self._call(self._handle.terminate)
                self._handle.free()
                self._handle.library.close()
            except RunError as error:
                self.say("Warning", str(error))
        _LISTENERS.pop(self._key, None)

    def say(self, status: str, text: str) -> None:
        """Pass on a message, as if the FMU had sent it."""
        self._last.append(text)
        if status in STATUS[DISCARD:] and not self._initialised:
            self._refused.append(text)
        self._listen(Message(self.name, status, text))

    def said(self) -> str:
        """Return the FMU's last messages as lines for an error's text."""
        texts = dict.fromkeys(map(in_one_line, self._last or self._refused[-3:]))
        return "".join(f"\n  It said: {text}" for text in texts)

    def fail(self, function: str, status: int) -> NoReturn:
        """Raise RunError for a call that did not answer OK or Warning."""
        self.poisoned |= status == FATAL
        raise RunError(f"{self._where()}: {function} answered {answer_of(status)}.{self.said()}")

    def _call(self, method: Callable[..., Any], *arguments: Any) -> Any:
        self._last.clear()
        answer = method(*arguments)
        status = answer[0] if isinstance(answer, tuple) else answer
        if status > WARNING:
            self.fail(self._handle.library.called, status)
        return answer

    def _references(self, names: Iterable[str]) -> list[int]:
        return [self.description.variables[name].reference for name in names]

    def _refuse_large(self, names: Sequence[str], values: Sequence[Value]) -> None:
        """Refuse a whole number that its type in FMI 3.0 would cut off: C does so silently."""
        for name, value in zip(names, values, strict=True):
            type_ = self.description.variables[name].type
            memory = TYPES_FMI3.get(type_)
            if memory and isinstance(value, int) and memory(value).value != value:
                self.say("Error", f"{name} = {value} does not fit into {type_}.")
                self.fail(f"fmi3Set{type_}", ERROR)

    def _made(self, folder: Path) -> Handle:
        """Return a new instance of the library, loaded."""
        about = self.description
        if (folder / _SLAVE_MODULE).is_file():
            reset_at_exit()
        try:
            library = FmuLibrary(
                folder / library_member(about.identifier, about.version),
                about.version,
                _on_message,
                types={v.reference: v.type for v in about.variables.values()},
                proxy=logger_proxy(),
            )
        except OSError as error:
            cure = ""
            if "_Py" in str(error) or "libpython" in str(error):
                cure = "\n  " + _SHARED_PYTHON.format(*sys.version_info)
            raise FmuError(f"{self._where()}: {error}{cure}") from error
        if missing := library.missing()[0]:
            raise FmuError(f"{self._where()}: its library lacks {listed(missing, 3)}.")
        made = library.instantiate(
            self.name, about.guid, resources_of(folder, about.version), logging=True,
            environment=self._key,
        )  # fmt: skip
        if made is None:
            raise FmuError(f"{self._where()}: cannot be instantiated.{self.said()}")
        return made

    def _need_binary(self, folder: Path) -> None:
        version = self.description.version
        if not (folder / library_member(self.description.identifier, version)).is_file():
            has = sorted(entry.name for entry in (folder / "binaries").glob("*")) or ["none"]
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


def _on_message(
    environment: int | None,
    name: bytes | None,
    status: int,
    _category: bytes | None,
    text: bytes | None,
) -> None:
    said_by = (name or b"").decode("utf-8", "replace")
    named = [one for one in _LISTENERS.values() if one.name == said_by]  # many pass no environment
    instance = _LISTENERS.get(environment or 0, named[-1] if named else None)
    line = (text or b"").decode("utf-8", "replace")
    if instance is None:  # an FMU that another part of this process has loaded through fmpy
        print(f"[{answer_of(status)}] {line}")
    else:
        instance.say(answer_of(status), line)
