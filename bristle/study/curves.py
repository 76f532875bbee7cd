"""A curve learned from a study's runs: its effect's file, its picture, and what is known of it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import date
from keyword import iskeyword
from pathlib import Path
from typing import Any

import numpy as np

from ..compare.names import site_name
from ..diagnose.bench import BenchRuns
from ..diagnose.equilibrium import BuildingRuns
from ..diagnose.learned.closed import ClosedForm, closed_forms, in_words, name_of
from ..diagnose.learned.closed_fit import Closed, close
from ..diagnose.learned.curve import Curve
from ..diagnose.learned.effect_file import effect_text
from ..diagnose.learned.fit import LearnedCurve, learn
from ..diagnose.learned.place import Place
from ..diagnose.learned.ring import RING
from ..diagnose.learned.rule import LEARN
from ..diagnose.learned.slip import SLIP
from ..diagnose.learned.surface import continues, separated
from ..diagnose.opening import Insufficient, Opening
from ..errors import StudyError
from ..physics.effect import EFFECTS
from ..physics.user import flaw_of
from ..progress import tell
from ..quantity import plain, quantity
from ..shown import shown
from ..trust import remember_made
from .curve_options import refuse_elsewhere
from .curve_picture import curve_png
from .identification import as_model
from .rig import building_of
from .set_aside import LEARNED
from .study import Study

Runs = BenchRuns | BuildingRuns

DRAWN = 400
"""Points of a closed form that a page draws."""


@dataclass(frozen=True)
class LearnedEffect:
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

    def __repr__(self) -> str:
        return shown(self, self.name, self.sentences())

    def sentences(self) -> list[str]:
        """Return what was learned, as an engineer would say it."""
        found = self.found
        if found.refused or found.curve is None or found.after is None:
            return [f"Nothing was learned{self._where()}. {found.refused}"]
        curve = found.curve
        fall = 100.0 * (1.0 - _excess(found.after.z) / max(_excess(found.before.z), 1e-12))
        out = [
            f"{self.name} is {curve.words()}{self._where()}. With it the error / noise (z) on "
            f"held-out runs falls from {found.before.z:.2f} to {found.after.z:.2f}; that is "
            f"{fall:.0f} % of what exceeds the noise."
        ]
        best = self.closed.form if self.closed else name_of(self.forms)
        if best is not None:
            out.append(
                f"The curve is nearly {in_words(best, curve)} "
                f"({100.0 * best.left:.0f} % of its variation remains)."
            )
            if self.closed is not None:
                out.append(
                    f"The effect has that formula, which leaves z = {self.closed.trial.z:.2f}: "
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
            mode = dict(curve.memory)
            out.append(
                f"{100.0 * curve.values[0]:.3g} % of the force passes through a mode at "
                f"{plain(mode['frequency'], 4)} Hz with a damping ratio of "
                f"{plain(mode['damping'], 2)}: the frame, the fixture or the load cell itself. "
                "Stiffen it, or measure the force closer to the damper."
            )
        elif self.forms:
            out.append(
                f"No closed form follows it: the nearest, {in_words(self.forms[0], curve)}, leaves "
                f"{100.0 * self.forms[0].left:.0f} % of its variation."
            )
        return [*out, *self._line()]

    def _where(self) -> str:
        """Return at which site it was learned, for a sentence; "" on a bench."""
        return f" at {site_name(self.site)}" if self.site else ""

    def _line(self) -> list[str]:
        """Return the sentence about the line of a layer or a storey beside the curve."""
        curve, trial = self.found.curve, self.closed.trial if self.closed else self.found.after
        if curve is None or trial is None or not curve.place.is_line:
            return []
        stiffness = trial.model.value(trial.model.law_class.stiffness)
        return [f"Beside it, the linear stiffness there is {plain(stiffness, 4)} N/m."]

    def _values(self) -> list[str]:
        assert self.closed is not None
        return [
            f"{name} = {plain(value, 4)} +- {plain(1.96 * self.closed.std[name], 2)}"
            + (f" {unit}" if unit != "1" else "")
            for name, value, unit in self.closed.formula.parameters
        ]

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
        if found.curve is not None and found.after is not None:
            curve = found.curve
            out |= {
                "z": found.after.z, "z_train": found.after.train, "site": curve.at,
                "part": curve.part,
                "along": curve.along, "unit": curve.unit, "along_unit": curve.along_unit,
                "knots": list(curve.knots), "values": list(curve.values), "std": list(found.std),
                "memory": dict(curve.memory),
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


def learn_effect(
    study: Study,
    *,
    parts: Sequence[str] = (),
    along: Sequence[str] = (),
    at: str = "",
    name: str = "",
    table: bool = False,
    write: bool = True,
) -> LearnedEffect:
    """Learn what a study's model misses at one of its sites, as an effect of the study.

    Parameters
    ----------
    study : the folder, opened
    parts, along : on which parts of the model a curve may act and along which signals, by name;
        empty for all
    at : the site, "damper", "layer", "storey1" ...; else that where the verdict is unknown, or
        where the model errs most
    name : of the effect; else learned_1, learned_2 ...
    table : whether the effect keeps the curve's table where a formula does as well
    write : whether to write the effect's file and the picture

    Raises
    ------
    StudyError
        If the data carry no verdict, the runs do not show the site, no curve can have such a part
        or signal there, or the name is taken.
    """
    for why in study.usable_effects():
        tell(f"left out: {why}")
    name = name or _free_name(study)
    if not name.isidentifier() or iskeyword(name):
        raise StudyError(f'the name "{name}" is no word of letters, digits and _, as worn_bore is.')
    if name in EFFECTS or (study.effects_folder / f"{name}.py").exists():
        raise StudyError(f'an effect is named "{name}" already. Another name is right.')
    site, opened = _opened(study, at)
    refuse_elsewhere(parts, along, Place(site), study.settings.beside)
    found = learn(opened, name, parts=parts, along=along)
    told = site if study.settings.has_building else ""
    if found.refused or found.curve is None:
        return LearnedEffect(found, site=told)
    forms, closed = tuple(closed_forms(found.curve, found.std)), None
    if not table:
        closed = close(opened, found, forms)
    if closed is not None:  # the name that the effect's formula has
        forms = (closed.form, *(one for one in forms if one is not closed.form))
    learned = LearnedEffect(found, forms, closed, site=told)
    flaw = ""
    for one in [learned, replace(learned, closed=None)] if closed is not None else [learned]:
        text = _text(study, one, found.curve)
        flaw = flaw_of(name, text)
        if not flaw:
            return _written(study, one, text) if write else one
    why = f"{found.curve.words().capitalize()} can be no effect: {flaw}"
    return replace(learned, closed=None, found=replace(found, refused=why))


def _text(study: Study, learned: LearnedEffect, curve: Curve) -> str:
    """Return the text of a learned effect's file."""
    name, closed = learned.name, learned.closed
    if closed is not None:
        values = closed.trial.model.values  # of an effect that has no file yet
        memory = tuple((n, values[f"{name}.{n}"]) for n, _ in curve.memory)
        curve = replace(curve, memory=memory)
    origin = f"{LEARNED} {study.name}, {date.today().year}"
    return effect_text(name, curve, origin, closed.formula if closed else None)


