"""A component as a WebAssembly module: the shim of its native FMU, called by a page."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any
from uuid import UUID, uuid5

from ..errors import BuildError
from ..fmu import catalogue
from ..fmu.plan import plan
from ..native import zig
from ..native.parts import SHIM, functions_text, keep, shim_digest, shim_sources
from ..native.prepare import GUID, Prepared, prepare
from .files import LOADERS, loader, write_files

_SOURCE = LOADERS / "fmi.c"
_NAMESPACE = UUID("b1c4f0de-7f4e-5c68-9d2f-776562666d75")

LOADER = ("component.mjs", "component.d.mts")
"""What runs the module, and its types for editors and TypeScript."""

_CALLED = (
    "fmi2SetupExperiment", "fmi2EnterInitializationMode", "fmi2ExitInitializationMode",
    "fmi2DoStep", "fmi2Reset", "fmi2FreeInstance", "fmi2GetReal", "fmi2GetInteger",
    "fmi2GetBoolean", "fmi2SetReal", "fmi2SetInteger", "fmi2SetBoolean", "fmi2SetString", "malloc",
    "free",
)  # fmt: skip
"""What the loader calls."""


def export_component(name: str, folder: Path) -> list[Path]:
    """Write a component as a WebAssembly module, its variables and a loader; return the files.

    Parameters
    ----------
    name : str
        A built-in component, or the file of a controller of one's own.
    folder : Path
        Where to write, made if missing.

    Raises
    ------
    BuildError
        If there is no such component, it needs a file, zig is not installed or refuses something,
        or the folder cannot be written.
    """
    what = plan(name)
    reading = getattr(catalogue.component_class(what.component), "file_of", None)
    if reading is not None and not reading.chooser:  # whatever its parameters, it reads a file
        raise BuildError(
            f"{name} plays a file, which a page cannot open. A scenario has it inside: "
            "`bristle export SCENARIO --web FOLDER` is right."
        )
    prepared = prepare(what)
    content = "".join([*prepared, shim_digest(), _SOURCE.read_text(encoding="utf-8")])
    guid = str(uuid5(_NAMESPACE, content))
    wasm = _module(prepared, guid, functions_text(what, prepared.functions))
    text = json.dumps(_described(what.name, guid, name), indent=1) + "\n"
    contents: dict[str, str | bytes] = {
        "component.wasm": wasm,
        "component.json": text,
        **loader(*LOADER),
    }
    return write_files(folder, contents)


def _module(prepared: Prepared, guid: str, text: Path) -> bytes:
    content = hashlib.sha256(f"{zig.tools_web()} {guid}".encode()).hexdigest()[:24]

    def link(path: Path) -> None:
        table = path.parent / "tables.c"
        table.write_text(prepared.tables.replace(GUID, guid), encoding="utf-8")
        options = [f"-I{SHIM}", *(f"-Wl,--export={one}" for one in _CALLED)]
        zig.link_web([*shim_sources(), table, _SOURCE, text], options, path)

    return keep(zig.folder() / f"{content}.wasm", link).read_bytes()


def _described(model: str, guid: str, component: str) -> dict[str, Any]:
    """Return what the loader reads, as plain data: see component.d.mts."""
    known = catalogue.describe(component)
    return {
        "name": model,
        "guid": guid,
        "text": known.description,
        "variables": [
            {
                "name": one.name, "reference": one.reference, "kind": one.kind,
                "causality": one.causality, "unit": one.unit or "", "start": one.start,
                "text": one.description,
            }
            for one in known.variables.values()
        ],
    }  # fmt: skip
