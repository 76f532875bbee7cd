"""The built-in FMUs, which all workers and sessions share."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

from bristle.fmu import build, catalogue
from bristle.physics.effect import effects_of
from bristle.physics.laws import laws_of

COMPONENTS = catalogue.component_names()
DAMPERS = {catalogue.component_of_law(law.name): law.name for law in laws_of("damper")}
"""Component to its law."""
SITES = {"Structure": ("structure", ""), **{name: ("damper", law) for name, law in DAMPERS.items()}}
LIVELY: dict[str, dict[str, Any]] = {
    "GroundMotion": {"peak": 3.0, "factor": 1.5},
    "ConstantVoltage": {"level": 3.0},
    "SignalSource": {"kind": "chirp", "amplitude": 2.0, "phase": 0.5},
    "PrescribedMotion": {"kind": "sine", "amplitude": 0.01, "phase": 0.5},
}
"""Parameters with which a component's outputs move."""


@cache
def folder() -> Path:
    path = Path(tempfile.mkdtemp(prefix="bristle-test-fmus-"))
    atexit.register(shutil.rmtree, path, ignore_errors=True)
    return path


@cache
def built(component: str) -> Path:
    """Return a built-in component's FMU."""
    return build.ensure(component)


@cache
def built_native(component: str) -> Path:
    """Return a built-in component's FMU that needs no Python, for this machine."""
    from bristle.native.build import build as build_native
    from bristle.native.zig import here

    return build_native(build.plan(component), folder() / "native", [here()])


def lively(component: str) -> dict[str, Any]:
    """Return parameters with every effect of the component on that the ones before it allow."""
    effects = effects_of(*SITES[component]) if component in SITES else ()
    on: list[str] = []
    for effect in effects:
        if not set(effect.excludes) & set(on):
            on.append(effect.name)
    return {**LIVELY.get(component, {}), **{f"{name}.on": True for name in on}}
