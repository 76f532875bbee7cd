"""The file of a learned effect, in the standard library alone.

What is fitted, exported and read by the user is the same text.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

from ..core.text import in_docstring, literal
from ..physics.drive import drive_named, unit_for
from .curve import BOUND, Curve, CurveFormula, bounds_of, followed
from .signals import FOLLOWING, GIVEN, MEMORIES, SLIP


def class_data(value: object) -> str:
    """Return a dictionary of texts, a tuple of names or a bool as source, in double quotes."""
    if isinstance(value, dict):
        return json.dumps(value, ensure_ascii=False)
    return f"{value!r}".replace("'", '"')


def row(begin: str, values: Sequence[float], end: str = "") -> list[str]:
    """Return the lines of a tuple of numbers, some to a line."""
    texts = [f"{float(f'{value:.6g}')!r}," for value in values]  # 0.0, for numba wants one type
    rows = [" ".join(texts[k : k + 6]) for k in range(0, len(texts), 6)]
    return [f"{begin}(", *(f"    {one}" for one in rows), f"){end}"]


MATH = tuple(
    one.__name__ for one in (math.copysign, math.cos, math.exp, math.log, math.sin, math.tanh)
)
"""Functions that a hook may import."""

POSITIVE = ("tau", "way", "early", "d", "frequency", "damping")
"""Parameters that are times, lengths and scales: they stay above zero."""

Declared = tuple[str, float, str, str]
"""A parameter's name, value, unit and meaning."""


def effect_text(name: str, curve: Curve, origin: str, formula: CurveFormula | None = None) -> str:
    """Return the text of the effect's file of a curve.

    Parameters
    ----------
    name : of the effect, and of its file
    curve : with the values to begin with
    origin : what it was learned from and when, for the file's `source`
    formula : what stands for the table, None for the table itself
    """
    body = _hooks(curve, formula)
    parameters = [
        *_declared([(n, value, *MEMORIES[n]) for n, value in curve.memory]),
        *_only_followed(curve),
        *(_of_formula(formula) if formula else []),
        *_only_value(curve),
        *_only_storey(curve),
    ]
    table = formula is None and not curve.of.parameter
    lines = [
        *_imports(name, curve, body, bool(parameters), table),
        *_about(name, curve, formula),
        "",
        f'    name = "{name}"',
        f'    sites = ("{curve.of.site}",)',
        *_fields(curve),
        f"    source = {literal(origin)}",
        f"    expect = {literal(f'an error that depends on {curve.of.cause or _signals(curve)}')}",
        "    start_shares = ({},)  # the defaults are those of this rig: no search scales them",
    ]
    held = _assumed(curve, table)
    if held:
        lines += _listed(held)
    if parameters:
        lines += ["    parameters = {", *parameters, "    }"]
    if table:
        lines += _table(curve)
    return "\n".join([*lines, "", *body]) + "\n"


def _assumed(curve: Curve, table: bool) -> tuple[str, ...]:
    """Return the parameters that stay: what a channel tells, and in a table some more.

    These are knots at the law's own constant, and where the way turns.
    """
    follows = (FOLLOWING,) if curve.measured else ()
    if not table:
        return follows
    held = tuple(curve.entries[k] for k in curve.held)
    return (*held, *(name for name, _ in curve.memory if name in GIVEN), *follows)


def _listed(held: Sequence[str]) -> list[str]:
    """Return the lines that declare which parameters stay."""
    names = [f'"{name}",' for name in held]
    if len(names) < 6:
        text = f"{tuple(held)!r}".replace("'", '"')
        return [f"    assumed = {text}  # no fit moves them"]
    rows = [" ".join(names[k : k + 6]) for k in range(0, len(names), 6)]
    return ["    assumed = (  # no fit moves them", *(f"        {one}" for one in rows), "    )"]


def _hooks(curve: Curve, formula: CurveFormula | None) -> list[str]:
    """Return the lines of the hooks."""
    part = curve.of
    elsewhere = ["        if p.which != 0.0 and p.which != q.storey:", "            return 0.0"]
    lines = [
        "    @staticmethod",
        f"    def {part.hook}(q, z, p):",
        *(elsewhere if curve.place.storey else []),
        f"        return {part.expression.format(g=_value(curve, formula))}",
    ]
    for advance in (along.advance for along in curve.signals if along.advance):
        lines += ["", "    @staticmethod", "    def advance(q, z, p):"]
        lines += ["    " + line for line in advance.splitlines()]
    return lines


