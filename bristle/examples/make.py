"""An example as a study: measurement files, a description, and the sealed answer."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.files import write_whole
from ..core.interrupt import deferred
from ..core.progress import counted, tell
from ..errors import StudyError
from ..study.steps import create_study
from ..study.study import Study
from . import rigs
from .devices import DEVICES, Values
from .hidden import UNITS, Hidden, Scales, choose, seal
from .rigs import (
    CENTRE,
    Damper,
    Signals,
    draw_damper,
    draw_frame,
    in_library_names,
    instruments,
    recorded,
    scales_of,
    streams,
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
