"""Parameters that depend on a label of the runs: a preload on the pressure, friction on the oil.

A label does not move within a run, so runs count, not samples. What each run asks of a parameter by
itself, all others shared, is held against its label; where that is beyond chance, and worth a
trial, the dependence becomes an effect that changes the parameter, and is tried as any other is.
Labels of the motion and of the command, such as an amplitude, are left out: they are the law's
inputs.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from contextvars import ContextVar
from dataclasses import dataclass, replace
from functools import wraps
from math import inf
from types import SimpleNamespace
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np
from scipy.special import fdtrc, stdtrit

from ..comparison.names import effect_name
from ..core.arrays import Array
from ..core.text import in_docstring, joined, literal, with_interval
from ..data.channels import TEMPERATURE, label_name, label_text, label_unit
from ..data.extra_channels import as_word
from ..data.measurement import Measurement
from ..data.run_labels import LabelOfRuns, labels_of, left_by
from ..identification.fit import Search, refine
from ..identification.problem import Problem, Run
from ..identification.search import HUBER, in_threads
from ..model.model import Model, parameter
from ..physics.effect import EFFECTS
from ..physics.law import WHOLE
from ..physics.parameter import Parameter
from ..units import canonical
from ..user_code.load import define, defined, undefine
from .decision import TOLD
from .prepared import Prepared
from .site_diagnosis import SiteDiagnosis
from .verdict import Diagnosis, gains_of

PLAUSIBLE, LIKELY = 0.05, 0.005
"""Largest probability that chance parts the runs so: for a fit, and beside that fit, there over all
labels and parameters looked at. A model that misses much says little of each run."""

WORTH = 0.04
"""Smallest share of the training runs' loss that is worth a trial: z falls by half of it."""

CLEARER = 0.97
"""Share of the loss that one parameter leaves, which a factor of the whole force leaves at most."""

BENT = 0.01
"""Largest probability that a straight line over the label explains the runs, for steps to do."""

WARM = 2.0
"""Kelvin by which runs differ at least for their temperature to be tried without proof."""

SWEEPS = 4
"""Jacobians of that fit."""

FEWEST, MOST_LEVELS, MOST = 4, 6, 4
"""Runs that tell of a label, levels that have a step each, and dependences that are tried."""

EXTRAPOLATED, NOT_SEPARABLE = "Extrapolation:", "Not separable:"
"""How sentences begin that are never left to the details."""

MOTION = "the "
"""How what belongs to the motion or the command begins, unlike the name of a label."""

REFITS = 10
"""Fits without one of the runs, or without a group of them, that give an interval."""

FACTOR = Parameter(1.0, "1", (0.0, inf), "law's force, all that it is linear in by one factor,")
"""The whole force, as a parameter that depends on a label."""

ZERO_C = 273.15  # K
NORMAL = 1.96
"""Standard deviations of an interval of 95 % as `with_interval` writes it."""


@dataclass(frozen=True)
class Dependence:
    """How a parameter depends on a label: the effect's `name`, its file's `text`, what it gains."""

    name: str
    text: str
    label: str
    gain: float


# What runs ask of a parameter, each by itself.


