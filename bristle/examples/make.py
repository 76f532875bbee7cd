"""An example as a study, measurement files and the sealed answer; its rig performs plans."""

from __future__ import annotations

import tempfile
from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline

from ..core.arrays import Array
from ..core.files import write_whole
from ..core.interrupt import deferred
from ..core.progress import Count, counted, tell
from ..core.text import plain
from ..data.corrections import jumps
from ..errors import StudyError
from ..planning.folder import NAME, PlanFolder, PlannedRun, read_plan
from ..study.extend import Extended, extend_study
from ..study.steps import create_study
from ..study.study import Study
from . import rigs
from .devices import DEVICES, Values
from .hidden import UNITS, Hidden, Scales, choose, seal, unseal
from .rigs import (
    CENTRE,
    RATE,
    STROKE,
    V_MAX,
    Damper,
    Motion,
    Programme,
    Signals,
    draw_damper,
    draw_frame,
    in_library_names,
    instruments,
    recorded,
    rig_of,
    scales_of,
    streams,
    times,
    tower_of,
    write_csv,
)

LARGEST_NOISE = 0.2


@dataclass(frozen=True)
class Choice:
    """What an example is to be like.

    effects: what to hide, by name; drawn where empty. nothing: hide nothing. outside: hide what the
    library does not have. held: on a bench the voltage is held in each run, as many laboratories
    do. noise: standard deviation on every channel as a share of its RMS [1].
    """

    effects: tuple[str, ...] = ()
    law: str = ""
    noise: float = 0.01
    seed: int = 1
    nothing: bool = False
    outside: bool = False
    held: bool = False

    def check(self) -> None:
        """Refuse what contradicts itself or cannot be.

        Raises
        ------
        StudyError
            If two ways of choosing are given, or noise, seed or law cannot be.
        """
        if sum((bool(self.effects), self.nothing, self.outside)) > 1:
            raise StudyError("--effect, --none and --outside exclude each other; give one.")
        if not 0.0 <= self.noise <= LARGEST_NOISE:
            raise StudyError(f"--noise {self.noise:g}: 0 to {LARGEST_NOISE:g} is plausible.")
        if self.seed < 0:
            raise StudyError(f"--seed {self.seed}: 0 or a positive whole number is right.")
        if self.law and self.law not in (*CENTRE, *DEVICES):
            known = ", ".join([*CENTRE, *DEVICES])
            raise StudyError(f'--law "{self.law}"; an example has: {known}.')


def make_bench(folder: Path | str, choice: Choice) -> Study:
    """Make a study of a damper on a bench, with something hidden in it.

    Raises
    ------
    StudyError
        If the folder exists, or the choice cannot be.
    """
    _check(Path(folder), choice)
    law = choice.law or "bingham"
    draw, drawn, noise = streams(choice.seed)
    values, scales = draw_damper(law, draw), scales_of("bench", law)
    hidden, secret = _secret("bench", law, choice, scales, drawn)
    plan = rigs.plan(scales, draw, choice.held)
    damper, bare = Damper(law, values, secret), Damper(law, values)
    runs, plain = [], []
    for _, motion, volts in counted(plan, "run"):
        runs.append(rigs.perform(damper, motion, volts, scales))
        plain.append(rigs.perform(bare, motion, volts, scales))
    answer = _answer("bench", law, choice, hidden) | {
        "values": _with_units(secret), "base": in_library_names(law, values),
        "share": rigs.share(runs, plain),
    }  # fmt: skip
    shown = dict(zip([name for name, *_ in plan], runs, strict=True))
    answer["instruments"] = instruments(shown, choice.noise)
    shown = _with_noise(shown, answer, noise)
    text = DESCRIBED["bench"] if damper.commanded else DESCRIBED["bench"].replace(*NO_VOLTAGE)
    return _written(Path(folder), shown, answer, text, "A damper on a bench")


