"""Which formula a learned curve follows, and what that leaves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ..core.arrays import Array
from ..core.text import plain, quantity, scale
from ..diagnosis.decision import missing
from ..diagnosis.prepared import Prepared
from ..diagnosis.trials import Trial, judge
from ..identification.fit import intervals_of, refine
from ..units import canonical
from ..user_code.load import defined
from .curve import Curve, CurveFormula
from .effect_file import effect_text
from .fit import SWEEPS, Fitted
from .rule import LEARN

# The formulas that a learned curve may follow.


NODES = 80
"""Values of a parameter in which a form is not linear that are looked at."""


@dataclass(frozen=True)
class CurveForm:
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
    CurveForm("constant", "c", ()),
    CurveForm("line", "c + m s", LINE),
    CurveForm("parabola", "c + m s^2", ("{s} ** 2",)),
    CurveForm("quadratic drag", "c + m s |s|", ("{s} * abs({s})",)),
    CurveForm("cubic", "c + m s^3", ("{s} ** 3",)),
    CurveForm("power", "c + m sgn(s) |s|^d", ("copysign(1.0, {s}) * abs({s}) ** {d}",), _powers),
    CurveForm("exponential fall", "c + m exp(-|s|/d)", ("exp(-abs({s}) / {d})",), _lengths),
    CurveForm("bell", "c + m exp(-(s/d)^2)", ("exp(-(({s} / {d}) ** 2))",), _lengths),
    CurveForm("levelling off", "c + m tanh(s/d)", ("tanh({s} / {d})",), _lengths),
    CurveForm("hyperbola", "c + m/(1 + |s|/d)", ("1.0 / (1.0 + abs({s}) / {d})",), _lengths),
    CurveForm("logarithm", "c + m ln(1 + |s|/d)", ("log(1.0 + abs({s}) / {d})",), _lengths),
    CurveForm("threshold", "c + m/(1 + (d/s)^4)", ("{s} ** 4 / ({s} ** 4 + {d} ** 4)",), _lengths),
    CurveForm(
        "dead band", "c + m sgn(s) max(|s| - d, 0)",
        ("(max({s} - {d}, 0.0) + min({s} + {d}, 0.0))",), _gaps,
    ),
    CurveForm(
        "contact above", "c + m max(s - d, 0)", ("max({s} - {d}, 0.0)",), _gaps, bent=True,
    ),
    CurveForm(
        "contact below", "c + m min(s + d, 0)", ("min({s} + {d}, 0.0)",), _gaps, bent=True,
    ),
    CurveForm(
        "ripple", "c + m sin(2 pi s/d) + n cos(2 pi s/d)", (f"sin({_TURN})", f"cos({_TURN})"),
        _pitches,
    ),
)  # fmt: skip


CENTRED = (
    CurveForm("bell", "c + m exp(-((s - s0)/d)^2)", ("exp(-(({s} / {d}) ** 2))",), _lengths,
         centred=True),
    CurveForm("exponential fall", "c + m exp(-|s - s0|/d)", ("exp(-abs({s}) / {d})",), _lengths,
         centred=True),
    CurveForm("hyperbola", "c + m/(1 + |s - s0|/d)", ("1.0 / (1.0 + abs({s}) / {d})",), _lengths,
         centred=True),
)  # fmt: skip
"""Forms about a centre of their own, of signals whose zero is a matter of mounting or scale."""


MAPS = (
    CurveForm("parabola", "c + m s (s/{top} - 1)", ("{s} * ({s} / {top} - 1.0)",)),
    CurveForm(
        "power", "c + {top} (s/{top})^d - s",
        ("({top} * copysign(1.0, {s}) * abs({s} / {top}) ** {d} - {s})",), _powers, sized=False,
    ),
    CurveForm(
        "levelling off", "c + {top} tanh(s/d)/tanh({top}/d) - s",
        ("({top} * tanh({s} / {d}) / tanh({top} / {d}) - {s})",), _lengths, sized=False,
    ),
)  # fmt: skip
"""Forms of a command's map s + g: the law has its scale already, so that it ends where s does."""


# A form about a centre of its own, fitted to the values of a learned curve.

UNCENTRED = ("displacement", "recent_displacement")
"""Signals whose zero says where a rig was mounted, beside those of measured channels."""