class RunwiseFit:
    """What each run asks of each free parameter, all others shared by the runs, linearly.

    The last of them is a factor of the law's whole force, where that is more than one parameter.

    Parameters
    ----------
    problem : all runs
    model : as fitted to those for training
    """

    def __init__(self, problem: Problem, model: Model) -> None:
        search = Search(problem, model, problem.expectation(model), model.free(), logarithms=False)
        r = search.residuals(search.start)
        J = search.jacobian(search.start, r)
        self.names, self.scale = [*search.names], search.scale
        linear = [k for k, n in enumerate(self.names) if n in model.law_class.linear()]
        if len(linear) > 1:
            J = np.column_stack([J, J[:, linear] @ search.start[linear]])
            self.names, self.scale = [*self.names, WHOLE], np.append(self.scale, 1.0)
        far = HUBER * max(1.0, float(np.median(np.abs(r))) / 0.6745)
        root = np.sqrt(np.minimum(1.0, far / np.maximum(np.abs(r), 1e-12)))
        J, r = J * root[:, None], r * root
        parts = list(zip(problem.by_run(J), problem.by_run(r), strict=True))
        self._normal = np.array([own.T @ own for own, _ in parts])  # (k, p, p)
        self._right = np.array([-own.T @ left for own, left in parts])  # (k, p)
        self._loss = float(r @ r)

    def apart(self, j: int) -> tuple[Array, Array]:
        """Return what each run (k,) asks of parameter j, in its unit, and which runs tell it."""
        others = [i for i in range(len(self.names)) if i != j]
        own, k = self._normal[:, j, j], len(self._normal)
        told = own > 1e-3 * own.max() if own.max() > 0.0 else np.zeros(k, dtype=bool)
        A = np.zeros((len(others) + k, len(others) + k))
        A[: len(others), : len(others)] = self._normal[:, others][:, :, others].sum(0)
        A[: len(others), len(others) :] = self._normal[:, others, j].T
        A[len(others) :, : len(others)] = self._normal[:, others, j]
        A[len(others) :, len(others) :] = np.diag(np.where(told, own, 1.0))
        b = np.concatenate([self._right[:, others].sum(0), self._right[:, j]])
        return self.scale[j] * _solved(A, b)[len(others) :], told

    def gain(self, j: int, columns: Array) -> tuple[float, Array]:
        """Return the share of the loss that a dependence takes, and its sizes (c,), linearly.

        Parameters
        ----------
        j : the parameter
        columns : (k, c) by how much it changes in each run with each of its sizes at 1
        """
        p, c = len(self.names), columns.shape[1]
        A, b = np.zeros((p + c, p + c)), np.zeros(p + c)
        A[:p, :p], b[:p] = self._normal.sum(0), self._right.sum(0)
        A[:p, p:] = np.einsum("kp,kc->pc", self._normal[:, :, j], columns)
        A[p:, :p] = A[:p, p:].T
        A[p:, p:] = np.einsum("k,kc,kd->cd", self._normal[:, j, j], columns, columns)
        b[p:] = self._right[:, j] @ columns
        without, all_of = _solved(A[:p, :p], b[:p]), _solved(A, b)
        share = float(b @ all_of - b[:p] @ without) / max(self._loss, 1e-300)
        if self.names[j] == WHOLE:  # one parameter, where it does as well, says more
            share = 1.0 - (1.0 - share) / CLEARER
        return share, self.scale[j] * all_of[p:]


def _solved(A: Array, b: Array) -> Array:
    """Return the solution of normal equations, the least where they leave it open."""
    size = np.sqrt(np.maximum(np.diag(A), 1e-300))
    return np.asarray(np.linalg.lstsq(A / np.outer(size, size), b / size, rcond=1e-10)[0] / size)


def chance_of(asked: Array, design: Array, simpler: Array | None = None) -> float:
    """Return the probability that chance parts what runs ask (k,) so well by a label: an F test.

    Parameters
    ----------
    asked : (k,) what each run asks of the parameter
    design : (k, c) the label's columns
    simpler : (k, s) those that it is held against beside a constant; None for the constant alone
    """
    one = np.ones((len(asked), 1))
    least = one if simpler is None else np.hstack([one, simpler])
    whole = np.hstack([one, design])
    rest, left, rank = (left_by(asked, X) for X in (least, whole)), 0.0, 0
    (before, rank_before), (left, rank) = rest
    free, more = len(asked) - rank, rank - rank_before
    if free < 2 or more < 1:
        return 1.0
    # Rounding is no proof: of runs that follow a line exactly the rest is zero.
    left = max(left, 1e-12 * float(asked @ asked), 1e-300)
    return float(fdtrc(more, free, max(before - left, 0.0) / more / (left / free)))


# What goes together with a label.


def _motions(runs: Sequence[Run]) -> dict[str, Array]:
    """Return what of the motion and the command may differ from run to run (k,), in words."""
    return {
        f"{MOTION}speed": np.array([float(np.sqrt(np.mean(run.v**2))) for run in runs]),
        f"{MOTION}stroke": np.array([float(np.ptp(run.x)) for run in runs]),
        f"{MOTION}{runs[0].drive}": np.array([float(np.mean(run.V)) for run in runs]),
    }


def together(label: LabelOfRuns, runs: Sequence[Run]) -> list[str]:
    """Return what these runs cannot separate from a label: other labels, the motion, in words."""
    others = [one for one in labels_of([run.labels for run in runs]) if one.name != label.name]
    found = [one.name for one in others if label.goes_with(one.numbers())]
    moved = [what for what, own in _motions(runs).items() if label.goes_with(own)]
    return [*found, *moved]


