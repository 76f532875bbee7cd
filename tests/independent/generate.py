"""Cases: a rig, a hidden effect of a wanted strength, seven runs, and the truth kept apart.

    python -m tests.independent.generate --effect gas_spring --strength 0.15 --noise 0.01 \
        --seed 1 --out DIR

writes DIR/train_1.csv ... DIR/holdout_3.csv (and DIR/building.toml on a building), and the truth
to DIR/truth/truth.json. The strength is the share of the force RMS that is left once the base
law's own parameters are refitted to noise-free data.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import experiments as ex
from .effects import CROSSED, FORMS, FURTHER, LIBRARY, OUTSIDE, Form, compatible, forms
from .instruments import BENCH, FAULTS, Fault, plant_fault, record, rms
from .refit import BaseLaw
from .rigs import LAWS, RIGS, Rig, draw_rig
from .specimen import Specimen

Array = NDArray[np.float64]
Run = dict[str, Any]

ON_BUILDING = ("base_friction", "duffing", "storey_softening", "end_stop")
CLOSE = 0.01  # of the wanted share
UNITS = {
    "time": "s",
    "displacement": "m",
    "velocity": "m/s",
    "acceleration": "m/s2",
    "voltage": "V",
    "force": "N",
    "ground_acceleration": "m/s2",
}
BUILDING_CHANNELS = [
    "ground_acceleration",
    "base_displacement",
    "base_velocity",
    "base_acceleration_absolute",
    "floor1_displacement",
    "floor1_velocity",
    "floor1_acceleration_absolute",
    "floor2_displacement",
    "floor2_velocity",
    "floor2_acceleration_absolute",
    "voltage",
    "force",
]


@dataclass
class Case:
    """Recorded runs and their truth.

    runs: dict of arrays (n,) in SI under their channel names, and `role`, `name`.
    truth: what json can hold. specimen and the rest make further runs of the same rig; plan holds
    the experiments of the runs.
    """

    runs: list[Run]
    truth: dict[str, Any]
    specimen: Specimen
    fault: Fault | None = None
    spread: dict[str, float] = field(default_factory=dict)
    channels: tuple[str, ...] = BENCH
    plan: list[ex.Experiment] = field(default_factory=list)

    def clean(self, role: str) -> list[Run]:
        """The recorded runs of a role once more, without noise and without a planted fault."""
        plan = [run for run in self.plan if run.role == role]
        return [
            _pick(_shown(self.specimen, run), self.channels, role, f"{role}_{number}")
            for number, run in enumerate(plan, 1)
        ]

    def perform(self, run: ex.Experiment, seed: int, name: str = "extra_1") -> Run:
        """A further run of the same specimen, with the same instruments."""
        clean = _shown(self.specimen, run)
        rng = np.random.default_rng([seed, 77])
        shown = record(clean, self.spread, self.fault, rng)
        return _pick(shown, self.channels, run.role, name)


def _unit(channel: str) -> str:
    if channel in UNITS:
        return UNITS[channel]
    return {"displacement": "m", "velocity": "m/s", "absolute": "m/s2"}[channel.rsplit("_", 1)[1]]


def _shown(specimen: Specimen, run: ex.Experiment) -> dict[str, Array]:
    """Noise-free channels of one run, the velocity transducer and a late force included."""
    a = specimen.answer(run)
    shown = {name: a[name] for name in ("time", "displacement", "acceleration", "voltage")}
    shown["velocity"], shown["force"] = a["velocity_shown"], a["force_shown"]
    if "velocity_filter" in specimen.fields:
        shown["velocity_true"] = a["velocity"]
    building = specimen.rig.building
    if building is not None:
        shown["ground_acceleration"] = a["ground"]
        shown["base_displacement"], shown["base_velocity"] = a["base"], a["velocity_shown"]
        shown["base_acceleration_absolute"] = a["base_acceleration"]
        for floor in ("floor1", "floor2"):
            shown[f"{floor}_displacement"], shown[f"{floor}_velocity"] = (
                a[floor],
                a[f"{floor}_rate"],
            )
            shown[f"{floor}_acceleration_absolute"] = a[f"{floor}_acceleration"]
        shown["force_from_response"] = from_response(building, shown)
    return shown


def from_response(building: dict[str, Any], run: dict[str, Array]) -> Array:
    """Damper force (n,) N by the equilibrium of a linear base with known parameters."""
    mass, (kb, k1) = building["masses"][0], building["stiffnesses"][:2]
    alpha, beta = building["alpha"], building["beta"]
    x, v = run["base_displacement"], run["base_velocity"]
    dx, dv = x - run["floor1_displacement"], v - run["floor1_velocity"]
    inertia = mass * run["base_acceleration_absolute"]
    return -(inertia + alpha * mass * v + kb * (x + beta * v) + k1 * (dx + beta * dv))


def _pick(run: dict[str, Array], channels: tuple[str, ...], role: str, name: str) -> Run:
    return {"name": name, "role": role, "time": run["time"]} | {c: run[c] for c in channels}


class Strength:
    """Share left by a refit, as a function of the effect's own strength s."""

    def __init__(
        self,
        rig: Rig,
        plan: list[ex.Experiment],
        one: Form,
        shape: int,
        size: dict[str, float],
        measure: str = "raw",
    ) -> None:
        self.rig, self.plan, self.form, self.shape, self.size = rig, plan, one, shape, size
        self.measure = measure
        on_building = rig.building is not None and one.effect in ON_BUILDING
        self.force = "force_from_response" if on_building else "force"
        self.search: Array | None = None
        self.tried: dict[float, float] = {}

    def fields(self, s: float) -> dict[str, Any]:
        return self.form.fields(s, np.random.default_rng(self.shape), self.rig, self.size)

    def share(self, s: float) -> float:
        if s not in self.tried:
            specimen = Specimen(self.rig, self.fields(s), rtol=1e-7)
            runs = [_shown(specimen, run) for run in self.plan]
            law = BaseLaw(self.rig, runs, self.force, stride=3)
            self.search, self.tried[s] = law.refit(self.search)
            if self.measure == "low_passed":
                linear, _ = law.solve(self.search)
                self.tried[s] = law.share_low_passed(self.search, linear)
        return self.tried[s]

    def find(self, wanted: float) -> tuple[float, str]:
        """Strength s at which the wanted share is left, and the bound that was met first, if any.

        The bound is "most" where plausible parameters leave less, "least" where they leave more.
        """
        high = 1.0
        if self.share(high) < wanted:
            better = max((0.4, 0.7), key=self.share)
            if self.share(better) < wanted:
                return max(self.tried, key=lambda s: self.tried[s]), "most"
            high = better
        low, least = 0.0, self.form.least
        guess = max(high * wanted / self.share(high), least)
        for _ in range(16):
            got = self.share(guess)
            if abs(got - wanted) <= CLOSE * wanted:
                break
            if got > wanted:
                if guess <= least:
                    return guess, "least"
                high = guess
            else:
                low = guess
            guess = max(self._next(low, high, wanted), least)
        return min(self.tried, key=lambda s: abs(self.tried[s] - wanted)), ""

    def _next(self, low: float, high: float, wanted: float) -> float:
        """Secant on logarithms between the brackets, kept away from their ends."""
        if low == 0.0:  # follow the power law of the last two, for some shares go as s^(1/4)
            higher = [s for s in self.tried if s > high]
            power = 1.0
            if higher:
                top = min(higher)
                rise = np.log(self.tried[top] / self.tried[high]) / np.log(top / high)
                power = float(np.clip(rise, 0.15, 1.5))
            return high * float(
                np.clip(0.97 * (wanted / self.tried[high]) ** (1.0 / power), 1e-3, 0.8)
            )
        a, b = np.log(self.tried[low]), np.log(self.tried[high])
        if b - a < 1e-6:
            return float(np.sqrt(low * high))
        part = min(max((np.log(wanted) - a) / (b - a), 0.08), 0.92)
        return float(low * (high / low) ** part)


