"""What planned tests show against ordinary campaigns of the same length, on the same rig.

    python -m benchmarks plan --campaign 6 --settled 10 --learn 4

makes what is missing of these figures, and prints them; without a number it prints what is there.

campaign   rigs with nothing hidden: the size from which effects are named, and the intervals of the
           law's parameters, on the paper's chirp, seven random runs, sines at three amplitudes and
           four levels; and on plans from the data sheet, one for each of four effects, one for all
           of them, one for the parameters
settled    rigs with a hidden effect whose sines leave a verdict open: the verdict after one plan
learn      rigs of the blind benchmark's generator with an effect that the library does not have: a
           curve learned from each of these campaigns and from a plan; z on the generator's own runs

Limits of the rig are checked on the true rig: stroke, speed, acceleration, with 10 % reserve.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

import bristle
from bristle.data.measurement import Measurement
from bristle.diagnosis.effect_limits import limit_of
from bristle.diagnosis.effect_size import Sized, SizeSearch
from bristle.diagnosis.trials import joinable
from bristle.examples.hidden import seal, unseal
from bristle.examples.make import Choice, make_bench, motion_of, perform_plan, programme_of
from bristle.examples.rigs import Damper, Signals, perform, recorded, rig_of, scales_of, write_csv
from bristle.identification.fit import intervals_of
from bristle.physics.effect import EFFECTS
from bristle.planning.folder import PlannedRun
from bristle.planning.limits import RigLimits, Test
from bristle.planning.waveforms import Command, Waveform
from bristle.study.learn import learn_effect
from bristle.study.steps import add_effects, create_study, diagnose_study
from bristle.study.study import Study
from tests.independent.experiments import proposed

from ._answers import Answer, asked
from ._blind import cases
from ._blind.plan import make_plan
from ._blind.subject import measurements, prepared
from ._rows import Row

LIMITS = RigLimits(
    stroke=17e-3, speed=0.2, acceleration=10.0, command=(0.0, 8.0), band=(0.3, 8.0),
    duration=12.0, runs=4,
)  # fmt: skip
"""Of the rig of examples, for ordinary tests and planned ones alike."""

SHEET = """schema = 1
[damper]
law = "{law}"
max_force = "15 N"
[limits]
stroke = "17 mm"
speed = "200 mm/s"
acceleration = "10 m/s2"
command = ["0 V", "8 V"]
band = ["0.3 Hz", "8 Hz"]
"""
"""The same as a rig.toml; its force is a data sheet's round number."""

IN_USE = 0.8
"""Share of the stroke that a hidden rig is driven to."""

CHANNELS = ("displacement", "velocity", "voltage", "force")


class TrueRig:
    """The rig of an example on a bench: performs tests, as often as it is asked to.

    Parameters
    ----------
    folder : an empty folder for the example
    choice : what the example is like
    """

    def __init__(self, folder: Path, choice: Choice) -> None:
        make_bench(folder, choice)
        self.answer = unseal(folder)
        rig = rig_of(self.answer)
        assert isinstance(rig, Damper)
        self.damper, self.law = rig, choice.law or "bingham"
        self._rng = np.random.default_rng([choice.seed, 77])

    def ideal(self, run: PlannedRun) -> Signals:
        """Return what ideal instruments show of a run."""
        volts = programme_of(run.time, run.signals["voltage"])
        scales = scales_of("bench", self.law)
        return perform(self.damper, motion_of(run.time, run.signals["displacement"]), volts, scales)

    def performed(self, runs: Sequence[PlannedRun]) -> list[Signals]:
        """Return what the rig's own instruments show."""
        return [recorded(self.ideal(run), self.answer["instruments"], self._rng) for run in runs]

    def measured(self, runs: Sequence[PlannedRun]) -> tuple[list[Measurement], list[Measurement]]:
        """Return measurements to fit to, and those held out."""
        shown = self.performed(runs)
        made = measurements(
            [{**one, "name": run.name} for run, one in zip(runs, shown, strict=True)], CHANNELS
        )
        roles = [run.role for run in runs]
        train = [one for one, role in zip(made, roles, strict=True) if role == "train"]
        return train, [one for one, role in zip(made, roles, strict=True) if role != "train"]

    def study(self, runs: Sequence[PlannedRun], folder: Path) -> Study:
        """Return an example with these runs in place of its own."""
        files = _written(runs, self.performed(runs), folder)
        study = create_study(folder / "study", files, law=self.law, rig="bench").study
        seal(study.folder, self.answer)
        return study


