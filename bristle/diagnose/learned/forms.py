"""The formulas that a learned curve may follow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NODES = 80
"""Values of a parameter in which a form is not linear that are looked at."""


@dataclass(frozen=True)
class Form:
    """A formula c + m h(s), with a scale d or without, or c + m h(s) + n k(s).

    `text` for readers; `columns` h and k as Python, of {s} and {d}, which a hook and numpy both
    take, and of {top}, the last knot of a command's map; `scales` gives the values of d to look at
    for a span and the least distance of knots, None where there is none. `bent` where it is for a
    line, or for a force along displacement, alone; `sized` where m is sought, else m = 1;
    `centred` where it is of the distance from a centre s0.
    """

    name: str
    text: str
    columns: tuple[str, ...]
    scales: Callable[[float, float], Array] | None = None
    bent: bool = False
    sized: bool = True
    centred: bool = False

    def count(self) -> int:
        """Return how many numbers it has, the constant included."""
        return 1 + len(self.columns) * self.sized + (self.scales is not None) + self.centred

    @property
    def grows(self) -> bool:
        """Whether it grows with the signal without end."""
        return bool(np.any(np.abs(self.at(np.array([1e9]), 1.0)[0, 1:]) > 100.0))

    def at_rest(self) -> tuple[float, ...]:
        """Return h, and k, where the signal is zero: they are the same at every scale."""
        return tuple(map(float, self.at(np.zeros(1), 1.0)[0, 1:]))

    def at(self, s: Array, d: float, top: float = 1.0) -> Array:
        """Return the columns (n, 1 + k) of a signal (n,), that of the constant first."""
        given = [
            eval(one.format(s="s", d="d", top="top"), dict(_NUMPY), {"s": s, "d": d, "top": top})
            for one in self.columns
        ]
        return np.stack([np.ones_like(s), *given], axis=1)


_NUMPY: dict[str, Any] = {
    **{one.__name__: one for one in (np.copysign, np.cos, np.exp, np.log, np.sin, np.tanh)},
    "__builtins__": {}, "abs": np.abs, "max": np.maximum, "min": np.minimum,
}  # fmt: skip


def _lengths(span: float, step: float) -> Array:
    return np.geomspace(0.3 * step, 3.0 * span, NODES)


def _pitches(span: float, step: float) -> Array:
    return np.geomspace(2.0 * step, 2.0 * span, 4 * NODES)


def _powers(_span: float, _step: float) -> Array:
    return np.linspace(0.25, 6.0, 93)


def _gaps(span: float, _step: float) -> Array:
    return np.linspace(0.02, 0.9, NODES) * span


LINE = ("{s}",)
"""The columns of a line."""

_TURN = "6.283185307179586 * {s} / {d}"
FORMS = (
    Form("constant", "c", ()),
    Form("line", "c + m s", LINE),
    Form("parabola", "c + m s^2", ("{s} ** 2",)),
    Form("quadratic drag", "c + m s |s|", ("{s} * abs({s})",)),
    Form("cubic", "c + m s^3", ("{s} ** 3",)),
    Form("power", "c + m sgn(s) |s|^d", ("copysign(1.0, {s}) * abs({s}) ** {d}",), _powers),
    Form("exponential fall", "c + m exp(-|s|/d)", ("exp(-abs({s}) / {d})",), _lengths),
    Form("bell", "c + m exp(-(s/d)^2)", ("exp(-(({s} / {d}) ** 2))",), _lengths),
    Form("levelling off", "c + m tanh(s/d)", ("tanh({s} / {d})",), _lengths),
    Form("hyperbola", "c + m/(1 + |s|/d)", ("1.0 / (1.0 + abs({s}) / {d})",), _lengths),
    Form("logarithm", "c + m ln(1 + |s|/d)", ("log(1.0 + abs({s}) / {d})",), _lengths),
    Form("threshold", "c + m/(1 + (d/s)^4)", ("{s} ** 4 / ({s} ** 4 + {d} ** 4)",), _lengths),
    Form(
        "dead band", "c + m sgn(s) max(|s| - d, 0)",
        ("(max({s} - {d}, 0.0) + min({s} + {d}, 0.0))",), _gaps,
    ),
    Form(
        "contact above", "c + m max(s - d, 0)", ("max({s} - {d}, 0.0)",), _gaps, bent=True,
    ),
    Form(
        "contact below", "c + m min(s + d, 0)", ("min({s} + {d}, 0.0)",), _gaps, bent=True,
    ),
    Form(
        "ripple", "c + m sin(2 pi s/d) + n cos(2 pi s/d)", (f"sin({_TURN})", f"cos({_TURN})"),
        _pitches,
    ),
)  # fmt: skip


CENTRED = (
    Form("bell", "c + m exp(-((s - s0)/d)^2)", ("exp(-(({s} / {d}) ** 2))",), _lengths,
         centred=True),
    Form("exponential fall", "c + m exp(-|s - s0|/d)", ("exp(-abs({s}) / {d})",), _lengths,
         centred=True),
    Form("hyperbola", "c + m/(1 + |s - s0|/d)", ("1.0 / (1.0 + abs({s}) / {d})",), _lengths,
         centred=True),
)  # fmt: skip
"""Forms about a centre of their own, of signals whose zero is a matter of mounting or scale."""


MAPS = (
    Form("parabola", "c + m s (s/{top} - 1)", ("{s} * ({s} / {top} - 1.0)",)),
    Form(
        "power", "c + {top} (s/{top})^d - s",
        ("({top} * copysign(1.0, {s}) * abs({s} / {top}) ** {d} - {s})",), _powers, sized=False,
    ),
    Form(
        "levelling off", "c + {top} tanh(s/d)/tanh({top}/d) - s",
        ("({top} * tanh({s} / {d}) / tanh({top} / {d}) - {s})",), _lengths, sized=False,
    ),
)  # fmt: skip
"""Forms of a command's map s + g: the law has its scale already, so that it ends where s does."""