def _settle_ground(rig: Rig, plan: list[ex.Experiment], rng: np.random.Generator) -> list:
    """Scales each ground motion until base or storeys move by 0.4 to 0.5 of the stroke."""
    bare = Specimen(rig, {}, rtol=1e-6)
    settled = []
    for run in plan:
        goal = rng.uniform(0.4, 0.5) * rig.stroke
        run = ex.with_peak(run, 3.0 * rig.scales[2])
        for _ in range(6):
            a = bare.answer(run)
            moves = (a["base"], a["floor1"] - a["base"], a["floor2"] - a["floor1"])
            most = max(float(np.max(np.abs(x))) for x in moves)
            if abs(most - goal) < 0.03 * goal:
                break
            run = ex.with_peak(run, float(np.clip(goal / max(most, 1e-9), 0.3, 2.0) ** 0.8))
        settled.append(run)
    return settled


def _response_size(rig: Rig, plan: list[ex.Experiment]) -> dict[str, float]:
    """What the base and the storeys do without a hidden effect (buildings only), m."""
    bare = Specimen(rig, {}, rtol=1e-6)
    answers = [bare.answer(run) for run in plan]
    drifts = [(a["floor1"] - a["base"], a["floor2"] - a["floor1"]) for a in answers]
    return {
        "travel": max(float(np.max(np.abs(a["base"]))) for a in answers),
        "drift": max(float(np.max(np.abs(d))) for pair in drifts for d in pair),
    }


