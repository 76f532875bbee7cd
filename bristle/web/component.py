"""A component as a WebAssembly module: the shim of its native FMU, called by a page."""

from __future__ import annotations

import hashlib
import json
import tempfile
from pathlib import Path
from typing import Any
from uuid import UUID, uuid5

from ..data.files import write_whole
from ..errors import BuildError
from ..fmu import catalogue
from ..fmu.plan import plan
from ..native import zig
from ..native.parts import SHIM, functions_text, shim_digest, shim_sources
from ..native.prepare import GUID, Prepared, prepare

_FOLDER = Path(__file__).parent
_SOURCE = _FOLDER / "fmi.c"
_NAMESPACE = UUID("b1c4f0de-7f4e-5c68-9d2f-776562666d75")

LOADER = ("component.mjs", "component.d.mts")
"""What runs the module, and its types for editors and TypeScript."""

READS_FILES = ("GroundMotion",)
"""Components that are nothing without a file, which a page cannot open."""

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
    if name in READS_FILES:
        raise BuildError(
            f"{name} plays a file, which a page cannot open. A scenario has it inside: "
            "`bristle export SCENARIO --web FOLDER` is right."
        )
    what = plan(name)
    prepared = prepare(what)
    content = "".join([*prepared, shim_digest(), _SOURCE.read_text(encoding="utf-8")])
    guid = str(uuid5(_NAMESPACE, content))
    wasm = _module(prepared, guid, functions_text(what, prepared.functions))
    text = json.dumps(_described(what.name, guid, name), indent=1) + "\n"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_whole(folder / "component.json", text)
        for one in LOADER:
            write_whole(folder / one, (_FOLDER / one).read_text(encoding="utf-8"))
        part = folder / "component.wasm.part"
        part.write_bytes(wasm)
        part.replace(folder / "component.wasm")
    except OSError as error:
        raise BuildError(f"{folder}: cannot be written ({error.strerror or error}).") from None
    return [folder / one for one in ("component.wasm", "component.json", *LOADER)]


def _module(prepared: Prepared, guid: str, text: Path) -> bytes:
    content = hashlib.sha256(f"{zig.tools()} web {guid}".encode()).hexdigest()[:24]
    kept = zig.folder() / f"{content}.wasm"
    if not kept.is_file():
        with tempfile.TemporaryDirectory(dir=zig.folder()) as temporary:
            table, part = Path(temporary) / "tables.c", Path(temporary) / kept.name
            table.write_text(prepared.tables.replace(GUID, guid), encoding="utf-8")
            options = [f"-I{SHIM}", *(f"-Wl,--export={one}" for one in _CALLED)]
            zig.link_web([*shim_sources(), table, _SOURCE, text], options, part)
            part.replace(kept)
    return kept.read_bytes()


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
