"""What is asked of every effect and law: rest, energy, bounds, and the compiled path.

`python -m bristle.user_code.conformance effect FILE` prints it as JSON: `bristle check` runs it in
a process of its own, under a limit.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cache
from itertools import product
from math import cos, inf, isclose, isfinite, pi, sin
from pathlib import Path
from typing import Any

import numpy as np

from ..component.structure import StructureModel
from ..core.arrays import Array
from ..core.files import cache_folder
from ..physics.building import Building, paper_building
from ..physics.damper import DamperModel, room, step
from ..physics.effect import Effect, Q, effects_of, laws_joined
from ..physics.generate import Slots, with_globals
from ..physics.law import Law
from ..physics.signals import instrument
from ..physics.tuples import Inputs
from ..user_code import load
from .reading import FlawError
from .trial import CYCLES, cycle, ends


def usable(effects: Iterable[load.Loaded]) -> list[load.Loaded]:
    """Return the same, with those left out, and unregistered, that numba cannot compile.

    All laws and effects of a site are compiled into one function, so a bad one would take the
    others along. What has passed is remembered in the cache by its digest.
    """
    out = []
    for loaded in effects:
        flaw = refused(loaded.made) if loaded.made is not None else None
        if flaw is not None:
            message = f"{loaded.path}, line {flaw[0]}: {flaw[1]}"
            load.leave_out(loaded.made, message)
            loaded = load.Loaded(loaded.path, None, message)
        out.append(loaded)
    return out


def refused(made: type[Effect] | type[Law]) -> tuple[int, str] | None:
    """Return line and reason why a hook of an effect or law cannot be compiled, None if all can."""
    from ..core.jit import compiled, digest

    q, p = _given(made)
    z = made.State(*(0.01 for _ in made.states))
    for hook, function in made.hooks().items():
        shape = f"{len(made.states)}_{len(made.parameters)}"
        mark = cache_folder() / "numba" / "passed" / f"{digest(function)}_{shape}"
        if mark.is_file():
            continue
        line, plain = function.__code__.co_firstlineno + 1, function(q, z, p)
        try:
            found = compiled(function, keep=False)(q, z, p)
        except Exception as error:  # numba's errors, and what hooks raise, have no base in common
            return line, f"{hook} cannot be compiled: {_reason(error)}"
        if not _same(found, plain):
            return line, f"{hook} gives {found!r} compiled and {plain!r} in Python."
        with suppress(OSError):  # without a cache it is compiled again next time
            mark.parent.mkdir(parents=True, exist_ok=True)
            mark.touch()
    return None


def _given(made: type[Effect] | type[Law]) -> tuple[Any, Any]:
    """Return the q and p that a hook is tried with."""
    if issubclass(made, Law):
        return Inputs(0.01, 0.02, 0.03, 4.0, 0.05, 0.06, 0.0, False), made.at({}, 4.0)
    return Q(*(0.01 * (1 + k) for k in range(len(Q._fields)))), made.values_of({})


def _same(found: Any, plain: Any) -> bool:
    first = found if isinstance(found, tuple) else (found,)
    second = plain if isinstance(plain, tuple) else (plain,)
    return len(first) == len(second) and all(
        isclose(a, b, rel_tol=1e-12, abs_tol=1e-300) for a, b in zip(first, second, strict=True)
    )


def _reason(error: Exception) -> str:
    """Return the line of numba's long text that says what it is about."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    telling = [
        line for line in lines if not line.startswith(("Failed in", "File ", "During", "->"))
    ]
    return (telling[0] if telling else type(error).__name__)[:200]


def channel_history(signal: Any, dt: float, z: Any, p: Any, out: Any) -> None:
    """Fill `out` (n,) with what the instrument shows of a signal (n,) sampled every dt [s].

    Parameters
    ----------
    signal, out : (n,) in the channel's unit
    dt : sampling step [s]
    z : (states,) of the effect, moved on in place
    p : flat parameters of the effect [SI]
    """
    for k in range(len(signal)):
        out[k] = show(signal[k], dt, z, p)  # type: ignore[name-defined]  # noqa: F821


