"""One compiled function per component, which leads to all of its functions.

It is generated, compiled by numba and written as C, in which nothing of Python is left. Compiling
runs in a process of its own: numba is told there to know no more of this machine's processor than
every other has.
"""

from __future__ import annotations

import gc
import hashlib
import json
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from inspect import signature
from pathlib import Path
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np

from ..component.clock import ORIGIN
from ..core.child import in_child
from ..core.jit import RefusedError, digest, library_text
from ..errors import BristleError, BuildError
from ..fmu import catalogue
from ..fmu.build import BuildPlan
from ..fmu.component import ComponentSlave
from ..fmu.controller import SampledSlave
from ..fmu.own_controller import COMPILED_MAY_USE, OwnController
from ..physics.linear import row
from .c_functions import c_text
from .description import description, description_fmi3, tables

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
    answer_of("bristle.native.entrance", order, what.name)


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
    own = Path(__file__)
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
    gc.disable()  # searching for garbage takes a fifth of the time, and this process soon ends
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


NEEDED = ("sizes", "setup", "constants", "start", "step", "output")
"""Functions that a component must have, see `bristle.component`."""
OPTIONAL = ("bind", "follow", "discretise", "scale_samples")
"""Functions that it may have."""

INLINE = ("linear.row",)
"""Callees that must become part of their callers: they return rows. Functions name their own as
`INLINED`."""

_NAMED = ("constants", "scale_samples", "discretise")
"""Functions that are called by the names of their parameters: see `ROWS`."""

NAME = "bristle_entrance"
ROWS = (
    "values", "given", "baked", "times", "samples", "store", "state", "new_state", "before", "now",
    "outputs", "work",
)  # fmt: skip

_SOURCE = """
def entrance(call, time, dt, {rows}):
    if call == 0:
        return sizes(values, baked, work)
    if call == 1:
        code = setup(values, given, baked, store, state)
        {unpack}
        {begin}
        return code
    {discretise}
    {bind}
    {unpack}
    c = constants({constants})
    {follow}
    if call == 2:
        return start(time, now, c, state, outputs, work)
    if call == 3:
        return step((time, dt, 0), before, now, c, state, new_state, outputs, work)
    return output(time, now, c, state, outputs, work)
"""

_BEGIN_CLOCK = f"state[{ORIGIN}] = time"
"""Until the first sample is taken, the clock of a sampled component begins with the instance."""
_SCALE = "code = code if code < 0 else scale_samples({names})"
_DISCRETISE = """if call == 5:
        discretise({names})
        return 0
"""
_UNPACK = "times, samples = row(times, 0), row(samples, 0)"
"""A host packs the samples of each signal that a component plays. What plays several finds its own,
and what it bakes says where; its `scale_samples` asks for that."""

_OUTSIDE = (
    "acos asin atan atan2 cbrt ceil cos cosh erf erfc exp exp2 expm1 fabs floor fmax fmin fmod "
    "hypot ldexp lgamma log log10 log1p log2 memcpy memmove memset pow round sin sinh sqrt tan "
    "tanh tgamma trunc"
)
"""What compiled functions may ask of the C library."""


