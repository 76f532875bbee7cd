"""The operands of LLVM's instructions in one function, as expressions of C."""

from __future__ import annotations

from .c_types import Names, Tokens, Type, Types

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
