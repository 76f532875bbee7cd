"""Laws and forms of the command compared on the runs of a study."""

from __future__ import annotations

import hashlib
import json
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from ..core.files import read_json
from ..core.interrupt import keeps
from ..core.progress import tell
from ..core.text import command, joined, short_z, unknown
from ..data.checks.runs import LEAST_LEVELS, command_levels, drives_of, tells_a_bend
from ..data.measurement import Measurement
from ..diagnosis.law_trials import LawTrial, not_finite, try_laws
from ..diagnosis.trials import BESIDE, End, Trial
from ..diagnosis.words import left_out
from ..errors import BristleError, PhysicsError, StudyError
from ..identification.rig import DAMPER, Rig
from ..model.model import Model, unfit
from ..model.model_file import model_text
from ..physics.command import MOST_KNOTS
from ..physics.drive import DRIVES
from ..physics.forms import FORMS, LINEAR_FORM, TABLE_FORM, joined_form, split_form
from ..physics.laws import DEFAULT, base_and_variant
from ..version import __version__
from .runs import Runs
from .study import Study
from .study_file import ALL

_MOVING_KNOTS = 5  # of a table where the command moves continuously
_TAIL = 0.005  # share of the samples beyond either end of such a table
_DIGITS = 4  # of a knot


@dataclass(frozen=True)
class FormError:
    """The error of a model in one form of the command, identified like the model itself.

    `errors` are those of `Identified.after`; `numbers` says how many parameters were fitted.
    """

    form: str
    model: Model
    errors: dict[str, float]
    numbers: int

    @property
    def judged(self) -> float:
        """Share of the force that is left on held-out runs; of training runs where none is."""
        return self.errors.get("error_share_holdout", self.errors["error_share_train"])

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        _, _, knots = split_form(self.model.law)
        return {
            "command": self.form, "knots": list(knots), "fitted": self.numbers,
            "errors": finite(self.errors), "values": self.model.values,
        }  # fmt: skip


def finite(errors: Mapping[str, float]) -> dict[str, float | None]:
    """Return errors as json can hold them: z is None where the noise is not known."""
    return {name: value if value == value else None for name, value in errors.items()}


def form_of(model: Model) -> str:
    """Return the form of the command that a model has: "linear" where none was chosen."""
    return split_form(model.law)[1] or LINEAR_FORM


def forms_asked(command: str | Sequence[str]) -> tuple[str, ...]:
    """Return the forms that were asked for: one, several with commas between them, or all.

    Raises
    ------
    StudyError
        If one is not known.
    """
    if not isinstance(command, str) and not isinstance(command, Sequence):
        raise StudyError(f"command is {command!r}; one of {', '.join(FORMS)}, or all, is right.")
    words = command.replace(",", " ").split() if isinstance(command, str) else list(command)
    for word in words:
        if word not in (*FORMS, ALL):
            raise StudyError(unknown("form of the command", str(word), (*FORMS, ALL)))
    if not words:
        raise StudyError(f"no form of the command is named; there are: {', '.join(FORMS)}, all.")
    return FORMS if ALL in words else tuple(dict.fromkeys(words))


def knots_of(runs: Sequence[Measurement]) -> tuple[float, ...]:
    """Return the knots [V, or A of a current] of a table that these runs carry.

    They are the levels that the command keeps to; where there are more than a table holds, or the
    command moves continuously, they are spread over its range.

    Raises
    ------
    StudyError
        If the command keeps to fewer than `LEAST_LEVELS`.
    """
    drives = drives_of(runs)
    if not drives:
        raise StudyError(
            "no command was measured: what depends on it cannot be told. "
            f"--command {LINEAR_FORM} is right."
        )
    levels = command_levels(runs)
    if levels is None:
        values = np.concatenate([run[name] for run, name in drives])
        low, high = np.quantile(values, (_TAIL, 1.0 - _TAIL))
        return _rounded(np.linspace(max(float(low), 0.0), float(high), _MOVING_KNOTS))
    if len(levels) < LEAST_LEVELS:
        unit = DRIVES[drives[0][1]].unit
        at = " and ".join(f"{level:.3g} {unit}" for level in levels)
        raise StudyError(
            f"the training runs hold the command at {at} alone: that tells a straight line at "
            f"most. Runs at {LEAST_LEVELS} levels or more, or --command {LINEAR_FORM}, would be "
            "right."
        )
    if len(levels) > MOST_KNOTS:
        picked = np.round(np.linspace(0, len(levels) - 1, MOST_KNOTS)).astype(int)
        levels = [levels[k] for k in picked]
    return _rounded(levels)


