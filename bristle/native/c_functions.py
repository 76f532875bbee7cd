"""A component's compiled functions as C: one statement per instruction."""

from __future__ import annotations

import math
import re
import struct
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import NamedTuple

from ..errors import BuildError

_WORD = re.compile(
    r'\s*([%@]"[^"]*"|[%@!][\w.$-]*|c"[^"]*"|-?(?:0x[0-9A-Fa-f]+|\d+(?:\.\d*(?:e[+-]?\d+)?)?)(?![\w.])'
    r"|[\w.]+|[][{}()<>,=*#]|\.\.\.)"
)

_PLAIN = {
    "void": "void", "double": "double", "float": "float", "i1": "bool", "i8": "int8_t",
    "i16": "int16_t", "i32": "int32_t", "i64": "int64_t", "ptr": "void *",
}  # fmt: skip


class Tokens:
    """The words of a line, taken one by one."""

    def __init__(self, line: str) -> None:
        self._words = _WORD.findall(line)
        self._at = 0

    def peek(self, ahead: int = 0) -> str:
        """Return a word without taking it; "" behind the last."""
        at = self._at + ahead
        return self._words[at] if at < len(self._words) else ""

    def take(self) -> str:
        """Return the next word."""
        self._at += 1
        return str(self._words[self._at - 1])

    def expect(self, word: str) -> None:
        """Take a word that must be there."""
        found = self.take()
        if found != word:
            raise ValueError(f"{word!r} is expected, not {found!r}")

    def passed(self, *words: str) -> bool:
        """Take the next word if it is one of these; return whether it was."""
        found = self.peek() in words
        self._at += found
        return found

    def pass_words(self, *words: str) -> None:
        """Take what follows as long as it is one of these."""
        while self.passed(*words):
            pass

    def pass_attributes(self) -> None:
        """Take what is said of a value or of a type: `noalias`, `captures(none)`, `align 8`."""
        while re.match(r"[a-z]", self.peek()) and self.peek() not in (*_LITERAL, *_PLAIN):
            word = self.take()
            if self.peek() == "(":
                depth = 0
                while depth or self.peek() == "(":
                    depth += {"(": 1, ")": -1}.get(self.take(), 0)
            elif word == "align":
                self.take()


_LITERAL = {"true", "false", "null", "undef", "poison", "zeroinitializer", "c"}


@dataclass(frozen=True)
class CStructure:
    """A type with parts."""

    parts: tuple[Type, ...]


@dataclass(frozen=True)
class Items:
    """A type of several items alike."""

    count: int
    item: Type


Type = str | CStructure | Items
"""A plain type by its name in LLVM's text, or one that is made of others."""


class Types:
    """The types of a text: those that are made of others get a name and a definition."""

    def __init__(self) -> None:
        self.definitions: list[str] = []
        self._names: dict[Type, str] = {}

    def read(self, tokens: Tokens) -> Type:
        """Take a type.

        Raises
        ------
        ValueError
            If it is none that is known.
        """
        word = tokens.take()
        if word in _PLAIN:
            return word
        if word == "{":
            parts: list[Type] = []
            while not tokens.passed("}"):
                parts.append(self.read(tokens))
                tokens.passed(",")
            return CStructure(tuple(parts))
        if word == "[":
            count = int(tokens.take())
            tokens.expect("x")
            found = Items(count, self.read(tokens))
            tokens.expect("]")
            return found
        raise ValueError(f"{word!r} is no type")

    def name(self, kind: Type) -> str:
        """Return a type's name in C; one that has none yet is defined."""
        if isinstance(kind, str):
            return _PLAIN[kind]
        if kind not in self._names:
            if isinstance(kind, Items):
                inside = f"{self.name(kind.item)} at[{kind.count}];"
            else:
                parts = [f"{self.name(one)} f{k};" for k, one in enumerate(kind.parts)]
                inside = " ".join(parts) or "char none;"
            self._names[kind] = f"T{len(self._names)}"
            self.definitions.append(f"typedef struct {{ {inside} }} {self._names[kind]};")
        return self._names[kind]

    def constant(self, tokens: Tokens, kind: Type) -> str:
        """Take a constant of a type and return it as an expression of C.

        Raises
        ------
        ValueError
            If it is none.
        """
        word = tokens.take()
        if word in ("zeroinitializer", "undef", "poison", "null"):
            return "0" if isinstance(kind, str) else f"({self.name(kind)}){{0}}"
        if word in ("{", "["):
            items: list[str] = []
            while not tokens.passed("}", "]"):
                items.append(self.constant(tokens, self.read(tokens)))
                tokens.passed(",")
            inside = ", ".join(items)
            inside = f"{{{inside}}}" if isinstance(kind, Items) else inside
            return f"({self.name(kind)}){{{inside}}}"
        if word.startswith('c"'):
            return f"({self.name(kind)}){{{{{', '.join(_bytes(word[2:-1]))}}}}}"
        if kind == "double":
            return _double(word)
        if kind == "i1":
            return {"true": "1", "false": "0"}[word]
        return _whole(int(word), str(kind))


