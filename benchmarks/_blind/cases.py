"""Cases on disk: making one takes seconds, so it is kept under the generator's digest."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bristle.core.files import cache_folder
from tests.independent import generate

from .plan import Task

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Recorded:
    """What a method gets to see, and the truth that it is scored by.

    `runs` dictionaries of arrays (n,) in SI by channel, with `name` and `role`.
    """

    task: Task
    runs: list[dict[str, Any]]
    truth: dict[str, Any]
    channels: tuple[str, ...]

    def part(self, role: str) -> list[dict[str, Any]]:
        """Return the runs of a role, "train" or "holdout"."""
        return [run for run in self.runs if run["role"] == role]


def digest_of(paths: list[Path]) -> str:
    """Return 12 hex digits of the content of files, in a fixed order."""
    whole = hashlib.sha256()
    for path in sorted(paths):
        whole.update(path.name.encode())
        whole.update(path.read_bytes())
    return whole.hexdigest()[:12]


def generator_digest() -> str:
    """Return the digest of the generator's code."""
    folder = ROOT / "tests" / "independent"
    return digest_of([p for p in folder.glob("*.py") if not p.name.startswith("test_")])


def folder() -> Path:
    """Return where cases of this generator are kept."""
    return cache_folder() / "blind" / f"cases-{generator_digest()}"


def make(task: Task) -> generate.Case:
    """Return the generator's case, with the specimen for further runs."""
    return generate.make_case(
        task.seed, task.effect, task.form or None, task.strength or 0.15, task.noise, task.rig,
        task.law, measured_force=not task.reconstructed,
    )  # fmt: skip


def load(task: Task) -> Recorded:
    """Return a case from disk, or make and keep it.

    Samples are kept in single precision: its rounding is 1e-5 of the noise.
    """
    path = folder() / f"{task.key}.npz"
    if not path.exists():
        _keep(make(task), path)
    with np.load(path) as file:
        truth = json.loads(str(file["truth"]))
        channels = tuple(str(name) for name in file["channels"])
        runs = []
        for number, about in enumerate(json.loads(str(file["about"]))):
            table: NDArray[np.float64] = file[f"run_{number}"].astype(float)
            time = np.arange(table.shape[1]) * about["step"]
            named = dict(zip(channels, table, strict=True))
            runs.append({"name": about["name"], "role": about["role"], "time": time, **named})
    return Recorded(task, runs, truth, channels)


def _keep(case: generate.Case, path: Path) -> None:
    about = [
        {"name": r["name"], "role": r["role"], "step": float(r["time"][1] - r["time"][0])}
        for r in case.runs
    ]
    tables = {
        f"run_{number}": np.stack([run[c] for c in case.channels]).astype(np.float32)
        for number, run in enumerate(case.runs)
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_suffix(f".{os.getpid()}.tmp")
    with unfinished.open("wb") as file:
        np.savez(
            file, truth=json.dumps(case.truth), channels=np.array(case.channels),
            about=json.dumps(about), **tables,
        )  # fmt: skip
    unfinished.replace(path)
