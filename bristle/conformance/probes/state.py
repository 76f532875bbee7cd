"""The whole state of an FMU: copied, set back, turned into bytes, freed."""

from __future__ import annotations

import os
from ctypes import c_void_p
from pathlib import Path

from ...core.finding import Finding
from ...fmu.library import UnexpectedError
from ..bench import Bench, good
from ..probe import Probe, failed, noted, passed, unless_claimed, unless_single

_COPY, _BYTES = "canGetAndSetFMUstate", "canSerializeFMUstate"


@Probe(
    "state replay",
    tried="fmi2GetFMUstate in mid-run, on to the end, fmi2SetFMUstate, on to the end; twice, and "
    "once after the same copy was overwritten at another time",
    standard=f"FMI 2.0 section 2.1.8, with {_COPY}: the copy contains everything, so continuing "
    "from it gives the same results",
    unless=unless_claimed(_COPY),
)
def state_replay(bench: Bench) -> Finding:
    """Replay the second half of a run from a copy of the state."""
    half, steps = bench.plan.steps // 2, bench.plan.steps
    instance = bench.ready()
    bench.run(instance, 0, half)
    state = c_void_p()
    good(instance.save(state), "GetFMUstate")
    here = bench.read(instance)
    wanted = bench.run(instance, half, steps)
    for attempt in ("first", "second"):
        good(instance.restore(state), "SetFMUstate")
        bench.same([bench.read(instance)], [here], "right after fmi2SetFMUstate ", half)
        bench.same(bench.run(instance, half, steps), wanted, f"{attempt} replay: ", half + 1)
    good(instance.restore(state), "SetFMUstate")
    bench.run(instance, half, half + 1)
    good(instance.save(state), "GetFMUstate into the same copy")
    bench.run(instance, half + 1, steps)
    good(instance.restore(state), "SetFMUstate")
    where = "after fmi2GetFMUstate into the same copy "
    bench.same(bench.run(instance, half + 1, steps), wanted[1:], where, half + 2)
    good(instance.forget(state), "FreeFMUstate")
    return passed(f"{steps - half} steps replayed {bench.equal}, three times")


@Probe(
    "state across reset",
    tried="a copy set back after fmi2Reset and initialisation of the same instance",
    standard=f"FMI 2.0 section 2.1.8, with {_COPY}: the copy is set back as the actual state",
    unless=unless_claimed(_COPY),
)
def state_across_reset(bench: Bench) -> Finding:
    """Set a copy back into an instance that was reset in between."""
    half, steps = bench.plan.steps // 2, bench.plan.steps
    instance = bench.ready()
    bench.run(instance, 0, half)
    state = c_void_p()
    good(instance.save(state), "GetFMUstate")
    wanted = bench.run(instance, half, steps)
    good(instance.reset(), "Reset")
    bench.ready(instance)
    good(instance.restore(state), "SetFMUstate after a reset")
    rows = bench.run(instance, half, steps)
    good(instance.forget(state), "FreeFMUstate")
    bench.same(rows, wanted, first=half + 1)
    return passed(f"replayed {bench.equal}")


@Probe(
    "freeing states",
    tried="30 copies made and freed in mid-run; fmi2FreeFMUstate of a null pointer",
    standard="FMI 2.0 section 2.1.8: memory is given back; a null pointer is ignored",
    unless=unless_claimed(_COPY),
)
def freeing_states(bench: Bench) -> Finding:
    """Make and free copies, and see that the run goes on as if there were none."""
    instance = bench.ready()
    rows = [bench.read(instance)]
    for k in range(bench.plan.steps):
        state = c_void_p()
        if k < 30:
            good(instance.save(state), "GetFMUstate")
        rows += bench.run(instance, k, k + 1)
        if k < 30:
            good(instance.forget(state), "FreeFMUstate")
    good(instance.forget(c_void_p()), "FreeFMUstate of a null pointer")
    if bench.plan.repeatable:
        bench.same(rows, bench.reference(), "making copies changes the run: ")
    return passed("freed; the run does not notice")


def _serialised(bench: Bench) -> tuple[bytes, list[list[float | int | bool | str]]]:
    half = bench.plan.steps // 2
    instance = bench.ready()
    bench.run(instance, 0, half)
    state = c_void_p()
    good(instance.save(state), "GetFMUstate")
    status, data = instance.serialise(state)
    good(status, "SerializeFMUstate")
    if not data:
        raise UnexpectedError("fmi2SerializedFMUstateSize answered 0 bytes")
    again = instance.serialise(state)[1]
    if again != data:
        raise UnexpectedError("serialising one copy twice gives different bytes")
    good(instance.forget(state), "FreeFMUstate")
    wanted = bench.run(instance, half)
    instance.free()
    return data, wanted


def _revived(bench: Bench, data: bytes, wanted: list[list[float | int | bool | str]]) -> str:
    """Return how a fresh instance differs that goes on from bytes."""
    half = bench.plan.steps // 2
    instance = bench.ready()
    state = c_void_p()
    good(instance.deserialise(data, state), "DeSerializeFMUstate")
    good(instance.restore(state), "SetFMUstate")
    good(instance.forget(state), "FreeFMUstate")
    return bench.differs(bench.run(instance, half), wanted, half + 1)


@Probe(
    "serialised state",
    tried="the state as bytes, brought to life in a fresh instance",
    standard=f"FMI 2.0 section 2.1.8, with {_BYTES}: bytes become a state again, equal to the "
    "state they were made from",
    unless=lambda plan: unless_claimed(_BYTES)(plan) or unless_single(plan),
)
def serialised_state(bench: Bench) -> Finding:
    """Serialise in mid-run, go on in another instance."""
    data, wanted = _serialised(bench)
    if difference := _revived(bench, data, wanted):
        return failed(difference)
    return passed(f"{len(data)} bytes; a fresh instance continues {bench.equal}")


@Probe(
    "state across processes",
    tried="the state as bytes from the run of another process",
    standard=f"FMI 2.0 section 2.1.8, with {_BYTES}: the bytes can be kept, and read when the FMU "
    "is instantiated again",
    unless=unless_claimed(_BYTES),
)
def state_across_processes(bench: Bench) -> Finding:
    """Write bytes in a process of their own, and read them in this one."""
    if not hasattr(os, "fork"):
        return noted("not tried: this platform cannot fork a process")
    file = Path(bench.plan.work) / "state.bin"
    child = os.fork()
    if child == 0:
        code = 1
        try:
            file.write_bytes(_serialised(bench)[0])
            code = 0
        finally:
            os._exit(code)
    if os.waitpid(child, 0)[1] != 0:
        return failed("the state cannot be serialised (see the row above)")
    rows = bench.reference()[bench.plan.steps // 2 + 1 :]
    if difference := _revived(bench, file.read_bytes(), rows):
        if bench.plan.repeatable:
            return failed(difference)
        return noted(f"not judged, since no two runs are equal: {difference}")
    return passed(f"a fresh process continues {bench.equal}")