CLEAR = 3.0
"""Times its standard error that a centre is from zero: nearer, a form about zero is as good."""

FEWEST = 8
"""Knots of a curve that may have such a form, twice the numbers of one."""

NEAR = 3
"""Knots within a form's own scale of its centre: fewer are no shape, but an outlier."""

FLANKS = 1.75
"""Times its scale that both flanks lie within the knots: a hump without them has many formulas."""

_CENTRES, _SCALES = 24, 16


class CentredFit(NamedTuple):
    """A form's values c, m, d and s0, and the weighted RMS that it leaves."""

    values: tuple[float, ...]
    rms: float


def fitted_about(form: CurveForm, s: Array, y: Array, weight: Array) -> CentredFit | None:
    """Return a form at its best centre and scale; None where the curve tells no centre.

    Parameters
    ----------
    form : with one column
    s, y : (n,) knots and values
    weight : (n,) one over the uncertainty of each value
    """
    if len(s) < FEWEST:
        return None
    wide, steps = 0.5 * float(np.ptp(s)), np.diff(s)
    scales = np.geomspace(float(np.min(steps)), wide, _SCALES)

    def factors(q: Array) -> tuple[Array, Array]:
        A = form.at(s - q[1], float(np.exp(q[0]))) * weight[:, None]
        return A, np.asarray(np.linalg.lstsq(A, y * weight, rcond=1e-12)[0], dtype=np.float64)

    def off(q: Array) -> Array:
        A, found = factors(q)
        return np.asarray(y * weight - A @ found)

    best = _start(form, s, y, weight, scales)
    bounds = ([np.log(scales[0]), s[1]], [np.log(wide), s[-2]])
    fit = least_squares(off, np.clip(best, *bounds), bounds=bounds, x_scale=(1.0, wide))
    d, centre = float(np.exp(fit.x[0])), float(fit.x[1])
    power = float(np.sum(fit.fun**2))
    std = float(np.sqrt(np.linalg.pinv(fit.jac.T @ fit.jac)[1, 1]))
    near = int(np.count_nonzero(np.abs(s - centre) <= d))
    inside = s[0] + FLANKS * d <= centre <= s[-1] - FLANKS * d
    if power > len(s) - form.count() or not inside or near < NEAR or abs(centre) <= CLEAR * std:
        return None  # most humps are no bell: the form must leave no more than the values' noise
    c, m = (float(one) for one in factors(fit.x)[1])
    return CentredFit((c, m, d, centre), float(np.sqrt(power / np.sum(weight**2))))


def _start(form: CurveForm, s: Array, y: Array, weight: Array, scales: Array) -> Array:
    """Return the logarithm of the scale and the centre, of a grid, that leave the least."""
    centres = np.linspace(s[1], s[-2], _CENTRES)
    away, share = (s - centres[:, None]).ravel(), weight**2 / np.sum(weight**2)
    taken = np.empty((len(scales), len(centres)))
    for row, d in enumerate(scales):
        h = form.at(away, float(d))[:, 1].reshape(len(centres), -1)
        h = h - (h @ share)[:, None]
        taken[row] = (h @ (share * y)) ** 2 / np.maximum(h**2 @ share, 1e-300)
    scale, centre = np.unravel_index(int(np.argmax(taken)), taken.shape)
    return np.array([np.log(scales[scale]), centres[centre]])


LEAST = 0.02
"""Share of a curve's height within which its values are not told apart."""


@dataclass(frozen=True)
class ClosedForm:
    """A form fitted to a curve: `left` the share of its variation that remains, as RMS.

    `values` in the order c, m, d, then n or s0, SI; `top` the last knot.
    """

    form: CurveForm
    values: tuple[float, ...]
    left: float
    top: float = 1.0

    @property
    def name(self) -> str:
        """The form's name."""
        return self.form.name

    def at(self, s: Array) -> Array:
        """Return the form's value (n,) along its signal (n,)."""
        scale = self.values[2] if self.form.scales is not None else 1.0
        factors = self.values[:2] + (self.values[3:] if not self.form.centred else ())
        return np.asarray(self.form.at(s - self.centre, scale, self.top) @ np.array(factors))

    @property
    def centre(self) -> float:
        """Where it has its centre, 0 where that is no number of its own."""
        return self.values[3] if self.form.centred else 0.0

    @property
    def price(self) -> float:
        """What it leaves, raised for each of its numbers: the least is the best form."""
        return (self.left + LEAST) * 1.25 ** self.form.count()  # less tells no forms apart