def part_of(kind: Type, index: str) -> tuple[Type, str]:
    """Return the type of a part of a structure or an array, and how C reaches it.

    Parameters
    ----------
    kind : Type
    index : str
        Its place: a number, or of an array any expression of C.
    """
    if isinstance(kind, Items):
        return kind.item, f".at[{index}]"
    if isinstance(kind, CStructure):
        return kind.parts[int(index)], f".f{index}"
    raise ValueError(f"{kind} has no parts")


def _double(word: str) -> str:
    """Return a number of LLVM, decimal or the bits, as C that means the same bits."""
    if word.startswith("0x"):
        value = struct.unpack(">d", int(word, 16).to_bytes(8, "big"))[0]
    else:
        value = float(word)
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY" if value > 0.0 else "-INFINITY"
    return repr(float(value))


def _bytes(text: str) -> list[str]:
    """Return a text's bytes, of which LLVM writes some as two hexadecimal digits, as numbers."""
    found = re.findall(r"\\([0-9A-F]{2})|(.)", text)
    values = [int(code, 16) if code else ord(plain) for code, plain in found]
    return [str(value - 256 if value > 127 else value) for value in values]


def _whole(value: int, kind: str) -> str:
    if kind != "i64":
        return str(value)
    return f"INT64_C({value})" if value > -(2**63) else "INT64_MIN"


class Names:
    """Names in C for words of LLVM's: readable, and no two alike."""

    def __init__(self) -> None:
        self._known: dict[str, str] = {}
        self._taken: set[str] = set()

    def has(self, word: str) -> bool:
        """Return whether a word has a name."""
        return word in self._known

    def of(self, word: str) -> str:
        """Return the name of a word: that which it had before."""
        if word not in self._known:
            plain = _plain_name(word[1:].strip('"'))
            name, count = plain, 1
            while name in self._taken:
                count += 1
                name = f"{plain}_{count}"
            self._taken.add(name)
            self._known[word] = name
        return self._known[word]


def _plain_name(word: str) -> str:
    """Return a word as C takes it: of `_ZN7bristle7physics3law5forceB3v47...` law_force.

    An underscore at its end keeps it apart from the words of C and of its library.
    """
    parts, rest = list[str](), word[3:] if word.startswith("_ZN") else ""
    while found := re.match(r"\d+", rest):
        end = found.end() + int(found[0])
        parts.append(rest[found.end() : end])
        rest = rest[end:]
    plain = re.sub(r"\W", "_", "_".join(parts[-2:]) or word).strip("_")
    return f"v{plain}_" if plain[:1].isdigit() else f"{plain}_"


_NOTHING = "(void *)0"
"""Address of what only Python needs."""


