"""LLVM's text of compiled functions as C: what every compiler takes, and no machine's own.

numba writes few of LLVM's instructions and keeps in memory what changes, so each instruction is one
statement here. Structures keep their parts, and the compiler at hand knows their sizes. What numba
does not write today is refused with its line.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from ..errors import BuildError
from .c_function import function
from .c_types import Names, Tokens, Types

_HEAD = """/* Compiled from Python by bristle: each function has the name of the one that it was. */

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>
"""

_PYTHONS = re.compile(r'^@"?(_ZN08NumbaEnv|\.const\.pickle|numba\.dynamic\.globals)')
"""What Python would need to raise an error; natively an error is a code."""


def c_text(text: str) -> str:
    """Return LLVM's text as C of the same functions.

    Parameters
    ----------
    text : str
        As `entrance.plain_text` gives it: its entrance is hidden, all other functions internal.

    Raises
    ------
    BuildError
        If it holds what has no C here, with the line.
    """
    types, names = Types(), Names()
    constants = [_constant(line, types, names) for line in text.splitlines() if line[:1] == "@"]
    found = [function(head, lines, types, names) for head, lines in _functions(text)]
    heads = [f"{one.head};" for one in found]
    bodies = [f"{one.head}\n{{\n" + "\n".join(one.lines) + "\n}\n" for one in found]
    kept = [one for one in constants if one]
    return "\n".join([_HEAD, *types.definitions, "", *kept, *heads, "", *bodies])


def _functions(text: str) -> Iterator[tuple[str, Sequence[str]]]:
    """Yield the head and the lines of each function; a switch, which spans lines, is one."""
    head, body = "", list[str]()
    for line in text.splitlines():
        if line.startswith("define "):
            head, body = line, []
        elif line == "}" and head:
            yield head, body
            head = ""
        elif head and body and body[-1].startswith("  switch ") and "]" not in body[-1]:
            body[-1] += f" {line.strip()}"
        elif head and line.strip() and not line.startswith(";"):
            body.append(line)


def _constant(line: str, types: Types, names: Names) -> str:
    """Return a constant as C; "" for what only Python needs."""
    if _PYTHONS.match(line):
        return ""
    try:
        tokens = Tokens(line)
        name = names.of(tokens.take())
        tokens.expect("=")
        while tokens.peek() not in ("constant", "global"):
            tokens.take()
        tokens.take()
        kind = types.read(tokens)
        return f"static const {types.name(kind)} {name} = {types.constant(tokens, kind)};"
    except (KeyError, IndexError, ValueError) as error:
        raise BuildError(f"there is no C for {line[:200]} ({error}).") from error
