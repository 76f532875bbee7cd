"""The WebAssembly module that runs any scenario of built-in components.

It is the coupled engine's time loop, compiled by numba to LLVM's text and by zig from there. A
scenario is numbers alone, so one module serves all; it is made once for the registered laws and
effects.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from ..errors import BristleError, BuildError
from ..fmu.plan import PACKAGE
from ..jit import RefusedError, digest, library_text
from ..native import zig
from ..native.entrance import plain_text, refusal
from ..native.prepare import COMPILER
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
        functions = digest(loop)
    sizes = [f"-D{name}_SIZE={make().itemsize}" for name, make in RECORDS.items()]
    content = hashlib.sha256(SOURCE.read_bytes())
    for one in (functions, zig.tools(), repr(COMPILER), *sizes):
        content.update(one.encode())
    kept = zig.folder() / f"{content.hexdigest()[:24]}.wasm"
    if not kept.is_file():
        with tempfile.TemporaryDirectory(dir=zig.folder()) as temporary:
            text = Path(temporary) / "march.ll"
            part = Path(temporary) / kept.name
            tell("compiling the time loop for the web, once")
            _compile(functions, text)
            zig.link_web([text, SOURCE], sizes, part)
            part.replace(kept)
    return kept.read_bytes()


def _compile(functions: str, target: Path) -> None:
    """Write LLVM's text of the time loop of a digest, compiled in a process of its own."""
    path = os.pathsep.join([str(PACKAGE.parent), os.environ.get("PYTHONPATH", "")])
    own = {kind: [str(file) for file in files] for kind, files in _own().items()}
    order = {"own": own, "functions": functions, "target": str(target)}
    child = subprocess.run(
        [sys.executable, "-c", "from bristle.web.module import serve; serve()"],
        input=json.dumps(order), capture_output=True, text=True, check=False,
        env={**os.environ, **COMPILER, "PYTHONPATH": path},
    )  # fmt: skip
    if child.returncode != 0:
        raise BuildError(f"the time loop cannot be compiled: {child.stderr.strip()[-800:]}")


def _own() -> dict[str, list[Path]]:
    """Return the files of the user's own laws, in the order of their codes, and effects."""
    laws = own_laws()
    return {
        "law": [laws[name] for name in LAWS if name in laws], "effect": [*own_effects().values()],
    }  # fmt: skip


def serve() -> None:
    """Compile what stands on the standard input; the other end of `module`."""
    from ..trust import load_file

    given = json.load(sys.stdin)
    for kind, files in given["own"].items():
        for file in files:
            load_file(Path(file), kind)
    try:
        with whole_loop() as (loop, _):
            if digest(loop) != given["functions"]:
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
    own = [file.resolve() for files in _own().values() for file in files]
    with whole_loop() as (loop, inline):
        try:
            return plain_text(*library_text(loop, examples, inline))
        except RefusedError as error:
            raise BuildError(refusal(str(error), own)) from error