def make_building(folder: Path | str, choice: Choice, *, load_cell: bool = True) -> Study:
    """Make a study of a building on a shake table, with something hidden in it.

    `load_cell` False leaves the damper's force out of the files.

    Raises
    ------
    StudyError
        If the folder exists, or the choice cannot be.
    """
    _check(Path(folder), choice)
    if choice.law not in ("", "lugre"):
        raise StudyError(
            f"--law {choice.law}: in a building the damper comes to rest and holds, for which an "
            "example's Bingham force needs a travel: that would be the effect presliding. "
            "lugre is right."
        )
    law = "lugre"
    draw, drawn, noise = streams(choice.seed)
    values, frame = draw_damper(law, draw), draw_frame(draw)
    hidden, secret = _secret("building", law, choice, scales_of("building", law), drawn)
    rig, plain = (tower_of(frame, law, values, one) for one in (secret, {}))
    tell("planning the ground motions")
    plan = rigs.tower_plan(plain, draw)
    runs = {name: rig.perform(ground, volts) for name, ground, volts in counted(plan, "run")}
    if not load_cell:
        runs = {name: _without(run, "force") for name, run in runs.items()}
    answer = _answer("building", law, choice, hidden) | {
        "values": _with_units(secret), "base": in_library_names(law, values),
        "instruments": instruments(runs, choice.noise),
    }  # fmt: skip
    shown = _with_noise(runs, answer, noise)
    text = DESCRIBED["building"] if load_cell else DESCRIBED["building"].replace(CELL, NO_CELL)
    return _written(
        Path(folder), shown, answer, text, "A building on a shake table", _building_file(frame)
    )


def _check(folder: Path, choice: Choice) -> None:
    """Refuse before the first equation is solved."""
    choice.check()
    if folder.exists():
        raise StudyError(f"{folder} is there already; give another name.")


def _without(run: Signals, channel: str) -> Signals:
    return {name: x for name, x in run.items() if name != channel}


def _secret(
    rig: str, law: str, choice: Choice, scales: Scales, rng: np.random.Generator
) -> tuple[list[Hidden], Values]:
    """Return what is hidden and all its values."""
    if choice.nothing:
        return [], {}
    hidden = choose(rig, law, choice.effects, choice.outside, rng)
    values: Values = {}
    for one in hidden:
        values |= one.draw(rng, scales)
    return hidden, {name: float(value) for name, value in values.items()}


def _answer(rig: str, law: str, choice: Choice, hidden: list[Hidden]) -> dict[str, Any]:
    return {
        "rig": rig,
        "law": law,
        "noise": choice.noise,
        "seed": choice.seed,
        "hidden": [one.name for one in hidden],
        "outside": [one.name for one in hidden if one.outside],
        "about": {one.name: one.about for one in hidden},
    }


def _with_units(values: Values) -> dict[str, tuple[float, str]]:
    return {name: (value, UNITS[name]) for name, value in values.items()}


def _with_noise(
    runs: dict[str, Signals], answer: dict[str, Any], rng: np.random.Generator
) -> dict[str, Signals]:
    return {name: recorded(run, answer["instruments"], rng) for name, run in runs.items()}


def _building_file(frame: rigs.Frame) -> str:
    """Return the building file: what the drawing says."""
    return (
        'schema = 1\nname = "tower"\nbase = "isolated"\n'
        f"masses = {[round(m, 6) for m in frame.masses]}  # kg, base first\n"
        f"stiffnesses = {[round(k, 4) for k in frame.stiffnesses]}  # N/m, below each mass\n"
        f"rayleigh = {{ ratio = {rigs.RATIO}, modes = [1, 3] }}\n"
    )


def _written(
    folder: Path, runs: dict[str, Signals], answer: dict[str, Any], text: str, title: str,
    building: str = "",
) -> Study:  # fmt: skip
    """Return the study that was made of the runs, with its description and the sealed answer."""
    with tempfile.TemporaryDirectory(prefix="bristle_example_") as name:
        place = Path(name)
        for run, signals in runs.items():
            write_csv(place / f"{run}.csv", signals)
        drawing = place / "building.toml"
        if building:
            drawing.write_text(building, encoding="utf-8")
        files = [place / f"{run}.csv" for run in runs]
        rig = {"rig": "structure", "building": drawing} if building else {"rig": "bench"}
        with deferred():  # an example is whole with its answer, or not there
            study = create_study(folder, files, title=title, law=answer["law"], **rig).study
            seal(folder, answer)
            readme = text.format(name=folder.name, noise=100 * answer["noise"])
            write_whole(folder / "README.md", readme)
    return study


