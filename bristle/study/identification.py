"""Identify the model of a study: fit it to the training runs, judge it on those held out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..data.channels import DRIVE
from ..data.measurement import Measurement
from ..data.model import StudyModel, new_model
from ..errors import StudyError
from ..identify.fit import Fit, Model, Problem, identify
from ..identify.fit import fit as fit_model
from ..identify.prepare import prepare, saturated
from ..identify.table import LawError, error_rms, error_table, force_rms
from ..physics.laws import DEFAULT, LAWS, base_and_variant, law_names
from ..units import convert
from .history import Step
from .judged import robust_z
from .study import Runs, Study

if TYPE_CHECKING:
    import pandas as pd

    from ..identify.structure import StructureProblem

Show = Callable[[int], None]

STAGES = 4
"""How many stages `identify_study` reports to `show`."""

_MISFIT = 1.15  # z above which an error is more than noise
_SATURATED = 0.05  # share of samples at one and the same extreme of the force
_TABLE_STARTS = 3
_LONGEST_TABLE = 4_000_000  # samples of all training runs beyond which the other laws are left out


@dataclass(frozen=True)
class Identified:
    """What an identification found.

    `fit` in SI; `model` the study's model with the values; `table` the errors of the laws after
    the low-pass at `cutoff` [Hz]; `before`, `after` errors of the two models; `notes` what to
    know; `step` the history's new step, None where nothing was written; `train`, `holdout` the
    runs as they were fitted and judged, `drawn` the part of the model that predicts them where
    that is not the whole of it.
    """

    fit: Fit
    model: StudyModel
    table: list[LawError]
    cutoff: float
    before: dict[str, float]
    after: dict[str, float]
    notes: tuple[str, ...]
    step: Step | None
    train: Problem
    holdout: Problem | None
    drawn: Model | None = None

    @property
    def unidentified(self) -> tuple[str, ...]:
        """Names of the parameters that the data cannot tell."""
        return self.fit.unidentified

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        rows = {row["name"]: row for row in self.parameters()}
        return {
            "schema": 1,
            "law": self.model.law,
            "effects": list(self.model.effects),
            "parameters": {
                name: {key: row[key] for key in row if key != "name"} for name, row in rows.items()
            },
            "unidentified": list(self.unidentified),
            "starts": self.fit.starts,
            "agreed": self.fit.agreed,
            "cut_off": self.cutoff,
            "before": self.before,
            "after": self.after,
            "table": [row.as_dict() for row in self.table],
            "notes": list(self.notes),
            "step": self.step.number if self.step else None,
        }

    def parameters(self) -> list[dict[str, Any]]:
        """Return one row per parameter: name, value, unit, half of its 95 % interval, how."""
        rows = []
        for name, value in self.model.flat().items():
            if name in self.fit.unidentified:
                how = "cannot be told"
            elif name in self.fit.std:
                how = "identified"
            else:
                how = "held"
            half = 1.96 * value.std if value.std is not None and how == "identified" else None
            rows.append(
                {
                    "name": name, "value": value.value, "unit": value.unit, "interval95": half,
                    "how": how,
                }
            )  # fmt: skip
        return rows


def identify_study(
    study: Study,
    *,
    law: str | None = None,
    model: StudyModel | None = None,
    begin: Mapping[str, float] | None = None,
    cutoff: float | None = None,
    starts: int = 4,
    table: bool = True,
    write: bool = True,
    show: Show | None = None,
) -> Identified:
    """Identify the present model of a study on its training runs, its effects included.

    Parameters
    ----------
    law : another law to take than the model's; its effects stay where they can join it
    model : a model to take in place of the present one
    begin : values in SI by name from which one more fit begins; the better one counts
    cutoff : Hz, of the low-pass for the table of errors; None takes the study's
    starts : how many starting points are tried
    table : whether to compare the laws as the paper does
    write : whether to make the result the present model, as a step of the history
    show : is told how many of `STAGES` are done

    Raises
    ------
    StudyError
        If the law is not known, the data cannot carry an identification, or the study cannot be
        written.
    RecordError
        If a file cannot be read, or a channel that is needed is missing.
    """
    if starts < 1:
        raise StudyError(f"starts = {starts}; 1 or more is right.")
    identifier = IDENTIFIERS.get(study.settings.rig)
    if identifier is None:
        raise StudyError(f'{study.folder}: rig = "{study.settings.rig}" is not identified yet.')
    left_out = tuple(f"Left out: {why}" for why in study.usable_effects())
    model = _of_law(model or study.model(), law)
    cutoff = study.settings.cut_off if cutoff is None else cutoff
    found = identifier(study, model, cutoff, starts, table, show or (lambda done: None), begin)
    found = replace(found, notes=(*found.notes, *left_out))
    if not write:
        return found
    step = study.add_step(
        f"identify {found.model.law}" + "".join(f" + {e}" for e in found.model.effects),
        _why(study, found), found.model, found.before, found.after,
    )  # fmt: skip
    return replace(found, step=step)


def identify_bench(
    study: Study, model: StudyModel, cutoff: float, starts: int, table: bool, show: Show,
    begin: Mapping[str, float] | None = None,
) -> Identified:  # fmt: skip
    """Identify a damper on a test bench: motion prescribed, force measured."""
    runs = study.runs()
    return _identify(runs, model, cutoff, starts, table, show, begin)


def identify_building(
    study: Study, model: StudyModel, cutoff: float, starts: int, table: bool, show: Show,
    begin: Mapping[str, float] | None = None,
) -> Identified:  # fmt: skip
    """Identify a damper in a building, and what the building's sites carry beside it."""
    from .structure import Sites, building_of, errors_of_sites

    runs = study.runs()
    notes = [*runs.notes, *_doubts([run for run in runs.all if run.has("force")])]
    model = _with_choices(model, begin or {})
    sites = Sites(runs, building_of(study, model))
    show(1)
    start = as_model(model)
    found = sites.fitted(start, starts, begin)
    show(2)
    fit = found.one(start)
    after_model = _with_fit(model, fit)
    held = sites.lines(as_model(after_model))
    # An effect that was never fitted is being added: before, there was none.
    fitted = {
        name: values for name, values in model.effects.items()
        if any(value.origin == "identified" for value in values.values())
    }  # fmt: skip
    before = sites.errors(as_model(replace(model, effects=fitted)), cutoff)
    after = errors_of_sites(held, cutoff)
    show(3)
    rows: list[LawError] = []
    site = "damper" if "damper" in held else next(iter(held))
    drawn, (train, holdout) = held[site]
    if table and site == "damper" and not LAWS[model.base_law].has("sign"):
        rows = error_table(train, holdout, cutoff, starts=min(starts, _TABLE_STARTS))
    show(4)
    notes += [*found.notes(), _by_site(held), *_weighing(rows, model, after)]
    if train.reconstructed:
        notes.append("The damper's force was not measured: it is what equilibrium asks for.")
    return Identified(
        fit, after_model, rows, cutoff, before, after, tuple(notes), None, train, holdout, drawn
    )


