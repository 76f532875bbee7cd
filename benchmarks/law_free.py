"""Which law and which effects a bench has, where nobody names the law.

    python -m benchmarks law_free --none 20 --effect 20 --law 20 --pair 20

makes what is missing of these figures and prints them; without a number it prints what is there.

none       cases of a Bingham or LuGre damper that hide nothing, from the generator of the blind
           benchmark
effect     the same with one effect of the library at 15 or 40 %
law        cases of the other laws, each as the library has it, that hide nothing
pair       the same with one effect of the library at 10 to 60 %

A case is right where the verdict names the law and the effects that made the runs. It is equal
where it names another pair of no more parameters and tells that the true one does as well.
"""

from __future__ import annotations

import json
import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np
import pandas as pd

from bristle.core.arrays import Array
from bristle.data.measurement import Measurement, measurements_of_frame
from bristle.diagnosis import diagnose_rig
from bristle.diagnosis.law_choice import LawAndEffects
from bristle.diagnosis.sensor_faults import instruments_of
from bristle.diagnosis.trials import joinable
from bristle.identification.fit import Search
from bristle.identification.histories import DamperForces
from bristle.identification.prepare import prepare
from bristle.identification.problem import Problem
from bristle.identification.start_grid import initial_guesses
from bristle.model.model import Model
from bristle.physics.effect import effects_of
from bristle.physics.forms import split_form
from bristle.physics.laws import LAWS as LIBRARY

from ._answers import Answer, asked
from ._blind import cases, score
from ._blind.plan import Task, make_plan
from ._blind.subject import halves
from ._rows import Row

LAWS = ("bouc_wen", "tanh", "dahl", "modified_bouc_wen")

RUNS = ("train_1", "train_2", "train_3", "train_4", "holdout_1", "holdout_2")

LEAST, MOST = 0.1, 0.6
"""Share of the force that an effect must change, beyond what the law absorbs."""

DRAWN = 4100

STEP, FINER, SECONDS = 0.002, 10, 12.0
"""Sampling step [s], steps of the truth within one of them, length of a run [s]."""

NOISE = 0.01
"""Standard deviation of a channel's noise, by that of the channel."""

SPREAD = 1.5
"""A parameter of the truth lies between its default over this and times it."""


@dataclass(frozen=True)
class Hidden:
    """What made the runs of a case: law, effects, the share of the force that these change."""

    law: str
    effects: tuple[str, ...]
    strength: float
    train: Sequence[Measurement]
    held_out: Sequence[Measurement]


def other_law(number: int, with_effect: bool) -> Hidden:
    """Return a case: laws take turns, effects are drawn.

    Parameters
    ----------
    number : of the case
    with_effect : whether an effect of the library is hidden
    """
    law = LAWS[number % len(LAWS)]
    rng = np.random.default_rng([DRAWN, number, int(with_effect)])
    values, effects, strength = truth_of(law, rng), tuple[str, ...](), 0.0
    if with_effect:
        effect, values, strength = _strong(Model(law, (), values), rng)
        effects = (effect,)
    runs = [recorded(law, values, rng, name, effects) for name in RUNS]
    return Hidden(law, effects, strength, runs[:4], runs[4:])


def motion(rng: np.random.Generator) -> tuple[Array, ...]:
    """Return t [s], x [m], v [m/s], a [m/s2] and V [V], every STEP / FINER."""
    t = np.arange(round(SECONDS / STEP) * FINER + 1) * STEP / FINER
    x, v, a = np.zeros((3, len(t)))
    for low, high, size in ((0.5, 1.5, 4e-3), (1.5, 3.0, 2.5e-3), (3.0, 6.0, 1.2e-3)):
        w, phase = 2.0 * np.pi * rng.uniform(low, high), rng.uniform(0.0, 2.0 * np.pi)
        size *= rng.uniform(0.7, 1.3)
        x += size * np.sin(w * t + phase)
        v += size * w * np.cos(w * t + phase)
        a -= size * w * w * np.sin(w * t + phase)
    swing = 2.5 * (1.0 + np.sin(2.0 * np.pi * rng.uniform(0.3, 1.2) * t))
    levels = rng.uniform(0.0, 8.0, 12)
    held = levels[np.minimum((t / SECONDS * 12).astype(int), 11)]
    return t, x, v, a, np.where(t < 0.5 * SECONDS, swing, held)


def truth_of(law: str, rng: np.random.Generator) -> dict[str, float]:
    """Return parameters of a law about its defaults; those that no fit moves stay there."""
    found = {}
    for name, parameter in LIBRARY[law].parameters.items():
        if name not in LIBRARY[law].fixed():
            low, high = parameter.bounds
            value = parameter.value * SPREAD ** rng.uniform(-1.0, 1.0)
            if parameter.value == 0.0:
                value = rng.uniform(-0.5, 0.5)
            found[name] = float(np.clip(value, low + 0.1 * abs(value), high))
    return found


def recorded(
    law: str,
    values: dict[str, float],
    rng: np.random.Generator,
    name: str,
    effects: Sequence[str] = (),
) -> Measurement:
    """Return one run of a law, and of effects with it, measured with noise."""
    t, x, v, a, V = motion(rng)
    force = DamperForces(law, list(effects)).force(x, v, a, V, STEP / FINER, values)
    seen = {"displacement [m]": x, "velocity [m/s]": v, "voltage [V]": V, "force [N]": force}
    frame = {"time [s]": t[::FINER]}
    for title, signal in seen.items():
        shown = signal[::FINER]
        noise = NOISE * np.std(shown) * rng.standard_normal(len(shown))
        frame[title] = shown if title.startswith("voltage") else shown + noise
    return measurements_of_frame(pd.DataFrame(frame), name)[0]