def shown(effect: type[Effect], values: dict[str, float], signal: Array, dt: float) -> Array:
    """Return what an instrument shows (n,) of a signal (n,) sampled every dt [s].

    Parameters
    ----------
    effect : Effect of the site "sensor"
    values : parameters of the effect by their own names ("gain"), in SI; missing ones default
    signal : (n,) in the channel's unit
    dt : sampling step [s]
    """
    history, slots = _history(effect)  # type: ignore[arg-type]  # a class can be hashed
    p, z = np.zeros(max(1, slots.p_size)), np.zeros(max(1, slots.z_size))
    for name, known in effect.parameters.items():
        p[slots.parameters[f"{effect.name}.{name}"]] = values.get(name, known.value)
    for state in effect.starts:
        z[slots.states[f"{effect.name}.{state}"]] = signal[0]
    out = np.empty(len(signal))
    history(np.ascontiguousarray(signal, dtype=np.float64), dt, z, p, out)
    return out


@cache
def _history(effect: type[Effect]) -> tuple[Callable[..., None], Slots]:
    """Return the compiled time loop of one effect's hooks over a signal."""
    from ..core.jit import compiled

    show, slots = instrument(effect)
    return compiled(with_globals(channel_history, {"show": show})), slots


STEP = 1e-3  # s


@dataclass(frozen=True)
class Check:
    """One thing asked of an effect, whether it holds, and what was found."""

    asked: str
    holds: bool
    found: str = ""


def examine(effect: type[Effect]) -> list[Check]:
    """Return what is asked of an effect that is registered, and whether it holds."""
    asked: list[Callable[[type[Effect]], Check]] = [_says, _compiles]
    for site in effect.sites:
        asked += _ASKED_AT[site]
    return [one(effect) for one in asked]


def _says(effect: type[Effect]) -> Check:
    return _texts(
        effect,
        "what happens",
        {
            'a docstring sentence "Leaves out ..."': "Leaves out" in (effect.__doc__ or ""),
            "a source with its year": _has_year(effect.source),
            "expect, what a residual looks like without it": len(effect.expect.split()) >= 5,
        },
    )


def _has_year(source: str) -> bool:
    return re.search(r"\b(1[89]|20)\d\d\b", source) is not None


def _texts(made: type[Effect] | type[Law], about: str, has: dict[str, bool]) -> Check:
    """Return whether a first line says `about`, and all else that users read is there."""
    line = made.first_line()
    has = {f'a first docstring line "Name: {about}."': ":" in line and line.endswith("."), **has}
    lacking = ", ".join(what for what, there in has.items() if not there)
    found = f"lacks {lacking}" if lacking else ""
    return Check("name, texts and source are complete", not lacking, found)


def _compiles(made: type[Effect] | type[Law]) -> Check:
    flaw = refused(made)
    return Check("compiled code gives the same numbers", flaw is None, flaw[1] if flaw else "")


def _corners(effect: type[Effect]) -> Iterator[dict[str, float]]:
    yield {}
    for name, parameter in effect.parameters.items():
        for bound in parameter.bounds:
            yield {f"{effect.name}.{name}": bound}


def _text(values: dict[str, float]) -> str:
    return ", ".join(f"{name} = {value:g}" for name, value in values.items()) or "defaults"


def _rests(effect: type[Effect]) -> Check:
    asked = "no force at rest" if effect.zero_at_rest else "a force at rest, as declared"
    most, at = 0.0, ""
    for law in laws_joined(effect):
        for values in _corners(effect):
            for V in (0.0, 4.0, 8.0):
                model = DamperModel(law, values, [effect.name])
                force = abs(model.force(0.0, 0.0, 0.0, V, inf, 0.0, 0.0, False))
                if force > most:
                    most, at = force, f"{force:.3g} N at {V:g} V, {law}, {_text(values)}"
    return Check(asked, (most == 0.0) == effect.zero_at_rest, at or "none at any bound")