NO_VOLTAGE = ("| voltage | V | commanded, 0 to 8 V |\n", "")
CELL = "| force | N | load cell between damper and ground |\n"
NO_CELL = "\nThe damper's force was not measured.\n"
DESCRIBED = {
    "bench": """# {name}: a damper on a bench

A made example. A bench moved a damper of about 10 N and 20 mm stroke to either side, and a
recorder took 500 samples per second with {noise:g} % noise on every channel.

| channel | unit | instrument |
|---|---|---|
| displacement | mm | of the rod |
| velocity | mm/s | of the rod |
| voltage | V | commanded, 0 to 8 V |
| force | N | load cell on the rod, positive when it resists motion along +x |

Three runs are for training, two are held out. `sealed/answer.txt` names what is hidden in this
damper, if anything; `bristle example reveal {name}` opens it.
""",
    "building": """# {name}: a base-isolated building on a shake table

A made example. Two storeys stand on an isolated base, with an MR damper of about 10 N between
ground and base. A recorder took 500 samples per second with {noise:g} % noise on every channel.
`building.toml` holds masses, stiffnesses and damping ratios of the drawing.

| channel | unit | instrument |
|---|---|---|
| ground_acceleration | m/s2 | of the table |
| base, floor1, floor2: displacement, velocity | mm, mm/s | relative to the ground |
| base, floor1, floor2: acceleration_absolute | m/s2 | accelerometers |
| voltage | V | commanded, 0 to 8 V |
| force | N | load cell between damper and ground |

Three runs are for training, two are held out. `sealed/answer.txt` names what is hidden in this
rig, if anything; `bristle example reveal {name}` opens it.
""",
}


# Planned motions and commands as a rig performs them: smooth, and held before each jump.

# The true rig of an example performs a plan: the same instruments, fresh noise.


def seconds_of(time: Array) -> float:
    """Return how long a run with samples at `time` (n,) s is recorded [s]."""
    return float(np.floor((time[-1] - time[0]) * RATE + 1e-6) / RATE)


def motion_of(time: Array, displacement: Array) -> Motion:
    """Return the motion through planned samples: a spline of order five."""
    spline = make_interp_spline(time - time[0], displacement, k=5)
    first, second = spline.derivative(1), spline.derivative(2)
    return Motion(
        times(seconds_of(time)), lambda q: (float(spline(q)), float(first(q)), float(second(q)))
    )


def ground_of(time: Array, acceleration: Array) -> Array:
    """Return a planned ground acceleration at the recorder's instants (n,), straight between."""
    return np.asarray(np.interp(times(seconds_of(time)), time - time[0], acceleration))


def programme_of(time: Array, command: Array) -> Programme:
    """Return the voltage through planned samples: straight between them, held before a jump.

    A jump comes at the recorder's instant that is nearest to its sample.
    """
    height = np.where(jumps(command), np.diff(command, prepend=command[:1]), 0.0)
    at = np.flatnonzero(height)
    moments = np.round((time[at] - time[0]) * RATE) / RATE
    smooth = (command - np.cumsum(height)).tolist()
    step = (time[-1] - time[0]) / (time.size - 1)
    levels = np.concatenate([[0.0], np.cumsum(height[at])]).tolist()
    edges = moments.tolist()

    def value(now: float) -> float:
        place = min(max(now / step, 0.0), len(smooth) - 1.0)
        k = min(int(place), len(smooth) - 2)
        level = levels[bisect_right(edges, now + 1e-9)]
        return float(smooth[k] + (smooth[k + 1] - smooth[k]) * (place - k) + level)

    return Programme(value, tuple(dict.fromkeys(edges)))


KINDS = {"bench": "bench", "building": "structure"}
"""Rigs of examples, and what a plan calls them."""
COMMAND = "voltage"
RESTS = 0.02
"""Share of the largest displacement, or speed, up to which a run begins at rest."""