_GAPS = {"dead band": "of", "contact above": "beyond", "contact below": "beyond"}
"""Forms that begin at a distance, and the word before it."""

_POWERS = {"line": 1, "parabola": 2, "quadratic drag": 2, "cubic": 3, **dict.fromkeys(_GAPS, 1)}
"""By which power of the signal's unit the slope of a form is divided."""


def name_of(forms: Sequence[ClosedForm]) -> ClosedForm | None:
    """Return the form that names a curve, the first of `forms`; None where it leaves too much."""
    return forms[0] if forms and forms[0].left <= LEARN.follows else None


def nearest_of(forms: Sequence[ClosedForm]) -> ClosedForm | None:
    """Return the first of `forms`; None where it leaves most of the curve's variation."""
    return forms[0] if forms and forms[0].left <= LEARN.near_form else None


def closed_forms(curve: Curve, std: Sequence[float]) -> list[ClosedForm]:
    """Return the forms fitted to a curve, the best first; fewer numbers win where two are near.

    Parameters
    ----------
    curve : as fitted
    std : (k,) of its values; a knot that was held at zero counts as the surest of the others
    """
    if curve.of.alone or curve.across or not curve.signal.named:
        return []  # its values are no curve, or more than one
    s, y = np.array(curve.knots), np.array(curve.values)
    given = np.array(std)
    some = given[given > 0.0]
    least = float(np.median(some)) if len(some) else 1.0
    # What the data tell least must not decide, and no knot alone.
    alike = LEAST * float(np.ptp(y)) + 1e-300
    weight = 1.0 / np.hypot(np.where(given > 0.0, given, least), alike)
    size = _spread(curve, y, weight)
    if not size > 0.0:
        return []
    able = [one for one in forms_for(curve) if one.count() + curve.of_line + 1 <= len(s)]
    found = [_fitted(form, curve, y, weight, size) for form in able]
    found = sorted(found, key=lambda one: one.price)
    return [*_about_a_centre(curve, y, weight, size, found), *found]


def forms_for(curve: Curve) -> list[CurveForm]:
    """Return the forms that a curve may have."""
    if curve.part == "command":
        return [FORMS[0], *MAPS]
    if curve.of_line:
        return [one for one in FORMS if one.columns != LINE]
    return [one for one in FORMS if not one.bent or curve.along == "displacement"]


def formula_of(found: ClosedForm, curve: Curve) -> CurveFormula:
    """Return a closed form as an effect computes it, without the constant that a law has.

    What would take ever more from a building's own stiffness or friction ends with the data.
    """
    s = curve.signal.source if not found.form.centred else f"({curve.signal.source} - p.s0)"
    grows = curve.place.is_line and found.form.grows
    ends = grows and found.values[1] < 0.0
    if ends:
        s = f"min(max({s}, {curve.knots[0]:.6g}), {curve.knots[-1]:.6g})"
    unit, along = curve.unit, curve.along_unit
    per = _POWERS.get(found.name, 0)
    slope = canonical(unit + f"/({_by(along)})" * per) if found.form not in MAPS else "1"
    if found.name == "line" and (curve.part, curve.along) in _PHYSICAL:
        slope = _PHYSICAL[curve.part, curve.along][1]
    found_at = dict(zip("cm", found.values[:2], strict=False))
    names = [f"p.{n}" for n, _ in zip("mn", found.form.columns, strict=False)]
    top = f"{found.top:.6g}"
    terms = [one.format(s=s, d="p.d", top=top) for one in found.form.columns]
    rest = found.form.at_rest() if curve.rests else (0.0,) * len(terms)
    terms = [f"({t} - {r!r})" if r else t for t, r in zip(terms, rest, strict=True)]
    g = " + ".join(f"{n} * {term}" for n, term in zip(names, terms, strict=True)) or "0.0"
    given = [("m", found_at["m"], slope)] if terms else []
    if not found.form.sized:
        g, given = terms[0], []
    if found.form.scales is not None:
        given.append(("d", found.values[2], "1" if found.name == "power" else along))
    if len(terms) > 1:
        given.append(("n", found.values[3], unit))
    if found.form.centred:
        given.append(("s0", found.centre, along))
    text = found.form.text.format(top=top)
    if curve.of.level:  # the law's own strength is the constant
        text = text.removeprefix("c + ")
        text += "".join(f" - {n}" for n, r in zip("mn", rest, strict=False) if r)
    else:
        given, g = [("c", found.values[0], unit), *given], f"p.c + {g}"
    return CurveFormula(g, text, tuple(given), ends, ("m",) if grows and not ends else ())