class Operands:
    """Reads operands.

    Parameters
    ----------
    types, names : Types, Names
        Of the whole text.

    Attributes
    ----------
    types, names
    locals : Names
        Of the function's values and labels.
    variables : dict
        What stands in memory, by its name in C: the type.
    """

    def __init__(self, types: Types, names: Names) -> None:
        self.types, self.names, self.locals = types, names, Names()
        self.variables: dict[str, Type] = {}

    def value(self, tokens: Tokens, kind: Type) -> str:
        """Take an operand of a type."""
        word = tokens.peek()
        if word[:1] == "%":
            name = self.locals.of(tokens.take())
            return f"&{name}" if name in self.variables else name
        if word[:1] == "@":
            tokens.take()
            return f"(void *)&{self.names.of(word)}" if self.names.has(word) else _NOTHING
        return self.types.constant(tokens, kind)

    def typed(self, tokens: Tokens) -> tuple[Type, str]:
        """Take a type and an operand of it."""
        kind = self.types.read(tokens)
        tokens.pass_attributes()
        return kind, self.value(tokens, kind)

    def pair(self, tokens: Tokens) -> tuple[Type, str, str]:
        """Take a type and two operands of it."""
        kind, one = self.typed(tokens)
        tokens.expect(",")
        return kind, one, self.value(tokens, kind)

    def at(self, pointer: str, kind: Type) -> str:
        """Return what a pointer leads to, as a type."""
        if pointer[0] == "&" and self.variables.get(pointer[1:]) == kind:
            return pointer[1:]
        return f"*({self.types.name(kind)} *){pointer}"


_WRAPPED = {"add": "+", "sub": "-", "mul": "*", "shl": "<<"}
"""What may run over, and so is unsigned in C."""
_UNSIGNED = {"udiv": "/", "urem": "%", "lshr": ">>"}
_OPERATORS = {
    "sdiv": "/", "srem": "%", "ashr": ">>", "and": "&", "or": "|", "xor": "^",
    "fadd": "+", "fsub": "-", "fmul": "*", "fdiv": "/",
}  # fmt: skip
_ORDER = {"eq": "==", "ne": "!=", "gt": ">", "ge": ">=", "lt": "<", "le": "<="}
_OPPOSITE = {"gt": "<=", "ge": "<", "lt": ">=", "le": ">"}
_CASTS = {
    "sitofp": "(double){}", "uitofp": "(double)({unsigned}){}", "fptosi": "({to}){}",
    "sext": "({to}){}", "zext": "({to})({unsigned}){}", "trunc": "({to}){}", "freeze": "{}",
    "bitcast": "{}", "ptrtoint": "({to})(intptr_t){}", "inttoptr": "(void *)(intptr_t){}",
}  # fmt: skip
FLAGS = (
    "nsw", "nuw", "exact", "fast", "nnan", "ninf", "nsz", "arcp", "contract", "afn", "reassoc",
    "nneg", "disjoint", "inbounds", "samesign",
)  # fmt: skip
"""What LLVM may assume, and C does without."""


def computed(word: str, tokens: Tokens, operands: Operands) -> tuple[Type, str]:
    """Return the type and the expression of an instruction.

    Parameters
    ----------
    word : str
        Its name.
    tokens : Tokens
        What stands behind it.
    operands : Operands

    Raises
    ------
    KeyError, ValueError
        If it has no C here.
    """
    tokens.pass_words(*FLAGS)
    if word in _CASTS:
        return _cast(word, tokens, operands)
    if word == "fneg":
        kind, value = operands.typed(tokens)
        return kind, f"-({value})"
    if word == "select":
        return _select(tokens, operands)
    if word in ("icmp", "fcmp"):
        how = tokens.take()
        kind, one, two = operands.pair(tokens)
        compare = _compare if word == "icmp" else _compare_reals
        return "i1", compare(how, kind, one, two)
    kind, one, two = operands.pair(tokens)
    if word in _WRAPPED or word in _UNSIGNED:
        sign, own = _WRAPPED.get(word) or _UNSIGNED[word], _unsigned(kind)
        return kind, f"({operands.types.name(kind)})(({own}){one} {sign} ({own}){two})"
    if word == "frem":
        return kind, f"fmod({one}, {two})"
    return kind, f"{one} {_OPERATORS[word]} {two}"