def entrance_of(functions: Any, sampled: bool = False) -> FunctionType:
    """Return the function that leads to a component's functions.

    Parameters
    ----------
    functions : module or namespace
        The component's, as its `flat_functions` gives them.
    sampled : bool
        Whether it has a clock of its own.

    Raises
    ------
    BuildError
        If it is not of flat functions throughout.
    """
    every = (*NEEDED, *OPTIONAL)
    found: dict[str, Any] = {one: getattr(functions, one, None) for one in every}
    missing = [name for name in NEEDED if not isinstance(found[name], FunctionType)]
    name = functions.setup.__module__ if hasattr(functions, "setup") else str(functions)
    if missing:
        raise BuildError(f"{name} has no flat {', '.join(missing)}: it runs in Python alone.")
    names = {one: ", ".join(signature(found[one]).parameters) for one in _NAMED if found[one]}
    scale, discretise = names.get("scale_samples"), names.get("discretise")
    several = scale and "baked" in signature(found["scale_samples"]).parameters
    text = _SOURCE.format(
        rows=", ".join(ROWS),
        begin=_BEGIN_CLOCK if sampled else _SCALE.format(names=scale) if scale else "pass",
        unpack=_UNPACK if scale and not several else "pass",
        constants=names["constants"],
        discretise=_DISCRETISE.format(names=discretise) if discretise else "pass",
        bind="bind(given, store)" if found["bind"] else "pass",
        follow="follow(now, c)" if found["follow"] else "pass",
    )
    namespace = {"row": row, **{name: function for name, function in found.items() if function}}
    exec(compile(text, f"<entrance of {name}>", "exec"), namespace)
    entrance: FunctionType = namespace["entrance"]
    entrance.__module__ = name
    return entrance


def functions_in_c(functions: Any, sampled: bool = False, files: Sequence[Path] = ()) -> str:
    """Return the C of a component's functions behind one entrance.

    Parameters
    ----------
    functions, sampled
        As in `entrance_of`.
    files : sequence of Path
        Where its source is, for the message.

    Raises
    ------
    BuildError
        If the compiler refuses a function, with file and line, or it needs what no C library has.
    """
    examples = (0, 0.0, 0.0, *[np.zeros(0)] * len(ROWS))
    try:
        inlined = (*INLINE, *getattr(functions, "INLINED", ()))
        text, root = library_text(entrance_of(functions, sampled), examples, inlined)
        return c_text(plain_text(text, root))
    except RefusedError as error:
        raise BuildError(refusal(str(error), [path.resolve() for path in files])) from error


def refusal(text: str, files: Sequence[Path]) -> str:
    """Return where, in files of the user's own, numba refuses something, and why."""
    plain = re.sub(r"\x1b\[[0-9;]*m", "", text)
    lines = [line.strip() for line in plain.splitlines()]
    whys = [line for line in lines if line and not line.startswith("Failed in nopython mode")]
    places = re.findall(r'File "([^"\n]+)", line (\d+)| at (\S+\.py) \((\d+)\)', plain)
    named = [(Path(one or two), line or other) for one, line, two, other in places]
    own = [f"{path}, line {line}" for path, line in named if path.resolve() in files]
    where = own[0] if own else str(files[0]) if files else "a component"
    return f"{where}: the compiler refuses this: {whys[0] if whys else 'it does not say why'}."


def plain_text(text: str, root: str) -> str:
    """Return LLVM's text without what ties it to this machine and to Python.

    Parameters
    ----------
    text : of a library of numba
    root : name of its entrance

    Raises
    ------
    BuildError
        If it calls what is neither in it nor in a C library.
    """
    lines = [
        line
        for line in text.splitlines()
        if not line.startswith(("target ", "source_filename", "; ModuleID"))
    ]
    text = "\n".join(lines) + "\n"
    text = re.sub(r"^(@\S+ = )common ", r"\1internal ", text, flags=re.MULTILINE)
    linkage = r"^define (?:linkonce_odr |internal |hidden )*"
    text = re.sub(linkage, "define internal ", text, flags=re.MULTILINE)
    quoted = re.escape(root)
    text = re.sub(rf'@"?{quoted}"?(?![\w.$])', f"@{NAME}", text)
    text = re.sub(rf"^define internal (.*@{NAME}\()", r"define hidden \1", text, flags=re.MULTILINE)
    outside = re.findall(r'^declare [^@]*@"?([^"(\s]+)"?\(', text, flags=re.MULTILINE)
    strange = sorted(n for n in outside if not n.startswith("llvm.") and n not in _OUTSIDE.split())
    if strange:
        raise BuildError(f"the compiled functions call {', '.join(strange)}, which no host has.")
    return text
