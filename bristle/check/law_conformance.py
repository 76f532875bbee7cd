"""What is asked of every law, asked of one: rest, energy, bounds, steps, and the compiled path."""

from __future__ import annotations

import re
from math import cos, inf, pi, sin

from ..physics.damper import DamperModel, room, step
from ..physics.effect import effects_of
from ..physics.inputs import Inputs
from ..physics.law import Law
from ..physics.probe_law import CYCLES, cycle, ends
from ..physics.user_text import FlawError
from .conformance import Check
from .user_effects import refused

FINER = 4
"""Steps into which one is divided to see what it leaves out."""

COARSE = 0.02
"""Difference of the force that a step of 2 ms may make, by its largest value."""


def examine_law(law: type[Law]) -> list[Check]:
    """Return what is asked of a law that is registered, and whether it holds."""
    return [one(law) for one in (_says, _compiles, _rests, _bounds, _energy, _steps, _has_effects)]


def _says(law: type[Law]) -> Check:
    lacking = []
    if ":" not in law.first_line() or not law.first_line().endswith("."):
        lacking.append('a first docstring line "Name: what it is."')
    if not re.search(r"\b(1[89]|20)\d\d\b", law.source):
        lacking.append("a source with its year")
    found = "lacks " + ", ".join(lacking) if lacking else ""
    return Check("name, texts and source are complete", not lacking, found)


def _compiles(law: type[Law]) -> Check:
    flaw = refused(law)
    return Check("compiled code gives the same numbers", flaw is None, flaw[1] if flaw else "")


def _rests(law: type[Law]) -> Check:
    most = max(
        abs(DamperModel(law.name).force(0.0, 0.0, 0.0, V, inf, 0.0, 0.0, False))
        for V in (0.0, 4.0, 8.0)
    )
    return Check("no force at rest", most == 0.0, f"{most:g} N" if most else "")


def _bounds(law: type[Law]) -> Check:
    asked = "it can be simulated at every bound"
    for values in ends(law):
        try:
            cycle(law, values, *CYCLES[0])
        except FlawError as flaw:
            if "energy" not in str(flaw):
                return Check(asked, False, str(flaw))
    return Check(asked, True)


def _energy(law: type[Law]) -> Check:
    asked = "a closed cycle gives no energy, at every bound"
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


def _has_effects(law: type[Law]) -> Check:
    return Check("effects join its parts", bool(effects_of("damper", law.name)))
