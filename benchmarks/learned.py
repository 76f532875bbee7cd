"""What is learned where no effect of the library explains the error, and on runs that hide nothing.

    python -m benchmarks learned --outside 24 --further 24 --crossed 8 --none 24
    python -m benchmarks learned --building 14 --clean 6

makes what is missing of these figures, with the generator of the blind benchmark, and prints them;
without a number it prints what is there.

outside    bench cases at 15 and 40 % with an effect that the library does not have: z on held-out
           runs before and after, and the closed form
further    the same for contact on one side, breakaway after reversal, a yield force that follows
           acceleration, a curved command, an accumulator that exchanges heat, cavitation
crossed    the same for what depends on two signals at once: friction that differs with place and
           speed, a yield force with an edge that the command moves
none       bench cases that hide nothing: nothing must be learned
building   buildings that hide something in the isolation layer or a storey: the same figures
clean      buildings that hide nothing: nothing must be learned at any of their lines
"""

from __future__ import annotations

import json
import traceback
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace

import numpy as np

from bristle.diagnosis.prepared import Prepared
from bristle.diagnosis.rig_runs import BenchRuns, BuildingRuns
from bristle.diagnosis.trials import Trial
from bristle.identification.rig import DAMPER
from bristle.learning.closed_forms import close, closed_forms, name_of
from bristle.learning.curve import Curve
from bristle.learning.effect_file import effect_text
from bristle.learning.fit import LearnedCurve, learn
from bristle.model.model import Model
from bristle.user_code.load import defined

from ._answers import Answer, Answers, ask
from ._blind import cases
from ._blind.plan import MORE, make_plan
from ._blind.subject import measurements
from ._houses import LAW, ODDITIES, SHARES, house
from ._rows import Row

SEED = 12
ADEQUATE = 1.5
"""z up to which a learned curve holds what was missing."""

MOST = 3
"""Curves that are learned one after the other, until they hold what was missing."""

RIGHT = {
    "bow": {"displacement": {"parabola", "power"}},
    "taper": {"displacement": {"line"}},
    "detent": {"displacement": {"ripple"}},
    "rings": {"displacement": {"ripple"}},
    "thixotropic": {"rebuilding": {"line"}},
    "ageing": {
        "age": {"line"}, "rebuilding": {"logarithm", "line", "levelling off", "hyperbola"},
    },
    "jamming": {"speed": {"threshold", "levelling off"}},
    "power": {"speed": {"threshold"}},
    "bumper": {"displacement": {"contact above", "contact below"}},
    "fall": {"travel": {"exponential fall"}},
    "sense": {"slowing": {"levelling off", "line"}},
    "steep": {"voltage": {"power"}},
    "parabola": {"voltage": {"line", "parabola"}},
    "relaxing": {"displacement": {"line"}, "recent_displacement": {"line"}},
    **{one.name: one.right for one in ODDITIES if one.right},
}  # fmt: skip
"""Signals and closed forms that name a hidden form.

A fixture's resonance is no curve; other forms have no closed form here, or follow no signal.
"""


def run() -> list[Row]:
    """Return the rows of what has been made so far."""
    return rows(Answers("learned").kept())


def main(given: list[str]) -> int:
    """Make what is missing of the figures, print them."""
    kinds = ("outside", "further", "crossed", "none", "building", "clean")
    return ask("learned", __doc__, kinds, _answered, rows, given)


def rows(done: dict[str, Answer]) -> list[Row]:
    """Return the rows of what has answers."""
    of: dict[str, list[Answer]] = {}
    for key, one in done.items():
        of.setdefault(json.loads(key)[0], []).append(one)
    out = []
    for kind, what in (
        ("outside", "outside effects"), ("further", "further outside effects"),
        ("crossed", "outside effects of two signals"), ("building", "what a building hides"),
    ):  # fmt: skip
        out += _of_hidden(of.get(kind, []), what)
    for kind, what in (("none", "curves"), ("clean", "curves in a building")):
        if clean := of.get(kind, []):
            wrong = sum(bool(one.get("learned")) or "error" in one for one in clean)
            text = f"{wrong} of {len(clean)}"
            out.append(Row(f"learned: {what} where nothing is missing", text, "0", float(wrong)))
    return out


