"""The equations of a model with its numbers: those that laws and effects state of themselves."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ..core.text import with_interval
from ..physics.drive import VOLTAGE, drive_named
from ..physics.effect import EFFECTS, plain_name
from ..physics.laws import LAWS, base_and_variant
from ..units import convert
from .model import Model

_COMMAND = re.compile(r"\bV(?=(_felt)?\b)")
"""The command in formulas, which are declared for a voltage; `V_felt` is what reaches the fluid."""

_NOTHING = re.compile(r"(?<!\w)\((\([^()]*\)|[^()\s]+) \+ 0 V(?:_felt)?\)| \+ 0 V(?:_felt)?\b")
"""A term of the command that is zero."""

_LAG = re.compile(r"(\w+)' = .*\bV\b")
"""The equation of a state that follows the command."""

_APART = re.compile(r"[,;]\s{2,}")
"""What stands between two formulas in a line."""


class Equation(NamedTuple):
    """A formula of a law or an effect: as its docstring has it, and with the model's numbers.

    `numbers` has values in SI, `intervals` the half of each 95 % interval as well.
    """

    of: str
    formula: str
    numbers: str
    intervals: str


def formulas(docstring: str) -> list[str]:
    """Return the formulas of a docstring: behind the colon of its first line, then indented ones.

    Only those of the first indented block count; what has no equals sign is prose.
    """
    lines = docstring.strip("\n").splitlines()
    if not lines:
        return []
    first = lines[0].partition(": ")[2].strip().rstrip(".")
    margin = min((_indent(line) for line in lines[1:] if line.strip()), default=0)
    block: list[str] = []
    for line in lines[1:]:
        if line.strip() and _indent(line) > margin:
            block.append(line.strip())
        elif block or line.strip():
            break
    pieces = [first] if "=" in first else []
    if pieces:  # several share the first line
        pieces = re.split(r", (?=\w+'? = )", first)
    for line in block:
        pieces += [piece.strip() for piece in _APART.split(line)]
    return [piece for piece in pieces if "=" in piece]


def equations(model: Model) -> list[Equation]:
    """Return the equations of a damper's law and of its effects, with the model's numbers.

    Not those of a law in another form than its own, whose formula would be another one: of a chosen
    form of the command, and of a variant that does without a part.
    """
    if model.only_shown:
        return []
    law = LAWS[model.law] if model.law in LAWS else base_and_variant(model.law)[0]
    values, facts = model.values, model.facts
    texts: dict[str, tuple[str, str]] = {}
    for name, value in values.items():
        fact, unit = facts[name], model.declared(name).unit
        std = fact.std
        if std is not None and fact.unit != unit:
            std = convert(fact.value + std, fact.unit, unit) - value
        texts[name] = with_interval(value, std)
    out: list[Equation] = []
    if not law.form and law.site == "damper" and not law.idle(values):
        own = {name: text for name, text in texts.items() if "." not in name}
        told = _with(law.name, law.__doc__ or "", own)
        moves = [name for name in law.driven() if law.parameters[name].bounds[0] <= 0.0]
        out += told if any(values.get(name) for name in moves) else _without_lag(told)
    for effect in model.effects:
        known = EFFECTS[plain_name(effect)]
        begin = f"{effect}."
        own = {n.removeprefix(begin): t for n, t in texts.items() if n.startswith(begin)}
        out += _with(effect, known.__doc__ or "", own)
    symbol = drive_named(model.drive).symbol
    out = [
        one._replace(numbers=_without_zero(one.numbers), intervals=_without_zero(one.intervals))
        for one in out
    ]
    return [
        Equation(one.of, *(_COMMAND.sub(symbol, formula) for formula in one[1:])) for one in out
    ]


def _without_lag(told: Sequence[Equation]) -> list[Equation]:
    """Return equations without that of a command which lags, and under which nothing moves."""
    lags = [one for one in told if _LAG.match(one.formula)]
    symbols = "|".join(one.formula.partition("'")[0] for one in lags)
    return [
        one._replace(**{
            field: re.sub(rf"\b({symbols})\b", "V_felt", text)
            for field, text in one._asdict().items() if field != "of"
        })
        for one in told
        if one not in lags
    ] if lags else [*told]  # fmt: skip


def _without_zero(formula: str) -> str:
    """Return a formula without terms of the command that are zero."""
    return _NOTHING.sub(lambda match: match[1] or "", formula)


def symbols(model: Model, told: Sequence[Equation]) -> str:
    """Return the sentence about units; it says what the command's symbol is, but for a voltage."""
    drive = drive_named(model.drive)
    named = drive != VOLTAGE and any(
        re.search(rf"\b{drive.symbol}(_felt)?\b", one.formula) for one in told
    )
    return (
        f"In SI units; {drive.symbol} is the {drive.name} [{drive.unit}]."
        if named
        else "In SI units."
    )


def _with(of: str, docstring: str, texts: Mapping[str, tuple[str, str]]) -> list[Equation]:
    """Return the equations of a docstring with the texts of values and intervals by name."""
    return [
        Equation(
            of, formula, _filled(formula, {name: text for name, (text, _) in texts.items()}),
            _filled(formula, {
                name: text if half == "-" else f"({text} {half})"
                for name, (text, half) in texts.items()
            }),
        )
        for formula in formulas(docstring)
    ]  # fmt: skip


def _filled(formula: str, texts: Mapping[str, str]) -> str:
    """Return a formula with the names of parameters replaced by texts."""

    def number(match: re.Match[str]) -> str:
        text = texts.get(match[0])
        if text is None:
            return match[0]
        alone = text[0].isdigit() or text.startswith("(")
        return text if (alone and " " not in text) or text.startswith("(") else f"({text})"

    filled = re.sub(r"(?<![\w.])[A-Za-z]\w*", number, formula)
    return re.sub(r"(?<=\d) (?=\d)", " \u00b7 ", filled)  # two numbers side by side


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())
