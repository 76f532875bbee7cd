"""A closure's network: what it computes on arrays, and the same as the file of an effect.

The network is written out in plain arithmetic, so that every form of an FMU runs it. Its force is
in parallel with the damper: it knows the motion of the rod and the command, nothing of the law.

A store of energy keeps the device passive (energy tank: Duindam & Stramigioli 2004, IEEE ICRA). The
store gains what the whole device takes in, and never holds more than `Store.most`; the network
gives back what is in it, no faster than in the time `Store.soon`, and may take in energy at all
times. It fills once the device has taken in `Store.kept`, which springs of the model may hold and
give back themselves. So over a closed cycle the device gives no energy, and in all no more than
`Store.begin`, whatever the weights, where law and effects are passive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..core.arrays import Array
from ..core.text import literal
from ..data.channels import TEMPERATURE, label_name
from ..diagnosis.by_label import word_of
from ..physics.drive import drive_named, unit_for
from ..physics.effect import CLOSURE
from .effect_file import class_data

FADES = 0.25
"""Share of its reach over which a network fades beyond it."""

_DIGITS = 9


@dataclass(frozen=True)
class Input:
    """An input of the network: a signal now, or a trace of it.

    `kind` is "v", "x" or "V"; "direction", tanh(v/slow); "way", the same fading over a travel of
    `over` [m]; "recent_v" or "recent_V", by how much the signal has left its trace behind a lag of
    `over` [s]: beside the signal the trace itself tells little that is new. "label" is the number
    `label` of the run, held at the ends of what the training runs had, `low` to `high`; a run
    without it has the `usual` one.
    """

    kind: str
    over: float
    slow: float = 1.0
    label: str = ""
    low: float = 0.0
    high: float = 0.0
    usual: float = 0.0

    @property
    def words(self) -> str:
        """The group of inputs that it belongs to, for a sentence."""
        return label_name(self.label) or {
            "v": "velocity", "direction": "velocity", "x": "displacement", "V": "the command",
            "recent_v": "the past of the velocity", "recent_V": "the past of the command",
            "way": "the way since the last reversals",
        }[self.kind]  # fmt: skip


@dataclass(frozen=True)
class Store:
    """Energy [J] that the device may give back: at the `begin`, and the `most`.

    `soon` [s] the shortest time in which it may do so; `slow` [m/s] the speed below which a network
    that may give nothing fades, so that its force does not jump where the motion turns. `kept` [J]
    is what springs of law and effects may hold.
    """

    begin: float
    most: float
    soon: float
    slow: float
    kept: float = 0.0


@dataclass(frozen=True)
class Region:
    """Where the training runs support a network, in its k scaled inputs that are no labels.

    These come first. `low`, `high` (k,) their range, `margin` (k,) over which it fades beyond;
    `axes` (k, k), whose product with them has the length `reach` at the most.
    """

    low: Array
    high: Array
    margin: Array
    axes: Array
    reach: float

    def inside(self, u: Array) -> Array:
        """Return how far scaled inputs (m, k) are supported (m,): 1 in the region, 0 far away."""
        u = u[:, : len(self.low)]
        beyond = np.maximum(np.maximum(self.low - u, u - self.high), 0.0) / self.margin
        away = np.sqrt(np.sum((u @ self.axes.T) ** 2, axis=1)) / self.reach - 1.0
        return np.asarray(np.prod(_faded(beyond), axis=1) * _faded(away / FADES))


@dataclass(frozen=True)
class Closure:
    """A network of one hidden layer.

    Of its k `inputs`: `middle`, `spread` (k,) to scale them, the `region` that supports it, and
    per input the `knots` and levels of the broken line that `evened` has;
    `hidden` (n, k), `bias` (n,), `out` (n,) [N], `linear` (k,) [N], `constant` [N]; `size` [N] the
    force that it comes near at most. `drive` is the command's channel.
    """

    inputs: tuple[Input, ...]
    middle: Array
    spread: Array
    region: Region
    knots: tuple[tuple[Array, Array], ...]
    hidden: Array
    bias: Array
    out: Array
    linear: Array
    constant: float
    size: float
    store: Store
    drive: str

    @property
    def weights(self) -> int:
        """How many numbers the training gave the network."""
        return int(np.count_nonzero(self.hidden)) + 2 * len(self.bias) + len(self.linear) + 1

    def scaled(self, signals: Array) -> Array:
        """Return inputs (m, k) scaled by their middle and spread."""
        return np.asarray((signals - self.middle) / self.spread)

    def output(self, signals: Array) -> Array:
        """Return the network's force (m,) [N] at inputs (m, k), supported or not."""
        u = evened(self.scaled(signals), self.knots)
        net = np.tanh(u @ self.hidden.T + self.bias) @ self.out + u @ self.linear + self.constant
        return np.asarray(self.size * np.tanh(net / self.size))

    def force(self, signals: Array) -> Array:
        """Return the force (m,) [N] at inputs (m, k), whatever the store of energy holds."""
        return self.output(signals) * self.region.inside(self.scaled(signals))


