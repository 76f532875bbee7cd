"""Types, constants and words of LLVM's text, as C writes them."""

from __future__ import annotations

import math
import re
import struct
from dataclasses import dataclass

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