def _fitted(form: CurveForm, curve: Curve, y: Array, weight: Array, size: float) -> ClosedForm:
    """Return a form at its best scale, its constants by weighted least squares."""
    best: ClosedForm | None = None
    s, beside = np.array(curve.knots), int(curve.of_line)
    span, step, top = float(np.max(np.abs(s))), float(np.min(np.diff(s))), float(s[-1])
    for d in form.scales(span, step) if form.scales else [1.0]:
        A = np.hstack([form.at(s, float(d), top), s[:, None][:, :beside]])
        found = _constants(A, y, weight, form.sized)
        at = A @ found
        left = float(np.sqrt(np.sum((weight * (y - at)) ** 2) / np.sum(weight**2))) / size
        if best is None or left < best.left:
            own = tuple(map(float, found[: len(found) - beside]))
            values = (*own[:2], *(() if len(own) < 2 else (float(d),)), *own[2:])
            best = ClosedForm(form, values, left, top)
    assert best is not None
    return best


def _about_a_centre(
    curve: Curve, y: Array, weight: Array, size: float, plain_forms: Sequence[ClosedForm]
) -> list[ClosedForm]:
    """Return the form about a centre of its own if it follows the curve best; else nothing."""
    if curve.rests or curve.of_line or not (curve.along in UNCENTRED or curve.measured):
        return []
    if any(one.price <= LEAST * 1.25 ** CENTRED[0].count() for one in plain_forms):
        return []  # even without an error it would not be the best
    own = [fitted_about(form, np.array(curve.knots), y, weight) for form in CENTRED]
    found = [
        ClosedForm(form, one.values, one.rms / size)
        for form, one in zip(CENTRED, own, strict=True)
        if one is not None
    ]
    best = min(found, key=lambda one: one.price, default=None)
    earned = best is not None and best.left <= LEARN.follows
    if best is None or not earned or any(one.price <= best.price for one in plain_forms):
        return []
    return [best]


def _constants(A: Array, y: Array, weight: Array, sized: bool) -> Array:
    """Return the factors (k,) of columns (n, k) by weighted least squares; not sized, m is 1."""
    if not sized:
        return np.array([float(np.average(y - A[:, 1], weights=weight**2)), 1.0])
    size_of = np.maximum(np.max(np.abs(A), axis=0), 1e-300)  # a cube of 1e6 Pa dwarfs the 1
    found = np.linalg.lstsq(A / size_of * weight[:, None], y * weight, rcond=1e-12)[0]
    return np.asarray(found / size_of)


def _spread(curve: Curve, y: Array, weight: Array) -> float:
    """Return the weighted RMS of values (k,) about what the model has already.

    That is their mean, or where its line is the model's own a line.
    """
    own = [np.ones_like(y), *([np.array(curve.knots)] if curve.of_line else [])]
    A = np.stack(own, axis=1)
    known = A @ np.linalg.lstsq(A * weight[:, None], y * weight, rcond=1e-12)[0]
    return float(np.sqrt(np.sum((weight * (y - known)) ** 2) / np.sum(weight**2)))


def _by(along: str) -> str:
    """Return the unit of a signal as one divides by it: K of a temperature in degC."""
    return "K" if along == "degC" else along