def evened(u: Array, knots: Sequence[tuple[Array, Array]]) -> Array:
    """Return scaled inputs (m, k), each in the middle between itself and its rank.

    The broken line of an input through its quantiles is its rank: where the runs have much, what
    they tell in detail is spread out.
    """
    ranks = [np.interp(own, *line) for own, line in zip(u.T, knots, strict=True)]
    return np.asarray(0.5 * (u + np.column_stack(ranks)))


def _faded(beyond: Array) -> Array:
    share = np.clip(beyond, 0.0, 1.0)
    return np.asarray(1.0 - share**2 * (3.0 - 2.0 * share))


def rounded(values: Array) -> Array:
    """Return numbers as the file has them, so that both compute the same."""
    return np.array([float(f"{x:.{_DIGITS}g}") for x in np.ravel(values)]).reshape(values.shape)


def closure_text(name: str, closure: Closure, origin: str) -> str:
    """Return the text of the effect's file of a closure.

    Parameters
    ----------
    name : of the effect, and of its file
    closure : with its weights
    origin : what it was learned from and when, for the file's `source`
    """
    inputs = closure.inputs
    recent = [k for k, one in enumerate(inputs) if one.kind.startswith("recent")]
    states = {f"s{k}": _unit(one, closure.drive) for k, one in enumerate(inputs) if one.over}
    labels = {word: one for word, one in zip(_words(inputs), inputs, strict=True) if one.label}
    starts = {f"s{k}": inputs[k].kind[-1] for k in recent}
    needs = ["v", "dt", "energy", *(["x"] if any(one.kind == "x" for one in inputs) else [])]
    needs += ["V"] if any(one.kind in ("V", "recent_V") for one in inputs) else []
    words = ", ".join(dict.fromkeys(one.words for one in inputs))
    moving = len(closure.region.low)
    names, even = ([f"{one}{k}" for k in range(len(inputs))] for one in "ue")
    title = name.replace("_", " ").capitalize()
    store, region = closure.store, closure.region
    lines = [
        f'"""{title}: a closure, what a model misses without a name, learned from measurements."""',
        "",
        "from math import exp, sqrt, tanh",
        "",
        f"from bristle.physics.effect import Effect,{' Parameter,' if labels else ''} interpolate",
        "",
        f"SIZE = {_n(closure.size)}",
        '"""Force [N] that it comes near at most."""',
        f"BEGIN, MOST, KEPT = {_n(store.begin)}, {_n(store.most)}, {_n(store.kept)}",
        '"""Energy [J] that the device may give back at the start, and at most; and in springs."""',
        f"SOON, SLOW = {_n(store.soon)}, {_n(store.slow)}",
        '"""Time [s] in which it may do so; speed [m/s] below which it fades where it may not."""',
        *(
            f"KNOTS{k}, LEVELS{k} = {_row(at)}, {_row(levels)}"
            for k, (at, levels) in enumerate(closure.knots)
        ),
        '"""Quantiles of its inputs in the training runs, and their ranks."""',
        "",
        "",
        "def fading(beyond):",
        '    """Return 1 up to 0, falling smoothly to 0 at 1."""',
        "    share = min(max(beyond, 0.0), 1.0)",
        "    return 1.0 - share * share * (3.0 - 2.0 * share)",
        "",
        "",
        f"def inside({', '.join(names[:moving])}):",
        '    """Return how far the training runs support scaled inputs: 1, or less beyond them."""',
        "    near = 1.0",
        *(
            f"    near = near * fading(max({_n(low)} - {u}, {u} - {_n(high)}) / {_n(margin)})"
            for u, low, high, margin in zip(
                names[:moving], region.low, region.high, region.margin, strict=True
            )
        ),
        "    away = 0.0",
        *(f"    away = away + ({_sum(row, names[:moving])}) ** 2" for row in region.axes),
        f"    return near * fading((sqrt(away) / {_n(region.reach)} - 1.0) / {FADES})",
        "",
        "",
        f"def network({', '.join(names)}):",
        '    """Return the network\'s force [N] at scaled inputs."""',
        *(
            f"    e{k} = 0.5 * ({u} + interpolate({u}, KNOTS{k}, LEVELS{k}))"
            for k, u in enumerate(names)
        ),
        f"    f = {_sum(closure.linear, even)} + {_n(closure.constant)}",
        *(
            f"    f = f + {_n(out)} * tanh({_sum(row, even)} + {_n(bias)})"
            for row, bias, out in zip(closure.hidden, closure.bias, closure.out, strict=True)
        ),
        "    return SIZE * tanh(f / SIZE)",
        "",
        "",
        f"class {''.join(word.capitalize() for word in name.split('_'))}(Effect):",
        f'    """{title}: a closure, what the model misses without a name.',
        "",
        f"    A network of {len(closure.out)} hidden units and {closure.weights} weights on",
        f"    {words}. It is no effect of",
        "    physics. Leaves out all that the training runs did not do: it fades to zero beyond",
        "    them, and gives back no energy that the device has not taken in.",
        '    """',
        "",
        f'    name = "{name}"',
        '    sites = ("damper",)',
        f'    kind = "{CLOSURE}"',
        f"    needs = {class_data(tuple(needs))}",
        f"    states = {class_data({**states, 'taken': 'J'})}",
        *([f"    starts = {class_data(starts)}"] if starts else []),
        *(_label_lines(labels) if labels else []),
        "    passive = True",
        f"    zero_at_rest = {store.begin <= 0.0}",
        f"    source = {literal(origin)}",
        '    expect = "an error that follows no formula which was tried"',
        "",
        "    @staticmethod",
        "    def parallel(q, z, p):",
        "        left = MOST - max(MOST - BEGIN + KEPT, z.taken) + q.energy",
        *(
            f"        u{k} = ({_signal(k, one, word)} - {_n(middle)}) / {_n(spread)}"
            for k, (one, word, middle, spread) in enumerate(
                zip(inputs, _words(inputs), closure.middle, closure.spread, strict=True)
            )
        ),
        f"        f = inside({', '.join(names[:moving])}) * network({', '.join(names)})",
        "        power = max(left, 0.0) / max(SOON, 2.0 * q.dt)",
        "        held = min(max(q.v / SLOW if f > 0.0 else -q.v / SLOW, 0.0), 1.0)",
        "        return f * max(held, power / (max(-f * q.v, power) + 1e-300))",
        "",
        "    @staticmethod",
        "    def advance(q, z, p):",
    ]
    if any(one.kind == "way" for one in inputs):
        lines.append("        travel = abs(q.v) * min(q.dt, 1e6)")
    for k, one in enumerate(inputs):
        if one.kind.startswith("recent"):
            signal = f"q.{one.kind[-1]}"
            lines.append(
                f"        s{k} = {signal} + (z.s{k} - {signal}) * exp(-q.dt / {_n(one.over)})"
            )
        elif one.kind == "way":
            lines.append(f"        to = tanh(q.v / {_n(one.slow)})")
            lines.append(f"        s{k} = to + (z.s{k} - to) * exp(-travel / {_n(one.over)})")
    moved = [f"{state}" for state in states]
    lines.append(f"        return {', '.join([*moved, 'max(z.taken, q.energy)'])},")
    return "\n".join(lines) + "\n"


