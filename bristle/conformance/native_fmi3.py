"""The FMI 3.0 functions of a shared library, called bare, under the names of `native`.

Instances are stepped without event mode, intermediate update and early return, as an importer may
choose for any FMU. Runs in the child process: standard library only.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from ctypes import byref, c_bool, c_char_p, c_double, c_int32, c_size_t, c_uint32, c_void_p
from ctypes import create_string_buffer as buffer_of
from pathlib import Path

from ..fmu.description import Value
from .native import DISCARD, OK, WARNING, BlackBox, Instance, Library
from .registry import UnexpectedError
from .signatures_fmi3 import LOGGER, NATURAL, OPTIONAL, REQUIRED, RESULTS, TYPES


class LibraryFmi3(Library):
    """A loaded FMU library of FMI 3.0; `types` says of value references which type they have."""

    prefix = "fmi3"
    required, optional, results = REQUIRED, OPTIONAL, RESULTS

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
    """One instance of FMI 3.0. Every method returns the status that the FMU answered."""

    library: LibraryFmi3

    def __init__(self, library: LibraryFmi3, handle: int) -> None:
        super().__init__(library, handle)
        self._start = 0.0
        self._stop: float | None = None
        self._ended = False

    def setup(self, start: float, stop: float | None) -> int:
        """Keep start and stop [s] until initialisation mode is entered, which tells them."""
        self._start, self._stop = start, stop
        return OK

    def enter(self) -> int:
        """Call fmi3EnterInitializationMode with the times of `setup`."""
        stop = self._stop
        told = False, 0.0, self._start, stop is not None, stop or 0.0
        return self._do("fmi3EnterInitializationMode", *told)

    def step(self, time_: float, step: float) -> int:
        """Call fmi3DoStep (s); Discard if the FMU asks to end the run, which is its word for it."""
        event, end, early = c_bool(), c_bool(), c_bool()
        last = c_double()
        answers = (byref(one) for one in (event, end, early, last))
        status = self._do("fmi3DoStep", time_, step, True, *answers)
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
            some = (c_uint32 * count)(*(references[i] for i in places))
            values = (TYPES[name] * count)()
            status = self._do(f"fmi3Get{name}", some, count, values, count)
            worst = max(worst, status)
            for i, value in zip(places, values, strict=True):
                text = name == "String"
                found[i] = (value or b"").decode("utf-8", "replace") if text else value
        return worst, list(found.values())

    def set(self, kind: str, references: Sequence[int], values: Sequence[Value]) -> int:
        """Set variables of one kind, whatever their types; return the worst status."""
        worst = OK
        for name, places in self._by_type(kind, references):
            count = len(places)
            some = (c_uint32 * count)(*(references[i] for i in places))
            raw = [values[i] for i in places]
            array = (TYPES[name] * count)(*(v.encode() if isinstance(v, str) else v for v in raw))
            worst = max(worst, self._do(f"fmi3Set{name}", some, count, array, count))
        return worst

    def save(self, state: c_void_p) -> int:
        """Call fmi3GetFMUState into `state`."""
        return self._do("fmi3GetFMUState", byref(state))

    def restore(self, state: c_void_p) -> int:
        """Call fmi3SetFMUState."""
        return self._do("fmi3SetFMUState", state)

    def forget(self, state: c_void_p) -> int:
        """Call fmi3FreeFMUState."""
        return self._do("fmi3FreeFMUState", byref(state))

    def serialise(self, state: c_void_p) -> tuple[int, bytes]:
        """Return the status and the bytes of a saved state."""
        size = c_size_t(0)
        status = self._do("fmi3SerializedFMUStateSize", state, byref(size))
        if status not in (OK, WARNING):
            return status, b""
        buffer = buffer_of(size.value)
        return self._do("fmi3SerializeFMUState", state, buffer, size.value), buffer.raw

    def deserialise(self, data: bytes, state: c_void_p) -> int:
        """Call fmi3DeserializeFMUState into `state`."""
        return self._do("fmi3DeserializeFMUState", data, len(data), byref(state))

    def debug_logging(self, on: bool, categories: Sequence[str] = ()) -> int:
        """Call fmi3SetDebugLogging."""
        names = (c_char_p * len(categories))(*(c.encode() for c in categories))
        return self._do("fmi3SetDebugLogging", on, len(categories), names)

    def derivatives(
        self, unknowns: Sequence[int], knowns: Sequence[int]
    ) -> tuple[int, list[float]]:
        """Return the status and the directional derivative along the sum of all knowns."""
        n, m = len(unknowns), len(knowns)
        result = (c_double * n)()
        status = self._do(
            "fmi3GetDirectionalDerivative", (c_uint32 * n)(*unknowns), n, (c_uint32 * m)(*knowns),
            m, (c_double * m)(*[1.0] * m), m, result, n,
        )  # fmt: skip
        return status, list(result)

    def output_derivative(self, reference: int) -> tuple[int, float]:
        """Return the status and the first derivative of one output."""
        value, one = (c_double * 1)(), (c_uint32 * 1)(reference)
        status = self._do("fmi3GetOutputDerivatives", one, 1, (c_int32 * 1)(1), value, 1)
        return status, value[0]