# The effects that are tried.


def dependences(prepared: Prepared, *, with_motion: bool = False) -> list[Dependence]:
    """Return the dependences on labels that are worth a trial, the most promising first.

    Parameters
    ----------
    prepared : the runs, and the model as fitted without
    with_motion : whether those on labels that go together with the motion are asked for, which are
        none to try, in place of all others
    """
    train, model = prepared.searched, prepared.before.model
    runs = [*train.runs, *prepared.held_out.runs]
    labels = [
        one
        for one in labels_of([run.labels for run in runs])
        if len({run.labels[one.name] for run in train.runs}) > 1
    ]
    if not labels or len(runs) < FEWEST:
        return []
    if any(run.force_draws is not None for run in runs):
        return []  # a force by equilibrium has the rest of a building in it
    fits = RunwiseFit(train.of(runs), model)
    looked = LIKELY / (len(labels) * max(1, len(fits.names)))
    found: list[Dependence] = []
    for label in labels:
        if any(what.startswith(MOTION) for what in together(label, runs)) is not with_motion:
            continue
        own = [
            one
            for j in range(len(fits.names))
            if (one := _dependence(fits, j, label, train, model, BENT * looked / LIKELY))
        ]
        own.sort(key=lambda one: -one.gain)
        own = [one for one in own if one is own[0] or one.name != _called(WHOLE, label)]
        own = [one for one in own[:2] if one.gain >= 0.5 * own[0].gain]
        found += [one for one in own if _beside(one, label, train, runs, model) <= looked]
    return sorted(found, key=lambda one: -one.gain)[:MOST]


def _called(parameter: str, label: LabelOfRuns) -> str:
    """Return the name of the effect that changes a parameter by a label."""
    return f"{parameter.replace('.', '_')}_by_{as_word(label.name)}"


def _dependence(
    fits: RunwiseFit, j: int, label: LabelOfRuns, train: Problem, model: Model, bent: float
) -> Dependence | None:
    """Return how a parameter depends on a label; None where it does not, or hardly."""
    name = fits.names[j]
    effect = _called(name, label)
    asked, told = fits.apart(j)
    if told.sum() < FEWEST or not effect.isidentifier() or effect in EFFECTS:
        return None
    steps, numbers = label.steps(), label.numbers()
    at_train = numbers[: len(train.runs)]
    middle = float(at_train.mean()) if label.is_number else numbers[0]
    line = (numbers - middle)[:, None]
    of_line = chance_of(asked[told], line[told]) if label.is_number else 1.0
    stepped = not label.is_number or (
        2 < len(label.levels) <= MOST_LEVELS
        and chance_of(asked[told], steps[told], line[told]) < bent
    )
    if stepped and len({*at_train}) < len(label.levels):
        stepped = False  # a level that training has not seen has no step
    if not stepped and (not label.is_number or of_line > PLAUSIBLE):
        return None
    if stepped and chance_of(asked[told], steps[told]) > PLAUSIBLE:
        return None
    columns = steps if stepped else line
    gain, sizes = fits.gain(j, columns)
    if gain < WORTH or not np.any(sizes):
        return None
    text = _text(effect, name, label, model, sizes, None if stepped else (middle, numbers))
    return Dependence(effect, text, label.name, gain)


def _beside(
    one: Dependence, label: LabelOfRuns, train: Problem, runs: list[Run], model: Model
) -> float:
    """Return the probability that chance parts runs by a dependence, told beside a fit with it."""
    with defined({one.name: one.text}):
        effect = cast(Any, EFFECTS[one.name])
        whole = refine(model.with_effect(one.name), train, SWEEPS)
        fits = RunwiseFit(train.of(runs), whole)
        asked, told = fits.apart(fits.names.index(effect.changes))
        p = {own: whole.value(f"{one.name}.{own}") for own in effect.parameters}
        value = _now(whole, effect.changes)
        (word,), codes = effect.labels, label.numbers()
        moved = [
            effect.changed(SimpleNamespace(value=value), None, effect.values_of({**p, word: code}))
            for code in codes
        ]
    asked = asked + np.array(moved) - value
    design = label.steps() if effect.tables else (codes - codes.mean())[:, None]
    return chance_of(asked[told], design[told])


