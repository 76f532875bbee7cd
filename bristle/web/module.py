"""The WebAssembly module that runs any scenario of built-in components.

It is the coupled engine's time loop, compiled by numba to C and by zig from there. A
scenario is numbers alone, so one module serves all that have the library's laws and effects; one
with a user's own has another.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BristleError, BuildError
from ..jit import RefusedError, library_text
from ..native import zig
from ..native.c_text import c_text
from ..native.entrance import plain_text, refusal
from ..native.parts import keep
from ..native.prepare import answer_of, text_digest
from ..physics import damper, structure
from ..physics.codegen import Functions
from ..physics.effect import EFFECTS
from ..physics.laws import LAWS
from ..physics.user import own_effects, own_laws
from ..progress import tell
from ..simulate import records, time_loop
from ..simulate.coupled import linked
from ..simulate.system import System

SOURCE = Path(__file__).with_name("march.c")

SITES = {"damper": damper.SETS, "structure": structure.SETS}


def module(system: System | None = None) -> bytes:
    """Return the module, compiled if it is not in the cache: a minute or two, once.

    Parameters
    ----------
    system : System, optional
        What it is to run, where a law or effect is not of the library.

    Raises
    ------
    BuildError
        If zig is not installed, the compiler refuses a law or effect, or the cache cannot be
        written.
    """
    sets = [one.library for one in SITES.values()]
    if system is not None:
        sets = [system.dampers, system.structures]
    functions = text_digest(linked(*sets)(time_loop.integrate))
    sizes = [f"-D{name}_SIZE={record.itemsize}" for name, record in _records(*sets).items()]
    content = hashlib.sha256(SOURCE.read_bytes())
    for one in (functions, zig.tools_web(), *sizes):
        content.update(one.encode())

    def link(path: Path) -> None:
        tell("compiling the time loop for the web, once")
        text = path.parent / "loop.c"
        order = {
            "own": _own(),
            "sets": [
                [[law.name for law in made.slots.laws], [e.name for e in made.slots.effects]]
                for made in sets
            ],
            "functions": functions,
            "target": str(text),
        }
        answer_of("bristle.web.module", order, "the time loop")
        zig.link_web([text, SOURCE], sizes, path)

    return keep(zig.folder() / f"{content.hexdigest()[:24]}.wasm", link).read_bytes()


def _records(dampers: Functions, structures: Functions) -> dict[str, np.dtype[np.void]]:
    """Return what the arrays of records hold; every other array holds numbers."""
    return {
        "SOURCE": records.source_record(),
        "DAMPER": records.damper_record(dampers.slots),
        "STRUCTURE": records.structure_record(structures.slots),
        "SAMPLED": records.sampled_record(),
    }


def _own() -> dict[str, list[str]]:
    """Return the files of the user's own laws and effects."""
    own = {"law": own_laws(), "effect": own_effects()}
    return {kind: [str(file) for file in files.values()] for kind, files in own.items()}


def serve() -> None:
    """Compile what stands on the standard input; the other end of `module`."""
    from ..trust import load_file

    given = json.load(sys.stdin)
    for kind, files in given["own"].items():
        for file in files:
            load_file(Path(file), kind)
    sets = [
        site.of(*(LAWS[name] for name in laws), *(EFFECTS[name] for name in effects))
        for site, (laws, effects) in zip(SITES.values(), given["sets"], strict=True)
    ]
    try:
        loop = linked(*sets)(time_loop.integrate)
        if text_digest(loop) != given["functions"]:
            raise BuildError("laws or effects have changed meanwhile; export it again.")
        text = _text(loop, _records(*sets))
    except BristleError as error:
        sys.exit(str(error))
    Path(given["target"]).write_text(text, encoding="utf-8")


def _text(loop: Any, known: Mapping[str, np.dtype[np.void]]) -> str:
    row, whole = np.zeros(0), np.zeros(0, dtype=np.int64)
    sources, dampers, structures, sampled = (np.zeros(0, record) for record in known.values())
    examples = (
        (0, 0, 0.0), (sources, row, row), (dampers, structures), (sampled, row, row), row, whole,
        np.zeros((0, 0)),
    )  # fmt: skip
    own = [Path(file).resolve() for files in _own().values() for file in files]
    try:
        return c_text(plain_text(*library_text(loop, examples, time_loop.INLINE)))
    except RefusedError as error:
        raise BuildError(refusal(str(error), own)) from error