def _value(curve: Curve, formula: CurveFormula | None) -> str:
    """Return a curve's value as source, in brackets where it is a sum that is multiplied."""
    if formula is None:
        return curve.source
    multiplied = "{g} *" in curve.of.expression or "* {g}" in curve.of.expression
    return f"({formula.g})" if multiplied and " + " in formula.g else formula.g


def _imports(
    name: str, curve: Curve, body: list[str], parameters: bool, table: bool
) -> list[str]:  # fmt: skip
    """Return the lines before the class: what the file is, its imports, its constants."""
    functions = [one for one in MATH if f"{one}(" in "\n".join(body)]
    reads = [one for one in ("bilinear", "interpolate") if f"{one}(" in "\n".join(body)]
    kinds = [
        *(["Parameter"] if parameters else []), *(["Table"] if table else []),
        *reads,
    ]  # fmt: skip
    lines = [
        f'"""{_title(name)}: {_subject(curve, "along")}, learned from measurements."""',
        "",
        *([f"from math import {', '.join(functions)}", ""] if functions else []),
        f"from bristle.physics.effect import Effect, {', '.join(kinds)}",
    ]
    if table:
        lines += ["", *row("KNOTS = ", curve.knots)]
        unit = curve.along_unit
        at = in_docstring(curve.signal.words)
        lines.append(f'"""Where the {_kind(curve)} is given: {at} [{unit}]."""')
    if curve.across:
        lines += ["", *row("LEVELS = ", curve.levels)]
        at = in_docstring(curve.second.words)
        lines.append(f'"""The same: {at} [{curve.across_unit}]."""')
    unit = drive_named(curve.drive).unit
    return [
        *lines,
        *_constant("SLOW", curve, curve.slow, "Speed [m/s] over which the direction changes."),
        *_constant("TOP", curve, curve.top, f"Largest command of the runs [{unit}]."),
        "",
        "",
    ]


def _about(name: str, curve: Curve, formula: CurveFormula | None) -> list[str]:
    """Return the class's first lines and its docstring."""
    along = curve.signal.formula or curve.signal.words
    g = f"g = {formula.text if formula else 'curve(s)'},   s = {along}"
    if curve.across:
        g = f"g = surface(s, t),   s = {along}, t = {curve.second.words}"
    ends = formula is None or formula.ends
    kind = _kind(curve)
    end = f", for beyond its ends the {kind} keeps its value." if ends else "."
    if curve.of.law:
        g, end = curve.of.law, "."
    return [
        f"class {''.join(word.capitalize() for word in name.split('_'))}(Effect):",
        f'    """{_title(name)}: {_subject(curve, "that depends on")}.',
        "",
        f"        {curve.of.formula},   {in_docstring(g)}",
        "",
        "    Learned from measurements, not derived. Leaves out what those runs did not do: doubt",
        f"    it where the motion goes further{end}",
        '    """',
    ]


def _title(name: str) -> str:
    return name.replace("_", " ").capitalize()


def _subject(curve: Curve, joined: str) -> str:
    """Return what a curve is, for a docstring: its part, and its signal after a word or two."""
    words = curve.of.words
    return words if curve.of.alone else f"{words} {joined} {in_docstring(_signals(curve))}"


def _kind(curve: Curve) -> str:
    return "surface" if curve.across else "curve"


def _signals(curve: Curve) -> str:
    """Return what a curve depends on: its signal, of a surface both."""
    return " and ".join(one.words for one in curve.signals)