def _choose(names: list[str], wanted: str | None, rig: Rig, rng: np.random.Generator) -> list[Form]:
    """One form for each effect: the wanted ones, or drawn among those that the rig can carry."""
    given: list[str | None] = list(wanted.split("+")) if wanted else [None] * len(names)
    if len(given) != len(names):
        raise ValueError(f"{len(given)} forms for {len(names)} effects")
    chosen = []
    for name, one in zip(names, given, strict=True):
        if name not in FORMS:
            raise ValueError(f"no effect is named {name!r}; there are {', '.join(FORMS)}")
        able = {f.name: f for f in forms(name, rig)}
        if not able or (one is not None and one not in able):
            raise ValueError(f"{name} in form {one!r} on {rig.name} ({rig.law}): not possible")
        chosen.append(able[one] if one else list(able.values())[int(rng.integers(len(able)))])
    if not compatible(tuple(names)):
        raise ValueError(f"{' and '.join(names)} cannot be hidden in one damper")
    return chosen


def make_case(
    seed: int,
    effect: str = "none",
    form: str | None = None,
    strength: float = 0.15,
    noise: float = 0.01,
    rig: str = "bench_10N",
    law: str = "bingham",
    *,
    duration: float | None = None,
    acceleration: bool = False,
    measured_force: bool = True,
    measure: str = "raw",
) -> Case:
    """One case: seven recorded runs and their truth.

    Parameters
    ----------
    effect : str
        "none", a name of LIBRARY, OUTSIDE, FURTHER or CROSSED, two joined by "+", or a name of
        FAULTS (then `form` is the channel).
    form : str, optional
        Functional form, two joined by "+"; drawn if absent.
    strength : float
        Wanted share of the force RMS after the refit [1]; for a fault, change of the channel.
    noise : float
        Standard deviation on every channel as a share of its RMS over all runs [1].
    rig, law : str
        Of rigs.RIGS and rigs.LAWS.
    measure : str
        "raw": the share counts every sample; "low_passed": force and residual through 18 Hz. A
        Bingham force jumps at each reversal, so that what smooths the jump over a single sample
        already leaves 5 to 15 % of the raw force.

    Raises
    ------
    ValueError
        If a name is unknown, or rig and law cannot carry the effect or the pair.
    """
    if measure not in ("raw", "low_passed"):
        raise ValueError(f"measure {measure!r}: there are raw and low_passed")
    streams = [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(5)]
    bed = draw_rig(rig, law, streams[0])
    plan, size = _plan(bed, streams[1], duration)
    names = [] if effect == "none" or effect in FAULTS else effect.split("+")
    shapes = [int(q) for q in streams[2].integers(0, 2**31, 4)]
    wanted = form if names else None  # of a fault it is the channel
    chosen = _choose(names, wanted, bed, np.random.default_rng(shapes[3]))
    fields: dict[str, Any] = {}
    found = []
    train = [run for run in plan if run.role == "train"]
    for one, shape in zip(chosen, shapes, strict=False):
        finder = Strength(bed, train, one, shape, size, measure)
        s, bound = finder.find(strength)
        fields |= finder.fields(s)
        found.append(
            {
                "effect": one.effect,
                "form": one.name,
                "source": one.source,
                "outside": one.outside,
                "s": s,
                "share_alone": finder.share(s),
                "bound": bound,
                "parameters": finder.fields(s),
            }
        )
    specimen = Specimen(bed, fields)
    for one in found:  # the specimen may need more damping in series than was drawn
        if "se_c" in one["parameters"]:
            one["parameters"]["se_c"] = float(specimen.plant[0]["se_c"])
    clean = [_shown(specimen, run) for run in plan]
    fault, fault_share = None, 0.0
    if effect in FAULTS:
        channel = form or str(streams[2].choice(_faulty(effect)))
        fault, fault_share = plant_fault(
            effect, _channel(bed, channel), strength, clean, streams[2]
        )
    channels = _channels(bed, acceleration, measured_force)
    spread = {name: noise * rms(clean, name) for name in channels}
    if bed.building is not None:
        spread |= {"displacement": 0.0, "velocity": 0.0}  # the base channels are what is recorded
    runs = _record_all(clean, plan, spread, fault, channels, streams[3])
    truth = {
        "seed": seed,
        "rig": rig,
        "law": law,
        "base": bed.values,
        "scales": {"force": bed.force, "speed": bed.speed, "stroke": bed.stroke},
        "building": bed.building,
        "effects": found,
        "kind": _kind(effect, names),
        "measure": measure,
        "wanted": strength if effect != "none" else 0.0,
        "fault": None if fault is None else vars(fault) | {"share": fault_share},
        "noise": noise,
        "spread": {name: spread[name] for name in channels},
        "plan": [{"role": run.role, **run.about} for run in plan],
        **_shares(bed, clean, plan, fault, found),
    }
    told = json.loads(json.dumps(truth, default=_plain))
    return Case(runs, told, specimen, fault, spread, channels, plan)


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value)} has no place in a truth")


