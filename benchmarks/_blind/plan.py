"""Which cases are made: stratified, so that any first part of the plan is balanced as well."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from tests.independent.effects import CROSSED, FURTHER, LIBRARY, OUTSIDE, compatible, forms
from tests.independent.instruments import BENCH, FAULTS
from tests.independent.rigs import LAWS, draw_rig

from .forms import is_same

CASES = 480
"""Cases on a bench that the published table counts."""
RESERVED = 2**31
"""Seeds from here on, of plans and of cases, belong to calibration: nothing reported is on them."""

STRENGTHS = (0.15, 0.40, 0.05)
RIGS = ("bench_10N", "bench_2kN")
BLOCK = (
    *[("none", 0.01)] * 15, *[("effect", 0.01)] * 16, *[("outside", 0.01)] * 4,
    *[("fault", 0.01)] * 3, *[("pair", 0.01)] * 2,
    *[("none", 0.03)] * 2, *[("effect", 0.03)] * 4, ("outside", 0.03), ("fault", 0.03),
)  # fmt: skip
"""Kind and noise of 48 cases: 40 at 1 % noise, 15 of which hide nothing, and 8 at 3 %."""

INVISIBLE = (
    ("sensor_gain", "force"), ("sensor_gain", "voltage"),
    ("sensor_bias", "voltage"), ("sensor_bias", "displacement"),
)  # fmt: skip
"""Faults that the parameters of the base laws absorb without a trace: no method can report them."""

APART = ("structure", "shared", "further", "crossed")
"""Kinds whose cases have plans of their own: the building; an effect of `SITES` in a damper on a
bench; effects outside the library beside those of the main plan, and such of two signals."""

MORE = {"further": (28, FURTHER), "crossed": (29, CROSSED)}
"""Kinds of further outside effects: the stream of random numbers of their plan, and their names."""

KINDS = ("none", "effect", "outside", "fault", "pair", *APART)
"""What `--only` takes."""

BUILDINGS = ("structure_10N", "structure_2kN")
SITES = ("base_friction", "duffing", "storey_softening", "end_stop")
"""Effects of the structure; in the plan they take turns with those of the damper."""

EVERY = 5
"""One building in so many hides nothing."""


@dataclass(frozen=True)
class Task:
    """One case to make: the arguments of the generator and what it is counted as."""

    kind: str
    effect: str
    form: str
    strength: float
    noise: float
    rig: str
    law: str
    seed: int
    reconstructed: bool = False
    """Whether a building's damper force is left out of the record."""

    @property
    def key(self) -> str:
        """Return 16 hex digits that name the case."""
        told = {n: v for n, v in asdict(self).items() if n != "reconstructed" or v}
        return hashlib.sha256(repr(sorted(told.items())).encode()).hexdigest()[:16]

    @property
    def same_form(self) -> bool:
        """Return whether every hidden effect has a form that bristle has."""
        pairs = zip(self.effect.split("+"), self.form.split("+"), strict=False)
        return self.effect == "none" or all(is_same(*pair) for pair in pairs)

    @staticmethod
    def of(record: dict[str, Any]) -> Task:
        """Return the task that a record was made for."""
        return Task(**record)


def make_plan(seed: int, cases: int, only: str = "") -> list[Task]:
    """Return the first `cases` tasks of a seed's endless plan, those of one kind if wanted.

    A longer plan begins with the shorter one.

    Raises
    ------
    ValueError
        If `only` is neither empty nor one of KINDS.
    """
    if only and only not in KINDS:
        raise ValueError(f"kind {only!r}: there are {', '.join(KINDS)}")
    if only == "structure":
        return make_structure_plan(seed, cases)
    if only == "shared":
        return make_shared_plan(seed, cases)
    if only in MORE:
        return make_further_plan(seed, cases, only)
    tasks: list[Task] = []
    for task in _endless(seed):
        if not only or task.kind == only:
            tasks.append(task)
        if len(tasks) == cases:
            break
    return tasks