def _rounded(levels: Any) -> tuple[float, ...]:
    largest = max(abs(float(level)) for level in levels)
    places = _DIGITS - 1 - int(np.floor(np.log10(largest))) if largest > 0.0 else _DIGITS
    return tuple(round(float(level), places) + 0.0 for level in levels)


def in_form(model: Model, form: str, runs: Sequence[Measurement]) -> Model:
    """Return a model with another form of the command, as near to what it was as can be.

    Parameters
    ----------
    model : a damper's law with effects
    form : one of `physics.forms.FORMS`
    runs : the training runs, whose levels are a table's knots

    Raises
    ------
    StudyError
        If the runs do not carry the form, nothing in the law can have it, or an effect bends the
        command already.
    """
    plain, present, _ = split_form(model.law)
    if form == LINEAR_FORM and not present:
        return model
    knots = knots_of(runs) if form != LINEAR_FORM else ()
    try:
        name = joined_form(plain, form, knots if form == TABLE_FORM else ())
        law, _ = base_and_variant(name)
    except PhysicsError as error:
        raise StudyError(str(error)) from None
    if wrong := unfit(law, model.effects):
        raise StudyError(
            f"{', '.join(wrong)} bends the command already, and a {form} would do so once more: "
            "undo that step first."
        )
    return _carried(model, model.with_law(name, model.effects))


def _carried(model: Model, other: Model) -> Model:
    """Return the other model with what both have, and quantities as they are in the first."""
    kept = {n: f for n, f in model.written().items() if n in other.values}
    other = other.with_facts(kept)
    before, after = (base_and_variant(one.law)[0] for one in (model, other))
    top = max(before.knots or after.knots or (1.0,))
    new: dict[str, float] = {}
    for quantity, form in after.command.items():

        def at(V: float, quantity: str = quantity) -> float:
            return float(getattr(before.at(model.values, V), quantity))

        names = [name for one in form.names() for name in after.listed(one)]
        points = after.knots if quantity in after.tables else ()
        found = _numbers(at, points, top)
        new.update({n: v for n, v in zip(names, found, strict=False) if n not in kept})
    bounded = {n: float(np.clip(v, *other.bounds(n))) for n, v in new.items()}
    return other.with_values(bounded, origin="assumed")


def _numbers(at: Any, knots: Sequence[float], top: float) -> Iterator[float]:
    """Yield a quantity's numbers: first value and gains of a table; else level, slope, no bend."""
    if knots:
        yield at(knots[0])
        yield from (at(b) - at(a) for a, b in pairwise(knots))
    else:
        yield from (at(0.0), (at(top) - at(0.0)) / top, 0.0)


# The fits of a search for the law, kept as they are made: an interrupted one goes on there.

NAME = "law_fits.json"
"""Where they are, in reports/."""


class LawFits:
    """The fits of laws to a study's training runs: what is known of them, and where more go.

    Those of other data, of another model or code, or of another version of bristle do not count.

    Parameters
    ----------
    study : the folder, opened
    model : the present one, whose effects the laws have
    """

    def __init__(self, study: Study, model: Model) -> None:
        self._study = study
        self._key = _key(study, model)
        self._ends = _read(study, self._key)
        self._nearest = ""
        self._lock = threading.Lock()

    def found(self, of: str) -> Sequence[End]:
        """Return the fits that are kept of a law, or of one effect more beside it, none if new."""
        return self._ends.get(of, ())

    def keep(self, of: str, ends: Sequence[End | Trial]) -> None:
        """Write the fits of a law, or of one effect more beside it, with those that are there."""
        with self._lock:
            self._ends[of] = [End(one.model, one.refined) for one in ends]
            fits = {of: list(map(_as_dict, own)) for of, own in self._ends.items()}
            content = json.dumps({"schema": 1, "key": self._key, "fits": fits}, indent=1)
            self._study.write_report(NAME, content + "\n")
        self._tell()

    def stands(self, law: str, effects: Sequence[str], z: float) -> None:
        """Take note of what comes nearest so far, and its z on held-out runs."""
        beside = f" with {joined(effects)}" if effects else ""
        self._nearest = (
            f"Nearest so far: {law}{beside}, error / noise (z) {short_z(z)} on held-out runs "
            f"({law_command(self._study.folder, law)} takes the law). "
        )
        self._tell()

    def _tell(self) -> None:
        count = sum(len(own) for of, own in self._ends.items() if BESIDE not in of)
        searched = len({of.partition(BESIDE)[0] for of in self._ends if BESIDE in of})
        effects = (
            f"and the effects tried of {searched} of them" if searched else "no effects were tried"
        )
        one = count == 1
        keeps(
            f"{self._nearest}The fit{'' if one else 's'} of {count} law{'' if one else 's'} "
            f"{'is' if one else 'are'} kept, {effects}: the same command goes on there."
        )


