"""What was learned from a study's runs: a curve, its closed forms, and what is said of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..comparison.names import site_name
from ..core.text import percent, plain, quantity, with_interval
from ..diagnosis.trials import Trial
from ..view import Viewable
from .closed_forms import Closed, ClosedForm, in_words, name_of, nearest_of
from .curve import Curve
from .fit import LearnedCurve
from .signals import RING, SLIP
from .surface import continues

DRAWN = 400
"""Points of a closed form that a page draws."""


@dataclass(frozen=True, repr=False)
class LearnedEffect(Viewable):
    """A learned curve as an effect of a study: `file` its effect's, None where none is kept.

    `forms` the closed forms fitted to it, the best first; `closed` the one that the effect has in
    the place of the table, None for the table; `picture` where it is drawn; `site` where on the rig
    it was learned, "" on a bench, which has one.
    """

    found: LearnedCurve
    forms: tuple[ClosedForm, ...] = ()
    closed: Closed | None = None
    file: Path | None = None
    picture: Path | None = None
    site: str = ""

    @property
    def name(self) -> str:
        """The effect's name."""
        return self.found.name

    def sentences(self) -> list[str]:
        """Return what was learned, as an engineer would say it."""
        found = self.found
        if found.refused or found.best is None:
            return [f"Nothing was learned{self._where()}. {found.refused}"]
        curve, after = found.best.curve, found.best.trial
        fall = 100.0 * (1.0 - _excess(after.z) / max(_excess(found.before.z), 1e-12))
        out = [
            f"{self.name} is {curve.words()}{self._where()}. With it the error on held-out runs "
            f"falls from {found.before.z:.2f} to {after.z:.2f} times the noise (z): it "
            f"explains {fall:.0f} % of the error beyond noise."
        ]
        best = self.closed.form if self.closed else name_of(self.forms)
        if best is not None:
            out.append(
                f"The curve is nearly {in_words(best, curve)} "
                f"({percent(best.left, 0)} of its variation remains)."
            )
            if self.closed is not None:
                out.append(
                    f"The effect has that formula, with z = {self.closed.trial.z:.2f}: "
                    + ", ".join(self._values())
                    + "."
                )
        elif curve.across:
            out += _of_surface(curve)
        elif curve.part == SLIP:
            pairs = zip(curve.knots, curve.values, strict=True)
            elements = [f"{quantity(f, 'N')} at {quantity(x, 'm')}" for x, f in pairs if f > 0.0]
            out.append(f"They give way with {', '.join(elements)} of travel.")
        elif curve.part == RING:
            out.append(_of_mode(curve))
        elif self.forms:
            near = nearest_of(self.forms)
            text = f": the nearest, {in_words(near, curve)}, leaves " if near else ""
            text += f"{percent(near.left, 0)} of its variation" if near else ""
            out.append(f"No formula follows the curve{text}.")
        return [*out, *_line(curve, self.closed.trial if self.closed else after)]

    def _where(self) -> str:
        """Return at which site it was learned, for a sentence; "" on a bench."""
        return f" at {site_name(self.site)}" if self.site else ""

    def _values(self) -> list[str]:
        assert self.closed is not None
        texts = []
        for name, value, unit in self.closed.formula.parameters:
            text, half = with_interval(value, self.closed.std[name] or None)
            parts = (f"{name} = {text}", half.strip("-"), unit if unit != "1" else "")
            texts.append(" ".join(part for part in parts if part))
        return texts

    def _nearest(self, curve: Curve) -> dict[str, list[float]]:
        """Return the best closed form along its signal, to draw it; empty where there is none."""
        if not self.forms:
            return {}
        along = np.linspace(curve.knots[0], curve.knots[-1], DRAWN)
        return {"along": along.tolist(), "values": self.forms[0].at(along).tolist()}

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        found = self.found
        out: dict[str, Any] = {
            "name": self.name, "kept": not found.refused, "why": found.refused,
            "sentences": self.sentences(), "z_before": found.before.z,
            "z_train_before": found.before.train,
        }  # fmt: skip
        if found.best is not None:
            curve, after = found.best.curve, found.best.trial
            out |= {
                "z": after.z, "z_train": after.train, "site": curve.at,
                "part": curve.part,
                "along": curve.along, "unit": curve.unit, "along_unit": curve.along_unit,
                "knots": list(curve.knots), "values": list(curve.values),
                "std": list(found.best.std), "memory": dict(curve.memory),
                **_levels(curve),
                "forms": [
                    {"name": one.name, "formula": one.form.text, "values": list(one.values),
                     "left": one.left}
                    for one in self.forms[:3]
                ],
                "nearest": self._nearest(curve),
                "others": [
                    {"part": one.curve.part, "along": one.curve.along,
                     **({"across": one.curve.across} if one.curve.across else {}),
                     "z": one.trial.z, "z_train": one.trial.train}
                    for one in found.others
                ],
            }  # fmt: skip
        return out


def _line(curve: Curve, trial: Trial) -> list[str]:
    """Return the sentence about the line of a layer or a storey beside a curve."""
    if not curve.place.is_line:
        return []
    stiffness = trial.model.value(trial.model.law_class.stiffness)
    return [f"Beside it, the linear stiffness there is {plain(stiffness, 4)} N/m."]


def _of_mode(curve: Curve) -> str:
    """Return what is said of a mode through which the measured force rings."""
    mode = dict(curve.memory)
    return (
        f"{100.0 * curve.values[0]:.3g} % of the force passes through a mode at "
        f"{plain(mode['frequency'], 4)} Hz with a damping ratio of {plain(mode['damping'], 2)}: "
        "the frame, the fixture or the load cell itself. Stiffen it, or measure the force closer "
        "to the damper."
    )


def _levels(curve: Curve) -> dict[str, Any]:
    """Return what a surface has more than a curve: `values` are then those of each level."""
    if not curve.across:
        return {}
    return {
        "across": curve.across, "across_unit": curve.across_unit, "levels": list(curve.levels),
        "continued": [curve.entries[k] for k in continues(curve)],
    }  # fmt: skip


def _of_surface(curve: Curve) -> list[str]:
    """Return what is said of a surface beside what it explains."""
    few, count = len(continues(curve)), len(curve.values)
    verb = "continues" if few == 1 else "continue"
    text = f"{few} of its {count} values {verb} those beside them: these runs hardly reach there."
    return [text] if few else []


def _excess(z: float) -> float:
    return max(z * z - 1.0, 0.0)