def make_structure_plan(seed: int, cases: int) -> list[Task]:
    """Return the first `cases` tasks on buildings: every second one without a measured force.

    A longer plan begins with the shorter one. It draws nothing from the bench's plan.
    """
    rng = np.random.default_rng([seed, 25])
    hidden = {late: _in_buildings(seed, late) for late in (False, True)}
    tasks = []
    for turn in range(cases):
        late = bool(turn % 2)
        what = next(hidden[late])
        case = int(rng.integers(2**31))
        tasks.append(Task("structure", noise=0.01, seed=case, reconstructed=late, **what))
    return tasks


def make_shared_plan(seed: int, cases: int) -> list[Task]:
    """Return the first `cases` tasks with an effect of a building's layer in a damper on a bench.

    At 15 and 40 %. A longer plan begins with the shorter one; it draws nothing from the others.
    """
    rng = np.random.default_rng([seed, 27])
    able = _shuffled([name for name in SITES if _able(name)], rng)
    beds = _shuffled([(rig, law) for rig in RIGS for law in LAWS], rng)
    tasks = []
    for turn in range(cases):
        name, (rig, law) = str(next(able)), next(beds)
        own = [form.name for form in forms(name, _bed(rig, law))]
        form = own[int(rng.integers(len(own)))]
        strength, case = STRENGTHS[turn % 2], int(rng.integers(2**31))
        tasks.append(Task("shared", name, form, strength, 0.01, rig, law, case))
    return tasks


def make_further_plan(seed: int, cases: int, kind: str) -> list[Task]:
    """Return the first `cases` tasks with a further outside effect at 15 and 40 % on a bench.

    A longer plan begins with the shorter one; it draws nothing from the others.

    Parameters
    ----------
    seed, cases : of the plan, and how many tasks
    kind : a key of `MORE`
    """
    stream, own = MORE[kind]
    rng = np.random.default_rng([seed, stream])
    each = {name: _variants(name, rng, STRENGTHS[:2]) for name in own}
    names = _shuffled(list(own), rng)
    whats = (next(each[next(names)]) for _ in range(cases))
    return [Task(kind, noise=0.01, seed=int(rng.integers(2**31)), **what) for what in whats]