def _unit(one: Input, drive: str) -> str:
    unit = {"recent_v": "m/s", "recent_V": "V", "way": "1"}[one.kind]
    return unit_for(unit, drive_named(drive))


def _words(inputs: Sequence[Input]) -> list[str]:
    """Return the parameter's name of each input that is a label, each another one."""
    words = [word_of(one.label) for one in inputs]
    return [w if words.count(w) == 1 else f"{w}_{k}" for k, w in enumerate(words)]


def _label_lines(labels: dict[str, Input]) -> list[str]:
    """Return the class data of labels, by the names of their parameters."""
    names = {word: one.label for word, one in labels.items()}
    far = [1e3 * max(abs(one.low), abs(one.high), 1.0) for one in labels.values()]
    return [
        f"    labels = {class_data(names)}",
        f"    assumed = {class_data(tuple(names))}",
        "    start_shares = ({},)",
        "    parameters = {",
        *(
            f'        "{word}": Parameter({_n(one.usual)}, '
            f'"{"degC" if one.label == TEMPERATURE else "1"}", '
            f"({_n(-most)}, {_n(most)}), {literal(f'{one.words} of the run')}),"
            for (word, one), most in zip(labels.items(), far, strict=True)
        ),
        "    }",
    ]


def _row(values: Array) -> str:
    return f"({', '.join(map(_n, values))},)"


def _signal(k: int, one: Input, word: str) -> str:
    if one.label:
        return f"min(max(p.{word}, {_n(one.low)}), {_n(one.high)})"
    if one.kind.startswith("recent"):
        return f"(q.{one.kind[-1]} - z.s{k})"
    if one.kind == "direction":
        return f"tanh(q.v / {_n(one.slow)})"
    return f"z.s{k}" if one.over else f"q.{one.kind}"


def _n(value: float) -> str:
    """Return a number as source: a float, in brackets where it is negative."""
    text = repr(float(f"{float(value):.{_DIGITS}g}"))
    return f"({text})" if text.startswith("-") else text


def _sum(weights: Array, names: list[str]) -> str:
    """Return the source of a weighted sum, without what has no weight."""
    terms = [f"{_n(w)} * {u}" for w, u in zip(weights, names, strict=True) if w != 0.0]
    return " + ".join(terms) or "0.0"
