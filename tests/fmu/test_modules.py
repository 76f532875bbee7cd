"""Modules of FMUs: who removes some waits for who imports some, and removes no others."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Event
from types import ModuleType

import bristle
from bristle.fmu import binary


def test_who_removes_modules_waits_for_who_imports(monkeypatch) -> None:
    for name in ("of_an_fmu", "of_another"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    begun = Event()

    def leave() -> None:
        begun.set()
        binary.forget(lambda name, _: name == "of_an_fmu")

    with ThreadPoolExecutor(1) as pool:
        with binary.LOCK:
            left = pool.submit(leave)
            begun.wait()
            assert "of_an_fmu" in sys.modules
        left.result()
    assert "of_an_fmu" not in sys.modules
    assert "of_another" in sys.modules


def test_threads_run_fmus_of_one_name_side_by_side() -> None:
    def peak(k: int) -> float:
        frame = bristle.run("bench_sine_bingham", {"run.stop": 0.02, "damper.f_c": float(k)})
        return float(frame["damper.force"].abs().max())

    with ThreadPoolExecutor(3) as pool:
        peaks = list(pool.map(peak, [1, 2, 3] * 2))
    assert peaks == peaks[:3] * 2
    assert peaks[0] < peaks[1] < peaks[2]