def _cycle(
    law: str, effects: list[str], values: dict[str, float], amplitude: float, frequency: float,
    V: Callable[[float], float] | float,
) -> tuple[list[float], list[float]]:  # fmt: skip
    """Return velocities and forces of three cycles."""
    model = DamperModel(law, values, effects)
    voltage = V if callable(V) else lambda _t: V
    w, before = 2.0 * pi * frequency, 2.0 * pi * frequency * amplitude
    speeds, forces = [], []
    for k in range(1, round(3.0 / frequency / STEP) + 1):
        t = k * STEP
        x, v = amplitude * sin(w * t), amplitude * w * cos(w * t)
        forces.append(model.step(x, v, (v - before) / STEP, voltage(t), STEP, 0.0, 0.0, False))
        speeds.append(v)
        before = v
    return speeds, forces


def _matters(effect: type[Effect]) -> Check:
    best = 0.0
    # A stop may not be met by the smaller motion.
    for law, amplitude in product(laws_joined(effect), (0.01, 0.03)):
        rows = [
            np.array(_cycle(law, on, {}, amplitude, 2.0, lambda t: 4.0 + 3.0 * sin(9.0 * t))[1])
            for on in ([], [effect.name])
        ]
        change = float(np.sqrt(np.mean((rows[1] - rows[0]) ** 2) / np.mean(rows[0] ** 2)))
        best = max(best, change)
    text = f"{100.0 * best:.3g} % of the RMS of a damper of 10 N, at its defaults"
    return Check("it changes the force by more than 1 %", best > 0.01, text)


def _bounds(effect: type[Effect]) -> Check:
    for law in laws_joined(effect):
        for values in _corners(effect):
            forces = _cycle(law, [effect.name], values, 0.01, 3.0, 8.0)[1]
            if not all(isfinite(force) for force in forces):
                return Check("it can be simulated at every bound", False, f"{law}, {_text(values)}")
    return Check("it can be simulated at every bound", True)


def _energy(effect: type[Effect]) -> Check:
    asked = "a closed cycle gives no energy"
    if not effect.passive:
        return Check(asked, True, "not asked: passive = False")
    for law in laws_joined(effect):
        for amplitude, frequency, V in ((0.001, 5.0, 6.0), (0.015, 5.0, 0.0), (0.015, 1.0, 6.0)):
            for values in _corners(effect):
                cycle = _cycle(law, [effect.name], values, amplitude, frequency, V)
                last = round(1.0 / frequency / STEP)
                v, force = (np.array(one[-last:]) for one in cycle)
                work = float(STEP * np.sum(v * force))
                scale = amplitude * max(1e-9, float(np.abs(force).max()))
                if work < -1e-3 * scale:
                    where = f"{law}, {1e3 * amplitude:g} mm at {frequency:g} Hz, {V:g} V"
                    text = f"{work:.3g} J at {where}, {_text(values)}"
                    return Check(asked, False, text)
    return Check(asked, True)


_FORCES = {"N": 10.0, "N/m": 1e3, "N/m2": 1e5, "N/m3": 1e7, "N.s/m": 50.0}
"""Forces [SI, by unit] of effects that are no more than such a model of a building is made for."""


def _building_of(effect: type[Effect]) -> Building:
    """Return a building to simulate an effect in, as heavy as the forces of its own rig ask for."""
    building = paper_building()
    if not effect.of_this_rig():
        return building
    sizes = [
        abs(p.value) / _FORCES[p.unit] for p in effect.parameters.values() if p.unit in _FORCES
    ]
    times = max([1.0, *sizes])
    M, C, K = (tuple(tuple(times * one for one in row) for row in part) for part in building[1:4])
    stiffnesses = tuple(times * one for one in building.stiffnesses)
    return building._replace(M=M, C=C, K=K, stiffnesses=stiffnesses)


def _building_rests(effect: type[Effect]) -> Check:
    model = StructureModel(_building_of(effect), {}, [effect.name])
    for _ in range(20):
        model.step(0.002, 0.0, 0.0, 0.0)
    still = not any(model.x)
    return Check("a building at rest stays at rest", still or not effect.zero_at_rest)


