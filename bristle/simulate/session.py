"""FMUs as loaded instances: unpacked, instantiated, initialised, with their messages collected."""

from __future__ import annotations

import ctypes
import itertools
import os
import sys
import tempfile
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, NoReturn, Self

from fmpy import fmi2
from fmpy.fmi1 import FMICallException

from ..errors import FmuError, RunError
from ..fmu import modules
from ..fmu.archive import extract, library_member, platform_folder
from ..fmu.description import Description, Value, Variable
from ..interrupt import Interrupt
from . import binding

STATUS = ("OK", "Warning", "Discard", "Error", "Fatal", "Pending")
WARNING, DISCARD, FATAL = 1, 2, 4

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
    category: str
    text: str


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

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
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
        with modules.LOCK:
            sys.path[:] = [entry for entry in sys.path if not entry.startswith(inside)]
            modules.forget(lambda _, one: _file_of(one).startswith(inside))
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
        with Interrupt() as interrupt, modules.LOCK:
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
        answer = STATUS[status] if 0 <= status < len(STATUS) else f"status {status}"
        raise RunError(f"{self._where()}: {function} answered {answer}.{self.said()}")

    def _call(self, method: Callable[..., Any], *arguments: Any) -> Any:
        self._last.clear()
        try:
            return method(*arguments)
        except FMICallException as error:
            self.fail(error.function, error.status)

    def _variables(self, names: Iterable[str]) -> list[Variable]:
        return [self.description.variables[name] for name in names]

    def _load(self, folder: Path) -> binding.Binding:
        self._need_binary(folder)
        try:
            return binding.load(
                self.description, folder, self.name, _callbacks(self._key), self.say
            )
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
    answer = STATUS[status] if 0 <= status < len(STATUS) else f"status {status}"
    decoded = ((part or b"").decode("utf-8", "replace") for part in (text, category))
    instance.say(answer, *decoded)


_LOGGER = fmi2.fmi2CallbackLoggerTYPE(_on_message)