def _by_site(held: Mapping[str, tuple[Model, tuple[StructureProblem, StructureProblem]]]) -> str:
    z = {site: robust_z(pair[1], own) for site, (own, pair) in held.items()}
    told = ", ".join(f"{site} {z[site]:.3g}" for site in sorted(z, key=lambda site: -z[site]))
    return f"z on held-out runs by site: {told}; the errors' z is the worst site's."


def _with_choices(model: StudyModel, begin: Mapping[str, float]) -> StudyModel:
    """Return the model with the choices of a form, such as a storey's number, that were found."""
    chosen = {n: v for n, v in begin.items() if n.endswith(".which") and n in model.flat()}
    return model.with_values(chosen, origin="assumed") if chosen else model


IDENTIFIERS: dict[
    str,
    Callable[[Study, StudyModel, float, int, bool, Show, Mapping[str, float] | None], Identified],
] = {"bench": identify_bench, "structure": identify_building}
"""What identifies a study, by its rig."""


def identify_frames(
    frames: Mapping[str, pd.DataFrame] | list[pd.DataFrame],
    law: str = DEFAULT,
    *,
    effects: tuple[str, ...] = (),
    holdout: Mapping[str, pd.DataFrame] | list[pd.DataFrame] | None = None,
    cutoff: float = 18.0,
    starts: int = 4,
    table: bool = False,
) -> Identified:
    """Identify a damper from pandas frames.

    Parameters
    ----------
    frames : one frame per run, with columns named by channel: `time`, `displacement`, `velocity`,
        `voltage` or `current`, `force`, in SI, or in the unit that a title gives: `force [kN]`
    holdout : runs to judge on; None splits a single run in time, and else judges on the training
        runs alone

    Raises
    ------
    RecordError, StudyError
        As `identify_study`.
    """
    train = measurements_of_frames(frames, "frame")
    held = measurements_of_frames(holdout, "held out") if holdout else []
    if not train:
        raise StudyError("no frame is given; one run or more is right.")
    model = _of_law(new_model(law, effects) if law in law_names() else new_model(), law)
    notes = () if held else ("No run is held out: errors are those of the fit itself.",)
    runs = Runs(train, held, notes)
    return _identify(runs, model, cutoff, starts, table, lambda done: None)


