"""The WebAssembly module that runs any scenario of built-in components.

It is the coupled engine's time loop, compiled by numba to C and by zig from there. A
scenario is numbers alone, so one module serves all; it is made once for the registered laws and
effects.
"""

from __future__ import annotations

import hashlib
import json
import sys
from pathlib import Path

import numpy as np

from ..errors import BristleError, BuildError
from ..jit import RefusedError, library_text
from ..native import zig
from ..native.c_text import c_text
from ..native.entrance import plain_text, refusal
from ..native.parts import keep
from ..native.prepare import answer_of, text_digest
from ..physics.laws import LAWS
from ..physics.user import own_effects, own_laws
from ..progress import tell
from ..simulate import records
from ..simulate.coupled import whole_loop

SOURCE = Path(__file__).with_name("march.c")

RECORDS = {
    "SOURCE": records.source_record,
    "DAMPER": records.damper_record,
    "STRUCTURE": records.structure_record,
    "SAMPLED": records.sampled_record,
}
"""What the arrays of records hold; every other array holds numbers."""


def module() -> bytes:
    """Return the module, compiled if it is not in the cache: a minute or two, once.

    Raises
    ------
    BuildError
        If zig is not installed, the compiler refuses a law or effect, or the cache cannot be
        written.
    """
    with whole_loop() as (loop, _):
        functions = text_digest(loop)
    sizes = [f"-D{name}_SIZE={make().itemsize}" for name, make in RECORDS.items()]
    content = hashlib.sha256(SOURCE.read_bytes())
    for one in (functions, zig.tools_web(), *sizes):
        content.update(one.encode())

    def link(path: Path) -> None:
        tell("compiling the time loop for the web, once")
        text = path.parent / "loop.c"
        order = {"own": _own(), "functions": functions, "target": str(text)}
        answer_of("bristle.web.module", order, "the time loop")
        zig.link_web([text, SOURCE], sizes, path)

    return keep(zig.folder() / f"{content.hexdigest()[:24]}.wasm", link).read_bytes()


def _own() -> dict[str, list[str]]:
    """Return the files of the user's own laws, in the order of their codes, and effects."""
    laws = own_laws()
    return {
        "law": [str(laws[name]) for name in LAWS if name in laws],
        "effect": [str(file) for file in own_effects().values()],
    }


def serve() -> None:
    """Compile what stands on the standard input; the other end of `module`."""
    from ..trust import load_file

    given = json.load(sys.stdin)
    for kind, files in given["own"].items():
        for file in files:
            load_file(Path(file), kind)
    try:
        with whole_loop() as (loop, _):
            if text_digest(loop) != given["functions"]:
                raise BuildError("laws or effects have changed meanwhile; export it again.")
        text = _text()
    except BristleError as error:
        sys.exit(str(error))
    Path(given["target"]).write_text(text, encoding="utf-8")


def _text() -> str:
    row, whole = np.zeros(0), np.zeros(0, dtype=np.int64)
    sources, dampers, structures, sampled = (np.zeros(0, make()) for make in RECORDS.values())
    examples = (
        (0, 0, 0.0), (sources, row, row), (dampers, structures), (sampled, row, row), row, whole,
        np.zeros((0, 0)),
    )  # fmt: skip
    own = [Path(file).resolve() for files in _own().values() for file in files]
    with whole_loop() as (loop, inline):
        try:
            return c_text(plain_text(*library_text(loop, examples, inline)))
        except RefusedError as error:
            raise BuildError(refusal(str(error), own)) from error
