"""One compiled function per component, which leads to all of its functions.

It is generated, compiled by numba and written as C, in which nothing of Python is left. Compiling
runs in a process of its own: numba is told there to know no more of this machine's processor than
every other has.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from inspect import signature
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np

from ..component.clock import ORIGIN
from ..core.jit import RefusedError, library_text
from ..errors import BuildError
from ..physics.linear import row
from .c_functions import c_text

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