def measurements_of_frames(
    frames: Mapping[str, pd.DataFrame] | list[pd.DataFrame], stem: str
) -> list[Measurement]:
    """Return the measurements in frames whose columns are named by channel."""
    from ..data.channels import ChannelSpec, channel_unit, is_channel
    from ..data.measurement import measurements_of_frame

    named = (
        dict(frames)
        if isinstance(frames, Mapping)
        else {f"{stem} {number}": frame for number, frame in enumerate(frames, 1)}
    )
    found = []
    for name, frame in named.items():
        plain = [str(column) for column in frame.columns]
        channels: dict[str, ChannelSpec] = {}
        for title in plain:
            channel = title.split("[")[0].strip()
            if is_channel(channel):
                given = "[" in title or channel in frame.attrs.get("units", {})
                channels[channel] = ChannelSpec(title, "" if given else channel_unit(channel))
        found += measurements_of_frame(frame, name, channels or None)
    return found


def _of_law(model: StudyModel, law: str | None) -> StudyModel:
    """Return the model with another law, its effects kept where they can join."""
    if law is None or law == model.law:
        return model
    if law not in law_names():
        raise StudyError(f'law "{law}"; there are: {", ".join(law_names())}.')
    from ..physics.effect import EFFECTS

    other = new_model(law, (), model.building)
    base, _ = base_and_variant(law)
    unfit = [
        name
        for name in model.effects
        if EFFECTS[name].site == base.site and not EFFECTS[name].joins(base)
    ]
    if unfit:
        raise StudyError(f'{", ".join(unfit)} cannot join the law "{law}": undo the step first.')
    return replace(other, effects=dict(model.effects))


def _identify(
    runs: Runs, model: StudyModel, cutoff: float, starts: int, table: bool, show: Show,
    begin: Mapping[str, float] | None = None,
) -> Identified:  # fmt: skip
    train = Problem([prepare(one, seed=31 * k) for k, one in enumerate(runs.train)])
    held = [prepare(one, seed=31 * k + 7) for k, one in enumerate(runs.holdout)]
    holdout = Problem(held) if held else None
    notes = [*runs.notes, *_doubts(runs.all)]
    show(1)
    start = as_model(model)
    fit = identify(
        train, start.law, start.effects, starts, values=start.values, held=start.held,
        limits=start.limits,
    )  # fmt: skip
    if begin is not None:
        other = fit_model(train, replace(fit.model, values={**fit.model.values, **begin}))
        fit = other if other.cost < fit.cost else fit
    show(2)
    found = _with_fit(model, fit)
    before = errors_of(train, holdout, start, cutoff)
    after = errors_of(train, holdout, fit.model, cutoff)
    show(3)
    rows: list[LawError] = []
    if table and sum(len(run.force) for run in train.runs) <= _LONGEST_TABLE:
        rows = error_table(train, holdout, cutoff, starts=min(starts, _TABLE_STARTS))
    show(4)
    notes += _weighing(rows, model, after)
    if not any(one.has(c) for one in runs.all for c in DRIVE):
        notes.append("Neither voltage nor current was measured: the parameters hold at its level.")
    return Identified(fit, found, rows, cutoff, before, after, tuple(notes), None, train, holdout)


