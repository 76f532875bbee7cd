"""A curve that is learned: on which part of the model it acts, along which signal, at which knots.

Its text is that of an effect's file, in the standard library alone: what is fitted, exported and
read by the user is the same.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ...quantity import quantity
from .along import ALONG, MEMORIES, Along

BOUND = 30.0
"""Times the largest value of a learned curve: bounds of each of its values."""


MATH = tuple(
    one.__name__ for one in (math.copysign, math.cos, math.exp, math.log, math.sin, math.tanh)
)
"""Functions that a hook may import."""

POSITIVE = ("tau", "way", "d")
"""Parameters that are times, lengths and scales: they stay above zero."""


class Part(NamedTuple):
    """A part of the model that a curve may change.

    `hook` of an effect and the expression that it returns, `{g}` being the curve's value; `unit` of
    the curve; `words` for sentences; `needs` more signals; `low` the least value of the curve;
    `level` whether a constant is the law's own already, so that one knot stays at zero.
    """

    hook: str
    expression: str
    unit: str
    words: str
    formula: str
    needs: tuple[str, ...] = ()
    low: float = float("-inf")
    level: bool = False


PARTS = {
    "force": Part("force", "{g}", "N", "an added force", "F = F_model + g"),
    "friction": Part(
        "force", "tanh(q.v / SLOW) * {g}", "N", "a friction force", "F = F_model + g sgn(v)",
        ("v",), level=True,
    ),
    "yield": Part(
        "yield_factor", "max(1.0 + {g}, 0.02)", "1", "a factor of the yield force",
        "yield force x (1 + g)", (), -0.98, True,
    ),
    "viscous": Part(
        "viscous_factor", "max(1.0 + {g}, 0.02)", "1", "a factor of the viscous force",
        "viscous force x (1 + g)", (), -0.98, True,
    ),
    "fluid": Part(
        "factor", "max(1.0 + {g}, 0.02)", "1", "a factor of the fluid's whole force",
        "force of the fluid x (1 + g)", (), -0.98, True,
    ),
    "yield_field": Part(
        "yield_factor", "max(1.0 + {g} * q.V / TOP, 0.02)", "1",
        "a factor of the yield force under command",
        "yield force x (1 + g V/V_top)", ("V",), -0.98,
    ),
    "fluid_field": Part(
        "factor", "max(1.0 + {g} * q.V / TOP, 0.02)", "1",
        "a factor of the fluid's whole force under command",
        "force of the fluid x (1 + g V/V_top)", ("V",), -0.98,
    ),
    "command": Part(
        "voltage", "max(q.V + {g}, 0.0)", "V", "a map of the command",
        "the damper sees V + g", ("V",), level=True,
    ),
}  # fmt: skip


def may_change(part: str, along: str) -> bool:
    """Return whether a curve along a signal may change a part: a command's map depends on it."""
    of_command = along in ("voltage", "recent_voltage")
    if part == "command":
        return of_command
    return not (of_command and part.endswith("_field"))


@dataclass(frozen=True)
class Curve:
    """A learned curve: its part and signal, knots (SI) and values there.

    `memory` holds the parameters of the signal's memory [SI]; `held` the knots (from 0) whose value
    stays zero; `slow` is the speed [m/s] below which a friction changes its sign smoothly, `top`
    the largest command of the runs [V].
    """

    part: str
    along: str
    memory: tuple[tuple[str, float], ...]
    knots: tuple[float, ...]
    values: tuple[float, ...]
    held: tuple[int, ...] = ()
    slow: float = 1e-3
    top: float = 1.0

    @property
    def of(self) -> Part:
        """The part of the model that it changes."""
        return PARTS[self.part]

    @property
    def signal(self) -> Along:
        """The signal that it depends on."""
        return ALONG[self.along]

    def words(self) -> str:
        """Return what it is, in a few words: "an added force along displacement"."""
        times = dict(self.memory)
        faded = f" (over {quantity(times['tau'], 's')})" if "tau" in times else ""
        return f"{self.of.words} along {self.signal.words}{faded}"


def bounds_of(curve: Curve) -> tuple[float, float]:
    """Return the bounds of the values of a curve, in its unit."""
    size = BOUND * max(max(abs(value) for value in curve.values), 1e-9)
    if curve.of.unit == "1":
        return max(curve.of.low, -size), max(size, 5.0)
    return -size, size


@dataclass(frozen=True)
class Formula:
    """A closed form in the place of a curve's table: `g` its expression of `p`, as source.

    `text` for readers; `parameters` by name: value and unit.
    """

    g: str
    text: str
    parameters: tuple[tuple[str, float, str], ...]