def perform_plan(
    folder: Path | str, plan: Path | str, *, name: str = "", insist: bool = False
) -> Extended:
    """Let the rig of an example perform a plan; its runs join the study.

    Parameters
    ----------
    folder : path
        The example.
    plan : path
        The folder of the plan.
    name : str
        The runs are called NAME_1, NAME_2 ...; "" leaves them the names of the plan.
    insist : bool
        Perform it although it was made for another study.

    Raises
    ------
    StudyError
        If the folder is no example, or the plan is for another rig; if its runs are in the study
        already, or ask for what the rig cannot do. Nothing is written then.
    RecordError
        If a file of the plan cannot be read.
    """
    if name and not NAME.fullmatch(name):
        raise StudyError(f'"{name}": a name of letters and digits is right, as in second.')
    answer, study, planned = unseal(Path(folder)), Study(folder), read_plan(plan)
    _refuse_other_rig(study, planned, answer["rig"], insist)
    if "instruments" not in answer:
        raise StudyError(
            f"{folder}: an older version of bristle has made this example, and its instruments are "
            f"not known. Make it again with --seed {answer['seed']}."
        )
    names = [f"{name}_{k}" if name else run.name for k, run in enumerate(planned.runs, 1)]
    _refuse_performed(study, names)
    rig = rig_of(answer)
    for run in planned.runs:
        _refuse_beyond(run)
    with tempfile.TemporaryDirectory(prefix="bristle_example_") as scratch:
        files = {
            Path(scratch, f"{one}.csv"): run for one, run in zip(names, planned.runs, strict=True)
        }
        count = Count("run", len(files))
        for file, run in files.items():
            count.begins(run.name)
            rng = np.random.default_rng([int(answer["seed"]), *file.stem.encode()])
            shown = _performed(rig, run, answer)
            write_csv(file, recorded(shown, answer["instruments"], rng))
        roles = {file.name: run.role for file, run in files.items()}
        return extend_study(study, list(files), roles=roles)


def _performed(rig: Any, run: PlannedRun, answer: Mapping[str, Any]) -> Signals:
    """Return what ideal instruments show of a run."""
    volts = programme_of(run.time, run.signals.get(COMMAND, np.zeros(run.time.size)))
    if isinstance(rig, Damper):
        motion = motion_of(run.time, run.signals["displacement"])
        return rigs.perform(rig, motion, volts, scales_of("bench", answer["law"]))
    shown: Signals = rig.perform(ground_of(run.time, run.signals["ground_acceleration"]), volts)
    _refuse_stroke(run, shown["base_displacement"], "it moves the base by")
    return shown


def _refuse_other_rig(study: Study, plan: PlanFolder, rig: str, insist: bool) -> None:
    if plan.rig != KINDS[rig]:
        raise StudyError(
            f'the plan is for a rig "{plan.rig}", and {study.folder} is a "{KINDS[rig]}". A plan '
            "for this rig is right."
        )
    if plan.study not in ("", study.name) and not insist:
        raise StudyError(
            f"the plan was made for the study {plan.study}, and this one is {study.name}. With "
            "--insist it is performed all the same."
        )
    if plan.command not in ("", COMMAND):
        raise StudyError(f"the plan commands a {plan.command}, and this rig takes a {COMMAND}.")


def _refuse_performed(study: Study, names: list[str]) -> None:
    there = [one for one in names if (study.folder / "data" / f"{one}.csv").exists()]
    if there:
        raise StudyError(
            f"{study.folder}: {', '.join(there)} {'is' if len(there) == 1 else 'are'} performed "
            "already. --as-runs NAME gives the new runs another name."
        )


def _refuse_beyond(run: PlannedRun) -> None:
    """Refuse what the rig cannot do, as far as the plan alone tells."""
    volts = run.signals.get(COMMAND, np.zeros(1))
    low, high = float(np.min(volts)), float(np.max(volts))
    if low < -1e-9 or high > V_MAX * (1.0 + 1e-9):
        raise StudyError(
            f"{run.name}: the voltage goes from {plain(low)} to {plain(high)} V; this rig's "
            f"amplifier gives 0 to {V_MAX:g} V."
        )
    if "displacement" not in run.signals:
        return
    x = run.signals["displacement"]
    _refuse_stroke(run, x, "it asks for")
    v = np.gradient(x, run.time)
    for what, values in (("displacement", x), ("velocity", v)):
        if abs(values[0]) > RESTS * float(np.max(np.abs(values))):
            raise StudyError(
                f"{run.name}: its {what} does not begin at zero, and the rig rests before it. "
                "A motion with a ramp is right."
            )


def _refuse_stroke(run: PlannedRun, x: Any, what: str) -> None:
    most = float(np.max(np.abs(x)))
    if most > STROKE:
        raise StudyError(
            f"{run.name}: {what} {plain(1e3 * most)} mm to one side; this rig's stroke is "
            f"{plain(1e3 * STROKE)} mm to either side."
        )