def _written(study: Study, learned: LearnedEffect, text: str) -> LearnedEffect:
    """Write a learned effect's file, its picture, and what the report says of it."""
    name = learned.name
    file = study.effects_folder / f"{name}.py"
    with study.writing():
        file.parent.mkdir(exist_ok=True)
        file.write_text(text, encoding="utf-8")
        remember_made(file, text)
    drawn = curve_png(learned.found, learned.forms, learned.closed)
    picture = study.write_report(f"{name}.png", drawn)
    told = json.dumps(learned.as_dict(), indent=2, ensure_ascii=False)
    study.write_report(f"{name}.json", told)
    return replace(learned, file=file, picture=picture)


def _opened(study: Study, at: str) -> tuple[str, Opening]:
    """Return the site to learn at, and what is known there."""
    rig = _rig(study)
    there = rig.sites()
    if at and at not in there:
        raise StudyError(
            f"--at: these runs do not show the site {at}; they show {', '.join(there)}."
        )
    openings = [(site, rig.open_site(site)) for site in ([at] if at else _wanted(study, there))]
    able = [(site, one) for site, one in openings if isinstance(one, Opening)]
    if not able:
        why = [" ".join(one.reasons) for _, one in openings if isinstance(one, Insufficient)]
        raise StudyError("the data carry no verdict: " + " ".join(why))
    return max(able, key=lambda pair: pair[1].before.z)


def _rig(study: Study) -> Runs:
    model, runs = study.model(), study.runs()
    known = any(value.origin == "identified" for value in model.flat().values())
    building, present = building_of(study, model), as_model(model)
    if building is None:
        return BenchRuns(runs.train, runs.holdout, present, known, tell)
    return BuildingRuns(runs.train, runs.holdout, present, building, tell)


def _wanted(study: Study, there: Sequence[str]) -> list[str]:
    """Return the sites where the verdict on the present model is unknown; all where it is nowhere.

    Parameters
    ----------
    study : the folder, opened
    there : the sites that its runs show
    """
    findings = (study.verdict() or {}).get("findings") or []
    unknown = [one["site"] for one in findings if one["kind"] == "unknown"]
    return [site for site in there if site in unknown] or list(there)


def _free_name(study: Study) -> str:
    number = 1
    while (
        study.effects_folder / f"learned_{number}.py"
    ).exists() or f"learned_{number}" in EFFECTS:
        number += 1
    return f"learned_{number}"


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
    one, other = (signal.words for signal in curve.signals)
    kind, left = separated(curve)
    out = (
        f"The surface is nearly the {kind} of a curve along {one} and one along {other} "
        f"({100.0 * left:.0f} % of its variation remains)."
        if left <= LEARN.follows
        else "The surface is neither the sum nor the product of two curves: the nearest "
        f"{kind} leaves {100.0 * left:.0f} % of its variation."
    )
    few, count = len(continues(curve)), len(curve.values)
    if not few:
        return [out]
    verb = "continues" if few == 1 else "continue"
    return [
        out,
        f"{few} of its {count} values {verb} those beside them: these runs hardly reach there.",
    ]


def _excess(z: float) -> float:
    return max(z * z - 1.0, 0.0)