def _plan(
    rig: Rig, rng: np.random.Generator, duration: float | None
) -> tuple[list[ex.Experiment], dict[str, float]]:
    if rig.building is None:
        plan = ex.bench_plan(rig, rng, duration or 12.0)
        return plan, {"travel": _common_travel(plan)}
    plan = _settle_ground(rig, ex.structure_plan(rig, rng, duration or 20.0), rng)
    return plan, _response_size(rig, plan)


def _common_travel(plan: list[ex.Experiment]) -> float:
    """How far the rod goes in the training runs and in those held out, m."""
    most = {"train": 0.0, "holdout": 0.0}
    for run in plan:
        most[run.role] = max(most[run.role], float(np.max(np.abs(run.motion[0]))))
    return min(most.values())


def _kind(effect: str, names: list[str]) -> str:
    if effect == "none":
        return "none"
    if effect in FAULTS:
        return "fault"
    if len(names) > 1:
        return "pair"
    return "outside" if names[0] in (*OUTSIDE, *FURTHER, *CROSSED) else "effect"


def _faulty(kind: str) -> list[str]:
    return [c for c in BENCH if not (kind == "sensor_delay" and c == "force")]


def _channel(rig: Rig, channel: str) -> str:
    """Name of a channel on a rig: the damper's motion is the base's on a building."""
    if rig.building is not None and channel in ("displacement", "velocity"):
        return f"base_{channel}"
    return channel


def _channels(rig: Rig, acceleration: bool, measured_force: bool) -> tuple[str, ...]:
    if rig.building is None:
        return (*BENCH[:2], "acceleration", *BENCH[2:]) if acceleration else BENCH
    return tuple(c for c in BUILDING_CHANNELS if measured_force or c != "force")


def _record_all(
    clean: list[dict[str, Array]],
    plan: list[ex.Experiment],
    spread: dict[str, float],
    fault: Fault | None,
    channels: tuple[str, ...],
    rng: np.random.Generator,
) -> list[Run]:
    count = {"train": 0, "holdout": 0}
    runs = []
    for run, experiment in zip(clean, plan, strict=True):
        count[experiment.role] += 1
        name = f"{experiment.role}_{count[experiment.role]}"
        runs.append(_pick(record(run, spread, fault, rng), channels, experiment.role, name))
    return runs