def _table(curve: Curve) -> list[str]:
    """Return the lines of the declaration of its table, of a surface one for each level."""
    low, high = bounds_of(curve)
    meanings = ["force at which the element slips" if curve.part == SLIP else "value of the curve"]
    if curve.across:
        unit = "" if curve.across_unit == "1" else f" {curve.across_unit}"
        meanings = [f"value where {curve.second.words} is {at:.4g}{unit}" for at in curve.levels]
    lines, each = ["    tables = {"], len(curve.knots)
    for k, (name, meaning) in enumerate(zip(curve.rows, meanings, strict=True)):
        lines += [
            f'        "{name}": Table(',
            "            KNOTS,",
            *(f"            {line}" for line in row("", curve.values[k * each :][:each], ",")),
            f'            "{curve.unit}",',
            f"            ({low:.4g}, {high:.4g}),",
            f"            {literal(meaning)},",
            "        ),",
        ]
    return [*lines, "    }"]


def _constant(name: str, curve: Curve, value: float, text: str) -> list[str]:
    """Return the lines of a constant that a part's expression uses; none where it does not."""
    used = name in curve.of.expression or name in curve.source
    return ["", f"{name} = {value:.6g}", f'"""{text}"""'] if used else []


def _fields(curve: Curve) -> list[str]:
    """Return the lines of the class data that follow from part and signal."""
    part, drive = curve.of, drive_named(curve.drive)
    needs = [name for along in curve.signals for name in along.needs]
    states = [state for along in curve.signals for state in along.states]
    starts = [start for along in curve.signals for start in along.starts]
    numbered = ("storey",) if curve.place.storey else ()  # which tells one storey from another
    given: dict[str, object] = {
        "channels": {FOLLOWING: curve.across or curve.along} if curve.measured else {},
        "needs": tuple(dict.fromkeys((*needs, *part.needs, *numbered))),
        "states": {name: unit_for(unit, drive) for name, unit in states},
        "starts": dict(starts),
        "passive": curve.passive,
        "zero_at_rest": curve.rests or part.alone or part.expression != "{g}",
    }
    texts = [(key, class_data(value)) for key, value in given.items()]
    return [f"    {key} = {text}" for key, text in texts if text not in ("{}", "()")]


def _declared(parameters: Sequence[Declared], kept: Sequence[str] = ()) -> list[str]:
    """Return the lines that declare parameters: name, value, unit, meaning.

    Those in `kept` stay above zero: below it, a building would be pushed over.
    """
    lines = []
    for name, value, unit, text in parameters:
        size = BOUND * max(abs(value), 1e-9)
        low, high = (0.02 * value, 50.0 * value) if name in POSITIVE else (-size, size)
        low = 0.0 if name in kept else low
        bounds = f"({low:.4g}, {high:.4g})"
        told = f"{literal(unit)}, {bounds}, {literal(text)}"
        lines.append(f'        "{name}": Parameter({value:.6g}, {told}),')
    return lines


def _of_formula(formula: CurveFormula) -> list[str]:
    """Return the lines that declare the parameters of a closed form."""
    text = formula.text
    named = [(n, value, unit, f"{n} in g = {text}") for n, value, unit in formula.parameters]
    return _declared(named, formula.positive)


def _only_followed(curve: Curve) -> list[str]:
    """Return the line that declares what follows a measured channel; none where nothing does."""
    if not curve.measured:
        return []
    unit = curve.across_unit if curve.across else curve.along_unit
    value, low, high = followed(curve)
    told = f"{literal(unit)}, ({low:.4g}, {high:.4g})"
    text = literal(f"{curve.signals[-1].words}, which runs tell")
    return [f'        "{FOLLOWING}": Parameter({value:.6g}, {told}, {text}),']


def _only_value(curve: Curve) -> list[str]:
    """Return the line that declares the value of what is no curve but has one; else none."""
    part, (value, *_) = curve.of, curve.values
    if not part.parameter:
        return []
    text = f"{part.parameter} of the force that it has"
    bounds = f"({part.low:.4g}, {part.high:.4g})"
    return [
        f'        "{part.parameter}": Parameter({value:.6g}, "{part.unit}", {bounds}, "{text}"),'
    ]


def _only_storey(curve: Curve) -> list[str]:
    """Return the line that declares in which storey a curve acts; none at other places."""
    if not curve.place.storey:
        return []
    text = "number of the storey; 0: every storey"
    return [f'        "which": Parameter({curve.place.storey}.0, "1", (0.0, 20.0), "{text}"),']
