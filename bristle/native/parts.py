"""The compiled parts of native FMUs, kept by the digest of what they are made of."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ..errors import BristleError, BuildError
from ..fmu import catalogue
from ..fmu.component import ComponentSlave
from ..fmu.controller import SampledSlave
from ..fmu.plan import PACKAGE, Plan
from ..jit import digest
from ..progress import tell
from . import zig
from .entrance import entrance_of, llvm_text
from .platforms import Platform

SHIM = Path(__file__).resolve().parent / "shim"
"""Folder with the C that all native FMUs share."""

_COMPILER = {
    "PYTHONHASHSEED": "0",  # numba numbers functions in the order in which it meets them
    "NUMBA_CPU_NAME": "generic",
    "NUMBA_CPU_FEATURES": "",
    "NUMBA_LOOP_VECTORIZE": "0",
    "NUMBA_SLP_VECTORIZE": "0",
    "NUMBA_COLOR_SCHEME": "no_color",
}
"""Environment of the process that compiles: its text is the same on every machine."""


def component_of(what: Plan) -> ComponentSlave:
    """Return a planned component as a Python object.

    Raises
    ------
    BuildError
        If it is not made of flat functions.
    """
    from ..trust import load_file

    kind = catalogue.component_class(what.component)
    own = [load_file(path).name for path in what.effects]
    files = {name: str(path) for name, path in what.files.items()}
    baked = {**what.baked, "files": files, **({"own": own} if own else {})}
    slave = kind(baked=baked, instance_name=what.name)
    if not isinstance(slave, ComponentSlave) or not hasattr(slave, "bake"):
        raise BuildError(f"{what.name} is not made of flat functions: it runs in Python alone.")
    entrance_of(slave.functions)
    return slave


def is_sampled(slave: ComponentSlave) -> bool:
    """Return whether a component has a clock of its own: its steps move the state on in place."""
    return isinstance(slave, SampledSlave)


def functions_digest(slave: ComponentSlave) -> str:
    """Return the digest of a component's functions and of what compiles them."""
    return digest(entrance_of(slave.functions, is_sampled(slave)))


def shim_digest() -> str:
    """Return the digest of the C that all native FMUs share, and of what compiles it."""
    content = hashlib.sha256(zig.tools().encode())
    for path in sorted(SHIM.iterdir()):
        content.update(path.name.encode() + path.read_bytes())
    return content.hexdigest()


def functions_text(what: Plan, slave: ComponentSlave) -> Path:
    """Return the file with LLVM's text of a component's functions, compiled if need be.

    Raises
    ------
    BuildError
        If the compiler refuses a function; if the cache cannot be written.
    """
    kept = zig.folder() / f"{functions_digest(slave)}.ll"
    if kept.is_file():
        return kept
    tell(f"compiling the functions of {what.name}, once")
    order = {
        "name": what.name,
        "component": str(what.component),
        "baked": dict(what.baked),
        "files": {name: str(path) for name, path in what.files.items()},
        "effects": [str(path) for path in what.effects],
        "laws": [str(path) for path in what.laws],
    }
    path = os.pathsep.join([str(PACKAGE.parent), os.environ.get("PYTHONPATH", "")])
    with tempfile.TemporaryDirectory(dir=zig.folder()) as temporary:
        part = Path(temporary) / "functions.ll"
        child = subprocess.run(
            [sys.executable, "-c", "from bristle.native.parts import serve; serve()"],
            input=json.dumps({"order": order, "target": str(part)}), capture_output=True,
            text=True, check=False, env={**os.environ, **_COMPILER, "PYTHONPATH": path},
        )  # fmt: skip
        if child.returncode != 0:
            raise BuildError(f"{what.name}: {child.stderr.strip()[-800:]}")
        part.replace(kept)
    return kept


def serve() -> None:
    """Compile what stands on the standard input; the other end of `functions_text`."""
    given = json.load(sys.stdin)
    try:
        slave = component_of(plan_of(given["order"]))
        text = llvm_text(slave.functions, is_sampled(slave))
    except BristleError as error:
        sys.exit(str(error))
    Path(given["target"]).write_text(text, encoding="utf-8")


def plan_of(order: dict[str, Any]) -> Plan:
    """Return the plan that an order in JSON stands for."""
    files = {name: Path(path) for name, path in order["files"].items()}
    effects, laws = (tuple(Path(path) for path in order[key]) for key in ("effects", "laws"))
    return Plan(order["name"], Path(order["component"]), order["baked"], files, effects, laws)


def library(name: str, text: Path, table: str, platform: Platform) -> bytes:
    """Return the bytes of a component's library for a platform.

    Parameters
    ----------
    name : str
        Of the FMU.
    text : Path
        LLVM's text of its functions.
    table : str
        C source of its tables.
    platform : Platform

    Raises
    ------
    BuildError
        If it cannot be compiled; if the cache cannot be written.
    """
    content = hashlib.sha256()
    for part in (zig.tools(), platform.target, text.stem, name, table, shim_digest()):
        content.update(part.encode())
    kept = zig.folder() / f"{content.hexdigest()[:24]}{platform.suffix}"
    if kept.is_file():
        return kept.read_bytes()
    functions = _kept(
        zig.folder() / f"{_object_digest(text, platform)}.o",
        lambda path: zig.compile_object(text, path, platform),
    )

    def link(path: Path) -> None:
        source = path.parent / "tables.c"
        source.write_text(table, encoding="utf-8")
        own = path.parent / f"{name}{platform.suffix}"
        sources = [*sorted(SHIM.glob("*.c")), source, functions]
        zig.link(sources, SHIM, own, platform)
        own.replace(path)

    return _kept(kept, link).read_bytes()


def _object_digest(text: Path, platform: Platform) -> str:
    return hashlib.sha256(f"{zig.tools()} {platform.target} {text.stem}".encode()).hexdigest()[:24]


def _kept(path: Path, make: Callable[[Path], None]) -> Path:
    """Return a file of the cache, made beside it and renamed into place if it is not there."""
    if not path.is_file():
        with tempfile.TemporaryDirectory(dir=path.parent) as temporary:
            part = Path(temporary) / path.name
            make(part)
            part.replace(path)
    return path


def libraries(
    name: str, text: Path, table: str, platforms: Sequence[Platform]
) -> dict[Platform, bytes]:
    """Return the libraries of a component for several platforms, compiled side by side.

    Raises
    ------
    BuildError
        What is wrong with the first platform that fails, once all are done.
    """
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        runs = [pool.submit(library, name, text, table, one) for one in platforms]
    return {one: run.result() for one, run in zip(platforms, runs, strict=True)}
