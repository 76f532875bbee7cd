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
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from bristle.core.arrays import Array
from bristle.data.channels import ChannelSpec, channel_unit
from bristle.data.measurement import Measurement, measurements_of_frame
from bristle.diagnosis.prepared import Prepared
from bristle.diagnosis.rig_runs import BenchRuns, BuildingRuns
from bristle.diagnosis.trials import Trial
from bristle.examples import rigs
from bristle.examples.hidden import Scales
from bristle.examples.rigs import CENTRE, ROUGH, Damper, Signals
from bristle.identification.rig import DAMPER
from bristle.learning.closed_forms import close, closed_forms, name_of
from bristle.learning.effect_file import effect_text
from bristle.learning.fit import Fitted, learn
from bristle.model.model import Model
from bristle.physics.building import Building, from_data
from bristle.user_code.load import defined

from ._answers import Answer, asked
from ._blind import cases
from ._blind.plan import MORE, make_plan
from ._blind.subject import halves
from ._rows import Row

Force = Callable[[Array, Array], Array]

LAW, NOISE = "lugre", 0.01
SHARES = (0.15, 0.4)
"""RMS of what is hidden, by that of the force of its site."""

SLOW = 1e-3
"""Speed [m/s] within which a friction turns round."""


@dataclass(frozen=True)
class Oddity:
    """Something that a layer or a storey may have.

    `level` is 0 for the isolation layer, else the storey; `force(x, v, far, fast)` (n,) of the
    motion there, far and fast being its RMS, in any unit; `right` the signals and closed
    forms that name it.
    """

    name: str
    level: int
    force: Callable[[Array, Array, float, float], Array]
    right: dict[str, set[str]]

    @property
    def site(self) -> str:
        """The site, as a verdict names it."""
        return f"storey{self.level}" if self.level else "layer"


def _brace(x: Array, _v: Array, far: float, _fast: float) -> Array:
    return np.asarray(np.maximum(x - 0.8 * far, 0.0) + np.minimum(x + 0.8 * far, 0.0))


def _bumper(x: Array, _v: Array, far: float, _fast: float) -> Array:
    return np.asarray(np.maximum(x - 0.6 * far, 0.0))


def _wall(x: Array, _v: Array, far: float, _fast: float) -> Array:
    return (x / far) ** 3


def _rub(x: Array, v: Array, far: float, _fast: float) -> Array:
    return np.asarray(np.tanh(v / SLOW) * np.exp(-((x / far) ** 2)))


def _rub_outwards(x: Array, v: Array, far: float, _fast: float) -> Array:
    return np.asarray(np.tanh(v / SLOW) * (0.3 + (x / far) ** 2))


def _orifice(_x: Array, v: Array, _far: float, fast: float) -> Array:
    return v * np.abs(v) / fast**2


def _damping(x: Array, v: Array, far: float, fast: float) -> Array:
    return (x / far) ** 2 * v / fast


ODDITIES = (
    Oddity("loose brace", 1, _brace, {"displacement": {"dead band"}}),
    Oddity("rub at mid-stroke", 0, _rub, {"displacement": {"bell"}}),
    Oddity("stiff wall", 2, _wall, {"displacement": {"cubic", "power"}}),
    Oddity("bumper on one side", 0, _bumper, {"displacement": {"contact above"}}),
    Oddity("rub that grows outwards", 1, _rub_outwards, {"displacement": {"parabola", "power"}}),
    Oddity(
        "oil damper with an orifice", 2, _orifice,
        {"velocity": {"quadratic drag", "power"}, "speed": {"parabola", "power"}},
    ),
    Oddity("damping that grows outwards", 0, _damping, {"displacement": {"parabola"}}),
)  # fmt: skip
"""What buildings may hide, one after the other."""


@dataclass(frozen=True)
class OddTower(rigs.Tower):
    """A tower with a further force [N] at one of its levels."""

    level: int = 0
    odd: Force | None = None

    def loads(
        self, q: list[float], volts: float, inner: list[float], rubbed: float
    ) -> tuple[list[float], float, list[float]]:
        """Return what `Tower.loads` does, with that force."""
        pushes, force, rates = super().loads(q, volts, inner, rubbed)
        if self.odd is not None:
            k, x, v = self.level, q[:3], q[3:]
            drift = x[k] - (x[k - 1] if k else 0.0)
            rate = v[k] - (v[k - 1] if k else 0.0)
            more = float(self.odd(np.array(drift), np.array(rate)))
            pushes[k] -= more / self.frame.masses[k]
            if k:
                pushes[k - 1] += more / self.frame.masses[k - 1]
        return pushes, force, rates


@dataclass(frozen=True)
class House:
    """A building's runs, and what is hidden: None for nothing."""

    building: Building
    train: list[Measurement]
    holdout: list[Measurement]
    hidden: Oddity | None


