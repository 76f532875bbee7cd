"""The C functions of an FMU's library: one class per version of FMI, both with the same methods.

The master prepares its calls once, by names without a version ("DoStep", "GetFMUstate") and by
`transfer` for values. `Fmi2` hands out the library's own functions; `Fmi3` hands out functions of
the same arguments where the library's differ.
"""

from __future__ import annotations

import ctypes
import os
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from fmpy import fmi2, fmi3
from fmpy.fmi1 import FMICallException

from ..fmu.binary import reset_at_exit
from ..fmu.description import Description, Value, Variable

DISCARD, ERROR = 2, 3

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
        names = ("OK", "Warning", "Discard", "Error", "Fatal")
        name = names[status] if 0 <= status < len(names) else f"status {status}"
        self._say(name, (message or b"").decode("utf-8", "replace"))


Binding = Fmi2


def _by_type(variables: Sequence[Variable]) -> dict[str, list[int]]:
    """Return the places of the variables of each type; an enumeration is a long integer."""
    found: dict[str, list[int]] = {}
    for i, variable in enumerate(variables):
        name = "Int64" if variable.type == "Enumeration" else variable.type
        found.setdefault(name, []).append(i)
    return found
