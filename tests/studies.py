"""Four studies that many tests look at: made once a session, by the commands, and copied per test.

`bench`: a damper with a gas spring that its law does not have. `building`: a house whose isolation
stiffens. `device`: a brace between two levels beside a tie whose force is measured. `learned`: a
bench whose hidden force a curve was learned of. Runs are from equations that share no code with
the package.
"""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import braced
import numpy as np
import shaken
from made import write
from numpy.typing import NDArray

from bristle.cli import main
from bristle.data.channels import channel_unit
from bristle.study.steps import create_study
from bristle.study.study import Study
from tests.independent.generate import UNITS, Case, make_case

FOLDER = "BRISTLE_TEST_STUDIES"
"""The variable that names the folder where a session keeps them, the same for all workers."""

TOWER = """schema = 1
name = "tower"
masses = [1.5, 1.6, 1.7]
stiffnesses = [1400.0, 1310.0, 1220.0]
base = "isolated"
damping_ratio = 0.02
"""
PLACES = {
    "brace": '[[devices]]\nname = "brace"\nat = "storey1"\n',
    "tie": '[[devices]]\nname = "tie"\nbetween = ["ground", "floor2"]\n',
}
DEVICES: list[dict[str, Any]] = [
    {"name": "brace", "at": "storey1"},
    {"name": "tie", "between": ["ground", "floor2"]},
]
STIFFENING = 1.5e7  # N/m3, of the springs below the house
Force = Callable[[Any, Any], Any]


def study(name: str, folder: Path) -> Path:
    """Copy a study into a folder; return its own, `folder / "rig"`."""
    return Path(shutil.copytree(made(name) / "rig", folder / "rig"))


def made(name: str) -> Path:
    """Return the folder of a study with its runs, made where no other process has."""
    kept = Path(os.environ[FOLDER])
    with (kept / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (kept / name).exists():
            unfinished = kept / f"{name}.unfinished"
            shutil.rmtree(unfinished, ignore_errors=True)
            unfinished.mkdir()
            MADE[name](unfinished)
            unfinished.rename(kept / name)
    return kept / name


def titled(channels: dict[str, NDArray[np.float64]]) -> dict[str, NDArray[np.float64]]:
    """Return channels of a building by titles with their units."""
    return {
        f"{name} [{'s' if name == 'time' else channel_unit(name)}]": values
        for name, values in channels.items()
    }


def _order(*words: str | Path) -> None:
    assert main([*map(str, words), "--quiet"]) == 0


def case_study(case: Case, folder: Path) -> Path:
    """Make a study of two training runs and one held out of a case; return its folder."""
    for run in case.runs:
        if run["name"] in ("train_1", "train_2", "holdout_1"):
            columns = {f"{name} [{unit}]": run[name] for name, unit in UNITS.items() if name in run}
            write(folder / f"{run['name']}.csv", columns)
    _order("study", "new", folder / "rig", "--law", "bingham", "--data", folder / "*.csv")
    return folder / "rig"


def _bench(folder: Path) -> None:
    case_study(make_case(1, "gas_spring", strength=0.15, duration=4.0), folder)
    _order("identify", folder / "rig")
    _order("diagnose", folder / "rig")


def stiffening(x: Any, v: Any) -> list[float]:
    """Return the forces [N] of isolation springs that grow stiffer with displacement."""
    return [STIFFENING * x[0] ** 3, 0.0]


def house(
    folder: Path, damper: Force | None = None, hidden: Force | None = stiffening
) -> tuple[Path, list[Path]]:
    """Write runs of a house of one floor, the last to be held out; return its file and theirs."""
    building = shaken.building(1, True, 6)
    runs = []
    for k, role in enumerate(("train", "train", "holdout")):
        clean = shaken.shake(building, 20 + k, damper, hidden, samples=2500)
        random = np.random.default_rng(k)
        noisy = {
            name: values + (name != "time") * 0.01 * np.std(values) * random.normal(size=2500)
            for name, values in clean.items()
        }
        runs.append(write(folder / f"{role}_{k}.csv", titled(noisy)))
    file = folder / "house.toml"
    file.write_text(
        'schema = 1\nname = "house"\nbase = "isolated"\ndamping_ratio = 0.02\n'
        f"masses = {np.diag(building.M).tolist()}\nstiffnesses = {list(building.stiffnesses)}\n"
    )
    return file, runs


def house_study(
    folder: Path, damper: Force | None = None, hidden: Force | None = stiffening
) -> Study:
    """Return a study of the runs of a house."""
    file, runs = house(folder, damper, hidden)
    return create_study(folder / "rig", runs, rig="structure", building=file, law="bingham").study


def _building(folder: Path) -> None:
    rig = ("--rig", "structure", "--building", house(folder)[0], "--law", "bingham")
    _order("study", "new", folder / "rig", *rig, "--data", folder / "*.csv")
    _order("identify", folder / "rig", "--json")
    _order("diagnose", folder / "rig")


def braced_tower(
    folder: Path, devices: Sequence[Mapping[str, Any]] = DEVICES, without: tuple[str, ...] = (),
    fine: int = 4,
) -> Path:  # fmt: skip
    """Write three runs of a tower with a brace, or a tie as well, and its file; return that.

    The equations are solved with the `fine`th part of the logger's step.
    """
    tower = braced.tower(devices, floors=2, isolated=True)
    laws = {"brace": (braced.brace, True), "tie": (braced.tie, False)}
    forces = {device["name"]: laws[device["name"]] for device in devices}
    for k in range(3):
        clean = braced.shake(tower, 40 + k, forces, samples=3000 * fine, step=braced.DT / fine)
        shown = {name: values[::fine] for name, values in clean.items()}
        write(folder / f"shake{k}.csv", titled(braced.noisy(shown, 40 + k, without=without)))
    file = folder / "tower.toml"
    file.write_text(TOWER + "".join(PLACES[device["name"]] for device in devices))
    return file


def _device(folder: Path) -> None:
    rig = ("--rig", "structure", "--building", braced_tower(folder), "--device", "brace")
    _order("study", "new", folder / "rig", *rig, "--law", "tanh", "--data", folder / "*.csv")
    _order("identify", folder / "rig")


def _learned(folder: Path) -> None:
    for k, seed in enumerate((1, 2, 3)):
        random = np.random.default_rng(seed)
        t = np.arange(2000) / 500.0
        w = 2.0 * np.pi * random.uniform(0.5, 3.0, 6)[:, None]
        angle, size = w * t + random.uniform(0.0, 6.0, 6)[:, None], 0.03 / w
        x, v = (size * np.sin(angle)).sum(axis=0), (size * w * np.cos(angle)).sum(axis=0)
        force = 6.0 * np.tanh(v / 3e-3) + 60.0 * v + 1.5 * np.sin(x / 2e-3)
        noisy = [y + 0.005 * np.std(y) * random.standard_normal(len(t)) for y in (x, v, force)]
        titles = ("time [s]", "x [m]", "v [m/s]", "F [N]")
        write(folder / f"run_{k}.csv", dict(zip(titles, [t, *noisy], strict=True)))
    _order("study", "new", folder / "rig", "--law", "tanh", "--data", folder / "*.csv")
    _order("identify", folder / "rig", "--starts", "1")
    _order("learn", folder / "rig", "--along", "displacement", "--as", "force")
    _order("add", folder / "rig", "learned_1")


MADE: dict[str, Callable[[Path], None]] = {
    "bench": _bench, "building": _building, "device": _device, "learned": _learned,
}  # fmt: skip