class HiddenRig:
    """A rig of the blind benchmark's generator, with an effect that the library does not have.

    Parameters
    ----------
    seed : of the cases
    number : of the case among them, at 15 or 40 % and with 1 % noise
    """

    def __init__(self, seed: int, number: int) -> None:
        tasks = make_plan(seed, 3 * (number + 1) + 12, "outside")
        self.task = [one for one in tasks if one.noise == 0.01 and one.strength > 0.05][number]
        self._made = cases.make(self.task)
        rig = self._made.specimen.rig
        self.limits = replace(
            LIMITS, stroke=IN_USE * rig.stroke, speed=rig.speed, acceleration=np.inf
        )
        self._rig = rig

    def sheet(self, path: Path) -> Path:
        """Write the data sheet of the rig as a rig.toml; return its path."""
        limits = self.limits
        path.write_text(
            f"""schema = 1
[damper]
law = "{self.task.law}"
max_force = "{self._rig.force:.2g} N"
[limits]
stroke = "{limits.stroke:.6g} m"
speed = "{limits.speed:.6g} m/s"
command = ["0 V", "8 V"]
band = ["0.3 Hz", "8 Hz"]
""",
            encoding="utf-8",
        )
        return path

    def performed(self, runs: Sequence[PlannedRun]) -> list[Signals]:
        """Return what the rig's instruments show of runs."""
        out = []
        for k, run in enumerate(runs):
            given = (run.signals["displacement"], run.signals["voltage"])
            one = proposed(self._rig, given, run.role, {})
            out.append(_signals(self._made.perform(one, self.task.seed + k, run.name)))
        return out

    def own(self) -> dict[str, Signals]:
        """Return the runs that the generator makes of the rig by itself."""
        return {run["name"]: _signals(run) for run in self._made.runs}

    def study(self, runs: Sequence[PlannedRun], folder: Path) -> Study:
        """Return a study of runs on the rig."""
        files = _written(runs, self.performed(runs), folder)
        return create_study(folder / "study", files, law=self.task.law, rig="bench").study


def _signals(run: dict[str, Any]) -> Signals:
    return {name: values for name, values in run.items() if name not in ("name", "role")}


def _written(runs: Sequence[PlannedRun], shown: Sequence[Signals], folder: Path) -> list[Path]:
    """Write recorded runs as files whose names have their roles; return the files."""
    folder.mkdir(parents=True)
    files = []
    for run, one in zip(runs, shown, strict=True):
        role = "holdout" if run.role == "holdout" else "train"
        files.append(folder / f"{role}_{run.name}.csv")
        write_csv(files[-1], one)
    return files


def _runs(tests: Sequence[Test], name: str, limits: RigLimits) -> list[PlannedRun]:
    out = []
    for k, test in enumerate(tests):
        one = test.signals(limits)
        signals = {"displacement": one.x, "voltage": one.V}
        role = "holdout" if k % 2 else "train"
        out.append(PlannedRun(f"{name}_{k + 1}", role, "", one.time, signals))
    return out


def chirps(seed: int, limits: RigLimits = LIMITS) -> list[PlannedRun]:
    """Return the paper's chirp under a sine of the command, four times."""
    rng = np.random.default_rng([seed, 1])
    return _runs(
        [
            Test(Waveform("sweep", 0.4, float(rng.uniform(4.0, 6.0))),
                 Command("sine", 0.0, 5.0, float(rng.uniform(0.7, 2.0))))
            for _ in range(4)
        ], "chirp", limits,
    )  # fmt: skip