def promising(problem: Problem, model: Model) -> list[Dependence]:
    """Return of each label the dependence that fits runs best, the most promising first.

    Nothing is proven by that, of few runs least. One that is defined for another model is the same.

    Parameters
    ----------
    problem : the training runs, which alone are looked at
    model : fitted to them
    """
    runs, out = problem.runs, list[Dependence]()
    for label in labels_of([run.labels for run in runs]):
        numbers = label.numbers()
        still = label.name == TEMPERATURE and float(np.ptp(numbers)) < WARM
        with_motion = any(what.startswith(MOTION) for what in together(label, runs))
        if still or with_motion or not label.is_number:
            continue
        fits, middle = RunwiseFit(problem, model), float(numbers.mean())
        gains = [
            (*fits.gain(j, (numbers - middle)[:, None]), j)
            for j, name in enumerate(fits.names)
            if not _labels(name.rpartition(".")[0])
        ]
        gain, size, j = max(gains, key=lambda one: one[0])
        name = fits.names[j]
        effect = _called(name, label)
        same = effect not in model.effects and effect in EFFECTS and EFFECTS[effect].changes == name
        if gain < WORTH or not size.any() or not effect.isidentifier():
            continue
        if same or effect not in EFFECTS:
            text = _text(effect, name, label, model, size, (middle, numbers))
            out.append(Dependence(effect, text, label.name, gain))
    return sorted(out, key=lambda one: -one.gain)


_made: ContextVar[dict[str, str] | None] = ContextVar("made", default=None)

_Diagnose = TypeVar("_Diagnose", bound=Callable[..., Diagnosis])


def with_labels(diagnose: _Diagnose) -> _Diagnose:
    """Return a diagnosis that tries labels: the effects that its verdict names stay defined."""

    @wraps(diagnose)
    def diagnosed(*given: Any, **named: Any) -> Diagnosis:
        made: dict[str, str] = {}
        before = _made.set(made)
        kept: set[str] = set()
        try:
            found = diagnose(*given, **named)
            gains = gains_of(found.worst) if found.worst else []
            rows = [{"effects": found.effects}, found.refined, *gains]
            kept = {name for row in rows for name in row.get("effects", ())}
            return replace(found, written={n: text for n, text in made.items() if n in kept})
        finally:
            _made.reset(before)
            for name in made:
                if name not in kept:
                    undefine(name)

    return cast(_Diagnose, diagnosed)


def try_labels(prepared: Prepared) -> None:
    """Define the effects of labels that are worth a trial; nothing where nobody lets it."""
    made = _made.get()
    if made is None:
        return
    for one in dependences(prepared):
        define(one.name, one.text)
        made[one.name] = one.text


# The file of such an effect.