_OF_MODEL = ("law", "effects", "values", "fixed", "limits")


def _as_dict(end: End) -> dict[str, Any]:
    return {name: getattr(end.model, name) for name in _OF_MODEL} | {"refined": end.refined}


def _end(kept: Mapping[str, Any]) -> End:
    law, effects, values, fixed, limits = (kept[name] for name in _OF_MODEL)
    pairs = {name: (float(low), float(high)) for name, (low, high) in limits.items()}
    values = {str(name): float(value) for name, value in values.items()}
    return End(Model(law, tuple(effects), values, tuple(fixed), pairs), bool(kept["refined"]))


def _read(study: Study, key: str) -> dict[str, list[End]]:
    """Return the fits that were kept."""
    path = study.reports_folder / NAME
    try:
        found = read_json(path) if path.is_file() else {}
        if found.get("key") != key:
            return {}
        return {str(of): list(map(_end, own)) for of, own in found["fits"].items()}
    except (BristleError, KeyError, TypeError, ValueError, AttributeError):
        return {}  # a file that somebody changed: the fits are made anew


def _key(study: Study, model: Model) -> str:
    whole = hashlib.sha256(f"{__version__} {study.data} {model_text(model)}".encode())
    for folder in (study.laws_folder, study.effects_folder):
        for path in sorted(folder.glob("*.py")) if folder.is_dir() else ():
            whole.update(path.read_bytes())
    return whole.hexdigest()[:16]


# All laws against the runs of a study: how each does, and a model brought to another law.


def refuse_in_building(law: str | None, in_building: bool) -> None:
    """Refuse to compare all laws, without their effects, on a rig that is no test bench.

    Raises
    ------
    StudyError
        If all laws were asked for and the damper is in a building.
    """
    if law == ALL and in_building:
        raise StudyError(
            "identify compares all laws on a test bench alone: in a building the law decides "
            "which samples its fit and z take. Name one law, or let diagnose seek it "
            "with its effects (--law all)."
        )


def law_or_all(study: Study, law: str | None) -> str | None:
    """Return what was asked for; where nothing was, "all" as long as nobody chose a law.

    A study that was made without a law begins with a stand-in. Once its model has another law, or
    an effect, that is what somebody or a verdict chose.
    """
    if law is not None or study.settings.law != ALL or study.settings.has_building:
        return law
    model = study.model()
    return None if model.law != DEFAULT or model.effects else ALL


def all_laws(rig: Rig, runs: Runs, present: Model) -> tuple[LawTrial, ...]:
    """Return how every law does on a bench, the best on held-out runs first.

    Parameters
    ----------
    rig : the bench with its runs
    runs : the measurements that it was made of, whose command decides on quadratic forms
    present : the model as it is; each law has those of its effects that can join it

    Raises
    ------
    StudyError
        If the rig is a building.
    """
    refuse_in_building(ALL, rig.building is not None)
    tell("trying every law")
    site = rig.sites(present)[DAMPER]
    held_out = site.train if site.holdout is None else site.holdout
    return try_laws(site.train, held_out, present, bends=tells_a_bend(runs.train))


def left_out_notes(rig: Rig, present: Model) -> tuple[str, ...]:
    """Return the sentence that tells which laws `all_laws` leaves out, none where it tries all.

    Parameters
    ----------
    rig : the bench with its runs
    present : the model as it is
    """
    unfit = not_finite(rig.sites(present)[DAMPER].train, present)
    return (left_out(unfit),) if unfit else ()


def with_law(model: Model, law: str) -> Model:
    """Return a model with another law, such as "lugre[quadratic]", and the effects that can join.

    Raises
    ------
    PhysicsError
        If there is no such law.
    """
    lost = unfit(base_and_variant(law)[0], model.effects)
    return model.with_law(law, [name for name in model.effects if name not in lost])


def law_command(folder: object, law: str, *others: str) -> str:
    """Return the command that identifies a study's model with a law, in the law's form."""
    plain, form, _ = split_form(law)
    words: Sequence[str] = ("--command", form) if form not in ("", LINEAR_FORM) else ()
    return command("identify", folder, "--law", plain, *words, *others)
