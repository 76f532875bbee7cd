"""One compiled function: its instructions as statements of C."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from textwrap import fill
from typing import NamedTuple

from ..errors import BuildError
from .c_arithmetic import FLAGS, computed
from .c_lines import Line, needed
from .c_operands import Operands
from .c_types import Names, Tokens, Type, Types, part_of

_SKIPPED = ("llvm.assume", "llvm.lifetime.", "llvm.experimental.noalias.", "llvm.dbg.")
_LIBRARY = {"minnum": "fmin", "maxnum": "fmax"}
"""Functions of C's library that LLVM has other names for."""
_PHI = re.compile(r"\s+%\S+ = phi ")


class Function(NamedTuple):
    """A function in C: its head, and the lines of its body."""

    head: str
    lines: list[str]


class _Phi(NamedTuple):
    """A value that depends on the block that was left, and what it then is."""

    name: str
    value: str


def function(head: str, lines: Sequence[str], types: Types, names: Names) -> Function:
    """Return a function of LLVM's text as C.

    Parameters
    ----------
    head : str
        Its line that begins with `define`.
    lines : sequence of str
        Its labels, and its instructions, which are indented.
    types, names : Types, Names
        Of the whole text.

    Raises
    ------
    BuildError
        If an instruction has no C here.
    """
    body = _Body(types, names)
    return Function(body.head(head), body.all(lines))


