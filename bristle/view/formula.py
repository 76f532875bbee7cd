"""Formulas of docstrings as MathML, which browsers set themselves: no script and no network."""

from __future__ import annotations

import re
from html import escape

_GREEK = ["alpha", "beta", "gamma", "delta", "eta", "mu", "rho", "sigma", "tau"]
GREEK = dict(zip(_GREEK, "αβγδημρστ", strict=True))
_SIGNS = {"-": "−", "+-": "±", "<=": "≤", ">=": "≥", "*": "·"}  # noqa: RUF001
_TOKEN = re.compile(
    r"\s*(?P<number>[−-]?\d[\d.]*(?: × 10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?|−\d[\d.]*)"  # noqa: RUF001
    r"|\s*(?P<name>[A-Za-z]\w*)|\s*(?P<sign><=|>=|\+-|[-+−±*/^()|=<>',])"  # noqa: RUF001
)
_OPEN, _CLOSE = "<mrow><mo>(</mo>", "<mo>)</mo></mrow>"
_RELATIONS = ("=", "<=", ">=", "<", ">", ",")
_SUMS = ("+", "-", "−", "±", "+-")  # noqa: RUF001

_ROOM = 95
"""Characters that a line of a page has room for; a longer formula is set smaller."""
_SMALLEST = 0.7


def formula(text: str) -> str:
    """Return a formula as a block of MathML; what is no formula by this grammar, as code.

    Parameters
    ----------
    text : str
        As docstrings have it: `f = (f_c + f_v V) sgn(v) + k x^2/2`; juxtaposed factors are
        multiplied, `a_b` has an index, a prime is a derivative.
    """
    try:
        inside = _Parser(text).whole()
    except _NotAFormulaError:
        return f'<div class="formula"><code>{escape(text)}</code></div>'
    size = (
        f' style="font-size: {max(_SMALLEST, _ROOM / len(text)):.2f}em"'
        if len(text) > _ROOM
        else ""
    )
    return f'<div class="formula"><math display="block"{size}><mrow>{inside}</mrow></math></div>'


class _NotAFormulaError(ValueError):
    """The text leaves the grammar of formulas."""


class _Parser:
    """Reads a formula from left to right; each method returns the MathML of what it read."""

    def __init__(self, text: str) -> None:
        self.tokens: list[tuple[str, str, bool]] = []
        at = 0
        text = text.rstrip()
        while at < len(text):
            match = _TOKEN.match(text, at)
            if match is None:
                raise _NotAFormulaError(text)
            kind = str(match.lastgroup)
            token = match[kind]
            close = match.start(kind) == at  # no blank before it
            if kind == "number" and token[0] in "-−" and self._ends_a_factor():  # noqa: RUF001
                kind, token = "sign", token[0]
                self.tokens.append((kind, token, close))
                at = match.start("number") + 1
                continue
            self.tokens.append((kind, token, close))
            at = match.end()
        self.at, self.bars = 0, False

    def _ends_a_factor(self) -> bool:
        return bool(self.tokens) and (
            self.tokens[-1][0] != "sign" or self.tokens[-1][1] in (")", "'", "|")
        )

    def _next(self) -> str:
        return self.tokens[self.at][1] if self.at < len(self.tokens) else ""

    def _take(self, *wanted: str) -> str:
        token = self._next()
        if wanted and token not in wanted:
            raise _NotAFormulaError(token)
        self.at += 1
        return token

    def whole(self) -> str:
        """Return all of it."""
        found = self._relation()
        if self.at != len(self.tokens):
            raise _NotAFormulaError(self._next())
        return found

    def _relation(self) -> str:
        parts = [self._sum()]
        while self._next() in _RELATIONS:
            parts.append(_sign(self._take()))
            parts.append(self._sum())
        return "".join(parts)

    def _sum(self) -> str:
        parts = []
        if self._next() in _SUMS:
            parts.append(_sign(self._take()))
        parts.append(self._product())
        while self._next() in _SUMS:
            parts.append(_sign(self._take()))
            parts.append(self._product())
        return "".join(parts)

    def _product(self) -> str:
        parts = [self._factor()]
        while self.at < len(self.tokens):
            token = self._next()
            if token == "/":
                self._take()
                above, below = _bare(parts[-1]), _bare(self._factor())
                parts[-1] = f"<mfrac><mrow>{above}</mrow><mrow>{below}</mrow></mfrac>"
            elif token == "*":
                parts += [_sign(self._take()), self._factor()]
            elif token in (*_RELATIONS, *_SUMS, ")", "^", "'") or (token == "|" and self.bars):
                break
            else:
                parts += ['<mspace width="0.17em"/>', self._factor()]
        return "".join(parts)

    def _factor(self) -> str:
        base = self._atom()
        while self._next() == "'":
            self._take()
            base = f"<msup><mrow>{base}</mrow><mo>′</mo></msup>"  # noqa: RUF001
        if self._next() == "^":
            self._take()
            minus = _sign(self._take()) if self._next() in ("-", "−") else ""  # noqa: RUF001
            power = _bare(self._atom())
            base = f"<msup><mrow>{base}</mrow><mrow>{minus}{power}</mrow></msup>"
        return base

    def _atom(self) -> str:
        kind = self.tokens[self.at][0] if self.at < len(self.tokens) else ""
        if kind == "number":
            return f"<mn>{escape(self._take())}</mn>"
        if kind == "name":
            return self._name()
        if self._next() == "(":
            return f"{_OPEN}{self._inside()}{_CLOSE}"
        self._take("|")
        outer, self.bars = self.bars, True
        inner = self._sum()
        self._take("|")
        self.bars = outer
        return f"<mrow><mo>|</mo>{inner}<mo>|</mo></mrow>"

    def _name(self) -> str:
        name = self._take()
        called = self._next() == "(" and self.tokens[self.at][2]
        if called and name == "sqrt":
            return f"<msqrt>{self._inside()}</msqrt>"
        shown = "<mo>∫</mo>" if name == "int" else _identifier(name)
        return f"{shown}{_OPEN}{self._inside()}{_CLOSE}" if called else shown

    def _inside(self) -> str:
        self._take("(")
        outer, self.bars = self.bars, False
        inner = self._relation()
        self._take(")")
        self.bars = outer
        return inner


def _bare(part: str) -> str:
    """Return a part without the brackets around the whole of it, unless it is a list."""
    inner = part.removeprefix(_OPEN).removesuffix(_CLOSE)
    whole = len(part) - len(inner) == len(_OPEN) + len(_CLOSE)
    return inner if whole and _OPEN not in inner and "<mo>,</mo>" not in inner else part


def _sign(token: str) -> str:
    return f"<mo>{escape(_SIGNS.get(token, token))}</mo>"


def _identifier(name: str) -> str:
    base, _, index = name.partition("_")
    shown = f"<mi>{GREEK.get(base, base)}</mi>"
    if not index:
        return shown
    return f"<msub>{shown}<mi>{GREEK.get(index, index).replace('_', ' ')}</mi></msub>"