def effect_text(name: str, curve: Curve, origin: str, formula: Formula | None = None) -> str:
    """Return the text of the effect's file of a curve.

    Parameters
    ----------
    name : of the effect, and of its file
    curve : with the values to begin with
    origin : what it was learned from and when, for the file's `source`
    formula : what stands for the table, None for the table itself
    """
    along, part = curve.signal, curve.of
    title = name.replace("_", " ").capitalize()
    g = formula.g if formula else f"interpolate({along.source}, KNOTS, p.curve)"
    body = [
        "    @staticmethod",
        f"    def {part.hook}(q, z, p):",
        f"        return {part.expression.format(g=g)}",
    ]
    if along.advance:
        body += ["", "    @staticmethod", "    def advance(q, z, p):"]
        body += ["    " + line for line in along.advance.splitlines()]
    functions = [name for name in MATH if f"{name}(" in "\n".join(body)]
    parameters = [(n, value, *MEMORIES[n]) for n, value in curve.memory]
    if formula:
        parameters += [
            (n, value, unit, f"{n} in g = {formula.text}") for n, value, unit in formula.parameters
        ]
    kinds = [
        *(["Parameter"] if parameters else []), *([] if formula else ["Table", "interpolate"]),
    ]  # fmt: skip
    lines = [
        f'"""{title}: {part.words} along {along.words}, learned from measurements."""',
        "",
        *([f"from math import {', '.join(functions)}", ""] if functions else []),
        f"from bristle.physics.effect import Effect, {', '.join(kinds)}",
        *([] if formula else ["", *_row("KNOTS = ", curve.knots)]),
        *([] if formula else [f'"""Where the curve is given: {along.words} [{along.unit}]."""']),
        *_constant("SLOW", part, curve.slow, "Speed [m/s] over which friction turns round."),
        *_constant("TOP", part, curve.top, "Largest command of the runs [V]."),
        "",
        "",
        f"class {''.join(word.capitalize() for word in name.split('_'))}(Effect):",
        f'    """{title}: {part.words} that depends on {along.words}.',
        "",
        f"        {part.formula},   g = {formula.text if formula else 'curve(s)'},   "
        f"s = {along.words}",
        "",
        "    Learned from measurements, not derived. Leaves out what those runs did not do: doubt",
        "    it where the motion goes further"
        + ("." if formula else ", for beyond its ends the curve keeps its value."),
        '    """',
        "",
        f'    name = "{name}"',
        '    sites = ("damper",)',
        *_fields(curve),
        f'    source = "{origin}"',
        f'    expect = "an error that depends on {along.words}"',
        "    start_shares = ({},)  # the defaults are those of this rig: no search scales them",
    ]  # fmt: skip
    if curve.held and not formula:
        held = tuple(f"curve[{k + 1}]" for k in curve.held)
        lines.append(f"    assumed = {held!r}  # the law has a constant already".replace("'", '"'))
    if parameters:
        lines += ["    parameters = {", *_declared(parameters), "    }"]
    if not formula:
        low, high = bounds_of(curve)
        lines += [
            "    tables = {",
            '        "curve": Table(',
            "            KNOTS,",
            *(f"            {line}" for line in _row("", curve.values, ",")),
            f'            "{part.unit}",',
            f"            ({low:.4g}, {high:.4g}),",
            '            "value of the curve",',
            "        )",
            "    }",
        ]
    return "\n".join([*lines, "", *body]) + "\n"


def _constant(name: str, part: Part, value: float, text: str) -> list[str]:
    """Return the lines of a constant that a part's expression uses; none where it does not."""
    used = name in part.expression
    return ["", f"{name} = {value:.6g}", f'"""{text}"""'] if used else []


def _fields(curve: Curve) -> list[str]:
    """Return the lines of the class data that follow from part and signal."""
    along, part = curve.signal, curve.of
    needs = tuple(dict.fromkeys((*along.needs, *part.needs)))
    given: dict[str, object] = {
        "needs": needs,
        "states": dict(along.states),
        "starts": dict(along.starts),
        "passive": part.hook not in ("force", "voltage") or _conserves(curve),
        "zero_at_rest": part.expression != "{g}",
    }
    texts = [(key, f"{value!r}".replace("'", '"')) for key, value in given.items()]
    return [f"    {key} = {text}" for key, text in texts if text not in ("{}", "()")]


def _declared(parameters: Sequence[tuple[str, float, str, str]]) -> list[str]:
    """Return the lines that declare parameters: name, value, unit, meaning."""
    lines = []
    for name, value, unit, text in parameters:
        size = BOUND * max(abs(value), 1e-9)
        low, high = (0.02 * value, 50.0 * value) if name in POSITIVE else (-size, size)
        bounds = f"({low:.4g}, {high:.4g})"
        lines.append(f'        "{name}": Parameter({value:.6g}, "{unit}", {bounds}, "{text}"),')
    return lines


def _conserves(curve: Curve) -> bool:
    """Return whether an added force gives no energy over a cycle whatever its curve."""
    return curve.part == "force" and curve.along == "displacement"


def _row(begin: str, values: tuple[float, ...], end: str = "") -> list[str]:
    """Return the lines of a tuple of numbers, some to a line."""
    texts = [f"{float(f'{value:.6g}')!r}," for value in values]  # 0.0, for numba wants one type
    rows = [" ".join(texts[k : k + 6]) for k in range(0, len(texts), 6)]
    return [f"{begin}(", *(f"    {row}" for row in rows), f"){end}"]