class _Body:
    """The statements of one function, block by block."""

    def __init__(self, types: Types, names: Names) -> None:
        self._given = Operands(types, names)
        self._named = types.name
        self._block = "%entry"
        self._phis: dict[tuple[str, str], list[_Phi]] = defaultdict(list)
        self._jumped: set[str] = set()
        self._target = ""
        self._do: Mapping[str, Callable[[Tokens], tuple[Type, str]]] = {
            "load": self._load, "getelementptr": self._place, "extractvalue": self._extract,
        }  # fmt: skip
        self._act: Mapping[str, Callable[[Tokens], str]] = {
            "store": self._store, "br": self._branch, "switch": self._switch,
            "ret": self._return, "alloca": self._alloca, "insertvalue": self._insert,
            "call": self._call,
        }  # fmt: skip

    # -- the whole

    def head(self, line: str) -> str:
        """Return the head of the function."""
        tokens = Tokens(line)
        hidden = "hidden" in line.split("@")[0]
        tokens.pass_attributes()
        result = self._named(self._given.types.read(tokens))
        word = tokens.take()
        tokens.expect("(")
        given = []
        while not tokens.passed(")"):
            kind = self._given.types.read(tokens)
            tokens.pass_attributes()
            given.append(f"{self._named(kind)} {self._given.locals.of(tokens.take())}")
            tokens.passed(",")
        start = (
            f"{result} {word[1:]}" if hidden else f"static {result} {self._given.names.of(word)}"
        )
        listed = fill(
            ", ".join(given) or "void", 92, initial_indent="    ", subsequent_indent="    "
        )
        return f"{start}(\n{listed})"

    def all(self, lines: Sequence[str]) -> list[str]:
        """Return all statements; labels that nothing jumps to are left out."""
        named = []
        for line in lines:
            if not line.startswith(" "):
                self._block = f"%{line.split(':')[0]}"
            named.append((self._block, line))
        declared = [self._note_phi(*one) for one in named if _PHI.match(one[1])]
        found: list[Line] = []
        for self._block, line in named:
            self._target = ""
            if not line.startswith(" "):
                found.append(Line(f"{self._given.locals.of(self._block)}: ;", label=self._block))
            elif _PHI.match(line):
                name = self._given.locals.of(line.split()[0])
                found.append(Line(f"    {name} = {name}_next;"))
            else:
                said = self._statement(line.strip())
                found.append(Line(f"    {said}", self._target))
        jumped = [one for one in found if not one.label or one.label in self._jumped]
        return declared + [one.text for one in needed(jumped)]

    def _note_phi(self, block: str, line: str) -> str:
        """Note what a phi is after each block; return the two variables that it needs."""
        tokens = Tokens(line)
        name = self._given.locals.of(tokens.take())
        tokens.expect("=")
        tokens.expect("phi")
        kind = self._given.types.read(tokens)
        while tokens.passed("["):
            value = self._given.value(tokens, kind)
            tokens.expect(",")
            self._phis[tokens.take(), block].append(_Phi(name, value))
            tokens.expect("]")
            tokens.passed(",")
        said = self._named(kind)
        return f"    {said} {name}; {said} {name}_next;"

    def _statement(self, line: str) -> str:
        """Return an instruction as a statement; `_target` is what it does no more than set."""
        tokens = Tokens(line)
        try:
            if tokens.peek(1) == "=":
                self._target = self._given.locals.of(tokens.take())
                tokens.expect("=")
            tokens.pass_words("tail", "musttail", "notail")
            word = tokens.take()
            if word in self._act:
                return self._act[word](tokens)
            own = self._do.get(word)
            kind, said = own(tokens) if own else computed(word, tokens, self._given)
            return f"{self._named(kind)} {self._target} = {said};"
        except (KeyError, IndexError, ValueError) as error:
            raise BuildError(f"there is no C for {line[:200]} ({error}).") from error

    # -- memory

    def _alloca(self, tokens: Tokens) -> str:
        kind = self._given.types.read(tokens)
        self._given.variables[self._target] = kind
        return f"{self._named(kind)} {self._target};"

    def _load(self, tokens: Tokens) -> tuple[Type, str]:
        kind = self._given.types.read(tokens)
        tokens.expect(",")
        return kind, self._given.at(self._given.typed(tokens)[1], kind)

    def _store(self, tokens: Tokens) -> str:
        kind, value = self._given.typed(tokens)
        tokens.expect(",")
        where = self._given.at(self._given.typed(tokens)[1], kind)
        if where in self._given.variables:
            self._target = where
        return f"{where} = {value};"

    def _place(self, tokens: Tokens) -> tuple[Type, str]:
        tokens.pass_words(*FLAGS)
        kind = self._given.types.read(tokens)
        tokens.expect(",")
        pointer = self._given.typed(tokens)[1]
        tokens.expect(",")
        first = _number(self._given.typed(tokens)[1])
        path = "" if first == "0" else f"[{first}]"
        where = self._given.at(pointer, kind) if not path else f"(({self._named(kind)} *){pointer})"
        if where[0] == "*":
            where = f"({where})"
        while tokens.passed(","):
            index = _number(self._given.typed(tokens)[1])
            kind, part = part_of(kind, index)
            path += part
        return "ptr", f"(void *)&{where}{path}"

    # -- structures

    def _extract(self, tokens: Tokens) -> tuple[Type, str]:
        kind, value = self._given.typed(tokens)
        kind, path = self._path(tokens, kind)
        return kind, value + path

    def _insert(self, tokens: Tokens) -> str:
        target = self._target
        kind, value = self._given.typed(tokens)
        tokens.expect(",")
        part = self._given.typed(tokens)[1]
        path = self._path(tokens, kind)[1]
        return f"{self._named(kind)} {target} = {value}; {target}{path} = {part};"

    def _path(self, tokens: Tokens, kind: Type) -> tuple[Type, str]:
        """Take the places behind a structure; return the type of the part, and how C reaches it."""
        path = ""
        while tokens.passed(","):
            kind, part = part_of(kind, tokens.take())
            path += part
        return kind, path

    # -- what leads elsewhere

    def _call(self, tokens: Tokens) -> str:
        tokens.pass_attributes()
        kind = self._given.types.read(tokens)
        word = tokens.take()
        tokens.expect("(")
        given = []
        while not tokens.passed(")"):
            given.append(self._given.typed(tokens)[1])
            tokens.passed(",")
        name = word[1:].strip('"')
        if name.startswith(_SKIPPED):
            return ";"
        if name.startswith(("llvm.memcpy.", "llvm.memset.", "llvm.memmove.")):
            return f"{name.split('.')[1]}({', '.join(given[:3])});"
        said = f"{self._called(word, name)}({', '.join(given)});"
        target, self._target = self._target, ""  # a call does more than set it
        return said if kind == "void" else f"{self._named(kind)} {target} = {said}"

    def _called(self, word: str, name: str) -> str:
        """Return what C calls a function."""
        if name.startswith("llvm."):
            _, short, *kind = name.split(".")
            if kind != ["f64"]:
                raise ValueError(f"{name} is not known")
            return _LIBRARY.get(short, short)
        return self._given.names.of(word) if name.startswith("_ZN") else name

    def _branch(self, tokens: Tokens) -> str:
        if tokens.passed("label"):
            return self._goto(tokens.take())
        condition = self._given.typed(tokens)[1]
        tokens.expect(",")
        tokens.expect("label")
        first = self._goto(tokens.take())
        tokens.expect(",")
        tokens.expect("label")
        return f"if ({condition}) {{ {first} }} else {{ {self._goto(tokens.take())} }}"

    def _switch(self, tokens: Tokens) -> str:
        value = self._given.typed(tokens)[1]
        tokens.expect(",")
        tokens.expect("label")
        other = self._goto(tokens.take())
        tokens.expect("[")
        cases = []
        while not tokens.passed("]"):
            case = self._given.typed(tokens)[1]
            tokens.expect(",")
            tokens.expect("label")
            cases.append(f"case {case}: {self._goto(tokens.take())}")
        return f"switch ({value}) {{ {' '.join(cases)} default: {other} }}"

    def _goto(self, label: str) -> str:
        """Return the jump to a block; what its phis become is set first."""
        self._jumped.add(label)
        taken = [f"{one.name}_next = {one.value};" for one in self._phis[self._block, label]]
        return " ".join([*taken, f"goto {self._given.locals.of(label)};"])

    def _return(self, tokens: Tokens) -> str:
        if tokens.passed("void"):
            return "return;"
        return f"return {self._given.typed(tokens)[1]};"


def _number(said: str) -> str:
    """Return an index as it stands in brackets."""
    found = re.fullmatch(r"INT64_C\((-?\d+)\)", said)
    return found[1] if found else said