def _of_hidden(hidden: list[Answer], what: str) -> list[Row]:
    """Return the rows of cases that hide something; none without a case."""
    if not hidden:
        return []
    z = np.array([one.get("z", np.inf) for one in hidden])
    middle, share = float(np.median(z)), float(np.mean(z <= ADEQUATE))
    before = float(np.median([one.get("z_before", np.inf) for one in hidden]))
    text = f"{middle:.2f}, before {before:.2f} ({len(hidden)} cases)"
    out = [Row(f"learned: z of {what}, median", text, "<= 1.2", middle / 1.2)]
    text = f"{share:.0%} of {len(hidden)}"
    out.append(Row(f"learned: z <= 1.5 of {what}", text, ">= 80 %", 0.8 / max(share, 1e-3)))
    able = [one for one in hidden if one.get("form") in RIGHT]
    if not able:
        return out
    named = float(np.mean([bool(one.get("named")) for one in able]))
    text = f"{named:.0%} of {len(able)}"
    out.append(Row(f"learned: closed form of {what}", text, ">= 60 %", 0.6 / max(named, 1e-3)))
    return out


def _answered(kind: str, number: int) -> Answer:
    """Return what was learned of a case; an error is an answer too."""
    answer = _of_building if kind in ("building", "clean") else _of_bench
    about, learned = answer(kind, number)
    try:
        return about | learned()
    except Exception:  # whatever it is, it is the method's failure on this case
        return about | {"error": traceback.format_exc()}


def _of_bench(kind: str, number: int) -> tuple[Answer, Callable[[], Answer]]:
    """Return a case of a bench, and what gives the answer to it."""
    many = number + 1 if kind in MORE else 3 * (number + 1) + 12  # of which some do not count
    able = [
        task
        for task in make_plan(SEED, many, kind)
        if task.noise == 0.01 and (kind == "none" or task.strength > 0.05)
    ]
    task = able[number]
    about = {"effect": task.effect, "form": task.form, "strength": task.strength, "law": task.law}

    def learned() -> Answer:
        case = cases.load(task)
        train, held_out = (
            measurements(case.part(role), case.channels) for role in ("train", "holdout")
        )
        runs = BenchRuns(train, held_out, Model(task.law))
        opened = runs.prepare(DAMPER)
        if opened is None:
            return {"learned": False, "why": list(runs.lacking.reasons if runs.lacking else ())}
        return _learned(opened, task.form)

    return about, learned


def _of_building(kind: str, number: int) -> tuple[Answer, Callable[[], Answer]]:
    """Return a case of a building, and what gives the answer to it."""
    one = ODDITIES[number % len(ODDITIES)] if kind == "building" else None
    share = SHARES[number // len(ODDITIES) % len(SHARES)]
    form = one.name if one else ""
    about = {"form": form, "strength": share, "at": one.site if one else ""}

    def learned() -> Answer:
        made = house(SEED + number, one, share)
        runs = BuildingRuns(made.train, made.holdout, Model(LAW), made.building)
        sites = [site for site in runs.sites() if site != DAMPER]
        able = {site: opened for site in sites if (opened := runs.prepare(site)) is not None}
        if one is None:
            told = [_learned(opened, "") for opened in able.values()]
            return {"learned": any(answer["learned"] for answer in told)}
        worst = max(able, key=lambda site: able[site].before.z)
        return _learned(able[worst], form) | {"site": worst}

    return about, learned


def _learned(opened: Prepared, form: str) -> Answer:
    before, told = opened.before.z, list[Answer]()
    with ExitStack() as stack:
        while len(told) < MOST and (not told or opened.before.z > ADEQUATE):
            name = f"learned_{len(told) + 1}"
            found = learn(opened, name)
            if found.refused or found.curve is None or found.after is None:
                told = told or [{"why": found.refused}]
                break
            one, text, trial = _closed(opened, found, found.curve, form)
            told.append(one)
            stack.enter_context(defined({name: text}))
            opened = replace(
                opened, before=trial, problem=opened.problem.of(opened.problem.runs),
                held_out=opened.held_out.of(opened.held_out.runs), part=None,
            )  # fmt: skip
    more = [one for one in told[1:] if "part" in one]
    out = {"z_before": before, "learned": "part" in told[0], **told[0], "z": opened.before.z}
    return {**out, "more": more} if more else out


def _closed(
    opened: Prepared, found: LearnedCurve, curve: Curve, form: str
) -> tuple[Answer, str, Trial]:
    """Return what is told of a curve, its effect's text, and the trial of the model with it."""
    assert found.after is not None
    out: Answer = {"part": curve.part, "along": curve.along, "z_table": found.after.z}
    if curve.across:
        out["across"] = curve.across
    forms, trial, formula = closed_forms(curve, found.std), found.after, None
    if forms:
        closed = close(opened, found, forms)
        best = closed.form if closed else forms[0]
        if closed:
            trial, formula = closed.trial, closed.formula
        right = RIGHT.get(form, {}).get(curve.along, set())
        named = (closed is not None or name_of(forms) is not None) and best.name in right
        out |= {"name": best.name, "left": best.left, "closed": bool(closed), "named": named}
    return out, effect_text(found.name, curve, "a benchmark", formula), trial