def _shares(
    rig: Rig,
    clean: list[dict[str, Array]],
    plan: list[ex.Experiment],
    fault: Fault | None,
    found: list[dict[str, Any]],
) -> dict[str, Any]:
    """What the refit of the base law to the noise-free training runs leaves."""
    force = "force"
    if rig.building is not None and any(f["effect"] in ON_BUILDING for f in found):
        force = "force_from_response"
    shown = [fault.after_noise(fault.before_noise(r)) if fault else r for r in clean]
    train = [r for r, run in zip(shown, plan, strict=True) if run.role == "train"]
    held = [r for r, run in zip(shown, plan, strict=True) if run.role == "holdout"]
    law = BaseLaw(rig, train, force)
    search, share = law.refit()
    linear, _ = law.solve(search)
    other = BaseLaw(rig, held, force)
    return {
        "share": share,
        "share_holdout": other.share(search, linear),
        "share_low_passed": law.share_low_passed(search, linear),
        "force_of_share": force,
        "refit": law.values(search),
    }


def write(case: Case, folder: Path, truth: Path | None = None) -> None:
    """CSV files with named columns and units, and the truth in a file of its own."""
    folder.mkdir(parents=True, exist_ok=True)
    for run in case.runs:
        names = ["time", *case.channels]
        header = ",".join(f"{name} [{_unit(name)}]" for name in names)
        table = np.stack([run[name] for name in names], axis=1)
        path = folder / f"{run['name']}.csv"
        np.savetxt(path, table, fmt="%.9g", delimiter=",", header=header, comments="")
    building = case.specimen.rig.building
    if building is not None:
        text = (
            "schema = 1\n"
            f'name = "{case.specimen.rig.name}"\n'
            f"masses = {building['masses']}\n"
            f"stiffnesses = {building['stiffnesses']}\n"
            'base = "isolated"\n'
            f"rayleigh = {{ ratio = {building['ratio']}, modes = {building['modes']} }}\n"
        )
        (folder / "building.toml").write_text(text, encoding="utf-8")
    path = truth or folder / "truth" / "truth.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(case.truth, indent=1) + "\n", encoding="utf-8")


def main(arguments: list[str] | None = None) -> int:
    """Command line; 2 for a wrong input."""
    parser = argparse.ArgumentParser(prog="generate", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--effect", default="none", help="a name, two joined by +, or none")
    parser.add_argument("--form", help="functional form; for a sensor fault its channel")
    parser.add_argument("--strength", type=float, default=0.15)
    parser.add_argument("--noise", type=float, default=0.01)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rig", choices=RIGS, default="bench_10N")
    parser.add_argument("--law", choices=LAWS, default="bingham")
    parser.add_argument("--measure", choices=("raw", "low_passed"), default="raw")
    parser.add_argument("--acceleration", action="store_true", help="record it on the bench too")
    parser.add_argument("--without-force", action="store_true", help="building: leave it out")
    parser.add_argument("--out", type=Path, help="folder for the CSV files")
    parser.add_argument("--truth", type=Path, help="file for the truth")
    parser.add_argument("--list", action="store_true", help="effects and their forms")
    a = parser.parse_args(arguments)
    if a.list:
        for group in (LIBRARY, OUTSIDE, FURTHER, CROSSED):
            for name in group:
                print(f"{name}: {', '.join(FORMS[name])}")
        print(f"faults (form: {', '.join(BENCH)}): {', '.join(FAULTS)}")
        return 0
    if a.out is None:
        parser.error("--out is missing")
    try:
        case = make_case(
            a.seed, a.effect, a.form, a.strength, a.noise, a.rig, a.law,
            acceleration=a.acceleration, measured_force=not a.without_force, measure=a.measure,
        )  # fmt: skip
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    write(case, a.out, a.truth)
    print(f"{a.out}: {len(case.runs)} runs, share left {case.truth['share']:.4f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