def _in_buildings(seed: int, reconstructed: bool) -> Iterator[dict[str, Any]]:
    """Yield what buildings hide: effects of damper and structure in turn, some nothing.

    A force that no load cell shows cannot be late.
    """
    rng = np.random.default_rng([seed, 26, int(reconstructed)])
    beds = _shuffled([(rig, law) for rig in BUILDINGS for law in LAWS], rng)
    own = [n for n in LIBRARY if n not in SITES and not (reconstructed and n == "delay")]
    groups = (_shuffled(list(SITES), rng), _shuffled(own, rng))
    turn, begins = 0, int(rng.integers(2))
    while True:
        for place in range(EVERY):
            rig, law = next(beds)
            if place == EVERY - 1:
                yield {"effect": "none", "form": "", "strength": 0.0, "rig": rig, "law": law}
                continue
            name = next(n for n in groups[turn % 2] if forms(n, _bed(rig, law)))
            able = [form.name for form in forms(name, _bed(rig, law))]
            strength = STRENGTHS[(begins + turn // 2) % 2]  # 15 and 40 %
            form = able[int(rng.integers(len(able)))]
            yield {"effect": name, "form": form, "strength": strength, "rig": rig, "law": law}
            turn += 1


def _endless(seed: int) -> Iterator[Task]:
    rng = np.random.default_rng([seed, 20])
    makers = {
        "none": _none(seed), "effect": _single("effect", LIBRARY, seed),
        "outside": _single("outside", OUTSIDE, seed), "fault": _faults(seed), "pair": _pairs(seed),
    }  # fmt: skip
    while True:
        for place in rng.permutation(len(BLOCK)):
            kind, noise = BLOCK[int(place)]
            what = next(makers[kind])
            yield Task(kind=kind, noise=noise, seed=int(rng.integers(2**31)), **what)


def _none(seed: int) -> Iterator[dict[str, Any]]:
    beds = [(rig, law) for rig in RIGS for law in LAWS]
    for k in _shuffled(beds, np.random.default_rng([seed, 21])):
        yield {"effect": "none", "form": "", "strength": 0.0, "rig": k[0], "law": k[1]}


def _shuffled(things: list[Any], rng: np.random.Generator) -> Iterator[Any]:
    """Yield all things in random order, again and again."""
    while True:
        for place in rng.permutation(len(things)):
            yield things[int(place)]


def _single(kind: str, names: tuple[str, ...], seed: int) -> Iterator[dict[str, Any]]:
    """Yield one hidden effect after the other; strengths, rigs, laws and forms rotate in each."""
    rng = np.random.default_rng([seed, 22, len(kind)])
    able = [name for name in names if name not in SITES and _able(name)]
    each = {name: _variants(name, rng) for name in able}
    for name in _shuffled(able, rng):
        yield next(each[name])


def _able(name: str) -> bool:
    return any(forms(name, _bed(rig, law)) for rig in RIGS for law in LAWS)


def _bed(rig: str, law: str) -> Any:
    return draw_rig(rig, law, np.random.default_rng(0))


def _variants(
    name: str, rng: np.random.Generator, strengths: tuple[float, ...] = STRENGTHS
) -> Iterator[dict[str, Any]]:
    """Yield all laws, rigs, strengths, same and other form of an effect; forms drawn in these."""
    beds = [
        (rig, law, group)
        for rig in RIGS
        for law in LAWS
        for group in _groups([f.name for f in forms(name, _bed(rig, law))], name)
    ]
    order = _shuffled(beds, rng)
    turn = int(rng.integers(len(strengths)))
    while True:
        for _ in beds:
            rig, law, group = next(order)
            strength = strengths[turn % len(strengths)]
            turn += 1
            form = group[int(rng.integers(len(group)))]
            yield {"effect": name, "form": form, "strength": strength, "rig": rig, "law": law}
        turn += 1  # so that a bed meets another strength in the next round


def _groups(able: list[str], effect: str) -> list[list[str]]:
    """Return the forms that bristle has and those that it lacks, empty groups left out."""
    same = [name for name in able if is_same(effect, name)]
    other = [name for name in able if not is_same(effect, name)]
    return [group for group in (same, other) if group]


def _faults(seed: int) -> Iterator[dict[str, Any]]:
    rng = np.random.default_rng([seed, 23])
    kinds = [
        (fault, channel)
        for fault in FAULTS
        for channel in BENCH
        if not (fault == "sensor_delay" and channel == "force")
        and (fault, channel) not in INVISIBLE
    ]
    beds = _shuffled([(rig, law) for rig in RIGS for law in LAWS], rng)
    for turn, (fault, channel) in enumerate(_shuffled(kinds, rng), 1):
        rig, law = next(beds)
        strength = STRENGTHS[turn % len(STRENGTHS)]
        yield {"effect": fault, "form": channel, "strength": strength, "rig": rig, "law": law}


def _pairs(seed: int) -> Iterator[dict[str, Any]]:
    rng = np.random.default_rng([seed, 24])
    beds = _shuffled([(rig, law) for rig in RIGS for law in LAWS], rng)
    turn = 0
    while True:
        rig, law = next(beds)
        able = [n for n in LIBRARY if n not in SITES and forms(n, _bed(rig, law))]
        names = tuple(str(name) for name in rng.choice(able, 2, replace=False))
        if not compatible(names):
            continue
        chosen = []
        for name in names:
            own = forms(name, _bed(rig, law))
            chosen.append(own[int(rng.integers(len(own)))].name)
        turn += 1
        strength = STRENGTHS[turn % 2]  # 15 and 40 %: 5 % of two would be less than that of one
        yield {
            "effect": "+".join(names), "form": "+".join(chosen), "strength": strength,
            "rig": rig, "law": law,
        }  # fmt: skip
