"""FMUs stepped by hand through fmpy, by the names of their variables; needs no part of bristle."""

from __future__ import annotations

import atexit
import ctypes
import hashlib
import os
import shutil
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import fmpy
from fmpy import fmi2
from fmpy.fmi1 import FMICallException

OK, WARNING, DISCARD, ERROR, FATAL = range(5)
MESSAGES: list[tuple[str, int, str]] = []
"""Instance, status and text of every message of every FMU in this process."""


def _listen(_environment: Any, name: bytes, status: int, _category: Any, text: bytes) -> None:
    MESSAGES.append((name.decode(), status, text.decode("utf-8", "replace")))


_LOGGER = fmi2.fmi2CallbackLoggerTYPE(_listen)
_CALLBACKS = fmi2.fmi2CallbackFunctions()
_CALLBACKS.logger = _LOGGER
_CALLBACKS.allocateMemory = fmi2.defaultCallbacks.allocateMemory
_CALLBACKS.freeMemory = fmi2.defaultCallbacks.freeMemory
fmi2.addLoggerProxy(ctypes.byref(_CALLBACKS))


if "BRISTLE_TEST_UNPACKED" not in os.environ:
    _OWN = os.environ["BRISTLE_TEST_UNPACKED"] = tempfile.mkdtemp()
    atexit.register(shutil.rmtree, _OWN, ignore_errors=True)


def unpacked(path: str | Path) -> Path:
    """Return the folder of an FMU's files: unpacked once, as hosts do it, for all instances."""
    root = Path(os.environ["BRISTLE_TEST_UNPACKED"])
    folder = root / hashlib.sha256(Path(path).read_bytes()).hexdigest()
    if not folder.is_dir():
        own = tempfile.mkdtemp(dir=root)
        fmpy.extract(str(path), own)
        try:
            Path(own).rename(folder)
        except OSError:  # another process was first
            shutil.rmtree(own)
    return folder


class Fmu:
    """One instance of an FMU, by the names of its variables. Calls answer their status."""

    def __init__(self, path: str | Path, name: str = "one") -> None:
        self.name = name
        self.folder = unpacked(path)
        self.description = fmpy.read_model_description(str(self.folder))
        self.variables = {v.name: v for v in self.description.modelVariables}
        assert self.description.coSimulation is not None
        self.slave = fmi2.FMU2Slave(
            guid=self.description.guid,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            unzipDirectory=str(self.folder),
            instanceName=name,
        )
        self.slave.instantiate(callbacks=_CALLBACKS, loggingOn=True)
        self.time = 0.0

    def __enter__(self) -> Fmu:
        return self

    def __exit__(self, *_: object) -> None:
        self.slave.freeInstance()

    @property
    def said(self) -> list[str]:
        """The texts of this instance's messages so far."""
        return [text for name, _, text in MESSAGES if name == self.name]

    def names(self, causality: str, kind: str | None = None) -> list[str]:
        """Return the names of the variables of a causality, and of a type where one is given."""
        return [
            name
            for name, v in self.variables.items()
            if v.causality == causality and kind in (None, v.type)
        ]

    def call(self, method: str, *arguments: Any, **named: Any) -> int:
        """Call a method of fmpy's slave; return the status."""
        try:
            getattr(self.slave, method)(*arguments, **named)
        except FMICallException as error:
            return int(error.status)
        return OK

    def set(self, values: Mapping[str, Any] | None = None, **more: Any) -> int:
        worst = OK
        for name, value in {**(values or {}), **more}.items():
            variable = self.variables[name]
            worst = max(worst, self.call(f"set{variable.type}", [variable.valueReference], [value]))
        return worst

    def get(self, name: str) -> Any:
        variable = self.variables[name]
        value = getattr(self.slave, f"get{variable.type}")([variable.valueReference])[0]
        return value.decode() if isinstance(value, bytes) else value

    def outputs(self) -> dict[str, Any]:
        return {name: self.get(name) for name in self.names("output")}

    def begin(self, values: Mapping[str, Any] | None = None, start: float = 0.0) -> Fmu:
        """Set values and go through initialisation."""
        self.time = start
        assert self.call("setupExperiment", startTime=start) == OK
        assert self.set(values) == OK
        assert self.call("enterInitializationMode") == OK
        assert self.call("exitInitializationMode") == OK
        return self

    def step(self, h: float, time: float | None = None) -> int:
        begin = self.time if time is None else time
        status = self.call("doStep", begin, h)
        if status == OK:
            self.time = begin + h
        return status

    def reset(self) -> int:
        return self.call("reset")

    def save(self) -> bytes:
        """Return the whole state, serialised."""
        state = self.slave.getFMUState()
        saved: bytes = self.slave.serializeFMUState(state)
        self.slave.freeFMUState(state)
        return saved

    def restore(self, saved: bytes, time: float) -> int:
        """Set a serialised state."""
        state = self.slave.deserializeFMUState(saved)
        status = self.call("setFMUState", state)
        self.slave.freeFMUState(state)
        self.time = time
        return status


Port = tuple[str, str]


class Loop:
    """FMUs in a plain master loop: Jacobi, or Gauss-Seidel in the order of the dictionary.

    Parameters
    ----------
    fmus : mapping of name to Fmu
    connections : mapping
        "target.input" to "source.output".
    """

    def __init__(self, fmus: Mapping[str, Fmu], connections: Mapping[str, str]) -> None:
        self.fmus = dict(fmus)
        self.connections = {
            tuple(target.split(".", 1)): tuple(source.split(".", 1))
            for target, source in connections.items()
        }

    def begin(self, parameters: Mapping[str, Mapping[str, Any]]) -> None:
        for name, fmu in self.fmus.items():
            assert fmu.call("setupExperiment", startTime=0.0) == OK
            assert fmu.set(parameters.get(name)) == OK
            assert fmu.call("enterInitializationMode") == OK
        for _ in self.fmus:
            self.pass_on(self.fmus)
        for fmu in self.fmus.values():
            assert fmu.call("exitInitializationMode") == OK
        for _ in self.fmus:
            self.pass_on(self.fmus)

    def pass_on(self, targets: Iterable[str]) -> None:
        """Read all outputs that feed these components, then set their inputs."""
        taken = {
            target: self.fmus[source[0]].get(source[1])
            for target, source in self.connections.items()
            if target[0] in targets
        }
        for (name, port), value in taken.items():
            assert self.fmus[name].set({port: value}) == OK

    def run(
        self, steps: int, h: float, watch: Iterable[str], algorithm: str, early: bool = False
    ) -> list[list[float]]:
        """Return rows of the watched "component.output" at t = 0, h, 2 h ...

        With Jacobi the values are those after all inputs of t_k were set, or, `early`, those right
        after the step, as hosts show them that read once.
        """
        watched = [tuple(port.split(".", 1)) for port in watch]

        def row() -> list[float]:
            return [self.fmus[name].get(port) for name, port in watched]

        rows = [row()]
        for k in range(steps):
            for name, fmu in self.fmus.items():
                if algorithm == "gauss-seidel":
                    self.pass_on([name])
                assert fmu.step(h, k * h) == OK, (name, k * h, fmu.said)
            seen = row()
            if algorithm == "jacobi":
                self.pass_on(self.fmus)
            rows.append(seen if early else row())
        return rows