def house(number: int, hidden: Oddity | None, share: float) -> House:
    """Return a building of a seed, what it hides having a share of its site's force.

    Parameters
    ----------
    number : the seed
    hidden : what is hidden, None for nothing
    share : RMS of its force by that of the line at its site
    """
    draw, noise = (np.random.default_rng(one) for one in np.random.SeedSequence(number).spawn(2))
    table = CENTRE[LAW]
    values = {name: v * (1.0 + draw.uniform(-0.12, 0.12)) for name, v in table.items()}
    masses = np.array([1.97, 1.23, 1.23]) * (1.0 + draw.uniform(-0.12, 0.12, 3))
    stiffnesses = np.array([1057.0, 1366.0, 1366.0]) * (1.0 + draw.uniform(-0.12, 0.12, 3))
    frame = rigs.frame(masses, stiffnesses)
    scales = Scales(10.0, 0.18, 0.02, table["w_n"], drift=5e-3)
    rig = OddTower(frame, Damper(LAW, values), {}, scales)
    plan = rigs.tower_plan(rig, draw)
    if hidden is not None:
        rig = _hiding(rig, hidden, rig.perform(plan[0][1], plan[0][2], ROUGH), share)
    shown = {name: rig.perform(ground, volts) for name, ground, volts in plan}
    runs = {name: _measured(name, run, noise) for name, run in shown.items()}
    told = {
        "schema": 1, "name": "house", "base": "isolated", "masses": masses.tolist(),
        "stiffnesses": stiffnesses.tolist(), "damping_ratio": rigs.RATIO,
    }  # fmt: skip
    train = [run for name, run in runs.items() if name.startswith("train")]
    holdout = [run for name, run in runs.items() if name.startswith("holdout")]
    return House(from_data(told), train, holdout, hidden)


def _hiding(rig: OddTower, hidden: Oddity, shown: Signals, share: float) -> OddTower:
    """Return a tower that hides something, of a size that follows from a run without it."""
    level, below = rigs.LEVELS[hidden.level], rigs.LEVELS[hidden.level - 1]
    x, v = shown[f"{level}_displacement"], shown[f"{level}_velocity"]
    if hidden.level:
        x, v = x - shown[f"{below}_displacement"], v - shown[f"{below}_velocity"]
    wide, fast = float(np.std(x)), float(np.std(v))
    line = rig.frame.stiffnesses[hidden.level] * wide
    size = share * line / float(np.std(hidden.force(x, v, wide, fast)))

    def odd(x: Array, v: Array) -> Array:
        return size * hidden.force(x, v, wide, fast)

    return replace(rig, level=hidden.level, odd=odd)


def _measured(name: str, run: Signals, noise: np.random.Generator) -> Measurement:
    """Return a run as instruments with white noise show it."""
    spread = {channel: NOISE * float(np.std(y)) for channel, y in run.items()} | {"time": 0.0}
    noisy = {c: y + spread[c] * noise.standard_normal(len(y)) for c, y in run.items()}
    units = {c: "s" if c == "time" else channel_unit(c) for c in run}
    specs = {c: ChannelSpec(column=c, unit=unit) for c, unit in units.items()}
    return measurements_of_frame(pd.DataFrame(noisy), name, specs)[0]


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
        runs = BenchRuns(*halves(case), Model(task.law))
        if runs.lacking is not None:
            return {"learned": False, "why": list(runs.lacking.reasons)}
        return _learned(runs.prepare(DAMPER), task.form)

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
        able = {site: runs.prepare(site) for site in sites}
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
            if found.refused or found.best is None:
                told = told or [{"why": found.refused}]
                break
            one, text, trial = _closed(opened, found.name, found.best, form)
            told.append(one)
            stack.enter_context(defined({name: text}))
            opened = replace(
                opened, before=trial, problem=opened.problem.of(opened.problem.runs),
                held_out=opened.held_out.of(opened.held_out.runs), part=None,
            )  # fmt: skip
    more = [one for one in told[1:] if "part" in one]
    out = {"z_before": before, "learned": "part" in told[0], **told[0], "z": opened.before.z}
    return {**out, "more": more} if more else out


def _closed(opened: Prepared, name: str, best: Fitted, form: str) -> tuple[Answer, str, Trial]:
    """Return what is told of a curve, its effect's text, and the trial of the model with it."""
    curve = best.curve
    out: Answer = {"part": curve.part, "along": curve.along, "z_table": best.trial.z}
    if curve.across:
        out["across"] = curve.across
    forms, trial, formula = closed_forms(curve, best.std), best.trial, None
    if forms:
        closed = close(opened, name, best, forms)
        shown = closed.form if closed else forms[0]
        if closed:
            trial, formula = closed.trial, closed.formula
        right = RIGHT.get(form, {}).get(curve.along, set())
        named = (closed is not None or name_of(forms) is not None) and shown.name in right
        out |= {"name": shown.name, "left": shown.left, "closed": bool(closed), "named": named}
    return out, effect_text(name, curve, "a benchmark", formula), trial


run, main = asked(
    "learned",
    __doc__,
    ("outside", "further", "crossed", "none", "building", "clean"),
    _answered,
    rows,
)