def in_words(found: ClosedForm, curve: Curve) -> str:
    """Return a form with its numbers, for a sentence: "a line, 320 N/m"."""
    unit, along = curve.unit, curve.along_unit
    if found.name == "constant":
        return f"a constant, {quantity(found.values[0], unit)}"
    m, d, scaled = found.values[1], found.values[2], found.form.scales is not None
    centre = found.centre
    if curve.measured:  # per kPa or MPa, not per Pa
        factor, along = scale(along, max(map(abs, curve.knots)))
        m, d = m / factor, d if found.name == "power" else factor * d
        centre = factor * found.centre
    rate = unit if along == "1" else canonical(f"{unit}/({_by(along)})")
    if found.name == "line":
        physical = _PHYSICAL.get((curve.part, curve.along))
        if physical:
            return (
                f"proportional to {curve.signal.words}: {physical[0]} of {plain(m)} {physical[1]}"
            )
        if unit == "1":
            return f"a line of slope {plain(m)}" + ("" if along == "1" else f" per {_by(along)}")
        return f"a line, {plain(m)} {rate}"
    over = {
        "ripple": f", pitch {quantity(d, along)}",
        "power": f" with exponent {plain(d, 2)}",
        **{
            name: f" {word} {quantity(d, along)}, then {plain(m)} {rate}"
            for name, word in _GAPS.items()
        },
    }.get(found.name, f" over {quantity(d, along)}" if scaled else "")
    over = f" at {quantity(centre, along)}{over}" if found.form.centred else over
    height = np.hypot(m, found.values[3]) if len(found.form.columns) > 1 else abs(m)
    article = "an" if found.name[0] in "aeiou" else "a"
    tall = f", height {quantity(float(height), unit)}"
    tall = tall if over and found.name not in ("power", *_GAPS) else ""
    return f"{article} {found.name}{over}{tall}"


_PHYSICAL = {
    ("force", "acceleration"): ("an added mass", "kg"),
    ("force", "displacement"): ("a spring", "N/m"),
    ("force", "velocity"): ("a dashpot", "N.s/m"),
}
"""What a force in proportion to a signal is."""


# Closed forms fitted inside the model, in the place of a learned curve.

CLOSED = 2
"""Closed forms that are fitted in the place of a curve, until one does as well."""


@dataclass(frozen=True)
class Closed:
    """A closed form in the place of a learned curve: `formula` with its fitted values, `trial`."""

    form: ClosedForm
    formula: CurveFormula
    trial: Trial
    std: dict[str, float]


def close(
    prepared: Prepared, name: str, best: Fitted, forms: Sequence[ClosedForm]
) -> Closed | None:
    """Fit the closed forms that may name a curve in its place; return the first that does as well.

    Parameters
    ----------
    prepared : runs and the fitted model, as a diagnosis begins with them
    name : of the curve's effect
    best : the curve
    forms : fitted to the curve, the best first
    """
    able = [one for one in forms if one.left <= LEARN.resembles][:CLOSED]
    return next(filter(None, (fit_closed(prepared, name, best, one) for one in able)), None)


def fit_closed(prepared: Prepared, name: str, best: Fitted, form: ClosedForm) -> Closed | None:
    """Fit a closed form in the place of a learned curve; None where it is clearly worse.

    It has fewer numbers, and holds between and beyond the knots: as good is good enough, and better
    where it follows the curve less closely.

    Parameters
    ----------
    prepared : runs and the fitted model, as a diagnosis begins with them
    name : of the curve's effect
    best : the curve
    form : fitted to the curve
    """
    formula = formula_of(form, best.curve)
    if not formula.parameters:
        return None
    text = effect_text(name, best.curve, "a trial", formula)
    base, values = best.trial.model, dict(best.trial.model.values)
    values = {k: v for k, v in values.items() if not k.startswith(f"{name}.curve[")}
    values |= {f"{name}.{n}": value for n, value, _ in formula.parameters}
    with defined({name: text}):
        train = prepared.searched.of(prepared.searched.runs)
        held_out = prepared.held_out.of(prepared.held_out.runs)
        model = refine(replace(base, values=values), train, SWEEPS)
        trial = judge(model, train, held_out)
        worst = (LEARN.as_good if form.left <= LEARN.follows else 1.0) * best.trial.train
        if trial.train > worst or not missing(prepared.before, trial, prepared.rule):
            return None
        std = intervals_of(train, model).std
        given = tuple((n, model.value(f"{name}.{n}"), unit) for n, _, unit in formula.parameters)
        memory = {f"{name}.{n}": n for n, _ in best.curve.memory}
        own = {f"{name}.{n}": n for n, _, _ in formula.parameters} | memory
        own_std = {n: std.get(key, 0.0) for key, n in own.items()}
    return Closed(form, replace(formula, parameters=given), trial, own_std)