def _building_bounds(effect: type[Effect]) -> Check:
    asked = "it can be simulated at every bound"
    for values in _corners(effect):
        model = StructureModel(_building_of(effect), values, [effect.name])
        for k in range(200):
            model.step(0.002, 4.0 * sin(0.02 * k), 4.0 * sin(0.02 * k + 0.02), 0.0)
        if not all(isfinite(x) and abs(x) < 10.0 for x in model.x):
            return Check(asked, False, f"the base leaves 10 m at {_text(values)}")
    return Check(asked, True)


def _shows(effect: type[Effect]) -> Check:
    signal = np.sin(2.0 * pi * 2.0 * np.arange(500) * 0.002)
    for values in _corners(effect):
        own = {name.partition(".")[2]: value for name, value in values.items()}
        if not np.isfinite(shown(effect, own, signal, 0.002)).all():
            return Check("what it shows is finite at every bound", False, _text(values))
    return Check("what it shows is finite at every bound", True)


_ASKED_AT: dict[str, tuple[Callable[[type[Effect]], Check], ...]] = {
    "damper": (_rests, _matters, _bounds, _energy),
    "structure": (_building_rests, _building_bounds),
    "sensor": (_shows,),
}
"""What is asked of an effect at each site."""


FINER = 4
"""Steps into which one is divided to see what it leaves out."""

COARSE = 0.02
"""Difference of the force that a step of 2 ms may make, by its largest value."""


def examine_law(law: type[Law]) -> list[Check]:
    """Return what is asked of a law that is registered, and whether it holds."""
    joins = Check("effects join its parts", bool(effects_of("damper", law.name)))
    asked = (_law_says, _compiles, _law_rests, _law_cycles, _steps)
    return [*(one(law) for one in asked), joins]


def _law_says(law: type[Law]) -> Check:
    return _texts(law, "what it is", {"a source with its year": _has_year(law.source)})


def _law_rests(law: type[Law]) -> Check:
    most = max(
        abs(DamperModel(law.name).force(0.0, 0.0, 0.0, V, inf, 0.0, 0.0, False))
        for V in (0.0, 4.0, 8.0)
    )
    return Check("no force at rest", most == 0.0, f"{most:g} N" if most else "")


def _law_cycles(law: type[Law]) -> Check:
    asked = "it can be simulated, and a closed cycle gives no energy, at every bound"
    for amplitude, frequency, V in CYCLES:
        for values in ends(law):
            try:
                cycle(law, values, amplitude, frequency, V)
            except FlawError as flaw:
                return Check(asked, False, str(flaw))
    return Check(asked, True)


def _steps(law: type[Law]) -> Check:
    """Ask whether a step of 2 ms leads where finer ones do."""
    coarse, fine = (_forces(law, step) for step in (2e-3, 2e-3 / FINER))
    most = max(abs(force) for force in fine)
    apart = max(abs(a - b) for a, b in zip(coarse, fine[FINER - 1 :: FINER], strict=True))
    share = apart / max(most, 1e-9)
    found = f"{100.0 * share:.2g} % of the force apart from steps of {2.0 / FINER:g} ms"
    return Check("a step of 2 ms is small enough", share < COARSE, found)


def _forces(law: type[Law], dt: float) -> list[float]:
    """Return the forces [N] of a motion that is linear over each step of dt [s]."""
    model, w, forces = DamperModel(law.name), 2.0 * pi * 2.0, []
    before, z = Inputs(0.0, 0.006 * w, 0.0, 4.0, dt, 0.0, 0.0, False), model.z
    linked, work = model.functions.link(step), room(len(z))
    for k in range(1, round(0.5 / dt) + 1):
        x, v = 0.006 * sin(w * k * dt), 0.006 * w * cos(w * k * dt)
        now = Inputs(x, v, -w * w * x, 4.0, dt, 0.0, 0.0, False)
        z1 = [0.0] * len(z)
        setup = model.setup._replace(active=True)
        forces.append(linked(setup, before, now, z, z1, [0.0] * work)[0])
        before, z = now, z1
    return forces


def main() -> int:
    """Print what is asked of a file's effect or law, and whether it holds."""
    from .load import load_file

    word, file = sys.argv[1:3]
    made = load_file(Path(file), word)
    checks = examine(made) if word == "effect" else examine_law(made)
    print(json.dumps([asdict(check) for check in checks]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