def _strong(model: Model, rng: np.random.Generator) -> tuple[str, dict[str, float], float]:
    """Return an effect that changes a law's force enough, the values with it, and by how much."""
    runs = [prepare(recorded(model.law, dict(model.values), rng, name)) for name in RUNS[:2]]
    problem = Problem(runs)
    expected = problem.expectation(model)
    search = Search(problem, model, expected, model.free())
    base = search.residuals(search.start)
    own = search.sensitivities()
    basis = np.linalg.qr(own / np.maximum(np.linalg.norm(own, axis=0), 1e-300))[0]
    sigma = np.concatenate([s[r.skip :] for r, (_, s, _) in zip(runs, expected, strict=True)])
    size = float(np.linalg.norm(np.concatenate([r.force[r.skip :] for r in runs]) / sigma))
    instruments = {one.name for one in effects_of("sensor")}
    able = [name for name in joinable(model) if name not in instruments]
    for name in rng.permutation(able).tolist():
        for guess in rng.permutation(np.array(initial_guesses(name, model, problem), dtype=object)):
            with_it = Search(problem, guess, expected, [])
            change = with_it.residuals(with_it.start) - base
            share = float(np.linalg.norm(change - basis @ (basis.T @ change))) / size
            if LEAST <= share <= MOST:
                return name, dict(guess.values), share
    raise ValueError(f"no effect changes the force of {model.law} by {LEAST:.0%} to {MOST:.0%}")


SEED = 41
GOALS = {"none": 0.95, "effect": 0.9, "law": 0.95, "pair": 0.9}


def rows(done: dict[str, Answer]) -> list[Row]:
    """Return the rows of what has answers."""
    out = []
    for kind, goal in GOALS.items():
        own = [answer for key, answer in done.items() if json.loads(key)[0] == kind]
        if not own:
            continue
        right = score.Count(sum(bool(one.get("right")) for one in own), len(own))
        equal = sum(bool(one.get("equal")) for one in own)
        share = (right.good + equal) / right.of
        text = f"{right.good} of {right.of} right, {equal} equal"
        ratio = goal / max(share, 1e-3)
        out.append(Row(f"law free: {kind}", text, f">= {goal:.0%}", ratio))
        false = sum(bool(one.get("alarm")) for one in own)
        if kind in ("none", "law"):
            text = f"{false} of {right.of}"
            name = f"law free: {kind}, effects where none is hidden"
            out.append(Row(name, text, "0", 2.0 * false))
    return out


def answered(kind: str, number: int) -> Answer:
    """Return what the verdict names of a case; an error is wrong."""
    hidden = other_law(number, kind == "pair") if kind in ("law", "pair") else _of(kind, number)
    about = {"law": hidden.law, "effects": hidden.effects, "strength": hidden.strength}
    try:
        return about | _named(hidden)
    except Exception:  # whatever it is, it is the method's failure on this case
        return about | {"right": False, "error": traceback.format_exc()}


def _of(kind: str, number: int) -> Hidden:
    """Return a case of the blind benchmark's generator."""
    task = _task(kind, number)
    case = cases.load(task)
    effects = () if kind == "none" else (task.effect,)
    return Hidden(task.law, effects, task.strength, *halves(case))


def _task(kind: str, number: int) -> Task:
    able = [
        task
        for task in make_plan(SEED, 6 * (number + 1) + 12, kind)
        if task.noise == 0.01 and (kind == "none" or task.strength > 0.05)
    ]
    return able[number]


def _named(hidden: Hidden) -> Answer:
    effects = hidden.effects
    begin = perf_counter()
    found = diagnose_rig(hidden.train, hidden.held_out, Model("bingham"), any_law=True)
    took = perf_counter() - begin
    laws = found.laws
    if laws is None:
        return {"right": False, "kind": found.kind, "seconds": took}
    # A sensor's effect is told as a fault of its channel: its lag may be short enough for a delay.
    told = list(instruments_of(found.sensors))
    if any((one.channel, one.kind) == ("velocity", "delay") for one in found.sensors):
        told.append("velocity_sensor")
    said = laws.name, tuple(dict.fromkeys((*found.effects, *told)))
    others = [(law, other) for law, other, _ in laws.equivalents]
    right = _is(said, hidden.law, effects)
    equal = not right and any(_is(one, hidden.law, effects) for one in others)
    chosen = next(pair for pair in laws.pairs if pair.row is laws.row)
    return {
        "right": right, "equal": equal and _simple(chosen, laws.pairs, hidden.law, effects),
        "alarm": found.kind in ("effect", "ambiguous") and not effects and not equal,
        "kind": found.kind, "said": [said[0], list(said[1])], "others": others, "seconds": took,
    }  # fmt: skip


def _is(pair: tuple[str, tuple[str, ...]], law: str, effects: tuple[str, ...]) -> bool:
    """Return whether a pair is that of a law, in its own form, and effects."""
    plain, _, _ = split_form(pair[0])
    return plain == law and set(pair[1]) == set(effects)


def _simple(
    chosen: LawAndEffects, pairs: tuple[LawAndEffects, ...], law: str, effects: tuple[str, ...]
) -> bool:
    """Return whether a pair has no more parameters than the true one, where that was searched."""
    true = [one for one in pairs if _is((one.row.law, one.finding.effects), law, effects)]
    return all(chosen.fitted <= one.fitted for one in true)


run, main = asked("law_free", __doc__, tuple(GOALS), answered, rows)