def random_runs(seed: int, limits: RigLimits = LIMITS) -> list[PlannedRun]:
    """Return seven random runs under random steps of the command."""
    return _runs(
        [
            Test(Waveform("multisine", 0.5, 5.0, 10 * seed + k),
                 Command("random", 0.0, 8.0, 0.7, k), seconds=48.0 / 7.0)
            for k in range(7)
        ], "random", limits,
    )  # fmt: skip


def sines(seed: int, limits: RigLimits = LIMITS) -> list[PlannedRun]:
    """Return sines at three amplitudes and four levels of the command."""
    rng = np.random.default_rng([seed, 3])
    f = float(rng.uniform(1.0, 2.0))
    return _runs(
        [
            Test(Waveform("sine", 0.3, f), Command("held", 0.0, level), share, 4.0)
            for share in (1.0, 0.5, 0.25)
            for level in (0.0, 8.0 / 3.0, 16.0 / 3.0, 8.0)
        ], "sine", limits,
    )  # fmt: skip


def few_sines(seed: int) -> list[PlannedRun]:
    """Return eight sines of 4 s: four to fit to and four to judge by, at two levels."""
    rng = np.random.default_rng([seed, 4])
    f, low, high = float(rng.uniform(1.0, 2.0)), *sorted(rng.uniform(0.0, 8.0, 2).tolist())
    tests = [
        Test(Waveform("sine", 0.3, f), Command("held", 0.0, level), share, 4.0)
        for level in (low, high)
        for share in (0.9, 0.8, 0.45, 0.4)
    ]
    return _runs(tests, "sine", LIMITS)


ORDINARY = {"chirp": chirps, "random": random_runs, "sines": sines}
"""Ordinary campaigns of 48 s by name."""


SEED = 5000
LAWS = ("bingham", "lugre")
HIDDEN = (
    "gas_spring", "coil_lag", "stribeck", "asymmetry", "fluid_inertia", "flattening",
    "mount_compliance", "saturation", "quadratic_damping", "temperature",
)  # fmt: skip
"""Effects that examples hide."""
SEEN = (
    "gas_spring", "coil_lag", "stribeck", "asymmetry", "fluid_inertia", "delay", "flattening",
    "saturation", "quadratic_damping", "temperature", "duffing", "remanence",
)  # fmt: skip
"""Effects that a plan is made for, whose size the steps of the integration do not bound."""

OF_EACH = 4
"""Effects in a case."""

APART = 0.02
"""Relative difference of two z below which they are alike: about what the noise of runs makes."""

ALSO = ("planning", "examples")


def _answered(kind: str, number: int) -> Answer:
    with tempfile.TemporaryDirectory(prefix="bristle_plan_") as folder:
        return KINDS[kind](number, Path(folder))