def _cast(word: str, tokens: Tokens, operands: Operands) -> tuple[Type, str]:
    kind, value = operands.typed(tokens)
    to = operands.types.read(tokens) if tokens.passed("to") else kind
    if word == "bitcast" and kind != to:
        raise ValueError(f"the bits of {kind} as {to}")
    if word == "trunc" and to == "i1":
        return to, f"{value} & 1"
    name = operands.types.name(to)
    if word == "sext" and kind == "i1":
        return to, f"-({name}){value}"
    unsigned = _unsigned(kind) if word in ("zext", "uitofp") else ""
    return to, _CASTS[word].format(value, to=name, unsigned=unsigned)


def _select(tokens: Tokens, operands: Operands) -> tuple[Type, str]:
    condition = operands.typed(tokens)[1]
    tokens.expect(",")
    kind, one = operands.typed(tokens)
    tokens.expect(",")
    return kind, f"{condition} ? {one} : {operands.typed(tokens)[1]}"


def _compare(how: str, kind: Type, one: str, two: str) -> str:
    if how[0] == "u":
        one, two = (f"({_unsigned(kind)}){value}" for value in (one, two))
    return f"{one} {_ORDER[how if how in ('eq', 'ne') else how[1:]]} {two}"


def _compare_reals(how: str, kind: Type, one: str, two: str) -> str:
    """Return a comparison; what begins with `o` is false where one is NaN, with `u` true."""
    if how in ("ord", "uno"):
        return f"{'!' if how == 'ord' else ''}isunordered({one}, {two})"
    if how in ("one", "ueq"):  # C's own == and != are oeq and une
        return f"{'!' if how == 'ueq' else ''}islessgreater({one}, {two})"
    if how[0] == "o" or how == "une":
        return f"{one} {_ORDER[how[1:]]} {two}"
    return f"!({one} {_OPPOSITE[how[1:]]} {two})"


def _unsigned(kind: Type) -> str:
    """Return the unsigned type of C as large as a whole number."""
    return "bool" if kind == "i1" else "uintptr_t" if kind == "ptr" else f"uint{str(kind)[1:]}_t"


class CLine(NamedTuple):
    """A statement: its text, the variable that it does no more than set, the label that it is."""

    text: str
    sets: str = ""
    label: str = ""


def needed(lines: list[CLine]) -> list[CLine]:
    """Return the lines without those that set what nothing reads."""
    while True:
        words = [set(re.findall(r"\w+", one.text)) for one in lines]
        read: set[str] = set()
        for one, said in zip(lines, words, strict=True):
            read |= said - {one.sets}
        kept = [one for one in lines if not one.sets or one.sets in read]
        if len(kept) == len(lines):
            return kept
        lines = kept


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
        found: list[CLine] = []
        for self._block, line in named:
            self._target = ""
            if not line.startswith(" "):
                found.append(CLine(f"{self._given.locals.of(self._block)}: ;", label=self._block))
            elif _PHI.match(line):
                name = self._given.locals.of(line.split()[0])
                found.append(CLine(f"    {name} = {name}_next;"))
            else:
                said = self._statement(line.strip())
                found.append(CLine(f"    {said}", self._target))
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


# LLVM's text of compiled functions as C: what every compiler takes, and no machine's own.
#
# numba writes few of LLVM's instructions and keeps in memory what changes, so each instruction is
# one statement here. Structures keep their parts, and the compiler at hand knows their sizes. What
# numba does not write today is refused with its line.

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