def _text(
    effect: str, name: str, label: LabelOfRuns, model: Model, sizes: Array,
    line: tuple[float, Array] | None,
) -> str:  # fmt: skip
    """Return the text of an effect's file.

    Parameters
    ----------
    effect, name : of the effect, and of the parameter that it changes
    label : what it depends on
    model : the model as fitted without
    sizes : (c,) to begin with: a slope, or a step for each level but the first
    line : the label's value where the parameter keeps its own, and its values (k,); None for steps
    """
    declared = FACTOR if name == WHOLE else parameter(model.law, name)
    unit, word = declared.unit, word_of(label.name)
    owner = name.rpartition(".")[0]
    of = f" of {effect_name(owner)}" if owner else ""
    about = declared.text if name == WHOLE else f"{declared.text}{of} ({name})"
    what = f"The {about}"
    least = f"{declared.bounds[0]!r}" if declared.bounds[0] >= 0.0 else ""
    told = label_unit(label.name)
    per = {"degC": "K"}.get(told, told) or f"unit of {label_name(label.name)}"
    family = f"by_{as_word(label.name)}"
    if line is None:
        parts = _steps_text(label, word, unit, sizes, what)
    elif label.name == TEMPERATURE and least and (now := _now(model, name)) > 0.0:
        parts = _arrhenius_text(word, float(sizes[0]) / now, line, what)
    else:
        parts = _line_text(word, unit, float(sizes[0]), line, what, (label.name, told, per))
    formula, value, words = parts.formula, parts.value, parts.words
    if name == WHOLE and "exp(" not in value:
        change = value.removeprefix("q.value + ")
        value = f"q.value * max(1.0 + {change}, 0.0)"
        formula = f"value (1 + {formula.removeprefix('value + ')}), never below zero"
        words = [
            re.sub(r"\{(abs\(p\.slope\)|p\.step\[\d+\]):(\+?)\.3g\}", r"{100.0 * \1:\2.3g} %", one)
            for one in words
        ]
    elif least and name != WHOLE:
        value = f"max({value}, min(q.value, {least}))"
        formula = f"{formula}, never below {least}"
    lines = [
        f'"""The {in_docstring(about)}, by the label {label.name} of the runs."""',
        "", *parts.imports, "",
        *parts.constants,
        "",
        f"class {''.join(one.capitalize() for one in effect.split('_'))}(Effect):",
        f'    """The {in_docstring(about)} depends on {label_name(label.name)}.',
        "",
        f"        {formula}",
        "",
        "    Told from runs that differ in the label, not derived. Leaves out what else those runs",
        "    differed in: doubt it at a value that none of them had.",
        '    """',
        "",
        f'    name = "{effect}"',
        '    sites = ("damper",)',
        '    needs = ("value",)',
        f'    changes = "{name}"',
        f'    family = "{family}"',
        "    passive = True",
        "    zero_at_rest = False",
        '    source = "Learned from runs: what each of them asks of the parameter, by its label"',
        f"    expect = {literal(f'an error that goes with {label.name} from run to run')}",
        "    start_shares = ({},)  # the defaults are those of this rig: no search scales them",
        *parts.fields,
        f"    labels = {{{literal(word)}: {literal(label.name)}}}",
        "    parameters = {", *parts.parameters, "    }", *parts.tables,
        "",
        "    @staticmethod",
        "    def changed(q, z, p):",
        f"        return {value}",
        "",
        "    @staticmethod",
        "    def in_words(p):",
        *words,
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def _now(model: Model, name: str) -> float:
    """Return the value of a parameter, or the factor of the whole force."""
    return 1.0 if name == WHOLE else model.value(name)


_IMPORT = "from bristle.physics.effect import Effect, Parameter"


class _Parts(NamedTuple):
    """What the file of a dependence has of its form: lines, but for formula and value."""

    formula: str
    value: str
    fields: list[str]
    parameters: list[str]
    words: list[str]
    imports: Sequence[str] = (_IMPORT,)
    constants: Sequence[str] = ()
    tables: Sequence[str] = ()


def _line_text(
    word: str, unit: str, slope: float, line: tuple[float, Array], what: str,
    told: tuple[str, str, str],
) -> _Parts:  # fmt: skip
    """Return the parts of the file of a straight line; `told`: the label's name, unit, and per."""
    middle, values = line
    name, label_si, per = told
    warm = label_si == "degC"
    own, of = ("degC", canonical(f"{unit}/K")) if warm else ("1", unit)
    shown = f" {per}" if label_si and not warm else " °C" if warm else ""
    of_what = f" of {label_name(name)}" if label_si else ""
    size = f"{{abs(p.slope):.3g}} {unit}" if unit != "1" else "{abs(p.slope):.3g}"
    return _Parts(
        f"value + slope ({word} - middle)",
        f"q.value + p.slope * (p.{word} - p.middle)",
        ['    amount = "slope"', f'    assumed = ({literal(word)}, "middle")',
         f'    label_means = {{"middle": {literal(name)}}}'],
        [
            f'        "slope": {_declared(slope, of, f"change with each {per}")},',
            *_label_parameters(word, own, values, middle),
        ],
        [
            '        way = "rises" if p.slope >= 0.0 else "falls"',
            f'        return f"{_braced(what)} {{way}} by {size} per {per}{_braced(of_what)}; "\\',
            f'            f"the model\'s value of it is that at {{p.middle:.4g}}{shown}."',
        ],
    )  # fmt: skip


def _arrhenius_text(word: str, share: float, line: tuple[float, Array], what: str) -> _Parts:
    """Return the parts of the file of a parameter that follows a temperature by Arrhenius' law."""
    middle, values = line
    size = -share * (middle + ZERO_C) ** 2
    return _Parts(
        f"value exp(B (1/{word} - 1/middle)), temperatures in K",
        f"q.value * exp(min(max(p.B * (1.0 / (p.{word} + {ZERO_C}) "
        f"- 1.0 / (p.middle + {ZERO_C})), -3.0), 3.0))",
        ['    amount = "B"', f'    assumed = ({literal(word)}, "middle")',
         f'    label_means = {{"middle": "{TEMPERATURE}"}}'],
        [
            f'        "B": {_declared(size, "K", "activation energy over the gas constant")},',
            *_label_parameters(word, "degC", values, middle, (-200.0, 1000.0)),
        ],
        [
            f"        share = 100.0 * p.B / (p.middle + {ZERO_C}) ** 2",
            '        way = "falls" if p.B >= 0.0 else "rises"',
            f'        return f"{_braced(what)} {{way}} by {{abs(share):.2g}} % per kelvin, "\\',
            '            "by the law of Arrhenius; the model\'s value of it is that at "\\',
            '            f"{p.middle:.4g} °C."',
        ],
        ("from math import exp", "", _IMPORT),
    )  # fmt: skip


def _steps_text(label: LabelOfRuns, word: str, unit: str, sizes: Array, what: str) -> _Parts:
    """Return the parts of the file of a parameter that has a value at each level of a label."""
    levels = [float(k) for k in range(1, len(label.levels) + 1)]
    if label.is_number:
        levels = [float(one) for one in label.levels]
    most = 100.0 * float(np.max(np.abs(sizes)))
    values = ", ".join(f"{float(one):.6g}" for one in (0.0, *sizes))
    texts = [f"{label_name(label.name)} {label_text(label.name, one)}" for one in label.levels]
    shown = [
        f"{{p.step[{k}]:+.3g}}{'' if unit == '1' else ' ' + unit} at {_braced(text)}"
        for k, text in enumerate(texts) if k
    ]  # fmt: skip
    words = tuple(str(one) for one in label.levels)
    named = [] if label.is_number else [
        f"    label_words = {{{literal(label.name)}: {json.dumps(words, ensure_ascii=False)}}}"
        .replace("[", "(").replace("]", ")")
    ]  # fmt: skip
    pairs = [f"{level:g} {text}" for level, text in zip(levels, texts, strict=True)]
    told = "" if label.is_number else f": {', '.join(pairs)}"
    return _Parts(
        f"value + step({word})",
        f"q.value + interpolate(p.{word}, LEVELS, p.step)",
        [f'    assumed = ({literal(word)}, "step[1]")', *named],
        [
            f'        "{word}": Parameter({levels[1]!r}, "1", {_span(np.array(levels))}, '
            f"{literal(f'of the run{told}')}),",
        ],
        [f'        return f"{_braced(what)} differs from that at {_braced(texts[0])} by '
         f'{joined(shown)}."'],
        (f"{_IMPORT}, Table, interpolate",),
        (f"LEVELS = ({', '.join(repr(one) for one in levels)})",
         f'"""Of the label: {in_docstring(", ".join(texts))}."""', ""),
        (
            "    tables = {",
            f'        "step": Table(LEVELS, ({values}), "{unit}", ({-most:.6g}, {most:.6g}),',
            f"            {literal(f'change with {label_name(label.name)} from {texts[0]}')}),",
            "    }",
        ),
    )  # fmt: skip


def _label_parameters(
    word: str, unit: str, values: Array, middle: float, bounds: tuple[float, float] | None = None
) -> list[str]:
    """Return the lines of the label as a parameter, and of where the law's value holds."""
    span = _span(values) if bounds is None else f"({bounds[0]!r}, {bounds[1]!r})"
    far, held = float(values[np.argmax(np.abs(values - middle))]), "where the value is as given"
    return [
        f'        "{word}": Parameter({far!r}, "{unit}", {span}, "of the run"),',
        f'        "middle": Parameter({middle!r}, "{unit}", {span}, "{held}"),',
    ]


def _span(values: Array) -> str:
    """Return bounds of a label far beyond what was seen: they only keep it a number."""
    far = 100.0 * max(float(np.max(np.abs(values))), 1.0)
    return f"({-far!r}, {far!r})"


def _declared(value: float, unit: str, text: str) -> str:
    most = 100.0 * abs(value)
    return f'Parameter({value:.6g}, "{unit}", ({-most:.6g}, {most:.6g}), {literal(text)})'


def word_of(label: str) -> str:
    """Return what the parameter of a label is called."""
    word = as_word(label)
    taken = word in ("slope", "middle", "step", "on", "b", "") or word.endswith("_0")
    return "label" if taken or not re.fullmatch(r"[a-z][a-z0-9_]*", word) else word


def _braced(text: str) -> str:
    """Return a text as it stands in a formatted one."""
    return json.dumps(text, ensure_ascii=False)[1:-1].replace("{", "{{").replace("}", "}}")


# What a finding with a label says besides: how sure, where it is extrapolation, what it goes with.


def confirmed(found: SiteDiagnosis, prepared: Prepared) -> SiteDiagnosis:
    """Return a finding that says how sure a dependence on a label is, unknown where it is not.

    Parameters
    ----------
    found : what the trials lead to
    prepared : the runs, and the model that it began with
    """
    if found.after is None:
        return found
    train, held_out = prepared.problem.runs, prepared.held_out.runs
    if found.kind == "none":
        beyond = extrapolated(found.after.model, train, held_out)
        return replace(found, reasons=(*found.reasons, *beyond)) if beyond else found
    runs = [*train, *held_out]
    texts: list[str] = []
    for name in (one for one in found.effects if one in EFFECTS and EFFECTS[one].changes):
        trial = next((t for t in (found.after, *found.trials) if name in t.effects), None)
        if trial is None or found.kind not in ("effect", "ambiguous"):
            continue
        model, std = _without_each(name, trial.model, prepared)
        if not any(abs(model.value(own)) > _far(len(runs)) * one for own, one in std.items()):
            return _unsure(found, name, model, std, len(runs))
        texts.append(_told(name, model, std, len(runs)))
        found = replace(found, std={**found.std, **std})
    texts += _all_at_one_level(prepared)
    found, inseparable = _not_separable(found, prepared, runs)
    texts += inseparable
    if found.after is not None:
        texts += extrapolated(found.after.model, train, held_out)
    return replace(found, reasons=(*found.reasons, *texts)) if texts else found


def _without_each(name: str, model: Model, prepared: Prepared) -> tuple[Model, dict[str, float]]:
    """Return a model fitted to all runs, and how its dependence varies with which run is left out.

    Returns
    -------
    the model; by parameter of the dependence its standard deviation by the jackknife, from fits
    without each run or each of `REFITS` groups of them in turn (Efron 1982, The Jackknife, ch. 3)
    """
    runs = [*prepared.problem.runs, *prepared.held_out.runs]
    n = min(REFITS, len(runs))
    sizes = [own for own in model.free() if own.startswith(f"{name}.")]
    whole = refine(model, prepared.problem.of(runs), 4)

    def without(k: int) -> list[float]:
        left = [run for j, run in enumerate(runs) if j % n != k]
        fitted = refine(whole, prepared.problem.of(left), 3)
        return [fitted.value(own) for own in sizes]

    values = np.array(in_threads(without, range(n)))
    std = np.sqrt((n - 1) / n * np.sum((values - values.mean(axis=0)) ** 2, axis=0))
    return whole, dict(zip(sizes, std.tolist(), strict=True))


def _far(runs: int) -> float:
    """Return how many standard deviations an interval of 95 % reaches, from so many runs."""
    return float(stdtrit(min(REFITS, runs) - 1, 0.975))


def _told(name: str, model: Model, std: dict[str, float], runs: int) -> str:
    """Return what a dependence comes to, with its interval over the runs."""
    effect, parts = EFFECTS[name], []
    for key, one in std.items():
        own = key.rpartition(".")[2]
        unit = effect.parameters[own].unit
        text, half = with_interval(model.value(key), one * _far(runs) / NORMAL)
        parts.append(f"{own} {text} {half}{'' if unit == '1' else f' {unit}'}")
    values = {own: model.value(f"{name}.{own}") for own in effect.parameters}
    words = str(effect.in_words(effect.values_of(values))) if hasattr(effect, "in_words") else ""
    each = "each" if runs <= REFITS else "each tenth"
    told = f"By fits without {each} of {runs} runs in turn: {', '.join(parts)} (95 %)."
    return f"{words} {told}".strip()


def _unsure(
    found: SiteDiagnosis, name: str, model: Model, std: dict[str, float], runs: int
) -> SiteDiagnosis:
    """Return a finding without a dependence that goes or turns with which run is left out."""
    before = found.before
    assert before is not None
    why = (
        f"With {effect_name(name)} the error falls, but these runs cannot tell it from chance. "
        f"{_told(name, model, std, runs)} Measure more runs at each value of the label."
    )
    return replace(
        found, kind="unknown", effects=(), reasons=(why,), after=before, model=before.model,
        z_after=before.z, share=0.0,
    )  # fmt: skip


def extrapolated(
    model: Model, train: Sequence[Run | Measurement], held_out: Sequence[Run | Measurement]
) -> list[str]:
    """Return which held-out runs have a label beyond those that the model was fitted to.

    Parameters
    ----------
    model : with the effects that depend on labels
    train, held_out : the runs
    """
    out = []
    names = {label for name in model.effects for label in EFFECTS[name].labels.values()}
    for label in sorted(names):
        seen = [y for run in train if not isinstance(y := run.labels.get(label, ""), str)]
        beyond = [
            run
            for run in held_out
            if seen and not isinstance(y := run.labels.get(label, ""), str)
            and not min(seen) <= y <= max(seen)
        ]  # fmt: skip
        if beyond:
            where = [f"{run.name} ({label_text(label, run.labels[label])})" for run in beyond]
            where = where if len(where) <= TOLD else [*where[:TOLD], f"{len(where) - TOLD} more"]
            ends = dict.fromkeys((min(seen), max(seen)))
            span = " to ".join(label_text(label, one) for one in ends)
            out.append(
                f"{EXTRAPOLATED} the training runs have {label_name(label)} {span}, beyond which "
                f"{'lie' if len(beyond) > 1 else 'lies'} {joined(where)}: nothing was fitted there."
            )
    return out


def _all_at_one_level(prepared: Prepared) -> list[str]:
    """Return that all training runs are at one level of a label that held-out ones differ in."""
    out = []
    for label in labels_of([r.labels for r in (*prepared.problem.runs, *prepared.held_out.runs)]):
        levels = {run.labels[label.name] for run in prepared.problem.runs}
        if len(levels) > 1:
            continue
        own = label_text(label.name, next(iter(levels)))
        apart = next(run for run in prepared.held_out.runs if run.labels[label.name] not in levels)
        out.append(
            f"All training runs are at {label_name(label.name)} {own}, and the held-out "
            f"{apart.name} at {label_text(label.name, apart.labels[label.name])}: nothing that was "
            f"fitted tells what {label_name(label.name)} does. Train on some of both: role = "
            '"train" in their [[runs]] of study.toml.'
        )
    return out


def _not_separable(
    found: SiteDiagnosis, prepared: Prepared, runs: Sequence[Run]
) -> tuple[SiteDiagnosis, list[str]]:
    """Return a finding that names all labels that these runs cannot separate, and says so.

    Two labels that change together are alternatives. One that changes with the motion is not
    named, and told where a parameter goes with it.
    """
    tried = {name: trial for trial in found.trials for name in trial.effects if _labels(name)}
    named = {label for name in found.effects for label in _labels(name)}
    if found.kind in ("unknown", "insufficient"):
        named |= {one.label for one in dependences(prepared, with_motion=True)}
    out: dict[frozenset[str], str] = {}
    for label in labels_of([run.labels for run in runs]):
        others = together(label, runs)
        alike = [n for n in tried if {*_labels(n)} & {*others} and n not in found.effects]
        others = [
            one for one in others
            if one.startswith(MOTION) or any(one in _labels(name) for name in tried)
        ]  # fmt: skip
        if not others or label.name not in named or f"{MOTION}{label.name}" in others:
            continue
        if found.kind in ("effect", "ambiguous") and alike:
            best = min(alike, key=lambda name: tried[name].z)
            found = replace(found, kind="ambiguous", effects=(*found.effects, best))
        numbers = label.numbers()
        low, high = runs[int(np.argmin(numbers))], runs[int(np.argmax(numbers))]
        own, at = label_name(label.name), label_text(label.name, low.labels[label.name])
        like = " and ".join(
            f"{one} of {high.name}" if one.startswith(MOTION)
            else f"{label_name(one)} {label_text(one, high.labels[one])}"
            for one in others
        )  # fmt: skip
        out.setdefault(
            frozenset((label.name, *others)),
            f"{NOT_SEPARABLE} {joined([own, *map(label_name, others)])} change together from run "
            f"to run. A run at {own} {at} with {like} separates them.",
        )
    return found, [*out.values()]


def _labels(name: str) -> tuple[str, ...]:
    """Return the labels that an effect changes a parameter by; none of another effect."""
    effect = EFFECTS.get(name)
    return tuple(effect.labels.values()) if effect is not None and effect.changes else ()