def _campaign(number: int, folder: Path) -> Answer:
    """Return sizes and deviations by campaign, and what the planned tests use of the limits."""
    law = LAWS[number % 2]
    rig = TrueRig(folder / "rig", Choice(law=law, nothing=True, seed=SEED + number))
    sheet = folder / "rig.toml"
    sheet.write_text(SHEET.format(law=law), encoding="utf-8")
    first = OF_EACH * (number // len(LAWS))
    named = [SEEN[k % len(SEEN)] for k in range(first, first + OF_EACH)]
    plans = {
        **{name: bristle.plan(sheet, see=name).runs() for name in named},
        "all": bristle.plan(sheet, see=True).runs(),
        "sharpen": bristle.plan(sheet, sharpen=True).runs(),
    }
    campaigns = {**{name: make(number) for name, make in ORDINARY.items()}, **plans}
    shown = {name: _shown(rig, runs) for name, runs in campaigns.items()}
    used = [_used(rig, runs) for runs in plans.values()]
    return {"law": law, "named": named, "shown": shown, "used": used}


def _shown(rig: TrueRig, runs: Sequence[PlannedRun]) -> Answer:
    """Return from what size each effect is named, and the deviations of the law's parameters."""
    opened = prepared(*rig.measured(runs), rig.law)
    model, problem = opened.before.model, opened.problem
    deciding = sum(len(run.force) - run.skip for run in opened.held_out.runs)
    known = SizeSearch(problem, model, problem.expectation(model), deciding)
    sizes = {}
    for name in joinable(model):
        if EFFECTS[name].amount:
            sized = Sized(name, known)
            named = limit_of(sized).named
            sizes[name] = None if not named else 1.0 / named if sized.falls else named
    found = intervals_of(problem, model)
    std = {name: s / max(abs(found.model.value(name)), 1e-300) for name, s in found.std.items()}
    return {"sizes": sizes, "std": std}


def _used(rig: TrueRig, runs: Sequence[PlannedRun]) -> list[float]:
    """Return the largest share of stroke, speed and acceleration that the true rig moves by."""
    shares = []
    for run in runs:
        one = rig.ideal(run)
        a = np.gradient(one["velocity"], one["time"])
        limits = (LIMITS.stroke, LIMITS.speed, LIMITS.acceleration)
        shares += [
            float(np.max(np.abs(values))) / limit
            for values, limit in zip((one["displacement"], one["velocity"], a), limits, strict=True)
        ]
    return shares


def _settled(number: int, folder: Path) -> Answer:
    """Return the verdicts before and after one plan, where the first one leaves something open."""
    hidden = HIDDEN[number % len(HIDDEN)]
    choice = Choice((hidden,), LAWS[(number // len(HIDDEN)) % 2], seed=SEED + 100 + number)
    rig = TrueRig(folder / "rig", choice)
    runs = few_sines(number)
    study = rig.study(runs, folder / "sines")
    bristle.identify(study)
    first = diagnose_study(study, law=rig.law)
    out: Answer = {"hidden": hidden, "before": [first.kind, list(first.effects)]}
    if first.kind == "effect" and hidden in first.effects:
        return out
    plan = bristle.plan(
        study, see=hidden if first.kind == "none" else None, stroke=LIMITS.stroke,
        speed=LIMITS.speed, acceleration=LIMITS.acceleration, command=LIMITS.command,
    )  # fmt: skip
    out["beyond"] = not plan.worth or all(one.beyond for one in plan.outcomes)
    if not plan.worth:
        return out
    perform_plan(study.folder, plan.write(folder / "plan"), insist=True)
    study = bristle.Study(study.folder)
    bristle.identify(study)
    after = diagnose_study(study, law=rig.law)
    return {**out, "after": [after.kind, list(after.effects)]}


def _learn(number: int, folder: Path) -> Answer:
    """Return z of curves learned from ordinary runs and from a plan, on runs of another kind."""
    rig = HiddenRig(SEED, number)
    sheet = rig.sheet(folder / "rig.toml")
    campaigns = {
        **{name: make(number, rig.limits) for name, make in ORDINARY.items()},
        "plan": bristle.plan(sheet, learn=True).runs(),
    }
    third = rig.own()
    out: Answer = {"hidden": rig.task.effect, "form": rig.task.form}
    for name, runs in campaigns.items():
        study = rig.study(runs, folder / name)
        bristle.identify(study)
        before = bristle.compare(third, study.model()).z
        found = learn_effect(study)
        if found.file is not None:
            study = bristle.Study(study.folder, trust=True)
            add_effects(study, [found.name])
        z = bristle.compare(third, study.model()).z
        out[name] = {"learned": found.file is not None, "z_before": before, "z": z}
    return out


KINDS = {"campaign": _campaign, "settled": _settled, "learn": _learn}


def rows(done: dict[str, Answer]) -> list[Row]:
    """Return the rows of what has answers."""
    by_kind: dict[str, list[Answer]] = {kind: [] for kind in KINDS}
    for key, answer in done.items():
        by_kind[json.loads(key)[0]].append(answer)
    return [
        *_campaign_rows(by_kind["campaign"]), *_settled_rows(by_kind["settled"]),
        *_learn_rows(by_kind["learn"]),
    ]  # fmt: skip


def _campaign_rows(answers: Sequence[Answer]) -> list[Row]:
    if not answers:
        return []
    own: dict[str, list[float]] = {}
    whole: dict[str, list[float]] = {}
    against: dict[str, list[float]] = {"chirp": [], "random": []}
    for answer in answers:
        shown = answer["shown"]
        for name in shown["all"]["sizes"]:
            others = [shown[one]["sizes"].get(name) for one in ORDINARY]
            best = min((size for size in others if size), default=None)
            for plan, found in ((name, own), ("all", whole)):
                planned = shown.get(plan, {"sizes": {}})["sizes"].get(name)
                if plan in shown and best:
                    found.setdefault(name, []).append(planned / best if planned else inf)
        for name, ratios in against.items():
            std, other = shown["sharpen"]["std"], shown[name]["std"]
            ratios += [std[p] / other[p] for p in std if other.get(p)]
    out = [
        _ratios("sizes named, a plan for the effect / best ordinary campaign", own, 0.5),
        _ratios("sizes named, one plan for all effects / best ordinary campaign", whole, None),
    ]
    for name, goal in (("chirp", 0.5), ("random", 0.7)):
        ratio = float(np.median(against[name]))
        out.append(
            Row(f"intervals of the law, plan / {name}", f"{ratio:.2f}", f"<= {goal}", ratio / goal)
        )
    used = max(share for answer in answers for shares in answer["used"] for share in shares)
    out.append(Row("largest share of a limit that is used", f"{used:.3f}", "<= 0.9", used / 0.9))
    return out


def _ratios(name: str, found: dict[str, list[float]], goal: float | None) -> Row:
    """Return the row of ratios by effect: the median over effects of their medians."""
    medians = {one: float(np.median(ratios)) for one, ratios in found.items()}
    middle = float(np.median(list(medians.values())))
    each = ", ".join(f"{one} {ratio:.2f}" for one, ratio in sorted(medians.items()))
    return Row(
        name, f"{middle:.2f}", f"<= {goal}" if goal else "", middle / goal if goal else None, each
    )


def _settled_rows(answers: Sequence[Answer]) -> list[Row]:
    asked = [one for one in answers if "beyond" in one]
    if not asked:
        return []
    right = [
        one for one in asked if "after" in one
        and one["after"][0] == "effect" and one["hidden"] in one["after"][1]
    ]  # fmt: skip
    beyond = sum(one["beyond"] and one not in right for one in asked)
    share = (len(right) + beyond) / len(asked)
    return [
        Row(
            "settled by one plan, or told as beyond any",
            f"{len(right)} and {beyond} of {len(asked)}",
            ">= 85 %", 0.85 / max(share, 1e-3),
        )
    ]  # fmt: skip


def _learn_rows(answers: Sequence[Answer]) -> list[Row]:
    if not answers:
        return []
    out = []
    for name in ORDINARY:
        ratios = np.array([one["plan"]["z"] / one[name]["z"] for one in answers])
        lower = int(np.sum(ratios < 1.0))
        clearly = int(np.sum(ratios < 1.0 - APART))
        apart = clearly + int(np.sum(ratios > 1.0 + APART))
        z = ", ".join(
            f"{kind} {float(np.median([one[kind]['z'] for one in answers])):.2f}"
            for kind in (name, "plan")
        )
        out.append(
            Row(
                f"learned from a plan, lower z than from {name}", f"{lower} of {len(answers)}",
                ">= 75 %", 0.75 * len(answers) / max(lower, 1e-3),
                f"of those apart by more than {APART:.0%}: {clearly} of {apart}; median z: {z}",
            )
        )  # fmt: skip
    return out


run, main = asked("plan", __doc__, tuple(KINDS), _answered, rows, ALSO)
