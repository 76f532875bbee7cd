"""Buildings as laboratories know them: what a verdict makes of files and instruments that are off.

    python -m benchmarks honest buildings --clean 100 --effect 60 --outside 20

makes what is missing of these figures and prints them; without a number it prints what is there.
Cases of two generators take turns: that of the blind benchmark, and that of `_shaken`. The
building's file has every mass up to 3 % off, in every second case every stiffness as well; every
second case lacks an accelerometer or a displacement; every second case has no velocities; noise is
0.5 to 2 % of each channel, the rate 200 to 500 Hz; every second case has no load cell.

clean      cases that hide nothing
effect     cases that hide one effect of the library at 15 or 40 % of the force
outside    cases that hide one that is not in it, likewise: its name is none of the library's
"""

from __future__ import annotations

import traceback
from dataclasses import dataclass, replace
from time import process_time
from typing import Any

import numpy as np

from bristle.data.measurement import Measurement
from bristle.diagnosis import diagnose_rig
from bristle.model.model import Model
from bristle.physics.building import Building, from_data
from tests.independent.effects import LIBRARY, OUTSIDE, forms
from tests.independent.rigs import LAWS, draw_rig

from . import _shaken as shaken
from ._answers import Answer, asked
from ._blind import cases, score
from ._blind.plan import BUILDINGS, SITES, Task
from ._blind.subject import measurements
from ._rows import Row

SEED = 4109
"""Of the cases that are reported. Nothing was developed on them."""

OFF = 0.03
"""Share by which a mass or a stiffness in the file is off at most."""

NOISE, SHARES = (0.005, 0.01, 0.02), (0.15, 0.4)
LESS = ("acceleration_absolute", "displacement")
"""What one level of every second building has no instrument for."""

KINDS = ("clean", "effect", "outside")


@dataclass(frozen=True)
class Made:
    """What a generator made: runs of all channels, the true numbers, and what is hidden."""

    runs: list[dict[str, Any]]
    masses: list[float]
    stiffnesses: list[float]
    ratio: float
    law: str
    reconstructed: bool
    hidden: tuple[str, ...]
    about: dict[str, Any]


@dataclass(frozen=True)
class House:
    """A building's case: what was made, what its file says, what was recorded and what was not."""

    made: Made
    building: Building
    train: list[Measurement]
    holdout: list[Measurement]
    lacks: tuple[str, ...]


def house(kind: str, number: int, seed: int = SEED) -> House:
    """Return a case of a seed.

    Parameters
    ----------
    kind : of `KINDS`
    number : from 0; laws, load cells and generators take turns
    seed : of all cases
    """
    rng = np.random.default_rng([seed, 33, KINDS.index(kind), number])
    second = number // 4 % 2 and kind != "outside"  # its effects are the library's
    made = _second(kind, number, rng) if second else _first(kind, number, rng)
    levels = ["base", *(f"floor{i}" for i in range(1, len(made.masses)))]
    factors = 1.0 + rng.uniform(-OFF, OFF, (2, len(levels))) * [[1.0], [float(rng.integers(2))]]
    building = from_data(
        {
            "schema": 1, "name": "house", "base": "isolated",
            "masses": (np.array(made.masses) * factors[0]).tolist(),
            "stiffnesses": (np.array(made.stiffnesses) * factors[1]).tolist(),
            "rayleigh": {"ratio": made.ratio, "modes": [1, len(levels)]},
        }
    )  # fmt: skip
    lacks = []
    if rng.integers(2):
        lacks.append(f"{rng.choice(levels)}_{rng.choice(LESS)}")
    if rng.integers(2) and not (lacks and lacks[0].endswith("displacement")):
        lacks += [f"{level}_velocity" for level in levels]
    if made.reconstructed:
        lacks.append("force")
    left = ("name", "role", "time", *lacks)
    channels = tuple(name for name in made.runs[0] if name not in left)
    parts = [[run for run in made.runs if run["role"] == role] for role in ("train", "holdout")]
    train, holdout = (measurements(part, channels) for part in parts)
    return House(made, building, train, holdout, tuple(lacks))