def _weighing(rows: list[LawError], model: StudyModel, after: Mapping[str, float]) -> list[str]:
    """Say what a model that errs by more than noise does to intervals and to the fit."""
    if after["z_train"] <= _MISFIT:
        return []
    notes = [
        "The error is more than noise: intervals are drawn from the error itself, and hold for "
        "this model's best values, not for a damper's constants."
    ]
    same = [row for row in rows if row.law == model.law and not model.effects]
    if same and same[0].train < 0.95 * after["rms_train"]:
        notes.append(
            f"The fit weighs each sample by its noise and counts outliers less. Least squares of "
            f"the force alone, as in the table, would leave {same[0].train:.4g} N in place of "
            f"{after['rms_train']:.4g} N."
        )
    return notes


def as_model(model: StudyModel) -> Model:
    """Return a study's model as the fit takes it: values, held parameters and bounds in SI."""
    held, limits = [], {}
    for name, value in model.flat().items():
        unit = model.declared(name).unit
        if not value.free:
            held.append(name)
        limits[name] = (convert(value.low, value.unit, unit), convert(value.high, value.unit, unit))
    return Model(model.base_law, tuple(model.effects), model.values(), tuple(held), limits)


def errors_of(
    train: Problem, holdout: Problem | None, model: Model, cutoff: float
) -> dict[str, float]:
    """Return z and RMS error [N, after the low-pass] on training and held-out runs."""
    out = {"z_train": robust_z(train, model), "rms_train": error_rms(train, model, cutoff)}
    out["share_train"] = out["rms_train"] / force_rms(train.runs, cutoff)
    if holdout is not None:
        out["z_holdout"] = robust_z(holdout, model)
        out["rms_holdout"] = error_rms(holdout, model, cutoff)
        out["share_holdout"] = out["rms_holdout"] / force_rms(holdout.runs, cutoff)
    return out


def _with_fit(model: StudyModel, fit: Fit) -> StudyModel:
    """Return the study's model with the values found; what the data cannot tell has no interval."""
    flat = model.flat()
    told = [name for name in fit.std if name not in fit.unidentified]
    found = model.with_values(
        {name: _inside(model, name, fit.model.values[name]) for name in told},
        {name: fit.std[name] for name in told},
    )
    silent = [name for name in fit.unidentified if flat[name].free]
    return found.with_values(
        {name: _inside(model, name, fit.model.value(name)) for name in silent}, origin="assumed"
    )


def _inside(model: StudyModel, name: str, value: float) -> float:
    """Return a value that rounding has not put outside of its bounds."""
    own, unit = model.flat()[name], model.declared(name).unit
    low, high = (convert(bound, own.unit, unit) for bound in (own.low, own.high))
    return float(np.clip(value, low, high))


def _doubts(runs: list[Measurement]) -> list[str]:
    """Refuse a saturated force; say what weakens an identification."""
    notes = []
    for run in runs:
        share = saturated(run)
        if share > _SATURATED:
            raise StudyError(
                f"{run.name}: {share:.0%} of the force's samples stand at its extremes: the load "
                "cell or its amplifier is saturated. Measure with a wider range, or leave the run "
                "out in study.toml."
            )
        if share > 0.0:
            notes.append(f"{run.name}: {share:.1%} of the force's samples stand at its extremes.")
    doubtful: dict[str, int] = {}
    for run in runs:
        for channel, fact in run.noise_facts.items():
            if fact is not None and fact.colour in ("hidden", "rough", "blue"):
                doubtful[channel] = doubtful.get(channel, 0) + 1
    if doubtful:
        where = ", ".join(f"{c} ({n} of {len(runs)} runs)" for c, n in doubtful.items())
        notes.append(
            f"The noise cannot be told well from the signal: {where}. Give it in study.toml: z and "
            "intervals rest on it."
        )
    return notes


def _why(study: Study, found: Identified) -> str:
    runs, held = len(found.train.runs), len(found.holdout.runs) if found.holdout else 0
    lost = ", ".join(found.unidentified)
    return (
        f"fit to {runs} training run{'s' * (runs != 1)}, judged on {held} held out; "
        f"{found.fit.agreed} of {found.fit.starts} starts agree"
        + (f"; the data cannot tell {lost}" if lost else "")
    )
