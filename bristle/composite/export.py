"""Writes a whole scenario as one FMU that needs no Python."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from ..fmu.plan import Plan
from ..scenario.naming import run_name
from ..scenario.scenario import resolve_scenario
from .assembly import Assembly

_COMPONENT = Path(__file__).with_name("component.py")


def export_composite(
    scenario: str | Path,
    folder: Path,
    build: Callable[[Plan, Path], Path],
    overrides: Mapping[str, object] | None = None,
    inputs: Iterable[str] = (),
) -> Path:
    """Write a scenario as one FMU into a folder, made if missing; return its path.

    Parameters
    ----------
    scenario, overrides
        As for `scenario.load_scenario`.
    folder : Path
    build : callable
        Builds a planned FMU into a folder: `native.build.build` for some platforms.
    inputs : iterable of str
        Ports, and parameters of sources, that become inputs: PART.PORT.

    Raises
    ------
    ScenarioError
        If the scenario is wrong or cannot be compiled, or an input is none.
    BuildError
        If the FMU cannot be built.
    """
    return build(plan_of(scenario, overrides, inputs), folder)


def plan_of(
    scenario: str | Path,
    overrides: Mapping[str, object] | None = None,
    inputs: Iterable[str] = (),
) -> Plan:
    """Return what to build; parameters and errors are those of `export_composite`."""
    file, named = resolve_scenario(scenario), list(inputs)
    given = (overrides or {}).items()
    chosen = {key: str(value) if isinstance(value, Path) else value for key, value in given}
    assembly = Assembly(file, chosen, named)
    name = re.sub(r"[^A-Za-z0-9_]", "_", run_name(file, chosen))
    if not name[0].isalpha():
        name = f"scenario_{name}"
    parts = assembly.scenario.components
    effects = dict.fromkeys(path for part in parts for path in part.effects)
    laws = dict.fromkeys(part.law.file for part in parts if part.law and part.law.file)
    baked = {"name": name, "scenario": str(file), "overrides": chosen, "inputs": named}
    files = {f"{name}.csv": path for name, path in assembly.files.items()}
    return Plan(name, _COMPONENT, baked, files, tuple(effects), tuple(laws))
