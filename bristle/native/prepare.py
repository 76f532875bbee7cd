"""What Python knows of a component that is to run without it: its tables, its functions."""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ..core.child import in_child
from ..core.jit import digest
from ..errors import BristleError, BuildError
from ..fmu import catalogue
from ..fmu.build import BuildPlan
from ..fmu.component import ComponentSlave
from ..fmu.controller import SampledSlave
from ..fmu.own_controller import COMPILED_MAY_USE, OwnController
from . import entrance
from .description import description, description_fmi3, tables
from .entrance import entrance_of, functions_in_c

GUID = "00000000-0000-0000-0000-000000000000"
"""Stands for the guid until that is known."""

COMPILER = {
    "PYTHONHASHSEED": "0",  # numba numbers functions in the order in which it meets them
    "NUMBA_CPU_NAME": "generic",
    "NUMBA_CPU_FEATURES": "",
    # What is optimised for this machine has its sizes of pointers in it: WebAssembly would compute
    # nonsense. zig optimises for each platform.
    "NUMBA_OPT": "0",
    "NUMBA_COLOR_SCHEME": "no_color",
}
"""Environment of the process that compiles: its text is the same on every machine."""


class PreparedComponent(NamedTuple):
    """A component's model description and C tables, `GUID` in both; the digest of its functions."""

    description: str
    tables: str
    functions: str


def prepare(what: BuildPlan, fmi: int = 2) -> PreparedComponent:
    """Return what Python knows of a planned component.

    Parameters
    ----------
    what : BuildPlan
    fmi : int
        2 or 3: the version of FMI that the description follows.

    Raises
    ------
    BuildError
        If it is not made of flat functions, or its tables cannot be.
    """
    slave = component_of(what)
    try:
        made = tables(slave, GUID)
    except ValueError as error:  # what a component says of a design that it cannot take
        raise BuildError(f"{what.name}: {error}") from error
    about = description_fmi3 if fmi == 3 else description
    return PreparedComponent(about(slave, GUID), made, _digest_of(slave))


def compile_functions(what: BuildPlan, functions: str, target: Path) -> None:
    """Write the C of a planned component's functions.

    Parameters
    ----------
    what : BuildPlan
    functions : str
        Their digest.
    target : Path

    Raises
    ------
    BuildError
        If the compiler refuses a function.
    """
    order = {"functions": functions, "target": str(target), "plan": what.as_data()}
    answer_of("bristle.native.prepare", order, what.name)


def component_of(what: BuildPlan) -> ComponentSlave:
    """Return a planned component as a Python object.

    Raises
    ------
    BuildError
        If it is not made of flat functions.
    """
    from ..user_code.load import load_file

    own = [load_file(path).name for path in what.effects]
    for path in what.laws:
        load_file(path, "law")
    kind = catalogue.component_class(what.component)
    files = {name: str(path) for name, path in what.files.items()}
    baked = {**what.baked, "files": files, **({"own": own} if own else {})}
    slave = kind(baked=baked, instance_name=what.name)
    if not isinstance(slave, ComponentSlave):
        raise BuildError(f"{what.name} is not made of flat functions: it runs in Python alone.")
    return slave


def _digest_of(slave: ComponentSlave) -> str:
    """Return the digest of a component's functions and of how they become text."""
    return text_digest(entrance_of(slave.flat_functions(), isinstance(slave, SampledSlave)))


def text_digest(function: Callable[..., Any]) -> str:
    """Return the digest of a function with all that it calls, and of how that becomes text."""
    own = Path(entrance.__file__)
    files = [own, *sorted(own.parent.glob("c_*.py"))]
    how = b"".join(file.read_bytes() for file in files) + repr(COMPILER).encode()
    return hashlib.sha256(digest(function).encode() + how).hexdigest()[:16]


def answer_of(module: str, order: Mapping[str, Any], about: str) -> str:
    """Return what `serve` of a module answers, in a process of its own, told to know no processor.

    Parameters
    ----------
    module : str
        Its full name.
    order : mapping
        What stands on the standard input there, as JSON.
    about : str
        What is compiled, for the message.

    Raises
    ------
    BuildError
        With what the process said, if it fails.
    """
    child = in_child(f"from {module} import serve; serve()", order, more=COMPILER)
    if child.returncode != 0:
        said = child.stderr.strip() or f"its process ended with {child.returncode}"
        raise BuildError(f"{about}: {said[-1000:]}")
    return child.stdout


def _text(slave: ComponentSlave, files: Sequence[Path]) -> str:
    """Return the C; what a controller of a user's own may use is told where it is refused."""
    try:
        return functions_in_c(slave.flat_functions(), isinstance(slave, SampledSlave), files)
    except BuildError as error:
        told = f"{COMPILED_MAY_USE} " if isinstance(slave, OwnController) else ""
        raise BuildError(f"{error} {told}Without --native it builds as it is.") from error


def serve() -> None:
    """Do what stands on the standard input; the other end of `compile_functions`."""
    order: dict[str, Any] = json.load(sys.stdin)
    what = BuildPlan.from_data(order["plan"])
    try:
        slave = component_of(what)
        if _digest_of(slave) != order["functions"]:
            raise BuildError("its functions have changed meanwhile; build it again.")
        text = _text(slave, (what.component, *what.effects, *what.laws))
    except BristleError as error:
        sys.exit(str(error))
    Path(order["target"]).write_text(text, encoding="utf-8")
