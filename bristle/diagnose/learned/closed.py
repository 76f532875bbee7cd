"""Closed forms of a learned curve: which formula it follows, and what that leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...quantity import plain, quantity, scale
from ...units import canonical
from .centred import UNCENTRED, fitted_about
from .curve import Curve, Formula
from .forms import CENTRED, FORMS, LINE, MAPS, Form
from .rule import LEARN, LearnRule

Array = NDArray[np.float64]

LEAST = 0.02
"""Share of a curve's height within which its values are not told apart."""


@dataclass(frozen=True)
class ClosedForm:
    """A form fitted to a curve: `left` the share of its variation that remains, as RMS.

    `values` in the order c, m, d, then n or s0, SI; `top` the last knot.
    """

    form: Form
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


def name_of(forms: Sequence[ClosedForm], rule: LearnRule = LEARN) -> ClosedForm | None:
    """Return the form that names a curve, the first of `forms`; None where it leaves too much."""
    return forms[0] if forms and forms[0].left <= rule.follows else None


def nearest_of(forms: Sequence[ClosedForm], rule: LearnRule = LEARN) -> ClosedForm | None:
    """Return the first of `forms`; None where it leaves most of the curve's variation."""
    return forms[0] if forms and forms[0].left <= rule.near_form else None


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


def forms_for(curve: Curve) -> list[Form]:
    """Return the forms that a curve may have."""
    if curve.part == "command":
        return [FORMS[0], *MAPS]
    if curve.of_line:
        return [one for one in FORMS if one.columns != LINE]
    return [one for one in FORMS if not one.bent or curve.along == "displacement"]


def formula_of(found: ClosedForm, curve: Curve) -> Formula:
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
    return Formula(g, text, tuple(given), ends, ("m",) if grows and not ends else ())


def _fitted(form: Form, curve: Curve, y: Array, weight: Array, size: float) -> ClosedForm:
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