def _first(kind: str, number: int, rng: np.random.Generator) -> Made:
    """Return a case of the blind benchmark's generator."""
    law, reconstructed = LAWS[number % 2], bool(number // 2 % 2)
    rig, noise = str(rng.choice(BUILDINGS)), float(rng.choice(NOISE))
    task = Task("structure", "none", "", 0.0, noise, rig, law, int(rng.integers(2**31)))
    if kind != "clean":
        bed = draw_rig(rig, law, np.random.default_rng(0))
        library = _able(LIBRARY, SITES, number, reconstructed)
        able = [name for name in (OUTSIDE if kind == "outside" else library) if forms(name, bed)]
        name = str(rng.choice(able))
        own = [one.name for one in forms(name, bed)]
        if reconstructed and name == "base_friction":
            own.remove("coulomb")  # the damper's yield force is the same to equilibrium
        form = str(rng.choice(own))
        task = replace(task, effect=name, form=form, strength=float(rng.choice(SHARES)))
    case = cases.load(task)
    stride = int(rng.choice((1, 2)))
    runs = [
        {k: v[::stride] if isinstance(v, np.ndarray) else v for k, v in run.items()}
        for run in case.runs
    ]
    told = case.truth["building"]
    hidden = () if kind == "clean" else (task.effect,)
    about = {"form": task.form, "share": task.strength, "noise": noise}
    return Made(
        runs, told["masses"], told["stiffnesses"], told["ratio"], law, reconstructed, hidden, about
    )


def _second(kind: str, number: int, rng: np.random.Generator) -> Made:
    """Return a case of the generator of `_shaken`."""
    law, reconstructed = LAWS[number % 2], bool(number // 2 % 2)
    noise, share, name = float(rng.choice(NOISE)), 0.0, ""
    if kind == "effect":
        able = _able(shaken.HIDDEN, shaken.SITES, number, reconstructed)
        if reconstructed:
            able = [name for name in able if name != "base_friction"]  # it is the yield force
        name = str(rng.choice(able))
        share = float(rng.choice(SHARES))
    one = shaken.shaken(int(rng.integers(2**31)), law, name, share, noise)
    hidden = (name,) if name else ()
    about = {"form": "", "share": share, "noise": noise}
    return Made(one.runs, one.masses, one.stiffnesses, one.ratio, law, reconstructed, hidden, about)


def _able(
    names: tuple[str, ...], sites: tuple[str, ...], number: int, reconstructed: bool
) -> list[str]:
    """Return the effects that a case may hide: two cases in five have one of the structure."""
    of_structure = number % 5 in (1, 3)
    return [
        name
        for name in names
        if (name in sites) == of_structure and not (reconstructed and name == "delay")
    ]


def answered(kind: str, number: int, seed: int = SEED) -> Answer:
    """Return what the verdict says of a case; an error is wrong, a generator's is no case."""
    about: Answer = {"kind": "error", "effects": [], "hidden": ["?"] * (kind != "clean")}
    try:
        given = house(kind, number, seed)
    except ValueError:  # the specimen's equations were not solved
        return about | {"kind": "no case", "error": traceback.format_exc()}
    try:
        made, begun = given.made, process_time()
        about |= {
            "law": made.law, "reconstructed": made.reconstructed, "hidden": [*made.hidden],
            "lacks": [*given.lacks], "rate": round(1.0 / given.train[0].step),
            "levels": len(made.masses), **made.about,
        }  # fmt: skip
        found = diagnose_rig(given.train, given.holdout, Model(made.law), given.building)
        said = found.as_dict()
    except Exception:  # whatever it is, it is the method's failure on this case
        return about | {"error": traceback.format_exc()}
    return about | {
        "kind": said["kind"], "effects": said["effects"], "words": said["words"],
        "alternatives": said.get("alternatives", []),
        "sensors": [[one["channel"], one["fault"]] for one in said["sensors"]],
        "sites": [_site(one) for one in said["findings"]], "seconds": process_time() - begun,
    }  # fmt: skip


def _site(found: dict[str, Any]) -> list[Any]:
    """Return what a record keeps of a site."""
    kept = ("site", "kind", "effects", "z_train_before", "z_holdout_before", "z_holdout_after")
    return [found.get(name) for name in kept]


def rows(done: dict[str, Answer]) -> list[Row]:
    """Return the rows of what has answers."""
    out = []
    made = [one for one in done.values() if one["kind"] != "no case"]
    clean = [one for one in made if not one.get("hidden")]
    outside = [one for one in made if {*one.get("hidden", ())} & {*OUTSIDE}]
    hiding = [one for one in made if one.get("hidden") and one not in outside]
    if clean:
        none = score.Count(sum(one["kind"] == "none" for one in clean), len(clean))
        named = sum(bool(one["effects"]) for one in clean)
        out += [
            Row("clean buildings: none", _text(none), ">= 98 %", 0.98 / max(none.share, 1e-3)),
            Row("clean buildings: effects named", f"{named} of {len(clean)}", "0", 2.0 * named),
        ]
    if hiding:
        alone = score.Count(sum(map(_alone, hiding)), len(hiding))
        among = score.Count(sum(map(_among, hiding)), len(hiding))
        unknown = score.Count(sum(one["kind"] == "unknown" for one in hiding), len(hiding))
        name = "buildings with one effect: "
        out += [
            Row(name + "named alone", _text(alone), ">= 75 %", 0.75 / max(alone.share, 1e-3)),
            Row(name + "among the names", _text(among), ">= 92 %", 0.92 / max(among.share, 1e-3)),
            Row(name + "unknown", _text(unknown), "<= 4 %", unknown.share / 0.04),
        ]
    if outside:
        unknown = score.Count(sum(one["kind"] == "unknown" for one in outside), len(outside))
        name = "buildings with an effect outside of the library: unknown"
        out.append(Row(name, _text(unknown), ">= 90 %", 0.9 / max(unknown.share, 1e-3)))
    return out


def _text(count: score.Count) -> str:
    low, high = count.interval
    return f"{count.good} of {count.of} ({low:.0%} to {high:.0%})"


def _family(names: list[str]) -> set[str]:
    """Return effects, those of one family as one, and wherever they act."""
    plain = [name.partition("@")[0] for name in names]
    return {score.FAMILY[0] if name in score.FAMILY else name for name in plain}


def _alone(one: Answer) -> bool:
    return one["kind"] == "effect" and _family(one["effects"]) == _family(one["hidden"])


def _among(one: Answer) -> bool:
    names, hidden = _family(one["effects"]), _family(one["hidden"])
    return _alone(one) or (one["kind"] == "ambiguous" and hidden <= names)


run, main = asked("buildings", __doc__, KINDS, answered, rows)
