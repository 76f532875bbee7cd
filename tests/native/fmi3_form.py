"""Native FMUs of FMI 3.0, driven through the functions of their library."""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path
from typing import Any

from both_forms import folder
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave

from bristle.fmu.archive import extract
from bristle.fmu.build import plan
from bristle.fmu.description import read_description
from bristle.native.build import build
from bristle.native.zig import here

LIGHT = "ClippedOptimal"
WARNING, ERROR = 1, 3


@cache
def built(component: str, offers: tuple[str, ...] | None = None) -> Path:
    """Return a built-in component's FMU of FMI 3.0 for this machine, with some effects or all."""
    where = folder() / ("fmi3" if offers is None else "fmi3_offers")
    return build(plan(component, offers=offers), where, [here()], fmi=3)


def unpacked(component: str, offers: tuple[str, ...] | None = None) -> Path:
    path = built(component, offers)
    where = folder() / f"{component}_{path.parent.name}_unpacked"
    return where if where.exists() else extract(path, where)  # a library in use is not replaced


class Three:
    """An instance of an FMU of FMI 3.0; `said` holds (status, category, text) of its messages."""

    def __init__(
        self, component: str, kind: Any = FMU3Slave, token: str = "",
        offers: tuple[str, ...] | None = None, **how: Any,
    ) -> None:  # fmt: skip
        self.about = read_description(built(component, offers))
        self.said: list[tuple[int, str, str]] = []
        self.slave = kind(
            guid=token or self.about.guid, modelIdentifier=self.about.identifier,
            unzipDirectory=str(unpacked(component, offers)), instanceName="one",
        )  # fmt: skip
        self.slave.instantiate(loggingOn=True, logMessage=self._log, **how)

    def _log(self, _: Any, status: int, category: bytes, text: bytes) -> None:
        self.said.append((status, category.decode(), text.decode()))

    def status(self, name: str, *arguments: Any) -> int:
        """Return what a function of the library answers; the instance is its first argument."""
        try:
            found: int = getattr(self.slave, f"fmi3{name}")(self.slave.component, *arguments)
        except FMICallException as error:
            return int(error.status)
        return found

    def set(self, name: str, value: Any) -> int:
        variable = self.about.variables[name]
        types = {"Float64": ctypes.c_double, "Int32": ctypes.c_int32, "Boolean": ctypes.c_bool}
        given = value.encode() if isinstance(value, str) else value
        at = (types.get(variable.type, ctypes.c_char_p) * 1)(given)
        reference = (ctypes.c_uint32 * 1)(variable.reference)
        return self.status(f"Set{variable.type}", reference, 1, at, 1)

    def get(self, *names: str) -> list[Any]:
        found = []
        for name in names:
            variable = self.about.variables[name]
            found += getattr(self.slave, f"get{variable.type}")([variable.reference])
        return found

    def shown(self) -> list[Any]:
        return self.get(*[v.name for v in self.about.of("output")])

    def begin(self, start: float = 0.0) -> None:
        self.slave.enterInitializationMode(startTime=start)
        self.slave.exitInitializationMode()

    def step(self, time: float, length: float) -> int:
        event, end, early = (ctypes.c_bool(True) for _ in range(3))
        self.last = ctypes.c_double()
        answers = [ctypes.byref(one) for one in (event, end, early, self.last)]
        status = self.status("DoStep", time, length, True, *answers)
        assert not any(one.value for one in (event, end, early))
        return status

    def end(self) -> None:
        self.slave.freeInstance()
