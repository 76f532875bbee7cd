"""Instructions of LLVM that compute a value from others, as expressions of C."""

from __future__ import annotations

from .c_operands import Operands
from .c_types import Tokens, Type

_WRAPPED = {"add": "+", "sub": "-", "mul": "*", "shl": "<<"}
"""What may run over, and so is unsigned in C."""
_UNSIGNED = {"udiv": "/", "urem": "%", "lshr": ">>"}
_PLAIN = {
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
    return kind, f"{one} {_PLAIN[word]} {two}"


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
